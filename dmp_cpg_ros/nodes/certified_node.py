# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes whose parameters may change while the robot walks, if the certificate allows it.

Every parameter that may change has one owner (:data:`~dmp_cpg_ros.core.suite_parameters.OWNER`).
The owner knows what the others run with, computes the certificate with the proposed value, and
refuses a change that would lose it; the others follow what the owner has accepted.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.parameter import Parameter

from dmp_cpg_ros.core.certificate import Certificate
from dmp_cpg_ros.core.certificate_gate import (
    UNCERTIFIED,
    CertificateGate,
    Running,
    Verdict,
    shown,
)
from dmp_cpg_ros.core.errors import DataError, DmpCpgError, ParameterError
from dmp_cpg_ros.core.gait_network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.inhibition import InhibitionParameters
from dmp_cpg_ros.core.leg_primitive import LegParameters, body_scale
from dmp_cpg_ros.core.posture import PostureParameters
from dmp_cpg_ros.core.reference import ReferenceParameters
from dmp_cpg_ros.core.suite_parameters import (
    CHANGEABLE,
    OWNER,
    CertificateParameters,
    GaitParameters,
    SuiteParameters,
    TickParameters,
)
from dmp_cpg_ros.nodes.gait_setup import description_of, gaits_of
from dmp_cpg_ros.nodes.managed_node import ManagedNode
from dmp_cpg_ros.nodes.parameter_follower import ParameterFollower
from dmp_cpg_ros.nodes.parameterized_node import Sets
from dmp_cpg_ros.nodes.ros_parameters import ros_value
from dmp_cpg_ros.nodes.tick_inputs import drain

PROBLEM = 'certificate'
"""Key of the warning on ``/diagnostics``."""


class CertifiedNode(ManagedNode):
    """A managed node that owns certified parameters and follows those of the others.

    Its parameter sets hold all of :data:`~dmp_cpg_ros.core.suite_parameters.CERTIFIED` and
    :class:`~dmp_cpg_ros.core.suite_parameters.CertificateParameters`.
    """

    CHANGEABLE = (*OWNER, 'allow_uncertified')

    def __init__(self, name: str | None = None, **options: Any) -> None:
        """Create the node; it follows nobody before it is configured."""
        self._follower: ParameterFollower | None = None
        self._following = False
        self._judged: Verdict | None = None
        self._held: Certificate | None = None
        self._changes = CertificateGate(self._let_ticks_pass)
        super().__init__(name, **options)

    # The certificate ---------------------------------------------------------------------------

    @property
    def certificate(self) -> Certificate:
        """Certificate of the parameters that were accepted last."""
        if self._held is None:
            self._held = self._running(self._accepted).certificate()
        return self._held

    def prepare_certificate(self) -> None:
        """Read what certificates are computed from, and follow the others; in ``configure``."""
        self._gaits, self._scale = gaits_of(self), body_scale(description_of(self))
        self._held = None
        others = {node: names for node, names in CHANGEABLE.items() if node != self.KIND}
        self._follower = ParameterFollower(self, others, self._follow)

    def new_network(self) -> GaitNetwork:
        """Network of the parameters in effect, without reading any file."""
        return GaitNetwork(self.parameters_of(CanonicalParameters),
                           self._gaits[self.parameters_of(GaitParameters).gait], self._scale)

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

    def _running(self, sets: Sets) -> Running:
        """What parameter sets describe; raises ParameterError for a gait that there is not."""
        def of(cls: Any) -> Any:
            return sets[cls]

        name = of(GaitParameters).gait
        if name not in self._gaits:
            raise ParameterError(
                f"there is no gait '{name}'; valid are {', '.join(self._gaits)}")
        parameters = SuiteParameters(of(ReferenceParameters), of(CanonicalParameters),
                                     of(InhibitionParameters), of(LegParameters),
                                     of(PostureParameters))
        return Running(parameters, self._gaits[name], self._scale,
                       of(TickParameters).tick_ns * 1e-9)

    # Own changes -------------------------------------------------------------------------------

    def check_parameters(self, sets: Sets) -> None:
        """Refuse what other nodes own, and what would lose the certificate."""
        self._judged = None
        before, after = self._table.values(self._accepted), self._table.values(sets)
        changed = {name: value for name, value in after.items() if value != before[name]}
        if self._following or not changed:
            return
        for name, value in changed.items():
            owner = OWNER.get(name, self.KIND)
            if owner != self.KIND:
                raise ParameterError(
                    f"'{name}' belongs to {owner}, which the other nodes follow; set it there: "
                    f'ros2 param set /{owner} {name} {shown(value)}')
        if not self.configured or UNCERTIFIED.issuperset(changed):
            return
        verdict = self._changes.judge(
            self._running(self._accepted), self.certificate, self._running(sets))
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
            self._held = self._judged.certificate
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

    def _follow(self, values: Mapping[str, Any]) -> None:
        """Take over what an owner has accepted."""
        accepted = self._table.values(self._accepted)
        news = {name: value for name, value in values.items()
                if name in accepted and value != ros_value(accepted[name])}
        if not news:
            return
        self._following = True
        try:
            result = self.set_parameters_atomically(
                [Parameter(name, value=value) for name, value in news.items()])
        except DmpCpgError as error:
            raise DataError(f'cannot follow {news}: {error}') from error
        finally:
            self._following = False
        if not result.successful:
            self.get_logger().error(f'cannot follow {news}: {result.reason}')


def _allowed(sets: Sets) -> bool:
    permission: Any = sets[CertificateParameters]
    return bool(permission.allow_uncertified)
