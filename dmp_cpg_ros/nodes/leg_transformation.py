# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``leg_transformation``: one leg; its three joints' transformation systems."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from dmp_cpg_ros.core.modes.body_command import BodyCommand
from dmp_cpg_ros.core.modes.motion import LegMotion, MotionState
from dmp_cpg_ros.core.modes.movements import Movements
from dmp_cpg_ros.core.primitives.spring_damper import SpringState
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS
from dmp_cpg_ros.core.suite_parameters import NODE_PARAMETERS, LegChoice
from dmp_cpg_ros.core.transformation.leg import LegParameters, LegPrimitive
from dmp_cpg_ros.nodes.conversions import (
    CanonicalStateReader,
    JointTargetsWriter,
    PostureFeedbackReader,
    read_reference,
)
from dmp_cpg_ros.nodes.executors import run_node
from dmp_cpg_ros.nodes.gait_setup import description_of, gait_reader
from dmp_cpg_ros.nodes.managed_node import ManagedNode
from dmp_cpg_ros.nodes.message_values import Array, frame_of, header_ns
from dmp_cpg_ros.nodes.robot_state_messages import JointsReader
from dmp_cpg_ros.nodes.ros_parameters import LockStepParameters
from dmp_cpg_ros.primitive_files import load_motion


class LegTransformation(ManagedNode):
    """Turns a leg's oscillator state and the reference into targets of its joints."""

    KIND = 'leg_transformation'
    PARAMETER_SETS = (*NODE_PARAMETERS[KIND], LockStepParameters)

    @classmethod
    def default_name(cls, arguments: Sequence[str]) -> str:
        """Name the node after its leg, which the command line gives as ``-p leg:=fl``."""
        for argument in arguments:
            found = re.fullmatch(r'leg:=([a-z]+)', argument)
            if found and found[1] in LEGS:
                return f'{cls.KIND}_{found[1]}'
        return cls.KIND

    def configure(self) -> None:
        """Build the leg's primitive and its topics."""
        leg, parameters = self.parameters_of(LegChoice).leg, self.parameters_of(LegParameters)
        self._place = LEGS.index(leg)
        self._joints = slice(
            len(JOINTS_OF_LEG) * self._place, len(JOINTS_OF_LEG) * (self._place + 1)
        )
        gaits, description = gait_reader(self), description_of(self)
        self._primitive = LegPrimitive(
            leg, description, gaits.read(''), parameters, load_motion(parameters.motion))
        self._motion = LegMotion(
            self._joints, Movements(description), self._primitive.transformation
        )
        self._motion_state: MotionState | None = None
        self._body = BodyCommand()
        self._state, self._last_ns = self._primitive.initial_state(), -1
        self._writer, self._publisher = JointTargetsWriter(leg), self.publisher('joint_targets')
        inputs = ['canonical_state', 'reference', 'posture_feedback']
        canonical, feedback = CanonicalStateReader(), PostureFeedbackReader()
        self.listen(
            'canonical_state',
            lambda message: self._ticks.add(
                'canonical_state',
                header_ns(message),
                (*canonical.read(message), gaits.read(frame_of(message))),
            ),
        )
        self.listen(
            'reference',
            lambda message: self._ticks.add(
                'reference', header_ns(message), read_reference(message)
            ),
        )
        self.listen(
            'posture_feedback',
            lambda message: self._ticks.add(
                'posture_feedback', header_ns(message), feedback.read(message)
            ),
        )
        if parameters.reading == 'torque':
            joints = JointsReader()
            inputs.append('joint_states')
            self.listen(
                'joint_states',
                lambda message: self._ticks.add(
                    'joint_states', header_ns(message), joints.read(message)
                ),
            )
        self._ticks = self.match(
            inputs, 'canonical_state', lock_step=self.parameters_of(LockStepParameters).lock_step
        )

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the leg to the stamp of the canonical state."""
        dt = (stamp_ns - self._last_ns) * 1e-9 if 0 <= self._last_ns < stamp_ns else 0.0
        self._last_ns = stamp_ns
        feedback, joints = values['posture_feedback'], self._joints
        if feedback.mode != self._body.text:
            self._body = BodyCommand.from_text(feedback.mode)
        if self._body.balanced:
            goal, goal_velocity = self._walk(values, dt)
        else:
            self._motion_state, self._state, goal, goal_velocity = self._motion.step(
                self._motion_state, self._state, self._body, feedback.measured[joints], dt
            )
        measured = None
        if 'joint_states' in values:
            position, velocity, _ = values['joint_states']
            measured = SpringState(position[joints], velocity[joints])
        targets = self._primitive.targets(
            self._state, goal, goal_velocity, feedback.torque[joints], measured
        )
        self._publisher.publish(self._writer.fill(stamp_ns, targets))

    def _walk(self, values: dict[str, Any], dt: float) -> tuple[Array, Array]:
        """Advance the gait's primitive; returns its goals."""
        self._motion_state = None
        x, x_dot, self._primitive.gait = values['canonical_state']
        feedback = values['posture_feedback']
        self._state, goal, goal_velocity = self._primitive.step(
            self._state,
            x[self._place],
            x_dot[self._place],
            values['reference'],
            feedback.of_leg(self._place),
            dt,
        )
        return goal, goal_velocity

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Which leg, and how much it swings."""
        return {
            'leg': LEGS[self._place],
            'activity': self._state.activity,
            'body_mode': self._body.mode,
            'movement': self._body.movement or 'none',
        }


def main() -> int:
    """Run the node."""
    return run_node(LegTransformation)


if __name__ == '__main__':
    sys.exit(main())
