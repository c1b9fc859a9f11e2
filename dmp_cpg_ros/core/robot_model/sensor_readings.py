# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sensor readings of one tick, and which of them are valid."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.robot_model.state import LEGS, Array, RobotState

FASTEST_TURN, HARDEST_BLOW = 100.0, 1000.0
"""Readings beyond these are no readings of a walking robot's IMU [rad/s], [m/s^2]."""

FASTEST_JOINT, LARGEST_FORCE = 200.0, 1e5
"""Readings beyond these are faults of joint and contact sensors [rad/s], [N]."""

ALL = (True,) * len(LEGS)
"""What is so of every leg."""


@made_often
@dataclass(frozen=True)
class SensorReadings:
    """What the sensors of one tick say; NaN marks what is missing.

    Attributes
    ----------
    time_ns : int
        Stamp [ns].
    joint_position, joint_velocity, joint_effort : ndarray (12,)
        [rad], [rad/s], [N m] in the order of ``JOINT_NAMES``.
    rate_in_base, specific_force_in_base : ndarray (3,)
        Gyroscope [rad/s] and accelerometer [m/s^2] at the origin of ``base_link``.
    foot_force : ndarray (4,)
        Normal force of each foot [N].
    joints_ns : int
        Stamp at which the joints were so [ns], where messages come late or get lost; by default
        that of all.
    imu_is_usable : bool
        Whether gyroscope and accelerometer both say something possible.
    usable_legs, usable_contacts : tuple of 4 bool
        Whether angles and velocities of each leg's joints, and each foot's force, are possible.
    """

    time_ns: int
    joint_position: Array
    joint_velocity: Array
    joint_effort: Array
    rate_in_base: Array
    specific_force_in_base: Array
    foot_force: Array
    joints_ns: int = -1

    imu_is_usable: bool = field(init=False)
    usable_legs: tuple[bool, ...] = field(init=False)
    usable_contacts: tuple[bool, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Judge the readings, once for all who ask."""
        q, q_dot, legs, contacts = self.joint_position, self.joint_velocity, ALL, ALL
        if not (_within(q, FASTEST_JOINT) and _within(q_dot, FASTEST_JOINT)):
            legs = tuple(_within(q[i:i + 3], FASTEST_JOINT) and _within(
                q_dot[i:i + 3], FASTEST_JOINT) for i in range(0, 12, 3))
        if not _within(self.foot_force, LARGEST_FORCE):
            contacts = tuple(abs(force) <= LARGEST_FORCE for force in self.foot_force.tolist())
        vars(self).update(
            imu_is_usable=_within(self.rate_in_base, FASTEST_TURN) and _within(
                self.specific_force_in_base, HARDEST_BLOW),
            usable_legs=legs, usable_contacts=contacts,
            joints_ns=self.time_ns if self.joints_ns < 0 else self.joints_ns)


def _within(values: Array, limit: float) -> bool:
    """Whether no value is beyond a limit, and none is NaN: certain where their length is not."""
    return bool(values.dot(values) <= 0.999 * limit * limit or np.abs(values).max() <= limit)


def readings_of(state: RobotState) -> SensorReadings:
    """Sensors' part of a robot's state; its ground truth stays behind."""
    return SensorReadings(
        state.time_ns, state.joint_position, state.joint_velocity, state.joint_effort,
        state.measured_rate_in_base, state.acceleration_in_base, state.foot_force)
