# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A lifecycle node with hooks that may raise, and callbacks that let no exception out.

An exception that leaves a callback ends the executor and with it the process, so one bad message
of a stranger would end a robot's controller. Every subscription, service and timer of the node,
rclpy's own ones included, therefore calls through :meth:`GuardedLifecycleNode.guarded`.
"""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.nodes.framework.health import NodeHealth
from dmp_cpg_ros.nodes.framework.judging import sends_later
from dmp_cpg_ros.nodes.framework.request_limits import RequestLimits
from dmp_cpg_ros.nodes.framework.strangers import Strangers


class GuardedLifecycleNode(LifecycleNode):  # type: ignore[misc]
    """A lifecycle node with the hooks ``configure``, ``activate``, ``deactivate``, ``cleanup``.

    ``configure`` and ``activate`` refuse by raising a
    :class:`~dmp_cpg_ros.core.errors.DmpCpgError`: the transition fails, and the log has the text.
    Whatever else a hook raises is an error, after which the node is unconfigured again.

    In callbacks a :class:`~dmp_cpg_ros.core.errors.DmpCpgError` is the fault of what came in, and
    its text says what is valid; everything else is a fault of the program and is logged with its
    traceback, once for each callback and kind of exception. Both are counted.

    Attributes
    ----------
    ENDS_WITH : tuple of exception classes
        What ends the process all the same, because the node has no work without it.
    health : NodeHealth
        Ticks, stamp, what was dropped, problems.
    strangers : Strangers
        Who may have sent what is dropped.
    active : bool
        Whether the node is in the state ``active``.
    configured : bool
        Whether it is in the state ``inactive`` or ``active``.
    state_label : str
        Lifecycle state.
    failure : Exception or None
        Why the last transition failed.
    """

    ENDS_WITH: ClassVar[tuple[type[Exception], ...]] = ()

    def __init__(self, name: str, **options: Any) -> None:
        """Create the node, unconfigured."""
        self._traced: set[tuple[str, type[Exception]]] = set()
        self._request_limits = RequestLimits(self)
        self.strangers = Strangers(self)
        self.active = self.configured = False
        self.state_label = 'unconfigured'
        self.failure: Exception | None = None
        super().__init__(name, **options)
        self.health = NodeHealth(self.get_name(), robot=self.get_namespace())
        self._guard_transitions(self._service_change_state)

    # Hooks -------------------------------------------------------------------------------------

    def configure(self) -> None:
        """Build what the parameters describe and create publishers, subscriptions, services."""

    def activate(self) -> None:
        """Get ready for the first message."""

    def deactivate(self) -> None:
        """Stop; messages no longer arrive."""

    def cleanup(self) -> None:
        """Drop what :meth:`configure` built."""

    def destroy_entities(self) -> None:
        """Destroy the publishers, subscriptions and services of :meth:`configure`."""

    def state_changed(self) -> None:
        """Note a new :attr:`state_label`."""

    def report(self) -> None:
        """Tell what :attr:`health` knows."""

    @property
    def lock_step(self) -> bool:
        """Whether the robot waits for this node at every tick, so that no work makes it late."""
        return False

    # What is wrong ------------------------------------------------------------------------------

    def warn(self, key: str, message: str, *, error: bool = False) -> None:
        """Raise a warning that stays until :meth:`clear`; logged and reported when it is new."""
        if self.health.set_problem(key, message, error=error):
            # rclpy wants one severity for every line that logs.
            if error:
                self.get_logger().error(message)
            else:
                self.get_logger().warning(message)
            self.report()

    def clear(self, key: str) -> None:
        """Withdraw a warning."""
        if self.health.clear_problem(key):
            self.report()

    # Transitions -------------------------------------------------------------------------------

    def start(self) -> None:
        """Configure and activate; raises what made that fail."""
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() != TransitionCallbackReturn.SUCCESS:
                raise self.failure or RuntimeError(f'{self.get_name()} could not start')

    def destroy_node(self) -> None:
        """Destroy the node, and its state machine, which would keep it in the graph otherwise."""
        self._state_machine.destroy_when_not_in_use()
        super().destroy_node()

    def close(self) -> None:
        """End the node's work without transitions, at shutdown; safe to call twice."""
        try:
            if self.active:
                self.active = False
                self.deactivate()
        finally:
            if self.configured:
                self.configured = False
                self.cleanup()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`configure`; what it made is destroyed again when it fails."""
        result = self._run('configure', self.configure)
        self.configured = result == TransitionCallbackReturn.SUCCESS
        return self._enter('inactive', result) if self.configured else self._leave(result)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`activate` and let messages in."""
        result = self._run('activate', self.activate)
        self.active = result == TransitionCallbackReturn.SUCCESS
        return self._enter('active' if self.active else 'inactive', result)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Keep messages out and run :meth:`deactivate`."""
        self.active = False
        return self._enter('inactive', self._run('deactivate', self.deactivate, may_refuse=False))

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`cleanup` and destroy all entities."""
        self.configured = False
        return self._leave(self._run('clean up', self.cleanup, may_refuse=False))

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the node's work in whatever state it is."""
        return self._leave(self._run('shut down', self.close, may_refuse=False), 'finalized')

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to ``unconfigured`` after an error."""
        failure = self.failure
        self._run('clean up', self.close, may_refuse=False)
        self.failure = failure
        return self._leave(TransitionCallbackReturn.SUCCESS)

    def _leave(self, result: TransitionCallbackReturn, label: str = 'unconfigured',
               ) -> TransitionCallbackReturn:
        self.destroy_entities()
        self.health.forget_problems()
        return self._enter(label, result)

    def _enter(self, label: str, result: TransitionCallbackReturn) -> TransitionCallbackReturn:
        self.state_label = label
        self.state_changed()
        return result

    def _run(self, verb: str, hook: Callable[[], None], *,
             may_refuse: bool = True) -> TransitionCallbackReturn:
        """Run a hook and translate what it raises."""
        try:
            hook()
        except DmpCpgError as error:
            self.failure = error
            self.get_logger().error(f'cannot {verb}: {error}')
            refused, failed = TransitionCallbackReturn.FAILURE, TransitionCallbackReturn.ERROR
            return refused if may_refuse else failed
        except Exception as error:  # noqa: BLE001 - a hook may raise anything; nothing is lost
            self.failure = error
            self.get_logger().error(f'cannot {verb}: {traceback.format_exc()}')
            return TransitionCallbackReturn.ERROR
        self.failure = None
        return TransitionCallbackReturn.SUCCESS

    # Callbacks ---------------------------------------------------------------------------------

    def guarded(self, name: str, callback: Callable[..., Any],
                who: Callable[[], str] = str) -> Callable[..., Any]:
        """Return a callback that drops what it cannot use instead of raising.

        Parameters
        ----------
        name : str
            Topic, service or whatever else calls it, under which drops are counted.
        callback : callable
            A service's response says by its ``success`` and ``message``, where it has them, that
            its request was dropped.
        who : callable () → str, optional
            Names those from whom it may have come, as :class:`Strangers` does.
        """
        def call(*arguments: Any) -> Any:
            try:
                return callback(*arguments)
            except self.ENDS_WITH:
                raise
            except Exception as error:  # noqa: BLE001 - whatever it is, the node goes on
                text = self.drop(name, error, who())
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
        who = partial(self.strangers.publishing, topic)
        return super().create_subscription(
            msg_type, topic, self.guarded(topic, callback, who), *arguments, **options)

    def create_service(self, srv_type: Any, srv_name: str, callback: Callable[..., Any],
                       *arguments: Any, **options: Any) -> Service:
        """Create a service with a guarded callback; one of parameters is not asked too much."""
        callback = self._request_limits.limited(srv_type, srv_name, callback)
        who = partial(self.strangers.asking, srv_name)
        service = super().create_service(
            srv_type, srv_name, self.guarded(srv_name, callback, who), *arguments, **options)
        send = service.send_response

        def answer(response: Any, header: Any) -> None:
            with contextlib.suppress(InvalidHandle):  # destroyed while its request was waiting
                send(response, header)

        service.send_response = answer
        sends_later(service)
        return service

    def change(self, make: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
        """Answer a request to change parameters, at once or later; rclpy makes the change."""
        return make(request, response)

    def create_timer(self, timer_period_sec: float, callback: Callable[..., Any],
                     *arguments: Any, **options: Any) -> Timer:
        """Create a timer with a guarded callback."""
        return super().create_timer(
            timer_period_sec, self.guarded(f'timer {callback.__name__}', callback),
            *arguments, **options)

    def create_steady_timer(self, period_s: float, callback: Callable[[], None]) -> Timer:
        """Create a timer of wall time [s] that goes on whatever the robot's clock does."""
        return self.create_timer(period_s, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

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

        service.callback = self.guarded(
            'change_state', answer, partial(self.strangers.asking, '~/change_state'))

    def drop(self, name: str, error: Exception, who: str = '') -> str:
        """Count, log now and then, and report, with whom it may come from; returns the reason."""
        expected, kind = isinstance(error, DmpCpgError), (name, type(error))
        reason = str(error) if expected else f'{type(error).__name__}: {error}'
        told = self.health.reject(name, reason + who, error=not expected)
        if not expected and kind not in self._traced:
            self._traced.add(kind)
            self.get_logger().error(f'{name}: {"".join(traceback.format_exception(error))}')
        elif told:
            count = self.health.rejected[name]
            self.get_logger().warning(f'{name}: dropped: {reason}{who} ({count} dropped so far)')
        else:
            return reason
        with contextlib.suppress(Exception):  # the report itself may be what failed
            self.report()
        return reason
