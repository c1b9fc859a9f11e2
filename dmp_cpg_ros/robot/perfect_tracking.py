# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot without physics, for testing everything that surrounds a robot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.modes.motion_library import lying_posture
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState
from dmp_cpg_ros.robot.joint_drive import checked_targets
from dmp_cpg_ros.robot.port import steps_per_tick
from dmp_cpg_ros.robot.start_pose import home_joint_position

CONTACT_HEIGHT = 0.002  # [m] over the lowest foot within which a foot counts as standing


class PerfectTrackingRobot:
    """Joints are exactly where they were told to be; the level body rides on its lowest feet.

    After each tick the lowest foot touches the ground, and the body has moved and turned in the
    plane such that the feet that stand before and after the tick stay where they were, in the
    least-squares sense. Roll and pitch stay zero. The weight is shared evenly by the feet that
    stand.

    Parameters
    ----------
    description : RobotDescription
        The robot to stand in for.
    tick_ns : int
        Control tick [ns].
    start_pose : str
        ``standing`` or ``lying``.

    Raises
    ------
    ParameterError
        If the tick is not positive, or there is no such pose.
    """

    def __init__(self, description: RobotDescription, tick_ns: int = 4_000_000,
                 start_pose: str = 'standing') -> None:
        steps_per_tick(tick_ns, 1)
        poses = {'standing': home_joint_position, 'lying': lying_posture}
        if start_pose not in poses:
            raise ParameterError(f'start_pose {start_pose!r} must be standing or lying')
        self.description, self.tick_ns = description, tick_ns
        self._legs = [LegKinematics(leg) for leg in description.legs]
        self._radius = np.array([leg.foot_radius for leg in description.legs])
        self._home = poses[start_pose](description)
        self.without_power: tuple[str, ...] = ()  # of no effect: there are no drives
        self.reset()

    def reset(self, time_ns: int = 0) -> RobotState:
        """Be in the start pose at a time, whole ticks from 0 [ns]."""
        self._tick = time_ns // self.tick_ns
        self._place, self._yaw = np.zeros(2), 0.0
        self._velocity_in_world, self._yaw_rate = np.zeros(3), 0.0
        self._feet, self._height, self._standing = self._feet_in_base(self._home)
        return self._state(self._home.copy(), np.zeros(12), np.zeros(12), np.zeros(3))

    def step(self, targets: JointTargets) -> RobotState:
        """Advance by one tick.

        Raises
        ------
        DataError
            If the targets have another shape than (12,) or are not finite.
        """
        position, velocity, effort = checked_targets(targets)
        tick_s = self.tick_ns * 1e-9
        feet, height, standing = self._feet_in_base(position)
        both = standing & self._standing
        turn, shift = _planar_fit(feet[both, :2], self._feet[both, :2])
        moved = _turned(shift, self._yaw)  # in the world
        velocity_in_world = np.array((*moved, height - self._height)) / tick_s
        acceleration_in_world = (velocity_in_world - self._velocity_in_world) / tick_s
        self._place, self._yaw = self._place + moved, self._yaw + turn
        self._velocity_in_world, self._yaw_rate = velocity_in_world, turn / tick_s
        self._feet, self._height, self._standing = feet, height, standing
        self._tick += 1
        return self._state(position, velocity, effort, acceleration_in_world)

    def _feet_in_base(self, joint_position: Array) -> tuple[Array, float, NDArray[np.bool_]]:
        """Return feet (4, 3), height of the base over the ground, and which feet stand (4,)."""
        feet = np.array([leg.foot_in_base(joint_position[3 * i:3 * i + 3])
                         for i, leg in enumerate(self._legs)])
        soles = feet[:, 2] - self._radius
        return feet, float(-soles.min()), soles <= soles.min() + CONTACT_HEIGHT

    def _state(self, position: Array, velocity: Array, effort: Array,
               acceleration_in_world: Array) -> RobotState:
        half = 0.5 * self._yaw
        specific_force = acceleration_in_world + (0.0, 0.0, GRAVITY)
        return RobotState(
            time_ns=self._tick * self.tick_ns, joint_position=position, joint_velocity=velocity,
            joint_effort=effort,
            base_position_in_world=np.array((*self._place, self._height)),
            base_quaternion=np.array((0.0, 0.0, np.sin(half), np.cos(half))),
            base_velocity_in_base=_in_base(self._velocity_in_world, self._yaw),
            base_rate_in_base=np.array((0.0, 0.0, self._yaw_rate)),
            acceleration_in_base=_in_base(specific_force, self._yaw),
            foot_force=self._standing * (self.description.mass * GRAVITY / self._standing.sum()))


def _planar_fit(moved: Array, fixed: Array) -> tuple[float, Array]:
    """Return angle and shift of least Σ |R(angle) moved_i + shift − fixed_i|², points (n, 2)."""
    if not len(moved):
        return 0.0, np.zeros(2)
    centre, target = moved.mean(axis=0), fixed.mean(axis=0)
    a, b = moved - centre, fixed - target
    angle = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    return angle, target - _turned(centre, angle)


def _turned(vector: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array((c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]))


def _in_base(in_world: Array, yaw: float) -> Array:
    return np.array((*_turned(in_world[:2], -yaw), in_world[2]))
