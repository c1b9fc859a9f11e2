# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``canonical_oscillators``: the coupled Andronov-Hopf network, inhibited where its state is in
the region C.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import (
    InhibitionParameters,
    initial_inhibition,
)
from dmp_cpg_ros.core.certificates.lock_watch import LOCKED, LOST, PhaseLock, PhaseLockWatch
from dmp_cpg_ros.core.clock import fresh
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.contact_feedback import quarter_weight
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.handover import SilentStop
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import CANONICAL, CertificateParameters
from dmp_cpg_ros.nodes.framework.certified import JUDGED, Acting, Certified, certificate_words
from dmp_cpg_ros.nodes.framework.gait_memory import GaitMemory
from dmp_cpg_ros.nodes.framework.gaits import check_gaits, description_of, gait_name
from dmp_cpg_ros.nodes.framework.known_stop import KnownStop
from dmp_cpg_ros.nodes.framework.parameters import Sets
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateWriter
from dmp_cpg_ros.nodes.messages.inhibition import AnnouncedReader
from dmp_cpg_ros.nodes.messages.interfaces import SILENT_NS
from dmp_cpg_ros.nodes.messages.reference import read_reference
from dmp_cpg_ros.nodes.messages.robot_state import FootContactsReader
from dmp_cpg_ros.nodes.messages.values import stamped, told_at


class CanonicalOscillators(SuiteNode):
    """Advances the four coupled oscillators with the robot's clock."""

    KIND = CANONICAL
    JUDGES = True
    CHANGEABLE = JUDGED
    certified: Certified

    def configure(self) -> None:
        """Build the network at its initial state and its topics.

        Without a certificate it refuses to walk, or says loudly that nothing is guaranteed.
        """
        inhibition = self.parameters_of(InhibitionParameters)
        self.certified = Certified(self, self._acting, watches=True)
        if not self.certified.certificate.holds:
            if not self.parameters_of(CertificateParameters).allow_uncertified:
                raise ParameterError(
                    'the gait is not certified to stop: '
                    f'{self.certified.certificate.explained()} (allow_uncertified:=true walks '
                    'all the same; certify --suggest proposes gains that hold)')
            self.certified.report()
        self._canonical = self.certified.running_gait(quarter_weight(description_of(self)))
        gaits = self.certified.gaits
        self._state = self._canonical.initial_state(gaits.named(gait_name(self)), inhibition)
        self._inhibition = self._latest = initial_inhibition(
            inhibition, self.parameters_of(CanonicalParameters).first_leg)
        self._silent: SilentStop | None = None
        self._known = KnownStop(self, 'acting_gains')
        self._watch = PhaseLockWatch()
        self._lock: PhaseLock | None = None
        self._writer = CanonicalStateWriter(tuple(gaits.gaits))
        self._publisher = self.publisher('canonical_state')
        feedback = self.parameters_of(CanonicalParameters).contact_feedback
        contacts = {'foot_contacts': stamped(FootContactsReader().read)} if feedback else {}
        self.match('reference', {'reference': read_reference, **contacts},
                   delayed={'inhibition_gains': stamped(AnnouncedReader().read)},
                   optional=contacts)
        self._memory = GaitMemory(self, gaits)

    def check_parameters(self, sets: Sets) -> None:
        """Raise ParameterError to refuse a change; before the node is configured only that of a
        gait which its file does not have.
        """
        asked = self.parameter_changes.between(sets).keys()
        if not (self.configured or asked.isdisjoint(('gait', 'auto_gait', 'auto_gaits'))):
            check_gaits(sets)
        super().check_parameters(sets)

    def activate(self) -> None:
        """Tell late joiners what acts."""
        self._known.learn(0, self._inhibition)

    def on_parameters(self) -> None:
        """Take over what may change while walking."""
        choice = self.parameters_of(GaitChoiceParameters)
        self._canonical = self._canonical.with_parameters(
            self.parameters_of(CanonicalParameters), self.parameters_of(GaitChangeParameters),
            choice)
        if not choice.auto_gait:
            self._state = self._canonical.want(self._state, gait_name(self))

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the oscillators to the stamp of the reference."""
        if self._memory.awaited(stamp_ns, values):
            return
        dt, r = self.elapsed, values['reference']
        force = told_at(stamp_ns, values.get('foot_contacts'), np.full(len(LEGS), np.nan))
        if known := self._memory.take(stamp_ns):
            dt, (x, x_dot, gait, _) = known
            self._state = replace(self._state, x=x, x_dot=x_dot, gait=gait,
                                  cadence_scale=gait.cadence_scale)
        self._take_inhibition(stamp_ns, values['inhibition_gains'])
        state = self._canonical.step(
            self._state, r, self._inhibition, dt, force, self.certified.contact)
        message = self._writer.fill(  # refuses what is not finite
            stamp_ns, state.x, state.x_dot, state.gait, self._canonical.cadence_rate(state))
        self._state = state
        self._publisher.publish(message)
        network = self._canonical.network(state.gait)
        if self._silent is not None:
            self._silent.step(stamp_ns, network, state.x, state.x_dot, r)
        self._watch_phases(network, r, dt)

    def _take_inhibition(self, stamp_ns: int, gains: tuple[int, Announced] | None) -> None:
        """Take what acts now, or stop the gait when what was heard last is too old."""
        if gains is None:
            return
        known_ns, announced = gains
        self._inhibition, self._latest = announced.at(stamp_ns).acting, announced.latest
        if self.lock_step or fresh(known_ns, stamp_ns, SILENT_NS + self.return_ns):
            if self._silent is not None:
                self._silent = None
                self.clear('inhibition')
        else:
            if self._silent is None:
                self._silent = SilentStop(
                    self.certified.supervisor(), self._inhibition, stamp_ns)
                self.warn('inhibition', 'inhibition is silent: the gait stops until it is back',
                          error=True)
            known_ns, self._inhibition = stamp_ns, self._silent.inhibition
            self._latest = self._inhibition
        self._known.learn(known_ns, self._inhibition)

    def _acting(self) -> Acting:
        state = self._state
        return Acting(  # legs may be caught from when what is armed now acts
            state.cadence_scale,
            (self._canonical.network(state.gait), self._latest, state.x),
            (*state.gait.ends, state.wanted), not self.lock_step)

    def _watch_phases(self, network: GaitNetwork, r: Any, dt: float) -> None:
        """Compare the phases with their bound; an alarm is published at once."""
        acting = self._inhibition.gains.any() and network.acting_gains(
            self._inhibition, self._state.x).any()
        former = LOCKED if self._lock is None else self._lock.level
        limits = self.certified.contact
        own = 0.0 if limits is None else limits.own
        self._lock = self._watch.step(self._lock, network, r, self._state.x, not acting, dt, own)
        if self._lock.level > former:
            self.warn('phase_lock', self._lock.alarm, error=self._lock.level == LOST)
        elif self._lock.level == LOCKED != former:
            self.clear('phase_lock')

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Phase error of the legs beside its bound [rad]."""
        return {'phase_error_rad': nan if self._lock is None else self._lock.error,
                'phase_error_bound_rad': nan if self._lock is None else self._lock.bound,
                'gait': self._state.gait.name, 'cadence_scale': self._state.cadence_scale,
                'gait_wanted': self._state.wanted.name,
                'highest_speed': self._canonical.network(self._state.gait).highest_speed,
                'certificate': certificate_words(self.certified.certificate)}
