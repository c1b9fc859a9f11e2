# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A lifecycle node whose callbacks let no exception out: what they cannot use is counted and told.

An exception that leaves a callback ends the executor and with it the process, so one bad message
of a stranger would end a robot's controller. Every subscription, service and timer of the node,
rclpy's own ones included, therefore calls through :meth:`GuardedNode.guarded`.
"""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Callable
from typing import Any, ClassVar

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.nodes.diagnostics import NodeHealth


class GuardedNode(LifecycleNode):  # type: ignore[misc]
    """A lifecycle node with guarded callbacks.

    A :class:`~dmp_cpg_ros.core.errors.DmpCpgError` is the fault of what came in, and its text says
    what is valid; everything else is a fault of the program and is logged with its traceback, once
    for each callback and kind of exception. Both are counted.

    Attributes
    ----------
    ENDS_WITH : tuple of exception classes
        What ends the process all the same, because the node has no work without it.
    health : NodeHealth
        Ticks, stamp, what was dropped, problems.
    """

    ENDS_WITH: ClassVar[tuple[type[Exception], ...]] = ()

    def __init__(self, name: str, **options: Any) -> None:
        """Create the node."""
        self._traced: set[tuple[str, type[Exception]]] = set()
        super().__init__(name, **options)
        self.health = NodeHealth(self.get_name())
        self._guard_transitions(self._service_change_state)

    def report(self) -> None:
        """Tell what :attr:`health` knows."""

    def guarded(self, name: str, callback: Callable[..., Any]) -> Callable[..., Any]:
        """Return a callback that drops what it cannot use instead of raising.

        Parameters
        ----------
        name : str
            Topic, service or whatever else calls it, under which drops are counted.
        callback : callable
            A service's response says by its ``success`` and ``message``, where it has them, that
            its request was dropped.
        """
        def call(*arguments: Any) -> Any:
            try:
                return callback(*arguments)
            except self.ENDS_WITH:
                raise
            except Exception as error:  # noqa: BLE001 - whatever it is, the node goes on
                text = self._drop(name, error)
                answer: Any = arguments[-1] if arguments else None
                if hasattr(answer, 'success'):
                    answer.success = False
                    if hasattr(answer, 'message'):
                        answer.message = text
                return answer

        return call

    def create_subscription(self, msg_type: Any, topic: str, callback: Callable[..., Any],
                            *arguments: Any, **options: Any) -> Subscription:
        """Create a subscription with a guarded callback."""
        return super().create_subscription(
            msg_type, topic, self.guarded(topic, callback), *arguments, **options)

    def create_service(self, srv_type: Any, srv_name: str, callback: Callable[..., Any],
                       *arguments: Any, **options: Any) -> Service:
        """Create a service with a guarded callback."""
        return super().create_service(
            srv_type, srv_name, self.guarded(srv_name, callback), *arguments, **options)

    def create_timer(self, timer_period_sec: float, callback: Callable[..., Any],
                     *arguments: Any, **options: Any) -> Timer:
        """Create a timer with a guarded callback."""
        return super().create_timer(
            timer_period_sec, self.guarded(f'timer {callback.__name__}', callback),
            *arguments, **options)

    def _guard_transitions(self, service: Service) -> None:
        """Let the service of transitions, which rclpy makes in a way of its own, refuse too."""
        change = service.callback

        def answer(request: Any, response: Any) -> Any:
            try:
                return change(request, response)
            except rclpy_implementation.RCLError:
                valid = ', '.join(f'{number} ({label})' for number, label, *_ in
                                  self._state_machine.available_transitions)
                raise DataError(
                    f'transition {request.transition.id} is not possible in the state '
                    f'{self._state_machine.current_state[1]}; valid are {valid or "none"}'
                ) from None

        service.callback = self.guarded('change_state', answer)

    def _drop(self, name: str, error: Exception) -> str:
        """Count, log now and then, and report; returns the reason."""
        expected, kind = isinstance(error, DmpCpgError), (name, type(error))
        reason = str(error) if expected else f'{type(error).__name__}: {error}'
        told = self.health.reject(name, reason, error=not expected)
        if not expected and kind not in self._traced:
            self._traced.add(kind)
            self.get_logger().error(f'{name}: {traceback.format_exc()}')
        elif told:
            count = self.health.rejected[name]
            self.get_logger().warning(f'{name}: dropped: {reason} ({count} dropped so far)')
        else:
            return reason
        with contextlib.suppress(Exception):  # the report itself may be what failed
            self.report()
        return reason
