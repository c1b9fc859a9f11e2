# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What votes are derived from, and sensors that fall silent."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class VoteSensors:
    """What contact sensors and IMU have said, not a number where they say nothing that is good.

    Attributes
    ----------
    contact_ns, imu_ns : int
        Stamps of the readings [ns]; those of the tick unless a message is late or missing.
    foot_force : ndarray (4,)
        Normal forces [N].
    rate_in_base, specific_force_in_base : ndarray (3,)
        Gyroscope [rad/s] and accelerometer [m/s^2].
    """

    contact_ns: int
    imu_ns: int
    foot_force: Array
    rate_in_base: Array
    specific_force_in_base: Array

    @property
    def imu_is_good(self) -> bool:
        """Whether gyroscope and accelerometer both say something."""
        return bool(np.isfinite(self.rate_in_base).all()
                    and np.isfinite(self.specific_force_in_base).all())


def vote_sensors(state: RobotState) -> VoteSensors:
    """Readings that a state of the robot holds."""
    return VoteSensors(state.time_ns, state.time_ns, state.foot_force,
                       state.measured_rate_in_base, state.acceleration_in_base)


@dataclass(frozen=True)
class LastGood:
    """Stamps of the last good values.

    Attributes
    ----------
    contact_ns : ndarray (4,) of int
        Of each foot [ns].
    imu_ns : int
        Of the IMU [ns].
    """

    contact_ns: Stamps
    imu_ns: int

    @classmethod
    def at(cls, time_ns: int) -> LastGood:
        """All sensors get their time from this stamp on."""
        return cls(np.full(len(LEGS), time_ns), time_ns)

    def after(self, sensors: VoteSensors) -> LastGood:
        """Stamps after a reading."""
        good = np.isfinite(sensors.foot_force) & (self.contact_ns < sensors.contact_ns)
        last = self
        if good.any():
            last = replace(last, contact_ns=np.where(good, sensors.contact_ns, self.contact_ns))
        if sensors.imu_ns > self.imu_ns and sensors.imu_is_good:
            last = replace(last, imu_ns=sensors.imu_ns)
        return last

    def silent(self, time_ns: int, silence_ns: int) -> tuple[Mask, bool]:
        """Sensors without a good value for longer than a time.

        Parameters
        ----------
        time_ns : int
            Stamp of the tick [ns].
        silence_ns : int
            The time [ns].

        Returns
        -------
        contact : ndarray (4,) of bool
            Legs whose contact sensor is silent.
        imu : bool
            Whether the IMU is silent.
        """
        return time_ns - self.contact_ns > silence_ns, time_ns - self.imu_ns > silence_ns
