# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base of all nodes: parameters, topics, ticks, readiness, diagnostics.

Guarded callbacks and the lifecycle are those of :mod:`~dmp_cpg_ros.nodes.framework.lifecycle`. A
node overrides the hooks that it needs: ``configure``, ``activate``, ``deactivate``, ``cleanup``,
``on_tick``, ``on_parameters``, ``check_parameters``, ``diagnostic_values``, ``readers``.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, TypeVar, cast

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from dmp_cpg_ros.core.clock import TickClock
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.nodes.framework import parameters
from dmp_cpg_ros.nodes.framework.certified import Certified
from dmp_cpg_ros.nodes.framework.changes import ParameterChanges
from dmp_cpg_ros.nodes.framework.commands import Commands
from dmp_cpg_ros.nodes.framework.health import missing_connections
from dmp_cpg_ros.nodes.framework.lifecycle import GuardedLifecycleNode
from dmp_cpg_ros.nodes.framework.local_delivery import LocalDelivery, SuitePublisher
from dmp_cpg_ros.nodes.framework.ticks import TickInputs, drain
from dmp_cpg_ros.nodes.framework.writers import TopicWriters
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader
from dmp_cpg_ros.nodes.messages.interfaces import (
    PUBLISHER_DEPTH,
    REPEATED,
    Interface,
    expected_count,
    interface,
    partners,
)
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.suite_table import KINDS

WATCH_EVERY_S = 0.5
"""How often strangers are looked for [s]."""

LOOK_AFTER_S = 0.02
"""How often a node looks after inputs that do not wake it, in case the one that does is late [s].
"""

P = TypeVar('P', bound=Parameters)
Readers = Mapping[str, Callable[[Any], Any]]


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
    PARAMETER_SETS : tuple of Parameters classes, optional
        Parameter sets beyond :class:`~dmp_cpg_ros.nodes.framework.parameters.NodeParameters`;
        default those of its kind in the table of nodes, and ``lock_step``.
    CHANGEABLE : collection of str
        Parameters that may change while the node runs; all others are read-only. Those that
        another node owns are refused with its name, and change only by
        :meth:`~dmp_cpg_ros.nodes.framework.changes.ParameterChanges.follow`.
    certified : Certified, optional
        What judges changes, of a node that makes it in ``configure``.
    parameter_changes : ParameterChanges
        What is done with changes, and the parameters that were accepted last.
    inputs : TickInputs
        Of :meth:`match`.
    writers : TopicWriters
        Who writes its topics.
    elapsed : float
        Time since the tick before, 0 at the first one [s].
    local : LocalDelivery or None
        How it reaches nodes of the same process; None where it is alone.
    """

    KIND: ClassVar[str] = ''
    PARAMETER_SETS: ClassVar[tuple[type[Parameters], ...]] = ()
    CHANGEABLE: ClassVar[Collection[str]] = ()
    certified: Certified | None = None
    local: LocalDelivery | None = None
    inputs: TickInputs
    elapsed = 0.0

    def __init__(self, name: str | None = None, **options: Any) -> None:
        """Create the node and check its parameters; raises ParameterError for a bad one."""
        super().__init__(name or self.KIND, **options)
        self.parameter_changes = ParameterChanges(self)
        self._sets: parameters.Sets = self.parameter_changes.accepted
        self._undo: list[Callable[[], object]] = []
        self._said: list[Callable[[], None]] = []
        self._late: list[Callable[[], None]] = []
        self._not_waking: dict[str, Subscription] = {}
        self._inputs: list[tuple[Interface, Subscription]] = []
        self.writers, self._commands = TopicWriters(self), Commands(self)
        topic, ready = interface('/diagnostics'), interface('~/ready')
        self._diagnostics = self.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._outputs: list[tuple[Interface, Publisher]] = [(topic, self._diagnostics)]
        self.create_service(ready.type, ready.name, self._answer_ready)
        self.create_steady_timer(WATCH_EVERY_S, lambda: self.writers.watch(
            dict.fromkeys(topic for topic, _ in (*self._inputs, *self._outputs))))

    # Hooks -------------------------------------------------------------------------------------

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Compute one tick from the inputs that :meth:`match` collected."""

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Values that the node adds to its diagnostics once it is configured."""
        return {}

    def readers(self, topic: Interface) -> tuple[str, ...]:
        """Kinds of nodes that read one of this node's topics, for :meth:`missing`."""
        return self.outside(partners(topic, readers=True))

    def leg_of(self, joint: str) -> str:
        """Leg that a joint belongs to, for a node that reads what the legs send."""
        return joint.partition('_')[0]

    def outside(self, kinds: Iterable[str]) -> tuple[str, ...]:
        """Those of some kinds of nodes that are not in this process."""
        inside = self.local.kinds if self.local is not None else ()
        return tuple(kind for kind in kinds if kind not in inside)

    def on_parameters(self) -> None:
        """Take over changed parameters from :meth:`parameters_of`, at the start of a tick."""

    def check_parameters(self, sets: parameters.Sets) -> None:
        """Raise ParameterError to refuse a change that every field by itself would allow."""
        if self.certified is not None:
            self.certified.check(sets)

    # Parameters ------------------------------------------------------------------------------

    @classmethod
    def parameter_table(cls) -> parameters.ParameterTable:
        """All parameters of this kind of node."""
        sets = cls.PARAMETER_SETS or (*KINDS[cls.KIND].sets, parameters.LockStepParameters)
        return parameters.ParameterTable((parameters.NodeParameters, *sets), cls.CHANGEABLE)

    @classmethod
    def default_name(cls, arguments: Sequence[str]) -> str:
        """Name of the node when the command line does not give one."""
        return cls.KIND

    @property
    def lock_step(self) -> bool:
        """Whether ticks wait for all their inputs; the recorder has none."""
        own = self._sets.get(parameters.LockStepParameters)
        return own is not None and cast(parameters.LockStepParameters, own).lock_step

    @property
    def waited_for(self) -> bool:
        """Whether no work makes a tick late: in lock-step the robot waits."""
        return self.lock_step

    def parameters_of(self, parameter_set: type[P]) -> P:
        """Return the values in effect of one parameter set."""
        return cast(P, self._sets[parameter_set])

    def start(self) -> None:
        """Configure and activate, unless ``autostart`` is false; raises what made that fail."""
        if self.parameters_of(parameters.NodeParameters).autostart:
            super().start()

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters; read-only ones may be set to the value that they have.

        So a file that ``ros2 param dump`` wrote can be loaded by the node that it describes.
        """
        news = [entry for entry in parameter_list if not (
            self.has_parameter(entry.name) and self.describe_parameter(entry.name).read_only
            and self.get_parameter(entry.name).get_parameter_value()
            == entry.get_parameter_value())]
        if parameter_list and not news:
            return SetParametersResult(successful=True)
        return super().set_parameters_atomically(news)

    def change(self, make: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
        """Change parameters when what the certificate says of it has been found."""
        return self.parameter_changes.take(make, request, response)

    def take_over(self) -> None:
        """Use what has been accepted: at once before anything runs, else from the next tick on."""
        if not self.configured:
            self._sets = self.parameter_changes.accepted
        elif self.certified is not None:
            self.certified.accept()

    # Topics and services -----------------------------------------------------------------------

    def publisher(self, name: str) -> SuitePublisher:
        """Create a publisher of an interface of the table."""
        topic = interface(name)
        qos = topic.publisher_qos
        repeated = topic.name in REPEATED and self.lock_step
        if topic.latched and repeated:  # it tells at every tick, and the recorder may lag
            qos.depth = PUBLISHER_DEPTH
        publisher = self.create_publisher(topic.type, topic.name, qos)
        self._undo.append(partial(self.destroy_publisher, publisher))
        self._outputs.append((topic, publisher))
        if topic.latched and self.local is not None and not topic.name.startswith('~'):
            self.local.latch(topic.name)
            self._undo.append(partial(self.local.unlatch, topic.name))
        return SuitePublisher(
            publisher, topic.name, self.local, self._said if repeated else None)

    def listen(self, topic: str | Interface, callback: Callable[[Any], None], *,
               command: bool = False, raw: bool = False, wakes: bool = True,
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
            Whether the queue is emptied at the start of every tick, and what was taken counted on
            ``~/commands_taken``.
        raw : bool
            Whether the callback takes serialized bytes.
        wakes : bool
            Whether a message wakes the node; else it waits for :meth:`look_after`.
        qos : QoSProfile, optional
            Default: the profile of the interface for the suite's nodes.

        Returns
        -------
        Subscription or None
            None when all publishers are in this process.
        """
        topic = topic if isinstance(topic, Interface) else interface(topic)
        local = self.local
        inside = local if local is not None and local.kinds.issuperset(topic.publishers) else None
        latched, read = topic.latched, serialized_reader(topic.type, as_message=command)

        def take(message: Any) -> None:
            if self.active or (latched and self.configured):
                callback(message if raw or inside else read(message))

        if inside is not None:
            guarded = self.guarded(topic.name, take)
            inside.attach(topic.name, guarded)
            self._undo.append(partial(inside.detach, guarded))
            if latched:
                self._late.append(partial(inside.catch_up, topic.name, guarded))
            return None
        receive: Callable[..., None] = take
        informed = command or not raw and expected_count(topic.publishers) > 0
        if command:
            receive = self._commands.counted(topic.name, take)
        elif informed:
            receive = self.writers.only(topic, callback, read)
        usual = topic.lossy_qos if self.lossy else topic.reader_qos
        subscription = self.create_subscription(
            topic.type, topic.name, receive, qos or usual, raw=True)
        if informed:
            subscription._callback_type = type(subscription).CallbackType.WithMessageInfo
        self._undo.append(partial(self.destroy_subscription, subscription))
        self._inputs.append((topic, subscription))
        if command:
            self._commands.add(topic, subscription)
        if not wakes:
            self._not_waking[topic.name] = subscription
        return subscription

    @property
    def lossy(self) -> bool:
        """Whether messages come over a link that loses some, and in any order."""
        delivery = self.parameters_of(parameters.NodeParameters).delivery
        return delivery == parameters.BEST_EFFORT and not self.lock_step

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Subscriptions whose messages wake the node, for the executor."""
        quiet = self._not_waking.values()
        return (entry for entry in super().subscriptions if entry not in quiet)

    def look_after(self) -> None:
        """Take what waits of the topics that do not wake the node."""
        for subscription in list(self._not_waking.values()):
            drain(subscription)

    def look_every(self, period_s: float, look: Callable[[], None] | None = None) -> None:
        """Call :meth:`look_after`, or something else, with a period of wall time [s]."""
        self._undo.append(partial(self.destroy_timer, self.create_steady_timer(
            period_s, look or self.look_after)))

    def serve(self, name: str, take: Callable[[Any], tuple[bool, str]]) -> None:
        """Create a service of the table; while the node is active, what takes its requests tells
        whether they are accepted, and what will happen or why not.
        """
        def answer(request: Any, response: Any) -> Any:
            response.success, response.message = take(request) if self.active else (
                False, f'{self.get_name()} is {self.state_label}, not active')
            return response

        service = interface(name)
        served = self.create_service(service.type, service.name, answer)
        self._undo.append(partial(self.destroy_service, served))

    def leave(self, subscription: Subscription) -> None:
        """Destroy a subscription that nobody needs any more."""
        self._inputs = [entry for entry in self._inputs if entry[1] is not subscription]
        self.destroy_subscription(subscription)

    def destroy_entities(self) -> None:
        """Destroy the publishers, subscriptions and services of :meth:`configure`."""
        if self.certified is not None:
            self.certified.end()
            self.certified = None
        for undo in reversed(self._undo):
            undo()
        self._undo, self._inputs, self._not_waking = [], [], {}
        self._commands.forget()
        self.writers.forget()
        self._outputs = self._outputs[:1]
        self._sets = self.parameter_changes.accepted

    def missing(self) -> list[str]:
        """List connections with the expected nodes that do not stand yet; empty when all do."""
        outputs = [(topic, self.readers(topic), publisher) for topic, publisher in self._outputs]
        return missing_connections(self, self.KIND, outputs, self._inputs,
                                   self.parameters_of(parameters.NodeParameters).expected_nodes)

    # Ticks -------------------------------------------------------------------------------------

    def match(self, trigger: str, readers: Readers, *, delayed: Readers | None = None,
              optional: Collection[str] = (), last: str = '') -> None:
        """Run :meth:`on_tick` for every tick with what readers make of the messages of topics.

        A node is woken by the message that comes last of those of a tick, and by delayed ones:
        every waking costs more than the message that it is for. Over a link any may be the last.

        Parameters
        ----------
        trigger : str
            The topic without which there is no tick.
        readers, delayed : mapping of str to callable
            Topics of the tick, and those that act one tick later, with what reads their messages.
        optional : collection of str
            As for :class:`~dmp_cpg_ros.nodes.framework.ticks.TickInputs`.
        last : str
            The topic whose message comes last; default the trigger.
        """
        delayed, last = delayed or {}, last or trigger
        self._clock_of_ticks = TickClock()
        ticks = TickInputs(self._run_tick, tuple(readers), trigger, delayed=tuple(delayed),
                           optional=tuple(optional), lock_step=self.lock_step,
                           on_repeat=self._repeat)
        self.inputs = ticks

        def feeding(name: str, read: Callable[[Any], Any]) -> Callable[[Any], None]:
            def feed(message: Any) -> None:
                stamp_ns = header_ns(message)
                if name == last:
                    for other, subscription in self._not_waking.items():
                        drain(subscription, partial(ticks.reached, other, stamp_ns))
                if not ticks.add(name, stamp_ns, read(message)):
                    raise DataError(
                        f'stamp {stamp_ns * 1e-9:.3f} s is not of this run of the robot, whose '
                        f'last tick was at {self.health.stamp_ns * 1e-9:.3f} s')

            return feed

        for name, read in {**readers, **delayed}.items():
            self.listen(name, feeding(name, read),
                        wakes=name == last or name in delayed or self.lossy)
        if self._not_waking:
            self.look_every(LOOK_AFTER_S)

    def begin_tick(self, stamp_ns: int) -> None:
        """Start a tick: waiting commands are taken and changed parameters take effect."""
        self.health.ticks += 1
        self.health.stamp_ns = stamp_ns
        self._commands.take()
        self.take_parameters()

    def take_parameters(self) -> None:
        """Let what has been accepted take effect, as at the next tick."""
        if self.parameter_changes.accepted is not self._sets:
            self._sets = self.parameter_changes.accepted
            self.on_parameters()

    def end_tick(self) -> None:
        """End a tick: once a second of the robot's clock, look for commands of a wrong type, and
        report.
        """
        if self.health.due():
            self._commands.watch_types()
            self.report(periodic=True)

    def _run_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        self.elapsed = self._clock_of_ticks.step(stamp_ns)
        self._said.clear()
        self.begin_tick(stamp_ns)
        self.on_tick(stamp_ns, values)
        self.end_tick()

    def _repeat(self) -> None:
        """Publish the last tick's messages again, for a node that was restarted meanwhile."""
        for publish in list(self._said):
            publish()

    # Diagnostics -------------------------------------------------------------------------------

    def report(self, *, periodic: bool = False) -> None:
        """Publish diagnostics now."""
        if self.context.ok():
            values = self.diagnostic_values() if self.configured else {}
            self._diagnostics.publish(
                self.health.status(self.state_label, values, periodic=periodic))

    def state_changed(self) -> None:
        """Report a new state, and say when the node works; take what was latched within this
        process before it was configured.
        """
        late, self._late = self._late, []
        for catch_up in late if self.configured else ():
            catch_up()
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

    def _answer_ready(self, request: Any, response: Any) -> Any:
        problems = [] if self.active else [f'{self.get_name()} is {self.state_label}']
        problems = problems or self.missing()
        response.success = not problems
        response.message = '; '.join(problems) or 'ready'
        return response
