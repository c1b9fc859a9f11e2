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
from math import nan
from typing import TYPE_CHECKING, Any, NamedTuple

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.certificates.certify import Certificate
from dmp_cpg_ros.core.certificates.changes import refused_change
from dmp_cpg_ros.core.certificates.gate import (
    UNCERTIFIED,
    CertificateGate,
    Running,
    Verdict,
    shown,
)
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters, highest_speed
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.running import RunningGait
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitChangeParameters, GaitInForce
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceParameters
from dmp_cpg_ros.core.suite_parameters import (
    CHANGEABLE,
    OWNER,
    CertificateParameters,
    CommandParameters,
    GaitParameters,
    SuiteParameters,
    TickParameters,
)
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.nodes.framework.gaits import description_of, known_gaits
from dmp_cpg_ros.nodes.framework.parameter_services import ParameterFollower
from dmp_cpg_ros.nodes.messages.conversions import read_twist
from dmp_cpg_ros.nodes.messages.interfaces import STAMPED_CMD_VEL

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

Sets = Mapping[type[Any], Any]
"""Parameter sets by their class."""

JUDGED = (*OWNER, 'allow_uncertified')
"""Parameters that may change in a node with a certificate."""

PROBLEM = 'certificate'
"""Key of the warning on ``/diagnostics``."""


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
        self._judged: Verdict | None = None
        self._gate = CertificateGate(node.let_ticks_pass)
        others = {owner: names for owner, names in CHANGEABLE.items() if owner != node.KIND}
        self._follower = ParameterFollower(node, others, node.follow)

    def end(self) -> None:
        """Stop following."""
        self._follower.end()

    # The certificate ---------------------------------------------------------------------------

    @property
    def certificate(self) -> Certificate:
        """Certificate of the parameters that were accepted last."""
        if self._held is None:
            accepted = self._running(self._node.accepted)
            self._held = replace(accepted, acting_cadence=None).certificate()
        return self._held

    def certificate_in(self, gait: GaitInForce) -> Certificate:
        """Certificate of a gait in force, or of a change between two, with the same parameters."""
        running = self.running_in(gait)
        if running.moving:
            return running.certificate()
        if running.gait.name == self._node.accepted[GaitParameters].gait:
            return self.certificate
        if gait.name not in self._held_in:
            self._held_in[gait.name] = running.certificate()
        return self._held_in[gait.name]

    def running_in(self, gait: GaitInForce) -> Running:
        """What runs in a gait in force, or in a change between two."""
        if gait.name == self._node.accepted[GaitParameters].gait:
            return self._running(self._node.accepted)
        ends = (gait.transition.before, gait.transition.after) if isinstance(
            gait, BlendedGait) else (gait,)
        return self._running(self._node.accepted, [end.name for end in ends])

    def report(self) -> None:
        """Say on ``/diagnostics`` whether the accepted parameters are certified."""
        if self.certificate.holds:
            self._node.clear(PROBLEM)
        else:
            self._node.warn(PROBLEM, f'WITHOUT a certificate: {self.certificate.explained()}',
                            error=True)

    def _running(self, sets: Sets, names: Sequence[str] = ()) -> Running:
        """What parameter sets describe, or the same with other gaits; raises ParameterError for a
        gait that there is not.
        """
        choice = sets[GaitChoiceParameters]
        chosen = choice.auto_gaits if choice.auto_gait else ()
        names = names or (sets[GaitParameters].gait, *chosen)
        gait, *others = [self.gaits.named(name) for name in dict.fromkeys(names)]
        return Running(SuiteParameters.of(sets), gait, self._scale,
                       sets[TickParameters].tick_ns * 1e-9, tuple(others),
                       self._acting().cadence if self._node.configured else None)

    # Changes -----------------------------------------------------------------------------------

    def check(self, sets: Sets) -> None:
        """Refuse what would lose the certificate, or what nobody can walk with.

        Raises
        ------
        ParameterError
            With the valid names, or with the inequality that fails and what is nearest.
        """
        node, self._judged = self._node, None
        if not node.configured:
            return
        acting, changed = self._acting(), node.changed_values(sets)
        if acting.gaits:
            self._check_gait(acting.gaits, sets)
        if not changed or UNCERTIFIED.issuperset(changed):
            return
        running = self._running(sets)
        if node.following:
            return
        present = self._running(node.accepted)
        waits = running.refused_now(present, *acting.stop) if acting.stop else ''
        if waits:
            raise ParameterError(waits)
        verdict = self._gate.judge(present, self.certificate, running)
        if not verdict.accepted and not sets[CertificateParameters].allow_uncertified:
            asked = ', '.join(f'{name} = {shown(value)}' for name, value in changed.items())
            raise ParameterError(
                f'{asked} would lose the certificate: {verdict.reason} '
                '(allow_uncertified:=true changes it all the same)')
        self._judged = verdict

    def _check_gait(self, walked: tuple[Gait, ...], sets: Sets) -> None:
        """Refuse gaits that are not known, or whose changes are not certified."""
        name, choice, named = sets[GaitParameters].gait, sets[GaitChoiceParameters], (
            self.gaits.named)
        asked = name != self._node.accepted[GaitParameters].gait
        chosen = choice.auto_gait and choice != self._node.accepted[GaitChoiceParameters]
        if asked:
            named(name)
            if choice.auto_gait:
                raise ParameterError(
                    f"gait = '{name}' cannot be set while auto_gait chooses among "
                    f'{", ".join(choice.auto_gaits)}; set auto_gait to false first')
        if not (asked or chosen):
            return
        news = choice.auto_gaits if chosen else (name,)
        gaits = [named(gait) for gait in (*(gait.name for gait in walked), *news)]
        reason = refused_change(SuiteParameters.of(sets), gaits, self._scale,
                                sets[TickParameters].tick_ns * 1e-9)
        if reason and not sets[CertificateParameters].allow_uncertified:
            raise ParameterError(f'{reason} (allow_uncertified:=true changes all the same)')

    def accept(self) -> None:
        """Take over what :meth:`check` has let pass, and tell of the certificate."""
        self._held_in = {}
        if self._judged is not None:
            moving = self._running(self._node.accepted).moving
            self._held = None if moving else self._judged.certificate
            self.report()
        elif self._node.following:
            self._held = None
            if self._watches:
                self.report()

    # What is made of the parameters in effect --------------------------------------------------

    def running_gait(self, quarter: float = nan) -> RunningGait:
        """Canonical block of all gaits."""
        of = self._node.parameters_of
        return RunningGait(of(CanonicalParameters), self._scale, self.gaits,
                           of(GaitChangeParameters), of(GaitChoiceParameters), quarter)

    def commands(self) -> CommandGate:
        """Gate of what comes on ``cmd_vel``."""
        gate = CommandGate(self._node.parameters_of(ReferenceParameters), self._scale)
        self.limit(gate)
        if self._node.parameters_of(CommandParameters).stamped_cmd_vel:
            self._node.listen(
                STAMPED_CMD_VEL, lambda message: gate.accept(*read_twist(message.twist)),
                command=True)
        else:
            self._node.listen(
                'cmd_vel', lambda message: gate.accept(*read_twist(message)), command=True)
        return gate

    def limit(self, gate: CommandGate) -> None:
        """Let a gate of commands follow the limits, those of the gait included."""
        of = self._node.parameters_of
        gate.follow(of(ReferenceParameters), highest_speed(
            of(GaitChoiceParameters), of(GaitParameters).gait, self.gaits.named))


def certificate_words(certificate: Certificate) -> str:
    """Certificate in a few words: whether it holds, its grade, what is sampled."""
    if not certificate.holds:
        return f'certificate fails: {", ".join(entry.name for entry in certificate.failing)}'
    sampled = f', sampled: {", ".join(certificate.sampled)}' if certificate.sampled else ''
    return f'certificate holds, {certificate.contraction_grade} grade{sampled}'
