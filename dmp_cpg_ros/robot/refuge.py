# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a robot does by itself when nobody tells its joints anything: it never just drops.

A robot that stands takes up a stand. One that is upright but low (on its way up or down, or on its
belly) lowers itself onto its belly. One that is tilted holds its joints by damping alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.modes.body_condition import BodySense
from dmp_cpg_ros.core.modes.fall_detection import FallParameters
from dmp_cpg_ros.core.modes.movements import RISE, Movements
from dmp_cpg_ros.core.modes.postures import lying_posture
from dmp_cpg_ros.core.primitives.demonstration import minimum_jerk
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState
from dmp_cpg_ros.robot.home_pose import home_joint_position

Array = NDArray[np.float64]

STAND_S = 0.6
"""Time in which a stand is taken up from wherever the joints are [s]."""

STANDING_HEIGHT = 0.7
"""Share of the standing height from which the robot stands."""


@dataclass(frozen=True, eq=False)
class Retreat:
    """A retreat under way.

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


class Refuge:
    """Decides and makes the targets of a robot that has been left alone.

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

    def begin(self, state: RobotState) -> Retreat:
        """Decide by how the robot is."""
        condition = self._sense.condition(state)
        what = 'stand' if condition.height >= STANDING_HEIGHT * self._stance_height else 'lie'
        if condition.tilt > self._tilt:
            what = 'damp'
        return Retreat(what, state.time_ns, state.joint_position.copy())

    def go_on(self, retreat: Retreat, state: RobotState) -> tuple[Retreat, JointTargets]:
        """Targets (12,) at a state; a robot that tips over meanwhile is damped."""
        if retreat.what != 'damp' and self._sense.condition(state).tilt > self._tilt:
            retreat = Retreat('damp', state.time_ns, state.joint_position.copy())
        zero = np.zeros(12)
        if retreat.what == 'damp':
            return retreat, JointTargets(state.joint_position.copy(), zero, zero.copy())
        share = (state.time_ns - retreat.begin_ns) * 1e-9 / self._seconds[retreat.what]
        way = self._goals[retreat.what] - retreat.start
        position = retreat.start + float(minimum_jerk(np.array(share))) * way
        return retreat, JointTargets(position, zero, zero.copy())
