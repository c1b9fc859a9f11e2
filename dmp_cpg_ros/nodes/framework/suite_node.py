# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base of all nodes: parameters, topics, ticks, readiness, diagnostics.

Guarded callbacks and the lifecycle are those of :mod:`~dmp_cpg_ros.nodes.framework.lifecycle`. A
node overrides the hooks that it needs: ``configure``, ``activate``, ``deactivate``, ``cleanup``,
``on_tick``, ``on_parameters``, ``check_parameters``, ``diagnostic_values``, ``readers``.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, ClassVar, TypeVar, cast

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.service import Service
from rclpy.subscription import Subscription

from dmp_cpg_ros.core.certificates.gate import shown
from dmp_cpg_ros.core.clock import TickClock
from dmp_cpg_ros.core.errors import DataError, DmpCpgError, ParameterError
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.suite_parameters import OWNER
from dmp_cpg_ros.nodes.framework.health import missing_connections
from dmp_cpg_ros.nodes.framework.lifecycle import GuardedLifecycleNode
from dmp_cpg_ros.nodes.framework.local_delivery import LocalDelivery, SuitePublisher
from dmp_cpg_ros.nodes.framework.parameters import (
    NodeParameters,
    ParameterTable,
    declare,
    plain,
    ros_value,
)
from dmp_cpg_ros.nodes.framework.ticks import TickInputs, drain
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader
from dmp_cpg_ros.nodes.messages.interfaces import Interface, interface, partners
from dmp_cpg_ros.nodes.messages.values import header_ns

P = TypeVar('P', bound=Parameters)
Sets = Mapping[type[Parameters], Parameters]


class SuiteNode(GuardedLifecycleNode):
    """A managed node of the suite, with declared and checked parameters.

    A node names its kind and its parameter sets and overrides the hooks that it needs.

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
        Parameter sets beyond :class:`~dmp_cpg_ros.nodes.framework.parameters.NodeParameters`.
    CHANGEABLE : collection of str
        Parameters that may change while the node runs; all others are read-only. Those that
        another node owns are refused with its name, and change only by :meth:`follow`.
    elapsed : float
        Time since the tick before, 0 at the first one [s].
    local : LocalDelivery or None
        How it reaches nodes of the same process; None where it is alone.
    """

    KIND: ClassVar[str] = ''
    PARAMETER_SETS: ClassVar[tuple[type[Parameters], ...]] = ()
    CHANGEABLE: ClassVar[Collection[str]] = ()
    local: LocalDelivery | None = None
    elapsed = 0.0

    def __init__(self, name: str | None = None, **options: Any) -> None:
        """Create the node and check its parameters; raises ParameterError for a bad one."""
        self._following = False
        super().__init__(name or self.KIND, **options)
        self._table = self.parameter_table()
        self._sets = self._accepted = declare(self, self._table)
        self.add_on_set_parameters_callback(self._check_change)
        self.add_post_set_parameters_callback(self._accept_change)
        self._entities: list[Publisher | Subscription | Service] = []
        self._commands: list[Subscription] = []
        self._commands_taken: dict[str, int] = {}
        self._local_readers: list[Callable[[Any], None]] = []
        self._inputs: list[tuple[Interface, Subscription]] = []
        topic, ready = interface('/diagnostics'), interface('~/ready')
        self._diagnostics = self.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._outputs: list[tuple[Interface, Publisher]] = [(topic, self._diagnostics)]
        self.create_service(ready.type, ready.name, self._answer_ready)

    # Hooks -------------------------------------------------------------------------------------

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Compute one tick from the inputs that :meth:`match` collected."""

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Values that the node adds to its diagnostics once it is configured."""
        return {}

    def readers(self, topic: Interface) -> tuple[str, ...]:
        """Kinds of nodes that read one of this node's topics, for :meth:`missing`."""
        inside = self.local.kinds if self.local is not None else ()
        return tuple(kind for kind in partners(topic, readers=True) if kind not in inside)

    def on_parameters(self) -> None:
        """Take over changed parameters from :meth:`parameters_of`, at the start of a tick."""

    def check_parameters(self, sets: Sets) -> None:
        """Raise ParameterError to refuse a change that every field by itself would allow."""

    # Parameters ------------------------------------------------------------------------------

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

    def start(self) -> None:
        """Configure and activate, unless ``autostart`` is false; raises what made that fail."""
        if self.parameters_of(NodeParameters).autostart:
            super().start()

    def take_changed_parameters(self) -> None:
        """Let changes that were accepted since the last call take effect, all at once."""
        if self._accepted is not self._sets:
            self._sets = self._accepted
            self.on_parameters()

    def follow(self, values: Mapping[str, Any]) -> None:
        """Take over what the owner of some parameters has accepted, where it is new.

        Raises
        ------
        DataError
            If it cannot be taken over; nothing is then changed.
        """
        accepted = self._table.values(self._accepted)
        news = {name: value for name, value in values.items()
                if name in accepted and value != ros_value(accepted[name])}
        if not news:
            return
        self._following = True
        try:
            result = self.set_parameters_atomically(
                [Parameter(name, value=value) for name, value in news.items()])
        finally:
            self._following = False
        if not result.successful:
            raise DataError(f'cannot follow {news}: {result.reason}')

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters; read-only ones may be set to the value that they have.

        So a file that ``ros2 param dump`` wrote can be loaded by the node that it describes.
        """
        news = [entry for entry in parameter_list if not self._is_fixed(entry)]
        if parameter_list and not news:
            return SetParametersResult(successful=True)
        return super().set_parameters_atomically(news)

    def _is_fixed(self, entry: Parameter) -> bool:
        """Whether a parameter is read-only and has this value."""
        return (self.has_parameter(entry.name) and self.describe_parameter(entry.name).read_only
                and self.get_parameter(entry.name).get_parameter_value()
                == entry.get_parameter_value())

    def _refuse_foreign(self, sets: Sets) -> None:
        before, after = self._table.values(self._accepted), self._table.values(sets)
        for name, value in after.items():
            owner = OWNER.get(name, self.KIND)
            if value != before[name] and owner != self.KIND:
                raise ParameterError(
                    f"'{name}' belongs to {owner}, which the other nodes follow; set it there: "
                    f'ros2 param set /{owner} {name} {shown(value)}')

    def _check_change(self, changes: list[Parameter]) -> SetParametersResult:
        """Validate changes together with the values that were accepted last."""
        try:
            sets = self._changed(changes)
            if not self._following:
                self._refuse_foreign(sets)
            self.check_parameters(sets)
        except DmpCpgError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _accept_change(self, changes: list[Parameter]) -> None:
        self._accepted = self._changed(changes)
        if not self.configured:
            self._sets = self._accepted

    def _changed(self, changes: list[Parameter]) -> dict[type[Parameters], Parameters]:
        values = self._table.values(self._accepted)
        values.update({change.name: plain(change.value) for change in changes
                       if change.name in self._table.fields})
        return self._table.build(values)

    # Topics and services -----------------------------------------------------------------------

    def publisher(self, name: str) -> SuitePublisher:
        """Create a publisher of an interface of the table."""
        topic = interface(name)
        publisher = self.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._entities.append(publisher)
        self._outputs.append((topic, publisher))
        return SuitePublisher(publisher, topic.name, self.local)

    def listen(self, topic: str | Interface, callback: Callable[[Any], None], *,
               command: bool = False, raw: bool = False,
               qos: QoSProfile | None = None) -> Subscription | None:
        """Create a subscription whose callback runs while the node is active.

        Messages that cannot be read, or that the callback refuses by raising
        :class:`~dmp_cpg_ros.core.errors.DataError`, are dropped and counted
        (:class:`~dmp_cpg_ros.nodes.framework.lifecycle.GuardedLifecycleNode`). So the bytes are
        read here: what the middleware cannot read it would drop without a word.

        Parameters
        ----------
        topic : str or Interface
            Interface of the table, or its name.
        callback : callable (message)
            Latched topics are also delivered while the node is configured and not active. Kinds
            that :mod:`~dmp_cpg_ros.nodes.messages.cdr` reads come as its classes from
            other processes, unless ``command``.
        command : bool
            Whether the queue is emptied at the start of every tick.
        raw : bool
            Whether the callback takes serialized bytes.
        qos : QoSProfile, optional
            Default: the profile of the interface for the suite's nodes.

        Returns
        -------
        Subscription or None
            None when all publishers are in this process.
        """
        topic = topic if isinstance(topic, Interface) else interface(topic)
        if self.local is not None and self.local.kinds.issuperset(topic.publishers):
            receive = self.guarded(topic.name, self._while_active(topic, callback))
            self.local.attach(topic.name, receive)
            self._local_readers.append(receive)
            return None
        take = callback
        if not raw:
            read = serialized_reader(topic.type, as_message=command)

            def take(data: bytes) -> None:
                callback(read(data))

        receive = self._while_active(topic, take)
        subscription = self.create_subscription(
            topic.type, topic.name, self._counted(topic.name, receive) if command else receive,
            qos or topic.reader_qos, raw=True)
        self._entities.append(subscription)
        self._inputs.append((topic, subscription))
        if command:
            if not self._commands:
                self.serve('~/commands_taken', self._answer_commands_taken)
            self._commands.append(subscription)
        return subscription

    def serve(self, name: str, callback: Callable[[Any, Any], Any]) -> Service:
        """Create a service of the table; its callback runs in every state of the node."""
        service = interface(name)
        entity = self.create_service(service.type, service.name, callback)
        self._entities.append(entity)
        return entity

    def destroy_entities(self) -> None:
        """Destroy the publishers, subscriptions and services of :meth:`configure`."""
        for entity in reversed(self._entities):
            if isinstance(entity, Publisher):
                self.destroy_publisher(entity)
            elif isinstance(entity, Subscription):
                self.destroy_subscription(entity)
            else:
                self.destroy_service(entity)
        for reader in self._local_readers if self.local is not None else ():
            self.local.detach(reader)  # type: ignore[union-attr]
        self._entities, self._commands, self._inputs, self._local_readers = [], [], [], []
        self._outputs = self._outputs[:1]

    def missing(self) -> list[str]:
        """List connections with the expected nodes that do not stand yet; empty when all do."""
        outputs = [(topic, self.readers(topic), publisher) for topic, publisher in self._outputs]
        return missing_connections(self, self.KIND, outputs, self._inputs,
                                   self.parameters_of(NodeParameters).expected_nodes)

    # Ticks -------------------------------------------------------------------------------------

    def match(self, inputs: Sequence[str], trigger: str, **options: Any) -> TickInputs:
        """Make :class:`~dmp_cpg_ros.nodes.framework.ticks.TickInputs` that run :meth:`on_tick`."""
        self._clock_of_ticks = TickClock()
        self._ticks = TickInputs(self._run_tick, inputs, trigger, **options)
        return self._ticks

    def feed(self, readers: Mapping[str, Callable[[Any], Any]]) -> None:
        """Let what readers make of the messages of topics fill the inputs of :meth:`match`."""
        def feeding(name: str, read: Callable[[Any], Any]) -> Callable[[Any], None]:
            return lambda message: self._ticks.add(name, header_ns(message), read(message))

        for name, read in readers.items():
            self.listen(name, feeding(name, read))

    def begin_tick(self, stamp_ns: int) -> None:
        """Start a tick: waiting commands are taken and changed parameters take effect."""
        health = self.health
        health.ticks += 1
        health.stamp_ns = stamp_ns
        for subscription in self._commands:
            drain(subscription)
        self.take_changed_parameters()

    def end_tick(self) -> None:
        """End a tick: once a second of the robot's clock, look for commands of a wrong type, and
        report.
        """
        if self.health.due():
            self._watch_command_types()
            self.report(periodic=True)

    def _run_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        self.elapsed = self._clock_of_ticks.step(stamp_ns)
        self.begin_tick(stamp_ns)
        self.on_tick(stamp_ns, values)
        self.end_tick()

    # Diagnostics -------------------------------------------------------------------------------

    def report(self, *, periodic: bool = False) -> None:
        """Publish diagnostics now."""
        if self.context.ok():
            values = self.diagnostic_values() if self.configured else {}
            self._diagnostics.publish(
                self.health.status(self.state_label, values, periodic=periodic))

    def state_changed(self) -> None:
        """Report a new state, and say when the node works."""
        if self.active:
            self.get_logger().info('active')
        self.report()

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

    # Inside ------------------------------------------------------------------------------------

    def _watch_command_types(self) -> None:
        """Warn of publishers of commands whose type no reader can match: DDS says nothing."""
        for topic, subscription in self._inputs:
            if subscription not in self._commands:
                continue
            name = subscription.topic_name
            types = {end.topic_type for end in self.get_publishers_info_by_topic(name)}
            wrong = ', '.join(sorted(types - {topic.type_name}))
            if wrong:
                self.warn(f'type of {name}', f'{name} is published as {wrong}, and this node '
                          f'reads {topic.type_name}{topic.other_type}')
            else:
                self.clear(f'type of {name}')

    def _while_active(self, topic: Interface, callback: Callable[[Any], None],
                      ) -> Callable[[Any], None]:
        latched = topic.latched

        def receive(message: Any) -> None:
            if self.active or latched:
                callback(message)

        return receive

    def _counted(self, topic: str, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        self._commands_taken.setdefault(topic, 0)

        def receive(message: Any) -> None:
            try:
                callback(message)
            finally:
                self._commands_taken[topic] += 1

        return receive

    def _answer_commands_taken(self, request: Any, response: Any) -> Any:
        counts = (f'{topic} {count}' for topic, count in self._commands_taken.items())
        response.success, response.message = True, ', '.join(counts)
        return response

    def _answer_ready(self, request: Any, response: Any) -> Any:
        problems = [] if self.active else [f'{self.get_name()} is {self.state_label}']
        problems = problems or self.missing()
        response.success = not problems
        response.message = '; '.join(problems) or 'ready'
        return response
