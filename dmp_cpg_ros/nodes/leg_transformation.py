# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``leg_transformation``: one leg; its three joints' transformation systems."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from dmp_cpg_ros.core.modes.leg_control import LegControl
from dmp_cpg_ros.core.modes.motion_library import Movements
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES
from dmp_cpg_ros.core.suite_parameters import LegChoice
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.nodes.framework.gaits import description_of, follow_gait, known_gaits
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages import conversions
from dmp_cpg_ros.nodes.messages.robot_state import JointsReader
from dmp_cpg_ros.primitive_files import load_motion
from dmp_cpg_ros.suite_table import KINDS, LEG

NO_JOINTS = (np.full(len(JOINT_NAMES), np.nan),) * 3
"""Measured joints where they are not read."""


class LegTransformation(SuiteNode):
    """Turns a leg's oscillator state and the reference into targets of its joints."""

    KIND = LEG
    CHANGEABLE = ('gait',)

    @classmethod
    def default_name(cls, arguments: Sequence[str]) -> str:
        """Name the node after its leg, which the command line gives as ``-p leg:=fl``."""
        for name, own in KINDS[LEG].instances.items():
            if any(f'{key}:={value}' in arguments for key, value in own.items()):
                return name
        return cls.KIND

    def configure(self) -> None:
        """Build the leg's primitive and its topics."""
        leg, parameters = self.parameters_of(LegChoice).leg, self.parameters_of(LegParameters)
        gaits, description = known_gaits(self), description_of(self)
        self._leg = LegControl(
            leg, description, parameters, Movements(description), load_motion(parameters.motion))
        self._state = self._leg.initial_state()
        self._writer = conversions.JointTargetsWriter(leg)
        self._publisher = self.publisher('joint_targets')
        readers: dict[str, Callable[[Any], Any]] = {
            'canonical_state': conversions.CanonicalStateReader(gaits).read,
            'reference': conversions.read_reference,
            'posture_feedback': conversions.PostureFeedbackReader().read,
        }
        if parameters.reading == 'torque':
            readers['joint_states'] = JointsReader().read
        self.match('canonical_state', readers)

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the leg to the stamp of the canonical state."""
        x, x_dot, gait = values['canonical_state']
        follow_gait(self, gait)
        position, velocity, _ = values.get('joint_states', NO_JOINTS)
        state, targets = self._leg.step(
            self._state, gait, x, x_dot, values['reference'], values['posture_feedback'], position,
            velocity, self.elapsed)
        message = self._writer.fill(stamp_ns, targets)  # refuses what is not finite
        self._state = state
        self._publisher.publish(message)

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Which leg, and how much it swings."""
        return {'leg': self.parameters_of(LegChoice).leg, 'activity': self._state.leg.activity,
                'body_mode': self._state.command.mode,
                'movement': self._state.command.movement or 'none'}
