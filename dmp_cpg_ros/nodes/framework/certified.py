# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""May parameters change while the robot walks? If the certificate allows it.

Every parameter that may change has one owner (:data:`~dmp_cpg_ros.core.suite_parameters.OWNER`).
The owner knows what the others run with, computes the certificate with the proposed value, and
refuses a change that would lose it; the others follow what the owner has accepted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from math import nan
from typing import TYPE_CHECKING, Any, NamedTuple

from rcl_interfaces.msg import ParameterEvent, ParameterValue
from rcl_interfaces.srv import GetParameters
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import qos_profile_parameter_events
from rclpy.task import Future

from dmp_cpg_ros.core import suite_parameters as suite
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.certificates import gate
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.gait.contact_feedback import ContactLimits
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.running import (
    CADENCE_RATE,
    GaitChoiceParameters,
    RunningGait,
    limiting_gaits,
)
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitChangeParameters, GaitInForce
from dmp_cpg_ros.core.parameters import typed
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.reference.governor import Governor
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.nodes.framework.gaits import description_of, known_gaits
from dmp_cpg_ros.nodes.framework.judging import Step
from dmp_cpg_ros.nodes.framework.parameters import plain
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader
from dmp_cpg_ros.nodes.messages.commands import read_twist
from dmp_cpg_ros.nodes.messages.interfaces import STAMPED_CMD_VEL

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

Sets = Mapping[type[Any], Any]
"""Parameter sets by their class."""

JUDGED = (*suite.OWNER, 'allow_uncertified')
"""Parameters that may change in a node with a certificate."""

PROBLEM = 'certificate'
"""Key of the warning on ``/diagnostics``."""

AHEAD_S = 0.25
"""Time within which a verdict is expected, for which the moving cadence is looked ahead [s]."""

ASK_EVERY_S = 5.0
"""Period of asking the owners [s]: what an event did not tell, because a node was not there yet or
had to be started again, is known after this time.
"""


class ParameterFollower:
    """Lets a node follow what the owners of parameters have accepted.

    What ``/parameter_events`` tells anybody can have said, so news make the node ask the owner,
    and so does time that has passed. False news, and answers that the node refuses, are counted
    as dropped.
    """

    def __init__(self, node: SuiteNode) -> None:
        """Listen, and ask the owners that are there."""
        self._node, space = node, node.get_namespace().rstrip('/')
        self._names = {owner: names for owner, names in suite.CHANGEABLE.items()
                       if owner != node.KIND}
        self._owners = {f'{space}/{owner}': owner for owner in self._names}
        self._events = node.create_subscription(
            ParameterEvent, '/parameter_events', self._on_event, qos_profile_parameter_events,
            raw=True)
        self._read = serialized_reader(ParameterEvent)
        self._askers = {owner: node.create_client(GetParameters, f'{owner}/get_parameters')
                        for owner in self._names}
        self._pending: dict[str, Future] = {}
        self._claimed: dict[str, dict[str, Any]] = {}
        self._timer = node.create_steady_timer(ASK_EVERY_S, self._ask)

    def end(self) -> None:
        """Stop following."""
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._events)
        for client in self._askers.values():
            self._node.destroy_client(client)

    def _on_event(self, data: bytes) -> None:
        event: ParameterEvent = self._read(data)
        owner = self._owners.get(event.node)
        if owner is None:
            return
        told = self._plain(owner, {entry.name: entry.value for entry in (
            *event.new_parameters, *event.changed_parameters)})
        if not told:
            return
        if not self._askers[owner].service_is_ready():
            raise DataError(f'{told} is said to be changed by {owner}, which does not answer')
        asked = self._pending.get(owner)
        self._claimed[owner] = told
        if asked is None or asked.done():  # else it asks again when the answer is there
            self._ask_owner(owner)

    def _plain(self, owner: str, values: Mapping[str, ParameterValue]) -> dict[str, Any]:
        """Values of the owner's parameters that are followed; raises DataError."""
        try:
            return {name: plain(parameter_value_to_python(value))
                    for name, value in values.items() if name in self._names[owner]}
        except RuntimeError as error:
            raise DataError(f'a value of {owner} cannot be read: {error}') from None

    def _ask(self) -> None:
        for owner, client in self._askers.items():
            former = self._pending.pop(owner, None)
            if former is not None and not former.done():
                client.remove_pending_request(former)
            if client.service_is_ready():
                self._ask_owner(owner)

    def _ask_owner(self, owner: str) -> None:
        claimed = self._claimed.pop(owner, {})
        future = self._askers[owner].call_async(
            GetParameters.Request(names=self._names[owner]))
        self._pending[owner] = future
        future.add_done_callback(self._node.guarded(
            f'{owner}/get_parameters', partial(self._answered, owner, claimed)))

    def _answered(self, owner: str, claimed: Mapping[str, Any], future: Future) -> None:
        answer, names = future.result(), self._names[owner]
        if answer is None or len(answer.values) != len(names):
            return
        told = self._plain(owner, dict(zip(names, answer.values, strict=True)))
        if owner in self._claimed:
            self._ask_owner(owner)
        if not self._node.parameter_changes.follow(told) and any(
                told[name] != value for name, value in claimed.items()):
            self._node.drop('/parameter_events', DataError(
                f'{dict(claimed)} is said to be changed by {owner}, which has not'),
                self._node.strangers.publishing('/parameter_events'))


class Acting(NamedTuple):
    """What acts in a node, as far as it knows.

    Attributes
    ----------
    cadence : float or None
        Factor on the cadence, on its way to the accepted one.
    stop : (GaitNetwork, Inhibition, ndarray (4, 2)) or None
        Network, inhibition and states of the last tick.
    gaits : tuple of Gait
        Of the node that owns the gait: the one that it walks or comes to, and the one it wants.
    """

    cadence: float | None = None
    stop: tuple[GaitNetwork, Inhibition, Any] | None = None
    gaits: tuple[Gait, ...] = ()


class Certified:
    """Certificate of all that runs, in a node whose parameters it is computed from.

    Parameters
    ----------
    node : SuiteNode
        Its parameter sets hold all of :data:`~dmp_cpg_ros.core.suite_parameters.CERTIFIED` and
        :class:`~dmp_cpg_ros.core.suite_parameters.CertificateParameters`.
    acting : callable () → Acting
        Asked once the node is configured.
    watches : bool
        Whether the node tells on ``/diagnostics`` what becomes of the certificate with what others
        accepted: two nodes may accept changes at the same moment that do not go together.

    Attributes
    ----------
    gaits : KnownGaits
        All gaits of the node's file.
    """

    def __init__(self, node: SuiteNode, acting: Callable[[], Acting], *, watches: bool = False
                 ) -> None:
        """Read what certificates are computed from, and follow the others."""
        self._node, self._acting, self._watches = node, acting, watches
        self.gaits, self._scale = known_gaits(node), body_scale(description_of(node))
        self._held: Certificate | None = None
        self._held_in: dict[str, Certificate] = {}
        self._verdict: gate.Verdict | None = None
        self._judged: tuple[gate.Change, gate.Verdict] | None = None
        self._follower = ParameterFollower(node)

    def end(self) -> None:
        """Stop following."""
        self._follower.end()

    # The certificate ---------------------------------------------------------------------------

    @property
    def certificate(self) -> Certificate:
        """Certificate of the parameters that were accepted last."""
        if self._held is None:
            self._held = self._running(self._accepted).settled.certificate()
        return self._held

    @property
    def contact(self) -> ContactLimits | None:
        """What contact feedback may do; None where it is off."""
        on = self._accepted[CanonicalParameters].contact_feedback
        return self.certificate.contact if on else None

    def certificate_in(self, gait: GaitInForce) -> Certificate:
        """Certificate of a gait in force, or of a change between two, with the same parameters."""
        running = self.running_in(gait)
        if running.moving:
            return running.certificate()
        if running.gait.name == self._accepted[suite.GaitParameters].gait:
            return self.certificate
        if gait.name not in self._held_in:
            self._held_in[gait.name] = running.certificate()
        return self._held_in[gait.name]

    def running_in(self, gait: GaitInForce) -> gate.Running:
        """What runs in a gait in force, or in a change between two."""
        if gait.name == self._accepted[suite.GaitParameters].gait:
            return self._running(self._accepted)
        ends = (gait.transition.before, gait.transition.after) if isinstance(
            gait, BlendedGait) else (gait,)
        return self._running(self._accepted, [end.name for end in ends])

    def report(self) -> None:
        """Say on ``/diagnostics`` whether the accepted parameters are certified."""
        if self.certificate.holds:
            self._node.clear(PROBLEM)
        else:
            self._node.warn(PROBLEM, f'WITHOUT a certificate: {self.certificate.explained()}',
                            error=True)

    def _running(self, sets: Sets, names: Sequence[str] = ()) -> gate.Running:
        """What parameter sets describe, or the same with other gaits; raises ParameterError for a
        gait that there is not.
        """
        choice = sets[GaitChoiceParameters]
        chosen = choice.auto_gaits if choice.auto_gait else ()
        names = names or (sets[suite.GaitParameters].gait, *chosen)
        gait, *others = [self.gaits.named(name) for name in dict.fromkeys(names)]
        return gate.Running(
            suite.SuiteParameters.of(sets), gait, self._scale,
            sets[suite.TickParameters].tick_ns * 1e-9, tuple(others),
            self._acting().cadence if self._node.configured else None)

    # Changes -----------------------------------------------------------------------------------

    @property
    def _accepted(self) -> Sets:
        return self._node.parameter_changes.accepted

    def check(self, sets: Sets) -> None:
        """Refuse what would lose the certificate, or what nobody can walk with.

        Raises
        ------
        ParameterError
            With the valid names, or with the inequality that fails and what is nearest.
        """
        self._verdict = None
        asked = self._asked(sets)
        if asked is None:
            return
        changed, change = asked
        waits = self._waits(change)
        if waits:
            raise ParameterError(waits)
        if self._judged is None or not self._judged[0].covers(change):
            self._judged = change, change.verdict()
        verdict = self._judged[1]
        if not verdict.accepted and not sets[suite.CertificateParameters].allow_uncertified:
            told = ', '.join(f'{name} = {typed(value)}' for name, value in changed.items())
            raise ParameterError(
                f'{told} would lose the certificate: {verdict.reason} '
                '(allow_uncertified:=true changes it all the same)')
        self._verdict = verdict

    def to_judge(self, sets: Sets) -> Step | None:
        """What has to be computed, and who is to be told, before :meth:`check` can judge a change
        at once; None where nothing has to be.

        Meanwhile the cadence that acts goes on towards the accepted one. The change is judged for
        where it will be, and :meth:`check` asks whether it still lies in what was judged.
        """
        if self._held is None and self._node.configured:
            present = self._running(self._accepted).settled
            return present.certificate, partial(self._learn, present)
        asked = self._asked(sets)
        if asked is None or self._waits(asked[1]) or (
                self._judged is not None and self._judged[0].covers(asked[1])):
            return None
        change = self._ahead(asked[1])

        def learn(verdict: gate.Verdict) -> None:
            self._judged = change, verdict

        return change.verdict, learn

    def _asked(self, sets: Sets) -> tuple[dict[str, Any], gate.Change] | None:
        """Values that change, and the change; None where there is nothing to judge: no inequality
        depends on it, or its owner has accepted it. Raises ParameterError for unknown gaits.
        """
        node = self._node
        if not node.configured:
            return None
        changed = node.parameter_changes.between(sets)
        gaits = self._changing_gaits(sets)
        if not changed or gate.UNCERTIFIED.issuperset(changed):
            return None
        proposed = self._running(sets)
        if node.parameter_changes.following:
            return None
        return changed, gate.Change(
            self._running(self._accepted), self.certificate, proposed, gaits)

    def _waits(self, change: gate.Change) -> str:
        """Why the change has to wait; empty when it has not."""
        stop = self._acting().stop
        return change.proposed.refused_now(change.present, *stop) if stop else ''

    def _ahead(self, change: gate.Change) -> gate.Change:
        """The change for the cadence that acts now or soon, whichever is farther from the one that
        is asked for.
        """
        now = change.proposed.acting_cadence
        if now is None:
            return change
        wanted, accepted = (running.parameters.canonical.cadence_scale
                            for running in (change.proposed, change.present))
        reach = CADENCE_RATE * AHEAD_S
        soon = now + min(max(accepted - now, -reach), reach)
        farther = max(now, soon, key=lambda cadence: abs(cadence - wanted))
        return replace(change, proposed=replace(change.proposed, acting_cadence=farther))

    def _changing_gaits(self, sets: Sets) -> tuple[Gait, ...]:
        """Gaits among which a change of the gait changes, the one that is walked included; empty
        where it does not change. Raises ParameterError for one that there is not.
        """
        walked, named = self._acting().gaits, self.gaits.named
        name, choice = sets[suite.GaitParameters].gait, sets[GaitChoiceParameters]
        asked = name != self._accepted[suite.GaitParameters].gait
        chosen = choice.auto_gait and choice != self._accepted[GaitChoiceParameters]
        if not walked or not (asked or chosen):
            return ()
        if asked:
            named(name)
            if choice.auto_gait:
                raise ParameterError(
                    f"gait = '{name}' cannot be set while auto_gait chooses among "
                    f'{", ".join(choice.auto_gaits)}; set auto_gait to false first')
        news = choice.auto_gaits if chosen else (name,)
        return tuple(named(gait) for gait in (*(gait.name for gait in walked), *news))

    def accept(self) -> None:
        """Take over what :meth:`check` has let pass, and tell of the certificate."""
        self._held_in = {}
        if self._verdict is not None:
            self._held = self._verdict.settled
            self.report()
        elif self._node.parameter_changes.following:
            needed, self._held = self._held is not None, None
            if self._watches or (needed and not self._node.lock_step):
                running = self._running(self._accepted).settled
                self._node.beside_ticks(running.certificate, partial(self._learn, running))

    def _learn(self, running: gate.Running, certificate: Certificate) -> None:
        """Take the certificate of what was accepted, unless that is something else by now."""
        if running == self._running(self._accepted).settled:
            self._held = certificate
            if self._watches:
                self.report()

    # What is made of the parameters in effect --------------------------------------------------

    def running_gait(self, quarter: float = nan) -> RunningGait:
        """Canonical block of all gaits."""
        of = self._node.parameters_of
        return RunningGait(of(CanonicalParameters), self._scale, self.gaits,
                           of(GaitChangeParameters), of(GaitChoiceParameters), quarter)

    def commands(self) -> CommandGate:
        """What comes on ``cmd_vel``, limited."""
        commands = CommandGate(self._node.parameters_of(ReferenceParameters), self._scale)
        self.limit(commands)
        stamped = self._node.parameters_of(suite.CommandParameters).stamped_cmd_vel

        def take(message: Any) -> None:
            commands.accept(*read_twist(message.twist if stamped else message))

        self._node.listen(STAMPED_CMD_VEL if stamped else 'cmd_vel', take, command=True)
        return commands

    def limit(self, commands: CommandGate) -> None:
        """Let commands follow the limits, those of the gait included."""
        commands.follow(self._node.parameters_of(ReferenceParameters), self._limiting_gaits())

    def reference(self) -> ReferenceSystem:
        """The reference's filters, with the limits of the gait that is wanted."""
        return ReferenceSystem(
            self._node.parameters_of(ReferenceParameters), self._scale.hip_radius,
            Governor(self._limiting_gaits(), self._scale))

    @property
    def wanted(self) -> Gait | None:
        """Gait that is asked for; None where it is chosen."""
        of = self._node.parameters_of
        if of(GaitChoiceParameters).auto_gait:
            return None
        return self.gaits.named(of(suite.GaitParameters).gait)

    def _limiting_gaits(self) -> tuple[Gait, ...]:
        of = self._node.parameters_of
        return limiting_gaits(
            of(GaitChoiceParameters), of(suite.GaitParameters).gait, self.gaits.named)


def certificate_words(certificate: Certificate) -> str:
    """Certificate in a few words: whether it holds, its grade, what is sampled."""
    if not certificate.holds:
        return f'certificate fails: {", ".join(entry.name for entry in certificate.failing)}'
    sampled = f', sampled: {", ".join(certificate.sampled)}' if certificate.sampled else ''
    return f'certificate holds, {certificate.contraction_grade} grade{sampled}'
