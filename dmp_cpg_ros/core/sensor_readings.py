# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the sensors of one tick say, and what of it can be used."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.robot_state import LEGS, RobotState

Array = NDArray[np.float64]

FASTEST_TURN, HARDEST_BLOW = 100.0, 1000.0
"""Readings beyond these are no readings of a walking robot's IMU [rad/s], [m/s^2]."""

FASTEST_JOINT, LARGEST_FORCE = 200.0, 1e5
"""Readings beyond these are faults of joint and contact sensors [rad/s], [N]."""


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
    """

    time_ns: int
    joint_position: Array
    joint_velocity: Array
    joint_effort: Array
    rate_in_base: Array
    specific_force_in_base: Array
    foot_force: Array

    @property
    def imu_is_usable(self) -> bool:
        """Whether gyroscope and accelerometer both say something possible."""
        return bool(
            (np.abs(self.rate_in_base) <= FASTEST_TURN).all()
            and (np.abs(self.specific_force_in_base) <= HARDEST_BLOW).all()
        )

    @property
    def usable_legs(self) -> NDArray[np.bool_]:
        """Whether angles and velocities of each leg's joints are possible, (4,)."""
        # NaN is neither smaller nor larger than anything.
        fine = (np.abs(self.joint_position) <= FASTEST_JOINT) & (
            np.abs(self.joint_velocity) <= FASTEST_JOINT
        )
        return np.asarray(fine.reshape(len(LEGS), 3).all(axis=1))

    @property
    def usable_contacts(self) -> NDArray[np.bool_]:
        """Whether each foot's force is possible, (4,)."""
        return np.abs(self.foot_force) <= LARGEST_FORCE


def readings_of(state: RobotState) -> SensorReadings:
    """Sensors' part of a robot's state; its ground truth stays behind."""
    return SensorReadings(
        state.time_ns,
        state.joint_position,
        state.joint_velocity,
        state.joint_effort,
        state.measured_rate_in_base,
        state.acceleration_in_base,
        state.foot_force,
    )
