# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``reference_filter``: cmd_vel → v, γ through the first-order reference system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.clock import fresh
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.gait.running import approached
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import REFERENCE
from dmp_cpg_ros.nodes.framework.certified import JUDGED, Acting, Certified
from dmp_cpg_ros.nodes.framework.gait_memory import GaitMemory
from dmp_cpg_ros.nodes.framework.gaits import WalkedGaits
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages.inhibition import AnnouncedReader
from dmp_cpg_ros.nodes.messages.interfaces import SILENT_NS
from dmp_cpg_ros.nodes.messages.reference import ReferenceWriter
from dmp_cpg_ros.nodes.messages.values import stamped


class ReferenceFilter(SuiteNode):
    """Filters the commanded velocity; brings it to zero when cmd_vel falls silent or a stop is
    requested.
    """

    KIND = REFERENCE
    JUDGES = True
    CHANGEABLE = JUDGED
    certified: Certified

    def configure(self) -> None:
        """Build the filter and its topics."""
        self.certified = Certified(
            self, lambda: Acting(self._cadence, gaits=self._walked.gaits))
        self._system = self.certified.reference()
        self._r = np.zeros(3)
        self._inhibition = Inhibition(False, np.zeros(len(LEGS)), 1.0)
        self._cadence = self.parameters_of(CanonicalParameters).cadence_scale
        self._writer, self._publisher = ReferenceWriter(), self.publisher('reference')
        self.match('joint_states', {'joint_states': lambda _: None},
                   delayed={'inhibition_gains': stamped(AnnouncedReader().read)})
        self._memory = GaitMemory(self, self.certified.gaits)
        self._gate = self.certified.commands()
        self._walked = WalkedGaits(self, self.certified.gaits)

    def on_parameters(self) -> None:
        """Take over limits and rates."""
        self._walked.follow()
        self.certified.limit(self._gate)
        self._system = self.certified.reference()

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the filter to the stamp of the robot's state."""
        if self._memory.awaited(stamp_ns, values):
            return
        dt, wanted = self.elapsed, self.parameters_of(CanonicalParameters).cadence_scale
        if known := self._memory.take(stamp_ns):
            since_s, (*_, self._r) = known
            dt = since_s if self.lock_step else 0.0  # the command is not known yet
        self._cadence = approached(self._cadence, wanted, dt)
        command, gains = self._gate.at(stamp_ns), values['inhibition_gains']
        if gains is not None:
            heard_ns, announced = gains
            self._inhibition = announced.at(stamp_ns).acting
            if not (self.lock_step or fresh(heard_ns, stamp_ns, SILENT_NS + self.return_ns)):
                self._inhibition = replace(self._inhibition, requested=True)
        self._r = self._system.towards(self._r, command, self._inhibition, dt)
        self._publisher.publish(self._writer.fill(stamp_ns, self._r))

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Reference, whether a stop holds it at zero, what was asked for and what cut it."""
        names = ('v_x', 'v_y', 'gamma')
        return {**dict(zip(names, self._r, strict=True)), 'stopping': self._inhibition.requested,
                'share': self._inhibition.share,
                **{f'asked_{name}': value
                   for name, value in zip(names, self._gate.asked, strict=True)},
                'limited_by': 'balance' if self._inhibition.share < 1.0 else (
                    self._gate.limited_by or 'acceleration' * self._system.limited)}
