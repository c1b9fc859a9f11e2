# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fallback controller: joint targets when the commands stop.

A standing robot holds its stance. One that is upright but low (on its way up or down, or on its
belly) is lowered onto its belly. The joints of a tilted one are damped.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.modes.falls import BodySense, FallParameters
from dmp_cpg_ros.core.modes.motion_library import RISE, Movements, lying_posture
from dmp_cpg_ros.core.primitives.demonstration import minimum_jerk
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState
from dmp_cpg_ros.robot.start_pose import home_joint_position

Array = NDArray[np.float64]

STAND_S = 0.6
"""Time in which a stand is taken up from wherever the joints are [s]."""

STANDING_HEIGHT = 0.7
"""Fraction of the standing height from which the robot stands."""


@dataclass(frozen=True, eq=False)
class Fallback:
    """A fallback under way.

    Attributes
    ----------
    what : str
        ``stand``, ``lie`` or ``damp``.
    begin_ns : int
        Stamp at which it began [ns].
    start : ndarray (12,)
        Joint angles at that stamp [rad].
    """

    what: str
    begin_ns: int
    start: Array


class FallbackController:
    """Chooses a safe stop for a robot without joint commands, and makes its targets.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Derive the postures."""
        self._sense, self._stance_height = BodySense(description), description.stance_height
        self._goals = {
            'stand': home_joint_position(description), 'lie': lying_posture(description)}
        unit = Movements(description).time_unit
        self._seconds = {'stand': STAND_S, 'lie': RISE * unit}
        self._tilt = FallParameters().fall_tilt

    def begin(self, state: RobotState) -> Fallback:
        """Decide by how the robot is."""
        condition = self._sense.condition(state)
        what = 'stand' if condition.height >= STANDING_HEIGHT * self._stance_height else 'lie'
        if condition.tilt > self._tilt:
            what = 'damp'
        return Fallback(what, state.time_ns, state.joint_position.copy())

    def step(self, fallback: Fallback, state: RobotState) -> tuple[Fallback, JointTargets]:
        """Targets (12,) at a state; a robot that tips over meanwhile is damped."""
        if fallback.what != 'damp' and self._sense.condition(state).tilt > self._tilt:
            fallback = Fallback('damp', state.time_ns, state.joint_position.copy())
        zero = np.zeros(12)
        if fallback.what == 'damp':
            return fallback, JointTargets(state.joint_position.copy(), zero, zero.copy())
        fraction = (state.time_ns - fallback.begin_ns) * 1e-9 / self._seconds[fallback.what]
        path = self._goals[fallback.what] - fallback.start
        position = fallback.start + float(minimum_jerk(np.array(fraction))) * path
        return fallback, JointTargets(position, zero, zero.copy())
