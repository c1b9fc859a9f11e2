# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to the services of a suite: whether they agree, and in which words."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.task import Future
from rclpy.timer import Timer

from dmp_cpg_ros.core.suite_parameters import CHANGEABLE, OWNER
from dmp_cpg_ros.nodes.framework.parameters import plain

ASK_EVERY_S, PATIENCE_S = 0.05, 20.0
"""How often a follower is asked whether it knows a change, and for how long [s]: who has missed
the news hears of it from the owner within some seconds.
"""


def ask(client: Any, request: Any, done: Callable[[bool, str], None]) -> None:
    """Call a service, of one of a node's parameters or another one; ``done`` is told whether it
    agrees, and in which words.
    """

    def answered(future: Future) -> None:
        answer = future.result()
        (result,) = getattr(answer, 'results', [getattr(answer, 'result', answer)])
        if result is None:
            done(False, 'no answer')
        elif result is answer:
            done(result.success, result.message)
        else:
            done(result.successful, result.reason)

    client.call_async(request).add_done_callback(answered)


class ParameterSetter:
    """Calls the nodes' own parameter services, as ``ros2 param set`` does.

    Parameters
    ----------
    node : Node
        Who asks.
    """

    def __init__(self, node: Node) -> None:
        """Create the clients."""
        self._node: Any = node
        self._timer: Timer | None = None
        self._setters = {owner: node.create_client(
            SetParametersAtomically, f'{owner}/set_parameters_atomically') for owner in CHANGEABLE}
        self._getters = {owner: node.create_client(GetParameters, f'{owner}/get_parameters')
                         for owner in CHANGEABLE}

    def connected(self) -> bool:
        """Whether all services are there."""
        return all(client.service_is_ready()
                   for client in (*self._setters.values(), *self._getters.values()))

    def set(self, values: Mapping[str, Any], done: Callable[[str], None]) -> None:
        """Ask for a change.

        Parameters
        ----------
        values : mapping of str to value
            Parameters of one owner.
        done : callable (reason)
            Called with why the change is refused, or which follower does not know it after
            ``PATIENCE_S``, or with an empty text once the owner has accepted it and all do.
        """
        owner = OWNER[next(iter(values))]
        wanted = {name: plain(value) for name, value in values.items()}
        request = SetParametersAtomically.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in wanted.items()])

        def answered(agreed: bool, reason: str) -> None:
            if agreed:
                self._await([node for node in CHANGEABLE if node != owner], wanted, done)
            else:
                done(reason)

        ask(self._setters[owner], request, answered)

    def _await(self, followers: list[str], wanted: Mapping[str, Any],
               done: Callable[[str], None]) -> None:
        """Ask one follower after the other, now and then, until it has the values."""
        request, values = GetParameters.Request(names=list(wanted)), list(wanted.values())
        end_s, asked = time.monotonic() + PATIENCE_S, False

        def ask_next() -> None:
            nonlocal asked
            asked = True
            self._getters[followers[0]].call_async(request).add_done_callback(answered)

        def answered(future: Future) -> None:
            nonlocal asked
            answer, asked = future.result(), False
            if timer is self._timer and answer is not None and values == [
                    plain(parameter_value_to_python(value)) for value in answer.values]:
                del followers[0]
                if followers:
                    ask_next()
                else:
                    end('')

        def look() -> None:
            if timer is not self._timer:
                return  # it had run out before it was destroyed
            if time.monotonic() > end_s:
                end(f'{followers[0]} does not follow')
            elif not asked:
                ask_next()

        def end(reason: str) -> None:
            self._forget()
            done(reason)

        self._forget()
        timer = self._timer = self._node.create_timer(
            ASK_EVERY_S, look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        ask_next()

    def _forget(self) -> None:
        """Ask no follower any more."""
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
        self._timer = None
