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
from dmp_cpg_ros.core.suite_parameters import LegChoice, RobotParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.nodes.framework.gaits import description_of, follow_gait, known_gaits
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateReader
from dmp_cpg_ros.nodes.messages.joint_targets import JointTargetsWriter
from dmp_cpg_ros.nodes.messages.posture_feedback import PostureFeedbackReader
from dmp_cpg_ros.nodes.messages.reference import read_reference
from dmp_cpg_ros.nodes.messages.robot_state import JointsReader
from dmp_cpg_ros.nodes.messages.values import stamped
from dmp_cpg_ros.primitive_files import load_motion
from dmp_cpg_ros.suite_table import KINDS, LEG

FEEDBACK_NS = 60_000_000
"""Age of the newest ``posture_feedback`` from which a leg does without, and says nothing [ns]."""

AWAY_NS = round(1e9 * RobotParameters().target_timeout)
"""Time without saying anything after which a leg begins anew where its joints are [ns]; sooner the
robot takes what it says then for a jump from what it said last.
"""

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
        self._state, self._joined, self._said_ns = self._leg.initial_state(), False, 0
        self._writer = JointTargetsWriter(leg, description.joint_names)
        self._publisher = self.publisher('joint_targets')
        readers: dict[str, Callable[[Any], Any]] = {
            'canonical_state': CanonicalStateReader(gaits).read,
            'reference': read_reference,
            'posture_feedback': stamped(PostureFeedbackReader().read),
        }
        if parameters.reading == 'torque':
            readers['joint_states'] = JointsReader(description.joint_names).read
        self.match('canonical_state', readers, last='posture_feedback')

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the leg to the stamp of the canonical state."""
        x, x_dot, gait = values['canonical_state']
        follow_gait(self, gait)
        position, velocity, _ = values.get('joint_states', NO_JOINTS)
        told_ns, feedback = values['posture_feedback']
        if stamp_ns - told_ns > FEEDBACK_NS:
            self.warn('feedback', f'no posture_feedback since {told_ns * 1e-9:.3f} s: the robot '
                      'has to stop by itself', error=True)
            return
        elapsed = self.elapsed
        if self.health.has_problem('feedback'):
            self.clear('feedback')
            silent_ns = stamp_ns - self._said_ns
            if not feedback.command.balanced:  # the drives may have moved the joints meanwhile
                self._state, elapsed = self._leg.initial_state(), 0.0
            elif 0 <= silent_ns <= AWAY_NS:
                elapsed = 1e-9 * silent_ns
            elif self.return_ns:
                self._joined = False
        if not self._joined:
            self._joined = True
            if (self.lock_step or self.return_ns) and stamp_ns > 0:
                self._state = self._leg.picked_up(gait, x, x_dot, values['reference'], feedback)
        state, targets = self._leg.step(
            self._state, gait, x, x_dot, values['reference'], feedback, position, velocity,
            elapsed)
        message = self._writer.fill(stamp_ns, targets)  # refuses what is not finite
        self._state, self._said_ns = state, stamp_ns
        self._publisher.publish(message)

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Which leg, and how much it swings."""
        return {'leg': self.parameters_of(LegChoice).leg, 'activity': self._state.leg.activity,
                'body_mode': self._state.command.mode,
                'movement': self._state.command.movement or 'none'}
