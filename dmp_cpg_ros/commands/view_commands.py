# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands of a browser to a running suite."""

from __future__ import annotations

import queue
import time
from collections.abc import Collection, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as Late
from typing import Any

from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from dmp_cpg_ros.commands.suite_client import SuiteClient, deliver
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.parameters import shown
from dmp_cpg_ros.core.suite_parameters import CANONICAL, INHIBITION
from dmp_cpg_ros.nodes.framework.requests import ask
from dmp_cpg_ros.nodes.messages.commands import push_force, twist
from dmp_cpg_ros.nodes.messages.interfaces import STAMPED_CMD_VEL, interface
from dmp_cpg_ros.nodes.messages.values import checked_numbers

DEAD_MAN_S = 0.5
"""Silence of a browser that drives after which the command is zero [s]."""

ANSWER_WITHIN_S = 60.0
"""How long the suite may take to answer [s]: to refuse a gait, it seeks one that works."""

LARGEST_PUSH = 1000.0
"""Largest component of a push [N]."""


class ViewCommands:
    """Takes commands from other threads, and sends them to a suite from its own.

    Parameters
    ----------
    client : SuiteClient
        The suite.
    gaits : collection of str or None
        Names of its gaits; None where nobody commands from outside, in lock-step.
    stamped : bool
        Whether the suite takes velocities with a stamp.
    """

    def __init__(self, client: SuiteClient, gaits: Collection[str] | None, *, stamped: bool
                 ) -> None:
        """Create the ends of commands; those of services first: see SuiteClient."""
        self._client, node = client, client.node
        self._gaits = None if gaits is None else tuple(gaits)
        self._tasks: queue.Queue[tuple[str, Any, Future[Any]]] = queue.Queue()
        self._heard, self._driving = 0.0, False
        self._services = {name: node.create_client(interface(name).type, name)
                          for name in ('inhibit', *REQUESTS)}
        self._setter = node.create_client(SetParameters, f'{CANONICAL}/set_parameters')
        client.meet((INHIBITION, CANONICAL), *self._services.values(), self._setter)
        velocity = STAMPED_CMD_VEL if stamped else interface('cmd_vel')
        self._velocity_type = velocity.type
        self._velocity, self._pushes = map(client.publisher, (velocity, interface('push')))

    def take(self, command: Any) -> dict[str, Any]:
        """Take a command from another thread, and wait for the answer.

        Parameters
        ----------
        command : value of JSON, numbers as floats
            An object of one entry: ``velocity`` (v_x, v_y [m/s], γ [rad/s]), ``push`` (force in
            the world [N]), ``inhibit`` (whether to stop), ``request`` (one of ``REQUESTS``) or
            ``gait``.

        Returns
        -------
        dict
            Whether it was taken (``taken``), and what the suite says (``text``).

        Raises
        ------
        DataError
            If it is none of these; nothing has been sent then.
        """
        name, value = self._checked(command)
        answer: Future[tuple[bool, str]] = Future()
        self._tasks.put((name, value, answer))
        try:
            taken, text = answer.result(ANSWER_WITHIN_S)
        except Late:
            taken, text = False, 'the suite did not answer'
        return {'taken': taken, 'text': text}

    def _checked(self, command: Any) -> tuple[str, Any]:
        if self._gaits is None:
            raise DataError('in lock-step nobody commands from outside: this view looks on')
        if not isinstance(command, dict) or len(command) != 1:
            raise DataError(f'a command is an object of one entry, not {shown(command)}')
        ((name, value),) = command.items()
        words = {'request': REQUESTS, 'gait': self._gaits, 'inhibit': (True, False)}
        if name in words:
            if not any(value is word or (isinstance(value, str) and value == word)
                       for word in words[name]):
                raise DataError(f'{name} must be one of {words[name]}, not {shown(value)}')
            return name, value
        if name not in ('velocity', 'push'):
            raise DataError(f'{shown(name)} is no command; valid are velocity, push, '
                            f'{", ".join(words)}')
        if not isinstance(value, list) or len(value) != 3 or not all(
                isinstance(entry, float) for entry in value):
            raise DataError(f'{name} must be three numbers, not {shown(value)}')
        numbers = checked_numbers(tuple(value), name)
        if name == 'push' and max(map(abs, numbers)) > LARGEST_PUSH:
            raise DataError(f'a push has at most {LARGEST_PUSH:g} N on each axis')
        return name, numbers

    def _execute(self, name: str, value: Any, answer: Future[Any]) -> None:
        if name == 'velocity':
            self._heard, self._driving = time.monotonic(), any(value)
            self._drive(value)
            answer.set_result((True, ''))
        elif name == 'push':
            self._pushes.publish(push_force(value, 'world'))
            answer.set_result((True, ''))
        elif name == 'gait':
            change = Parameter('gait', value=value).to_parameter_msg()
            self._ask(self._setter, SetParameters.Request(parameters=[change]), answer,
                      f'changes to {value}')
        else:
            service, request = ('inhibit', SetBool.Request(data=value)) if name == 'inhibit' else (
                value, Trigger.Request())
            self._ask(self._services[service], request, answer)

    def _ask(self, client: Any, request: Any, answer: Future[Any], without_words: str = ''
             ) -> None:
        def answered(agreed: bool, words: str) -> None:
            if not answer.cancelled():
                answer.set_result((agreed, words or without_words))

        ask(client, request, answered)

    def _drive(self, velocity: Sequence[float]) -> None:
        message = twist(self._velocity_type, velocity)
        if hasattr(message, 'header'):
            message.header.stamp = self._client.node.get_clock().now().to_msg()
        self._velocity.publish(message)

    def waiting(self) -> bool:
        """Whether commands wait."""
        return not self._tasks.empty()

    def execute(self) -> None:
        """Send what waits, and let go of the stick of a browser that has fallen silent."""
        while not self._tasks.empty():
            self._execute(*self._tasks.get())
        if self._driving and time.monotonic() - self._heard > DEAD_MAN_S:
            self._let_go()

    def end(self) -> None:
        """Let go of the stick."""
        if self._driving:
            self._let_go()
            deliver(self._velocity)

    def _let_go(self) -> None:
        self._driving = False
        self._drive((0.0, 0.0, 0.0))
