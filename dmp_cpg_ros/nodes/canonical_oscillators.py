# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``canonical_oscillators``: the coupled Andronov-Hopf network, inhibited where its state is in
the region C.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import (
    Inhibition,
    InhibitionParameters,
    initial_inhibition,
)
from dmp_cpg_ros.core.certificates.lock_watch import LOCKED, LOST, PhaseLock, PhaseLockWatch
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.contact_feedback import quarter_weight
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import (
    CANONICAL,
    CertificateParameters,
    GaitParameters,
)
from dmp_cpg_ros.nodes.framework.certified import CertifiedNode
from dmp_cpg_ros.nodes.framework.execution import run_node
from dmp_cpg_ros.nodes.framework.gaits import (
    certificate_words,
    check_gait,
    description_of,
    gait_name,
)
from dmp_cpg_ros.nodes.framework.parameters import LockStepParameters
from dmp_cpg_ros.nodes.framework.suite_node import Sets
from dmp_cpg_ros.nodes.messages.conversions import (
    CanonicalStateWriter,
    InhibitionGainsReader,
    read_reference,
)
from dmp_cpg_ros.nodes.messages.robot_state import FootContactsReader
from dmp_cpg_ros.nodes.messages.values import stamped
from dmp_cpg_ros.suite_table import KINDS

Array = NDArray[np.float64]


class CanonicalOscillators(CertifiedNode):
    """Advances the four coupled oscillators with the robot's clock."""

    KIND = CANONICAL
    PARAMETER_SETS = (*KINDS[KIND].sets, LockStepParameters)

    def configure(self) -> None:
        """Build the network at its initial state and its topics."""
        inhibition = self.parameters_of(InhibitionParameters)
        self.prepare_certificate()
        if not self.certificate.holds:
            self._without_certificate(self.certificate.explained())
        self._canonical = self.new_running(quarter_weight(description_of(self)))
        self._state = self._canonical.initial_state(self.gaits.named(gait_name(self)), inhibition)
        self._inhibition = initial_inhibition(inhibition)
        self._watch = PhaseLockWatch()
        self._lock: PhaseLock | None = None
        self._writer = CanonicalStateWriter(tuple(self.gaits.gaits))
        self._publisher = self.publisher('canonical_state')
        contacts = self._contact_readers()
        self.match(
            ('reference', *contacts),
            'reference',
            optional=tuple(contacts),
            delayed=('inhibition_gains',),
            lock_step=self.parameters_of(LockStepParameters).lock_step,
        )
        self.feed({'reference': read_reference,
                   'inhibition_gains': InhibitionGainsReader().read, **contacts})

    def on_parameters(self) -> None:
        """Take over what may change while walking."""
        choice = self.parameters_of(GaitChoiceParameters)
        self._canonical = self._canonical.with_parameters(
            self.parameters_of(CanonicalParameters), self.parameters_of(GaitChangeParameters),
            choice)
        if not choice.auto_gait:
            self._state = self._canonical.want(
                self._state, self.parameters_of(GaitParameters).gait)

    def acting_cadence(self) -> float | None:
        """Factor on the cadence, on its way to the accepted one."""
        return self._state.cadence_scale

    def stop_in_force(self) -> tuple[GaitNetwork, Inhibition, Any] | None:
        """Network, inhibition and states of the last tick."""
        return self._canonical.network(self._state.gait), self._inhibition, self._state.x

    def check_parameters(self, sets: Sets) -> None:
        """Refuse a gait that there is not, and a change of gait that is not certified."""
        if self.configured:
            check_gait(self._canonical, self._state, sets, self._accepted)
        super().check_parameters(sets)

    def others_changed(self) -> None:
        """Watch the certificate of all that runs: two nodes may have accepted changes at the same
        moment that do not go together.
        """
        self.certificate_changed()

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the oscillators to the stamp of the reference."""
        dt = self.elapsed
        self._inhibition = values['inhibition_gains'] or self._inhibition
        r = values['reference']
        self._state = state = self._canonical.step(
            self._state, r, self._inhibition, dt, self._foot_force(stamp_ns, values),
            self.certificate.contact)
        self._publisher.publish(
            self._writer.fill(stamp_ns, state.x, state.x_dot, state.gait,
                              self._canonical.cadence_rate(state)))
        self._watch_phases(self._canonical.network(state.gait), r, dt)

    def _watch_phases(self, network: GaitNetwork, r: Any, dt: float) -> None:
        """Compare the phases with their bound; an alarm is published at once."""
        acting = self._inhibition.gains.any() and self._inhibition.acting_gains(
            self._state.x, network.target
        ).any()
        former = LOCKED if self._lock is None else self._lock.level
        limits = self.certificate.contact
        own = 0.0 if limits is None else limits.own
        self._lock = self._watch.step(self._lock, network, r, self._state.x, not acting, dt, own)
        if self._lock.level > former:
            self.warn('phase_lock', self._lock.alarm, error=self._lock.level == LOST)
        elif self._lock.level == LOCKED != former:
            self.clear('phase_lock')

    def _contact_readers(self) -> dict[str, Callable[[Any], Any]]:
        """How to read the feet, where they are fed back."""
        if not self.parameters_of(CanonicalParameters).contact_feedback:
            return {}
        return {'foot_contacts': stamped(FootContactsReader(strict=False).read)}

    @staticmethod
    def _foot_force(stamp_ns: int, values: dict[str, Any]) -> Array:
        """Forces of the feet at this tick; of a lost message none are known [N]."""
        feet = values.get('foot_contacts')
        return feet[1] if feet and feet[0] == stamp_ns else np.full(len(LEGS), np.nan)

    def _without_certificate(self, reason: str) -> None:
        """Refuse to walk without a certificate, or say loudly that nothing is guaranteed."""
        if not self.parameters_of(CertificateParameters).allow_uncertified:
            raise ParameterError(
                f'the gait is not certified to stop: {reason} '
                '(allow_uncertified:=true walks all the same; '
                'certify --suggest proposes gains that hold)'
            )
        self.certificate_changed()

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Phase error of the legs beside its bound [rad]."""
        return {
            'phase_error_rad': nan if self._lock is None else self._lock.error,
            'phase_error_bound_rad': nan if self._lock is None else self._lock.bound,
            'gait': self._state.gait.name,
            'cadence_scale': self._state.cadence_scale,
            'gait_wanted': self._state.wanted.name,
            'highest_speed': self._canonical.network(self._state.gait).highest_speed,
            'certificate': certificate_words(self.certificate),
        }


def main() -> int:
    """Run the node."""
    return run_node(CanonicalOscillators)


if __name__ == '__main__':
    sys.exit(main())
