# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Leg block: the gait's rhythmic primitive or a movement's discrete one, as the mode says."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.balance.body_command import STANDING, BodyCommand
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.modes.motion import LegMotion, MotionState
from dmp_cpg_ros.core.modes.motion_library import Movements
from dmp_cpg_ros.core.primitives.spring_damper import SpringState
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, JointTargets
from dmp_cpg_ros.core.transformation.foot_motion import Motion
from dmp_cpg_ros.core.transformation.leg import LegParameters, LegPrimitive, LegState

Array = NDArray[np.float64]


class LegControlState(NamedTuple):
    """State of the leg block.

    Attributes
    ----------
    leg : LegState
        Joints, swing activity, foothold offset, stumbling reflex.
    motion : MotionState or None
        Movement under way.
    command : BodyCommand
        What the body did at the last tick.
    """

    leg: LegState
    motion: MotionState | None = None
    command: BodyCommand = STANDING


class LegControl:
    """One leg; state in, state out.

    Parameters
    ----------
    leg : str
        ``fl``, ``fr``, ``rl`` or ``rr``.
    description : RobotDescription
        The robot.
    parameters : LegParameters
        Gains and swing.
    movements : Movements
        The robot's movements.
    motion : Motion, optional
        Where the path of the foot comes from; the foot path without.
    """

    def __init__(self, leg: str, description: RobotDescription, parameters: LegParameters,
                 movements: Movements, motion: Motion | None = None) -> None:
        """Build both primitives around one transformation system."""
        self.primitive = LegPrimitive(leg, description, parameters, motion)
        count = len(JOINTS_OF_LEG)
        self.joints = slice(count * self.primitive.place, count * (self.primitive.place + 1))
        self._motion = LegMotion(self.joints, movements, self.primitive.transformation)

    def initial_state(self) -> LegControlState:
        """State of a leg that stands at its foothold."""
        return LegControlState(self.primitive.initial_state())

    def step(
        self, state: LegControlState, gait: GaitInForce, x: Array, x_dot: Array, r: Array,
        feedback: PostureFeedback, position: Array, velocity: Array, dt: float,
    ) -> tuple[LegControlState, JointTargets]:
        """Advance the leg by one tick.

        Parameters
        ----------
        state : LegControlState
            After the tick before.
        gait : Gait or BlendedGait
            In force.
        x, x_dot : ndarray (4, 2)
            Canonical states and rates.
        r : ndarray (3,)
            Reference.
        feedback : PostureFeedback
            Of the posture block, with what the body does.
        position, velocity : ndarray (12,)
            Measured joints [rad], [rad/s]; only the torque reading uses them.
        dt : float
            Time since the last tick [s].

        Returns
        -------
        state : LegControlState
        targets : JointTargets
            Of the leg's three joints.
        """
        place, joints, command = self.primitive.place, self.joints, feedback.command
        if command.balanced:
            motion = None
            leg, goal, goal_velocity = self.primitive.step(
                state.leg, gait, x[place], x_dot[place], r, feedback.of_leg(place), dt)
        else:
            motion, leg, goal, goal_velocity = self._motion.step(
                state.motion, state.leg, command, feedback.measured[joints], dt)
        measured = None
        if self.primitive.parameters.reading == 'torque':
            measured = SpringState(position[joints], velocity[joints])
        targets = self.primitive.targets(
            leg, goal, goal_velocity, feedback.torque[joints], measured)
        return LegControlState(leg, motion, command), targets
