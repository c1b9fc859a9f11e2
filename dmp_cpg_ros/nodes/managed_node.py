# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base of all nodes: topics, ticks, readiness, diagnostics.

Guarded callbacks, lifecycle and parameters are those of
:mod:`~dmp_cpg_ros.nodes.guarded_node`, :mod:`~dmp_cpg_ros.nodes.hooked_lifecycle` and
:mod:`~dmp_cpg_ros.nodes.parameterized_node`. A node names its kind and its parameter sets and
overrides the hooks that it needs: ``configure``, ``activate``, ``deactivate``, ``cleanup``,
``on_tick``, ``on_parameters``, ``check_parameters``, ``diagnostic_values``, ``readers``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.service import Service
from rclpy.subscription import Subscription

from dmp_cpg_ros.core.clock import TickClock
from dmp_cpg_ros.nodes.interfaces import Interface, interface, partners
from dmp_cpg_ros.nodes.local_delivery import LocalDelivery, SuitePublisher
from dmp_cpg_ros.nodes.parameterized_node import ParameterizedNode
from dmp_cpg_ros.nodes.readiness import missing_connections
from dmp_cpg_ros.nodes.ros_parameters import NodeParameters
from dmp_cpg_ros.nodes.serialized_messages import serialized_reader
from dmp_cpg_ros.nodes.tick_inputs import TickInputs, drain


class ManagedNode(ParameterizedNode):
    """A managed node of the suite.

    Parameters
    ----------
    name : str, optional
        Name of the node; default its kind.
    **options
        For :class:`rclpy.node.Node`: ``parameter_overrides``, ``context``, ``namespace``, ...

    Attributes
    ----------
    elapsed : float
        Time since the tick before, 0 at the first one [s].
    local : LocalDelivery or None
        How it reaches nodes of the same process; None where it is alone.
    """

    local: LocalDelivery | None = None
    elapsed = 0.0

    def __init__(self, name: str | None = None, **options: Any) -> None:
        """Create the node and check its parameters; raises ParameterError for a bad one."""
        super().__init__(name, **options)
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
        (:class:`~dmp_cpg_ros.nodes.guarded_node.GuardedNode`). So the bytes are read here: what
        the middleware cannot read it would drop without a word.

        Parameters
        ----------
        topic : str or Interface
            Interface of the table, or its name.
        callback : callable (message)
            Latched topics are also delivered while the node is configured and not active. Kinds
            that :mod:`~dmp_cpg_ros.nodes.serialized_messages` reads come as its classes from
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
        """Make a :class:`~dmp_cpg_ros.nodes.tick_inputs.TickInputs` that runs :meth:`on_tick`."""
        self._clock_of_ticks = TickClock()
        return TickInputs(self._run_tick, inputs, trigger, **options)

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
