# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``canonical_oscillators``: the coupled Andronov-Hopf network, inhibited where its state is in
the region C.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
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
from dmp_cpg_ros.core.gait.contact_feedback import ContactPhase, initial_contact_state
from dmp_cpg_ros.core.gait.foot_contact import quarter_weight
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.running_network import RunningNetwork
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters
from dmp_cpg_ros.core.loop import initial_canonical_state
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import (
    NODE_PARAMETERS,
    CertificateParameters,
    GaitParameters,
)
from dmp_cpg_ros.nodes.certified_node import CertifiedNode
from dmp_cpg_ros.nodes.conversions import CanonicalStateWriter, read_reference
from dmp_cpg_ros.nodes.executors import run_node
from dmp_cpg_ros.nodes.gait_changes import check_gait, take_gait
from dmp_cpg_ros.nodes.gait_setup import certificate_words, description_of, gait_name
from dmp_cpg_ros.nodes.inhibition_messages import InhibitionMessage, read_inhibition_state
from dmp_cpg_ros.nodes.message_values import header_ns
from dmp_cpg_ros.nodes.parameterized_node import Sets
from dmp_cpg_ros.nodes.robot_state_messages import FootContactsReader
from dmp_cpg_ros.nodes.ros_parameters import LockStepParameters

Array = NDArray[np.float64]


class CanonicalOscillators(CertifiedNode):
    """Advances the four coupled oscillators with the robot's clock."""

    KIND = 'canonical_oscillators'
    PARAMETER_SETS = (*NODE_PARAMETERS[KIND], LockStepParameters)

    def configure(self) -> None:
        """Build the network at its initial state and its topics."""
        inhibition = self.parameters_of(InhibitionParameters)
        self.prepare_certificate()
        if not self.certificate.holds:
            self._without_certificate(self.certificate.explained())
        self._running_network = RunningNetwork(
            self.new_networks(),
            self.gaits.named(gait_name(self)),
            self.parameters_of(GaitChoiceParameters),
        )
        network = self._running_network.network
        self._x, self._last_ns = initial_canonical_state(network, inhibition), -1
        self._inhibition = initial_inhibition(inhibition)
        self._watch = PhaseLockWatch()
        self._lock: PhaseLock | None = None
        self._writer, self._publisher = CanonicalStateWriter(), self.publisher('canonical_state')
        contacts = self._read_contacts()
        self._ticks = self.match(
            ('reference', *contacts),
            'reference',
            optional=contacts,
            delayed=('inhibition_state',),
            lock_step=self.parameters_of(LockStepParameters).lock_step,
        )
        self.listen(
            'reference',
            lambda message: self._ticks.add(
                'reference', header_ns(message), read_reference(message)
            ),
        )
        self.listen(
            'inhibition_state',
            lambda message: self._ticks.add(
                'inhibition_state',
                header_ns(message),
                inhibition_from(read_inhibition_state(message)),
            ),
        )

    def on_parameters(self) -> None:
        """Take over what may change while walking."""
        running = self._running_network
        running.change(
            self.parameters_of(CanonicalParameters), self.parameters_of(GaitChangeParameters)
        )
        take_gait(
            running, self.parameters_of(GaitParameters), self.parameters_of(GaitChoiceParameters)
        )

    def acting_cadence(self) -> float | None:
        """Factor on the cadence, on its way to the accepted one."""
        return self._running_network.cadence_scale

    def stop_in_force(self) -> tuple[GaitNetwork, Inhibition, Any] | None:
        """Network, inhibition and states of the last tick."""
        return self._running_network.network, self._inhibition, self._x

    def check_parameters(self, sets: Sets) -> None:
        """Refuse a gait that there is not, and a change of gait that is not certified."""
        if self.configured:
            check_gait(self._running_network, sets, self._accepted)
        super().check_parameters(sets)

    def others_changed(self) -> None:
        """Watch the certificate of all that runs: two nodes may have accepted changes at the same
        moment that do not go together.
        """
        self.certificate_changed()

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the oscillators to the stamp of the reference."""
        dt = (stamp_ns - self._last_ns) * 1e-9 if 0 <= self._last_ns < stamp_ns else 0.0
        self._last_ns = stamp_ns
        self._inhibition = values['inhibition_state'] or self._inhibition
        r, running = values['reference'], self._running_network
        self._x = running.begin_tick(self._x, r, self._inhibition, dt)
        offset = self._contact_offset(stamp_ns, values, running.network, dt)
        self._x = running.advance(self._x, r, self._inhibition, dt, offset)
        x_dot = running.network.rate(self._x, r, self._inhibition, offset)
        word = self._running_network.word
        self._publisher.publish(self._writer.fill(stamp_ns, self._x, x_dot, word))
        self._watch_phases(self._running_network.network, r, dt)

    def _watch_phases(self, network: GaitNetwork, r: Any, dt: float) -> None:
        """Compare the phases with their bound; an alarm is published at once."""
        acting = self._inhibition.gains.any() and self._inhibition.acting_gains(
            self._x, network.target
        ).any()
        former = LOCKED if self._lock is None else self._lock.level
        limits = self.certificate.contact
        own = 0.0 if limits is None else limits.own
        self._lock = self._watch.step(self._lock, network, r, self._x, not acting, dt, own)
        if self._lock.level > former:
            self.warn('phase_lock', self._lock.alarm, error=self._lock.level == LOST)
        elif self._lock.level == LOCKED != former:
            self.clear('phase_lock')

    def _read_contacts(self) -> tuple[str, ...]:
        """Listen to the feet where they are fed back; returns the topics."""
        self._contact: ContactPhase | None = None
        if not self.parameters_of(CanonicalParameters).contact_feedback:
            return ()
        self._contact = ContactPhase(quarter_weight(description_of(self)))
        self._contact_state, reader = initial_contact_state(), FootContactsReader(strict=False)
        self.listen(
            'foot_contacts',
            lambda message: self._ticks.add(
                'foot_contacts', header_ns(message), (header_ns(message), reader.read(message))
            ),
        )
        return ('foot_contacts',)

    def _contact_offset(
        self, stamp_ns: int, values: dict[str, Any], network: GaitNetwork, dt: float
    ) -> Array | float:
        """Frequency offsets from the contacts of this tick; a lost message gives none [rad/s]."""
        if self._contact is None:
            return 0.0
        feet, self._contact.limits = values['foot_contacts'], self.certificate.contact
        force = feet[1] if feet and feet[0] == stamp_ns else np.full(len(LEGS), np.nan)
        self._contact_state, offset = self._contact.step(
            self._contact_state, force, network, self._x, values['reference'], self._inhibition, dt
        )
        return offset

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
            'gait': self._running_network.word,
            'gait_wanted': self._running_network.wanted.name,
            'highest_speed': self._running_network.network.highest_speed,
            'certificate': certificate_words(self.certificate),
        }


def inhibition_from(message: InhibitionMessage) -> Inhibition:
    """Inhibition that ``inhibition_state`` announces; raises DataError for numbers that are not
    finite.
    """
    gains = np.array([message.number(f'gain_{leg}') for leg in LEGS])
    return Inhibition(
        message.flag('requested'),
        gains,
        message.number('region_radius'),
        message.word == 'at_rest',
    )


def main() -> int:
    """Run the node."""
    return run_node(CanonicalOscillators)


if __name__ == '__main__':
    sys.exit(main())
