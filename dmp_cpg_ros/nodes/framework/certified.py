# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes whose parameters may change while the robot walks, if the certificate allows it.

Every parameter that may change has one owner (:data:`~dmp_cpg_ros.core.suite_parameters.OWNER`).
The owner knows what the others run with, computes the certificate with the proposed value, and
refuses a change that would lose it; the others follow what the owner has accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

from rclpy.parameter import Parameter

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.certificates.certify import Certificate
from dmp_cpg_ros.core.certificates.gate import (
    UNCERTIFIED,
    CertificateGate,
    Running,
    Verdict,
    shown,
)
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters, highest_speed
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
from dmp_cpg_ros.nodes.framework.suite_node import P, Sets, SuiteNode
from dmp_cpg_ros.nodes.framework.ticks import drain
from dmp_cpg_ros.nodes.messages.conversions import read_twist
from dmp_cpg_ros.nodes.messages.interfaces import STAMPED_CMD_VEL

PROBLEM = 'certificate'
"""Key of the warning on ``/diagnostics``."""


class CertifiedNode(SuiteNode):
    """A managed node that owns certified parameters and follows those of the others.

    Its parameter sets hold all of :data:`~dmp_cpg_ros.core.suite_parameters.CERTIFIED` and
    :class:`~dmp_cpg_ros.core.suite_parameters.CertificateParameters`.
    """

    CHANGEABLE = (*OWNER, 'allow_uncertified')

    def __init__(self, name: str | None = None, **options: Any) -> None:
        """Create the node; it follows nobody before it is configured."""
        self._follower: ParameterFollower | None = None
        self._judged: Verdict | None = None
        self._held: Certificate | None = None
        self._held_in: dict[str, Certificate] = {}
        self._held_for: Sets = {}
        self._changes = CertificateGate(self._let_ticks_pass)
        super().__init__(name, **options)

    # The certificate ---------------------------------------------------------------------------

    @property
    def certificate(self) -> Certificate:
        """Certificate of the parameters that were accepted last."""
        if self._held is None:
            accepted = self._running(self._accepted)
            self._held = replace(accepted, acting_cadence=None).certificate()
        return self._held

    def certificate_in(self, gait: GaitInForce) -> Certificate:
        """Certificate of a gait in force, or of a change between two, with the same parameters."""
        running = self.running_in(gait)
        if running.gait.name == self._accepted_of(GaitParameters).gait and not running.moving:
            return self.certificate
        if running.moving:
            return running.certificate()
        if self._held_for is not self._accepted:
            self._held_for, self._held_in = self._accepted, {}
        found = self._held_in.get(gait.name)
        if found is None:
            found = self._held_in[gait.name] = running.certificate()
        return found

    def running_in(self, gait: GaitInForce) -> Running:
        """What runs in a gait in force, or in a change between two."""
        if gait.name == self._accepted_of(GaitParameters).gait:
            return self._running(self._accepted)
        ends = (gait.transition.before, gait.transition.after) if isinstance(
            gait, BlendedGait) else (gait,)
        return self._running(self._accepted, [end.name for end in ends])

    def acting_cadence(self) -> float | None:
        """Factor on the cadence that acts, for a node that knows it."""
        return None

    def stop_in_force(self) -> tuple[GaitNetwork, Inhibition, Any] | None:
        """Network, inhibition and states that act, for a node that knows them."""
        return None

    def prepare_certificate(self) -> None:
        """Read what certificates are computed from, and follow the others; in ``configure``."""
        self.gaits, self._scale = known_gaits(self), body_scale(description_of(self))
        self._held = None
        others = {node: names for node, names in CHANGEABLE.items() if node != self.KIND}
        self._follower = ParameterFollower(self, others, self.follow)

    def new_running(self, quarter: float = float('nan')) -> RunningGait:
        """Canonical block of all gaits with the parameters in effect, without reading any file."""
        return RunningGait(self.parameters_of(CanonicalParameters), self._scale, self.gaits,
                           self.parameters_of(GaitChangeParameters),
                           self.parameters_of(GaitChoiceParameters), quarter)

    def new_gate(self) -> CommandGate:
        """Gate of commands with the limits in effect."""
        gate = CommandGate(self.parameters_of(ReferenceParameters), self._scale)
        self.limit(gate)
        return gate

    def limit(self, gate: CommandGate) -> None:
        """Let a gate of commands follow the limits in effect, those of the gait included."""
        gate.follow(self.parameters_of(ReferenceParameters), highest_speed(
            self.parameters_of(GaitChoiceParameters), self.parameters_of(GaitParameters).gait,
            self.gaits.named))

    def listen_to_commands(self, gate: CommandGate) -> None:
        """Let a gate take what comes on ``cmd_vel``."""
        if self.parameters_of(CommandParameters).stamped_cmd_vel:
            self.listen(STAMPED_CMD_VEL, lambda message: gate.accept(*read_twist(message.twist)),
                        command=True)
        else:
            self.listen('cmd_vel', lambda message: gate.accept(*read_twist(message)),
                        command=True)

    def certificate_changed(self) -> None:
        """Say on ``/diagnostics`` whether the accepted parameters are certified."""
        if self.certificate.holds:
            self.clear(PROBLEM)
        else:
            self.warn(PROBLEM, f'WITHOUT a certificate: {self.certificate.explained()}',
                      error=True)

    def destroy_entities(self) -> None:
        """Destroy what ``configure`` made."""
        if self._follower is not None:
            self._follower.end()
            self._follower = None
        super().destroy_entities()

    def _accepted_of(self, cls: type[P]) -> P:
        return cast(P, self._accepted[cls])

    def _running(self, sets: Sets, names: Sequence[str] = ()) -> Running:
        """What parameter sets describe, or the same with other gaits; raises ParameterError for a
        gait that there is not.
        """
        def of(cls: Any) -> Any:
            return sets[cls]

        choice = of(GaitChoiceParameters)
        chosen = choice.auto_gaits if choice.auto_gait else ()
        names = names or (of(GaitParameters).gait, *chosen)
        gait, *others = [self.gaits.named(name) for name in dict.fromkeys(names)]
        return Running(SuiteParameters.of(sets), gait, self._scale,
                       of(TickParameters).tick_ns * 1e-9, tuple(others),
                       self.acting_cadence() if self.configured else None)

    # Own changes -------------------------------------------------------------------------------

    def check_parameters(self, sets: Sets) -> None:
        """Refuse what would lose the certificate, or what nobody can walk with."""
        self._judged = None
        before, after = self._table.values(self._accepted), self._table.values(sets)
        changed = {name: value for name, value in after.items() if value != before[name]}
        if not changed or not self.configured or UNCERTIFIED.issuperset(changed):
            return
        running = self._running(sets)
        if self._following:
            return
        present, stop = self._running(self._accepted), self.stop_in_force()
        waits = '' if stop is None else running.refused_now(present, *stop)
        if waits:
            raise ParameterError(waits)
        verdict = self._changes.judge(present, self.certificate, running)
        if not verdict.accepted and not _allowed(sets):
            asked = ', '.join(f'{name} = {shown(value)}' for name, value in changed.items())
            raise ParameterError(
                f'{asked} would lose the certificate: {verdict.reason} '
                '(allow_uncertified:=true changes it all the same)')
        self._judged = verdict

    def _accept_change(self, changes: list[Parameter]) -> None:
        super()._accept_change(changes)
        if not self.configured:
            return
        if self._judged is not None:
            moving = self._running(self._accepted).moving
            self._held = None if moving else self._judged.certificate
            self.certificate_changed()
        elif self._following:
            self._held = None
            self.others_changed()

    def _let_ticks_pass(self) -> None:
        """Between two certificates of a long look for the nearest value, take waiting messages:
        the robot walks on while its parameters are judged.
        """
        for _, subscription in self._inputs if self.active else ():
            drain(subscription)

    # Others' changes ---------------------------------------------------------------------------

    def others_changed(self) -> None:
        """Note that other nodes accepted changes, which are in the accepted parameters."""


def _allowed(sets: Sets) -> bool:
    permission: Any = sets[CertificateParameters]
    return bool(permission.allow_uncertified)
