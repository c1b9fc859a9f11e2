# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base of all nodes: lifecycle, checked parameters, guarded callbacks, readiness, diagnostics.

A node of the suite names its kind and its parameter sets and overrides the hooks ``configure``, ``activate``,
``deactivate``, ``cleanup``, ``on_tick``, ``on_parameters``, ``check_parameters`` and ``diagnostic_values`` as it needs.
Hooks raise :class:`~dmp_cpg_ros.core.errors.DmpCpgError` to say what is wrong; a transition then fails with that text.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, ClassVar, TypeVar, cast

from rcl_interfaces.msg import SetParametersResult
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.service import Service
from rclpy.subscription import Subscription

from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.nodes.diagnostics import NodeHealth
from dmp_cpg_ros.nodes.interfaces import Interface, interface, partners
from dmp_cpg_ros.nodes.readiness import missing_connections
from dmp_cpg_ros.nodes.ros_parameters import NodeParameters, ParameterTable, declare, plain
from dmp_cpg_ros.nodes.tick_inputs import TickInputs, drain

P = TypeVar('P', bound=Parameters)


class ManagedNode(LifecycleNode):  # type: ignore[misc]
    """A managed node of the suite.

    Parameters
    ----------
    name : str, optional
        Name of the node; default its kind.
    **options
        For :class:`rclpy.node.Node`: ``parameter_overrides``, ``context``, ``namespace``, ...

    Attributes
    ----------
    KIND : str
        Kind of node in the interfaces table, also the name of its executable.
    PARAMETER_SETS : tuple of Parameters classes
        Parameter sets beyond :class:`~dmp_cpg_ros.nodes.ros_parameters.NodeParameters`.
    CHANGEABLE : collection of str
        Parameters that may be set while the node runs.
    active : bool
        Whether the node is in the state ``active``.
    health : NodeHealth
        Ticks, stamp and problems.
    failure : Exception or None
        Why the last transition failed.
    """

    KIND: ClassVar[str] = ''
    PARAMETER_SETS: ClassVar[tuple[type[Parameters], ...]] = ()
    CHANGEABLE: ClassVar[Collection[str]] = ()

    def __init__(self, name: str | None = None, **options: Any) -> None:
        """Create the node and check its parameters; raises ParameterError for a bad one."""
        super().__init__(name or self.KIND, **options)
        self.active = False
        self.failure: Exception | None = None
        self.health = NodeHealth(self.get_name())
        self._configured = False
        self._entities: list[Publisher | Subscription | Service] = []
        self._commands: list[Subscription] = []
        self._commands_taken = 0
        self._outputs: list[tuple[Interface, Publisher]] = []
        self._inputs: list[tuple[Interface, Subscription]] = []
        self._table = self.parameter_table()
        self._sets = self._accepted = declare(self, self._table)
        self.add_on_set_parameters_callback(self._check_change)
        self.add_post_set_parameters_callback(self._accept_change)
        diagnostics = interface('/diagnostics')
        self._diagnostics = self.create_publisher(diagnostics.type, diagnostics.name, diagnostics.publisher_qos)
        self._outputs.append((diagnostics, self._diagnostics))
        ready = interface('~/ready')
        self.create_service(ready.type, ready.name, self._answer_ready)

    # Hooks ---------------------------------------------------------------------------------------------------

    def configure(self) -> None:
        """Build what the parameters describe and create publishers, subscriptions and services."""

    def activate(self) -> None:
        """Get ready for the first message."""

    def deactivate(self) -> None:
        """Stop; messages no longer arrive."""

    def cleanup(self) -> None:
        """Drop what :meth:`configure` built; entities are destroyed by the base class."""

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Compute one tick from the inputs that :meth:`match` collected."""

    def on_parameters(self) -> None:
        """Take over changed parameters from :meth:`parameters_of`; called at the start of a tick."""

    def check_parameters(self, sets: Mapping[type[Parameters], Parameters]) -> None:
        """Raise ParameterError to refuse a change that every field by itself would allow."""

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Values that the node adds to its diagnostics."""
        return {}

    def readers(self, topic: Interface) -> tuple[str, ...]:
        """Kinds of nodes that read one of this node's topics, for :meth:`missing`."""
        return partners(topic, readers=True)

    # For nodes -----------------------------------------------------------------------------------------------

    @classmethod
    def parameter_table(cls) -> ParameterTable:
        """All parameters of this kind of node."""
        return ParameterTable((NodeParameters, *cls.PARAMETER_SETS), cls.CHANGEABLE)

    @classmethod
    def default_name(cls, arguments: Sequence[str]) -> str:
        """Name of the node when the command line does not give one."""
        return cls.KIND

    def parameters_of(self, parameter_set: type[P]) -> P:
        """Return the values in effect of one parameter set."""
        return cast(P, self._sets[parameter_set])

    def publisher(self, name: str) -> Publisher:
        """Create a publisher of an interface of the table."""
        topic = interface(name)
        publisher = self.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._entities.append(publisher)
        self._outputs.append((topic, publisher))
        return publisher

    def listen(self, topic: str | Interface, callback: Callable[[Any], None], *, command: bool = False,
               raw: bool = False, qos: QoSProfile | None = None) -> Subscription:
        """Create a subscription whose callback runs while the node is active.

        A :class:`~dmp_cpg_ros.core.errors.DataError` that the callback raises drops the message: it is counted,
        logged now and then, and shown on ``/diagnostics``.

        Parameters
        ----------
        topic : str or Interface
            Interface of the table, or its name.
        callback : callable (message)
            Latched topics are also delivered while the node is configured and not active.
        command : bool
            Whether the queue is emptied at the start of every tick.
        raw : bool
            Whether the callback takes serialized bytes.
        qos : QoSProfile, optional
            Default: the profile of the interface for the suite's nodes.
        """
        topic = topic if isinstance(topic, Interface) else interface(topic)
        receive = self._guarded(topic, callback)
        subscription = self.create_subscription(topic.type, topic.name, self._counted(receive) if command else receive,
                                                qos or topic.reader_qos, raw=raw)
        self._entities.append(subscription)
        self._inputs.append((topic, subscription))
        if command:
            if not self._commands:
                self.serve('~/commands_taken', self._answer_commands_taken)
            self._commands.append(subscription)
        return subscription

    def serve(self, name: str, callback: Callable[[Any, Any], Any]) -> Service:
        """Create a service of the table; the callback runs in every state and checks :attr:`active` itself."""
        service = interface(name)
        entity = self.create_service(service.type, service.name, callback)
        self._entities.append(entity)
        return entity

    def match(self, inputs: Sequence[str], trigger: str, **options: Any) -> TickInputs:
        """Make a :class:`~dmp_cpg_ros.nodes.tick_inputs.TickInputs` that runs :meth:`on_tick` as a tick."""
        return TickInputs(self._run_tick, inputs, trigger, **options)

    def begin_tick(self, stamp_ns: int) -> None:
        """Start a tick: waiting commands are taken and changed parameters take effect."""
        health = self.health
        health.ticks += 1
        health.stamp_ns = stamp_ns
        for subscription in self._commands:
            drain(subscription)
        if self._accepted is not self._sets:
            self._sets = self._accepted
            self.on_parameters()

    def end_tick(self) -> None:
        """End a tick: once a second of the robot's clock, report."""
        if self.health.due():
            self.report(periodic=True)

    def report(self, *, periodic: bool = False) -> None:
        """Publish diagnostics now."""
        if self.context.ok():
            self._diagnostics.publish(
                self.health.status(self.state_label, self.diagnostic_values(), periodic=periodic))

    def warn(self, key: str, message: str, *, error: bool = False) -> None:
        """Raise a warning that stays on the diagnostics until :meth:`clear`; logged and sent when it is new."""
        if self.health.set_problem(key, message, error=error):
            log = self.get_logger().error if error else self.get_logger().warning
            log(message)
            self.report()

    def clear(self, key: str) -> None:
        """Withdraw a warning."""
        if self.health.clear_problem(key):
            self.report()

    @property
    def state_label(self) -> str:
        """Lifecycle state."""
        return str(self._state_machine.current_state[1])

    def missing(self) -> list[str]:
        """List connections with the expected nodes that do not stand yet; empty when all do."""
        outputs = [(topic, self.readers(topic), publisher) for topic, publisher in self._outputs]
        return missing_connections(self, self.KIND, outputs, self._inputs,
                                   self.parameters_of(NodeParameters).expected_nodes)

    def start(self) -> None:
        """Configure and activate, as far as parameter ``autostart`` says; raises what made that fail."""
        if not self.parameters_of(NodeParameters).autostart:
            return
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() != TransitionCallbackReturn.SUCCESS:
                raise self.failure or RuntimeError(f'{self.get_name()} could not start')

    def close(self) -> None:
        """Run the hooks that end the node's work, at shutdown, without transitions; safe to call twice."""
        if self.active:
            self.active = False
            self.deactivate()
        if self._configured:
            self._configured = False
            self.cleanup()

    # Transitions ---------------------------------------------------------------------------------------------

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`configure`; what it made is destroyed again when it fails."""
        result = self._transition('configure', self.configure)
        self._configured = result == TransitionCallbackReturn.SUCCESS
        if not self._configured:
            self._destroy_entities()
        return result

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`activate` and let messages in."""
        result = self._transition('activate', self.activate)
        self.active = result == TransitionCallbackReturn.SUCCESS
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Keep messages out and run :meth:`deactivate`."""
        self.active = False
        return self._transition('deactivate', self.deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Run :meth:`cleanup` and destroy all entities."""
        self._configured = False
        result = self._transition('clean up', self.cleanup)
        self._destroy_entities()
        return result

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the node's work in whatever state it is."""
        result = self._transition('shut down', self.close)
        self._destroy_entities()
        return result

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to ``unconfigured`` after an unexpected error."""
        self.active = self._configured = False
        self._destroy_entities()
        return TransitionCallbackReturn.SUCCESS

    # Inside --------------------------------------------------------------------------------------------------

    def _transition(self, verb: str, hook: Callable[[], None]) -> TransitionCallbackReturn:
        """Run a hook; DmpCpgError is a refusal, anything else an error with its traceback in the log."""
        try:
            hook()
        except DmpCpgError as error:
            self.failure = error
            self.get_logger().error(f'cannot {verb}: {error}')
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            self.failure = error
            self.get_logger().error(f'cannot {verb}: {traceback.format_exc()}')
            return TransitionCallbackReturn.ERROR
        self.failure = None
        return TransitionCallbackReturn.SUCCESS

    def _guarded(self, topic: Interface, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        name, latched = topic.name, topic.latched

        def receive(message: Any) -> None:
            if not self.active and not latched:
                return
            try:
                callback(message)
            except DataError as error:
                self._reject(name, error)
            except Exception:
                if self.context.ok():
                    raise

        return receive

    def _counted(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            callback(message)
            self._commands_taken += 1

        return receive

    def _answer_commands_taken(self, request: Any, response: Any) -> Any:
        response.success, response.message = True, str(self._commands_taken)
        return response

    def _reject(self, topic: str, error: DataError) -> None:
        if self.health.reject(topic, str(error)):
            self.get_logger().warning(
                f'{topic}: message dropped: {error} ({self.health.rejected[topic]} dropped so far)')
            self.report()

    def _run_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        self.begin_tick(stamp_ns)
        self.on_tick(stamp_ns, values)
        self.end_tick()

    def _check_change(self, changes: list[Parameter]) -> SetParametersResult:
        """Validate changes together with the values that were accepted last."""
        try:
            self.check_parameters(self._changed(changes))
        except DmpCpgError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept_change(self, changes: list[Parameter]) -> None:
        self._accepted = self._changed(changes)
        if not self._configured:
            self._sets = self._accepted

    def _changed(self, changes: list[Parameter]) -> dict[type[Parameters], Parameters]:
        values = self._table.values(self._accepted)
        values.update((change.name, plain(change.value)) for change in changes if change.name in self._table.fields)
        return self._table.build(values)

    def _answer_ready(self, request: Any, response: Any) -> Any:
        problems = [] if self.active else [f'{self.get_name()} is {self.state_label}']
        problems = problems or self.missing()
        response.success = not problems
        response.message = '; '.join(problems) or 'ready'
        return response

    def _destroy_entities(self) -> None:
        for entity in reversed(self._entities):
            if isinstance(entity, Publisher):
                self.destroy_publisher(entity)
            elif isinstance(entity, Subscription):
                self.destroy_subscription(entity)
            else:
                self.destroy_service(entity)
        self._entities, self._commands, self._inputs = [], [], []
        self._outputs = self._outputs[:1]
