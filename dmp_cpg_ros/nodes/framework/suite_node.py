# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base of all nodes: parameters, ticks, readiness, diagnostics.

Guarded callbacks and the lifecycle are those of :mod:`~dmp_cpg_ros.nodes.framework.lifecycle`,
topics and services those of :mod:`~dmp_cpg_ros.nodes.framework.connected_node`. A node overrides
the hooks that it needs: ``configure``, ``activate``, ``deactivate``, ``cleanup``, ``on_tick``,
``on_parameters``, ``check_parameters``, ``diagnostic_values``, ``readers``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, TypeVar, cast

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter

from dmp_cpg_ros.core.clock import TickClock
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.nodes.framework import parameters
from dmp_cpg_ros.nodes.framework.certified import Certified
from dmp_cpg_ros.nodes.framework.changes import ParameterChanges
from dmp_cpg_ros.nodes.framework.connected_node import ConnectedNode
from dmp_cpg_ros.nodes.framework.health import FAILED, LACKS, missing_connections
from dmp_cpg_ros.nodes.framework.ticks import TickInputs, drain
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.suite_table import KINDS

LOOK_AFTER_S = 0.02
"""How often a node looks after inputs that do not wake it, in case the one that does is late [s].
"""

STALLED_S = 1.0
"""Time after the beginning of a tick from which on it is told what the next one lacks [s]."""

P = TypeVar('P', bound=Parameters)
Readers = Mapping[str, Callable[[Any], Any]]


class SuiteNode(ConnectedNode):
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
    JUDGES : bool
        Whether it judges changes, for which a process that runs it has another one ready.
    certified : Certified, optional
        What judges changes, of a node that makes it in ``configure``.
    parameter_changes : ParameterChanges
        What is done with changes, and the parameters that were accepted last.
    inputs : TickInputs
        Of :meth:`match`.
    elapsed : float
        Time since the tick before, 0 at the first one [s].
    """

    KIND: ClassVar[str] = ''
    PARAMETER_SETS: ClassVar[tuple[type[Parameters], ...]] = ()
    CHANGEABLE: ClassVar[Collection[str]] = ()
    JUDGES: ClassVar[bool] = False
    certified: Certified | None = None
    inputs: TickInputs
    elapsed = 0.0
    _failed, _begun_s = '', 0.0
    _said_before: tuple[int, list[Callable[[], None]]] = (-1, [])

    def __init__(self, name: str | None = None, **options: Any) -> None:
        """Create the node and check its parameters; raises ParameterError for a bad one."""
        super().__init__(name or self.KIND, **options)
        self.parameter_changes = ParameterChanges(self)
        self._sets: parameters.Sets = self.parameter_changes.accepted
        delivery = self.parameters_of(parameters.NodeParameters).delivery
        self.lossy = delivery == parameters.BEST_EFFORT and not self.lock_step
        topic, ready = interface('/diagnostics'), interface('~/ready')
        self._diagnostics = self.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._outputs.append((topic, self._diagnostics))
        self.create_service(ready.type, ready.name, self._answer_ready)

    # Hooks -------------------------------------------------------------------------------------

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Compute one tick from the inputs that :meth:`match` collected."""

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Values that the node adds to its diagnostics once it is configured."""
        return {}

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
    def return_ns(self) -> int:
        """How much longer than otherwise the gait goes on without a node [ns]."""
        own = self._sets.get(parameters.LockStepParameters)
        return 0 if own is None or self.lock_step else round(
            1e9 * cast(parameters.LockStepParameters, own).return_time)

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

    # Readiness ---------------------------------------------------------------------------------

    def destroy_entities(self) -> None:
        """Destroy what :meth:`configure` made; what has been accepted is used from now on."""
        if self.certified is not None:
            self.certified.end()
            self.certified = None
        super().destroy_entities()
        self._sets = self.parameter_changes.accepted

    def missing(self) -> list[str]:
        """List connections with the expected nodes that do not stand yet, and whose parameters
        are not known yet; empty when nothing is missing.
        """
        outputs = [(topic, self.readers(topic), publisher) for topic, publisher in self._outputs]
        unheard = () if self.certified is None else sorted(self.certified.others.unheard)
        return missing_connections(
            self, self.KIND, outputs, self._inputs,
            self.parameters_of(parameters.NodeParameters).expected_nodes) + [
                f'parameters of {owner} are not known' for owner in unheard]

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
        self.health.stamp_ns, self._begun_s = stamp_ns, time.monotonic()
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
            self._watch_services()
            self.report(periodic=True)

    def _watch_services(self) -> None:
        """Tell which of the node's services somebody else serves too."""
        for service in self.services:
            name, key = service.service_name, f'servers of {service.service_name}'
            who = self.strangers.serving(name) if self.count_services(name) > 1 else ''
            if who:
                self.warn(key, f'{name} is not only of this node{who}: whoever is faster answers')
            else:
                self.clear(key)

    def _run_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        self.elapsed = self._clock_of_ticks.step(stamp_ns)
        self._said_before, self._said[:] = (self.health.stamp_ns, list(self._said)), []
        try:
            self.begin_tick(stamp_ns)
            self.on_tick(stamp_ns, values)
            self.end_tick()
        except Exception as error:
            self._failed = f'{FAILED} {stamp_ns * 1e-9:.3f} s: {type(error).__name__}: {error}'
            raise
        self._failed = ''

    def unfinished(self) -> str:
        """How the last tick failed; in lock-step, where nobody goes on, what the one lacks that
        has not ended for a while; else empty.
        """
        waits = self.lock_step and self.active and (
            time.monotonic() > self._begun_s + STALLED_S)
        stamp_ns, lacking = self.awaited() if waits else (-1, [])
        return self._failed or (lacking and f'{LACKS} {stamp_ns * 1e-9:.3f} s of '
                                f'{", ".join(lacking)}' or '')

    def awaited(self) -> tuple[int, list[str]]:
        """Stamp of the tick that has begun and cannot end [ns], and what it lacks."""
        return self.inputs.awaited() if hasattr(self, 'inputs') else (-1, [])

    def _repeat(self, stamp_ns: int) -> None:
        """Publish again what was said in a tick, one of the last two, or in the last before it,
        for a node that was restarted meanwhile.
        """
        before_ns, before = self._said_before
        for publish in before if stamp_ns == before_ns else list(self._said) if (
                stamp_ns >= self.health.stamp_ns) else ():
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

    def _answer_ready(self, request: Any, response: Any) -> Any:
        problems = self.missing() if self.active else [
            f'{self.get_name()} is {self.state_label}']
        response.success = not problems
        response.message = '; '.join(filter(None, (*(problems or ['ready']), self.unfinished())))
        return response
