# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""State and joint targets of the robot, as plain arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from typing import NamedTuple

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import made_often

LEGS = ('fl', 'fr', 'rl', 'rr')
"""Leg names in the order of every array over legs."""

JOINTS_OF_LEG = ('abduction', 'hip', 'knee')
"""Joints of one leg from the body outwards."""

JOINT_NAMES = tuple(f'{leg}_{joint}' for leg in LEGS for joint in JOINTS_OF_LEG)
"""The twelve joint names in the order of every array over joints."""


@made_often
@dataclass(frozen=True)
class RobotState:
    """State of the robot at one tick.

    Attributes
    ----------
    time_ns : int
        Stamp on the robot's clock [ns].
    joint_position, joint_velocity, joint_effort : ndarray (12,)
        Measured [rad], [rad/s], [N m], in the order of ``JOINT_NAMES``.
    base_position_in_world : ndarray (3,)
        Origin of ``base_link`` in ``world`` [m].
    base_quaternion : ndarray (4,)
        Orientation of ``base_link`` in ``world``, x, y, z, w.
    base_velocity_in_base, base_rate_in_base : ndarray (3,)
        Linear [m/s] and angular [rad/s] velocity of ``base_link``, seen in ``base_link``.
    acceleration_in_base : ndarray (3,)
        Accelerometer reading (specific force) [m/s^2].
    foot_force : ndarray (4,)
        Normal contact force of each foot [N].
    gyro_in_base : ndarray (3,), optional
        Gyroscope reading [rad/s].
    ground_normal_in_world : ndarray (3,), optional
        Of the ground under the feet, upwards, as far as an estimator knows it.
    joint_work : ndarray (12,), optional
        Positive mechanical work that each joint's torque has done since time 0 [J].
    joint_peak_effort : ndarray (12,), optional
        Largest size of each joint's torque during the tick that ends here [N m].
    joint_loss : ndarray (12,), optional
        Energy that damping and dry friction of each joint have taken since time 0 [J]. These three
        are known where torques are applied more often than states are told: in a simulator.
    felt_legs : tuple of 4 bool, optional
        Whose joints an estimator could use, where it could not use all; those of other legs are
        the last that it could.

    Joints, efforts, gyroscope, accelerometer and forces are measured; position, orientation and
    velocities of the base are the truth in a simulator's state and an estimate in a controller's.
    """

    time_ns: int
    joint_position: Array
    joint_velocity: Array
    joint_effort: Array
    base_position_in_world: Array
    base_quaternion: Array
    base_velocity_in_base: Array
    base_rate_in_base: Array
    acceleration_in_base: Array
    foot_force: Array
    gyro_in_base: Array | None = None
    ground_normal_in_world: Array | None = None
    joint_work: Array | None = None
    joint_peak_effort: Array | None = None
    joint_loss: Array | None = None
    felt_legs: tuple[bool, ...] | None = None

    @property
    def feels_nothing(self) -> bool:
        """Whether neither joints nor IMU could be used."""
        return self.felt_legs is not None and not any(self.felt_legs) and isnan(
            self.measured_rate_in_base[0])

    @property
    def measured_rate_in_base(self) -> Array:
        """Gyroscope's reading, (3,) [rad/s]; a perfect one's where none is given."""
        return self.base_rate_in_base if self.gyro_in_base is None else self.gyro_in_base


class LegTargets(NamedTuple):
    """Targets of one leg's joints, in numbers, for code that runs for every leg at every tick.

    Attributes
    ----------
    position, velocity, effort : sequence of 3 floats
        As of :class:`JointTargets`.
    """

    position: Sequence[float]
    velocity: Sequence[float]
    effort: Sequence[float]


@made_often
@dataclass(frozen=True)
class JointTargets:
    """Targets for some joints; what the legs send to the robot.

    Attributes
    ----------
    position, velocity, effort : ndarray (n,)
        Target angle [rad], angular velocity [rad/s] and feed-forward torque [N m].
    """

    position: Array
    velocity: Array
    effort: Array

    def by_leg(self) -> dict[str, JointTargets]:
        """Those of each leg, where these are all."""
        parts = {leg: slice(3 * place, 3 * place + 3) for place, leg in enumerate(LEGS)}
        return {leg: JointTargets(self.position[part], self.velocity[part], self.effort[part])
                for leg, part in parts.items()}
