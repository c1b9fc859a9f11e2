# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""May parameters change while the robot walks? If the certificate allows it.

Every parameter that may change has one owner (:data:`~dmp_cpg_ros.core.suite_parameters.OWNER`).
The owner knows what the others run with, computes the certificate with the proposed value, and
refuses a change that would lose it; the others follow what the owner has accepted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import nan
from typing import TYPE_CHECKING, Any, NamedTuple

from dmp_cpg_ros.core import suite_parameters as suite
from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.certificates import gate
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.certificates.verdict import Change, Verdict
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import Changing, GaitChoiceParameters, changing_to
from dmp_cpg_ros.core.gait.contact_feedback import ContactLimits
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.running import CADENCE_RATE, RunningGait, limits_on_the_way
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters, GaitInForce
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.parameters import typed
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.reference.governor import Governor
from dmp_cpg_ros.core.transformation.leg import LegParameters, body_scale
from dmp_cpg_ros.core.voting.parameters import VotingParameters
from dmp_cpg_ros.nodes.framework.gaits import description_of, known_gaits
from dmp_cpg_ros.nodes.framework.judging import Step, beside_ticks
from dmp_cpg_ros.nodes.framework.parameter_follower import ParameterFollower
from dmp_cpg_ros.nodes.framework.parameters import Sets
from dmp_cpg_ros.nodes.messages.commands import read_twist
from dmp_cpg_ros.nodes.messages.interfaces import STAMPED_CMD_VEL

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

JUDGED = (*suite.OWNER, 'allow_uncertified')
"""Parameters that may change in a node with a certificate."""

PROBLEM = 'certificate'
"""Key of the warning on ``/diagnostics``."""

AHEAD_S = 0.25
"""Time within which a verdict is expected, for which the moving cadence is looked ahead [s]."""


class Acting(NamedTuple):
    """What acts in a node, as far as it knows.

    Attributes
    ----------
    cadence : float or None
        Factor on the cadence, on its way to the accepted one.
    stop : (GaitNetwork, Inhibition, ndarray (4, 2)) or None
        Network, inhibition and states of the last tick.
    gaits : tuple of Gait
        That are walked, both ends of a change between two, and wanted.
    ahead : bool
        Whether inhibition is armed by another node, which tells it some time before it acts.
    """

    cadence: float | None = None
    stop: tuple[GaitNetwork, Inhibition, Any] | None = None
    gaits: tuple[Gait, ...] = ()
    ahead: bool = False


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
    others : ParameterFollower
        What the other owners have accepted.
    """

    def __init__(self, node: SuiteNode, acting: Callable[[], Acting], *, watches: bool = False
                 ) -> None:
        """Read what certificates are computed from, and follow the others."""
        self._node, self._acting, self._watches = node, acting, watches
        self.gaits, self._scale = known_gaits(node), body_scale(description_of(node))
        self._held: Certificate | None = None
        self._held_in: dict[str, Certificate] = {}
        self._verdict: Verdict | None = None
        self._judged: tuple[Change, Verdict] | None = None
        self.others = ParameterFollower(node)

    def end(self) -> None:
        """Stop following."""
        self.others.end()

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
        return self._running(self._accepted, [end.name for end in gait.ends])

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
        chosen = self.gaits.chosen(sets[GaitChoiceParameters])
        gaits = [self.gaits.named(name) for name in names or (sets[suite.GaitParameters].gait,)]
        gait, *others = dict.fromkeys([*gaits, *(() if names else chosen)])
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

        def learn(verdict: Verdict) -> None:
            self._judged = change, verdict

        return change.verdict, learn

    def _asked(self, sets: Sets) -> tuple[dict[str, Any], Change] | None:
        """Values that change, and the change; None where there is nothing to judge: no inequality
        depends on it, or its owner has accepted it. Raises ParameterError for unknown gaits.
        """
        node = self._node
        if not node.configured:
            return None
        changed = node.parameter_changes.between(sets)
        gaits = self._walked_gaits(sets)
        if not changed or gate.UNCERTIFIED.issuperset(changed):
            return None
        proposed = self._running(sets)
        if node.parameter_changes.following:
            return None
        return changed, Change(
            self._running(self._accepted), self.certificate, proposed, gaits)

    def _waits(self, change: Change) -> str:
        """Why the change has to wait; empty when it has not."""
        acting = self._acting()
        return '' if acting.stop is None else change.proposed.refused_now(
            change.present, *acting.stop, ahead=acting.ahead)

    def _ahead(self, change: Change) -> Change:
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

    def _walked_gaits(self, sets: Sets) -> tuple[Gait, ...]:
        """Gaits that are walked until those that are asked for are; raises ParameterError for one
        that there is not, or that nobody may ask for now.
        """
        named, accepted = self.gaits.named, self._accepted
        name, choice = sets[suite.GaitParameters].gait, sets[GaitChoiceParameters]
        before, chose = accepted[suite.GaitParameters].gait, accepted[GaitChoiceParameters]
        if name != before:
            named(name)
            choice.check_asked(name)
        names = [gait.name for gait in self._acting().gaits]
        names += chose.auto_gaits if chose.auto_gait else (before,)
        return tuple(map(named, names))

    def accept(self) -> None:
        """Take over what :meth:`check` has let pass, and tell of the certificate."""
        self._held_in = {}
        if self._verdict is not None:
            self._held = self._verdict.settled
            if self._verdict.accepted and self._held is None:
                # while a cadence is on its way this holds, too; the answer did not wait for that
                # of the one that was asked for
                self._held, running = self._verdict.certificate, self._running(
                    self._accepted).settled
                beside_ticks(self._node, running.certificate, partial(self._learn, running))
            self.report()
        elif self._node.parameter_changes.following:
            needed, self._held = self._held is not None, None
            if self._watches or (needed and not self._node.lock_step):
                running = self._running(self._accepted).settled
                beside_ticks(
                    self._node, running.certificate, partial(self._learn, running))

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

    def supervisor(self, lead_ns: int = 0) -> GaitSupervisor:
        """What stops and starts the gait, told ahead by a time [ns]."""
        of = self._node.parameters_of
        return GaitSupervisor(
            of(InhibitionParameters), of(VotingParameters), of(LegParameters).activity_rate,
            of(ReferenceParameters), lead_ns)

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
        commands.follow(self._node.parameters_of(ReferenceParameters), *self._limits())

    def reference(self) -> ReferenceSystem:
        """The reference's filters, with the limits of the gait that is wanted."""
        return ReferenceSystem(
            self._node.parameters_of(ReferenceParameters), self._scale.hip_radius,
            Governor(self._limits()[0], self._scale))

    def changing(self, gait: GaitInForce) -> Changing | None:
        """Change of the gait in force that shortens commands, None for none."""
        of = self._node.parameters_of
        return changing_to(of(GaitChoiceParameters), gait,
                           self.gaits.named(of(suite.GaitParameters).gait))

    def _limits(self) -> tuple[tuple[Gait, ...], tuple[Gait, ...], float]:
        of = self._node.parameters_of
        return limits_on_the_way(
            of(GaitChoiceParameters), of(suite.GaitParameters).gait, self.gaits.named,
            of(CanonicalParameters).cadence_scale,
            self._acting().cadence if self._node.configured else None)


def certificate_words(certificate: Certificate) -> str:
    """Certificate in a few words: whether it holds, its grade, what is sampled."""
    if not certificate.holds:
        return f'certificate fails: {", ".join(entry.name for entry in certificate.failing)}'
    sampled = f', sampled: {", ".join(certificate.sampled)}' if certificate.sampled else ''
    return f'certificate holds, {certificate.contraction_grade} grade{sampled}'
