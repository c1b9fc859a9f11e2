# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which way is up, from an IMU alone: the turning gyroscope, pulled towards the accelerometer.

A complementary filter (Mahony, Hamel and Pflimlin 2008) on the one direction that tilt needs. It
is for whoever wants to notice a fall whatever else has failed; balance uses the body's estimate.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, cos, exp, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.gait.gait import GRAVITY

Array = NDArray[np.float64]

TIME_CONSTANT = 1.0
"""Time in which the accelerometer wins over the gyroscope [s]: longer than a step."""

PLAUSIBLE = (0.5, 1.5)
"""Specific forces that can be gravity, as multiples of it; others are blows."""

LONGEST_GAP = 0.1
"""Longest time over which a turn rate is held [s]."""


@dataclass(frozen=True)
class UpDirection:
    """Estimate of the upward direction.

    Attributes
    ----------
    up_in_base : ndarray (3,)
        Of length 1.
    time_ns : int
        Stamp of the last reading [ns]; −1 before the first.
    """

    up_in_base: Array
    time_ns: int = -1

    @classmethod
    def upright(cls) -> UpDirection:
        """Before the first reading."""
        return cls(np.array([0.0, 0.0, 1.0]))

    @property
    def tilt(self) -> float:
        """Angle between the vertical and the upright of the body [rad]."""
        return acos(min(max(float(self.up_in_base[2]), -1.0), 1.0))

    def after(self, rate_in_base: Array, specific_force_in_base: Array, time_ns: int
              ) -> UpDirection:
        """Estimate after a reading; one that is not newer than the last changes nothing.

        Parameters
        ----------
        rate_in_base : ndarray (3,)
            Turn rate [rad/s].
        specific_force_in_base : ndarray (3,)
            Accelerometer [m/s^2].
        time_ns : int
            Stamp [ns]; at the first reading and after a gap the accelerometer alone counts.

        Returns
        -------
        UpDirection
        """
        if time_ns <= self.time_ns:
            return self
        force, dt = specific_force_in_base, (time_ns - self.time_ns) * 1e-9
        strength = sqrt(float(force @ force))
        plausible = PLAUSIBLE[0] * GRAVITY < strength < PLAUSIBLE[1] * GRAVITY
        if self.time_ns < 0 or dt > LONGEST_GAP:
            return UpDirection(force / strength if plausible else self.up_in_base, time_ns)
        up = _turned_back(self.up_in_base, rate_in_base * dt)
        if plausible:
            up = up + (force / strength - up) * (1.0 - exp(-dt / TIME_CONSTANT))
        length = sqrt(float(up @ up))
        return UpDirection(up / length if length > 1e-6 else self.up_in_base, time_ns)


def _turned_back(direction: Array, rotation_vector: Array) -> Array:
    """A direction that stands still in the world, seen after the body has turned (Rodrigues)."""
    angle = sqrt(float(rotation_vector @ rotation_vector))
    if angle < 1e-12:
        return direction
    axis = rotation_vector / -angle
    x, y, z = axis.tolist()
    u, v, w = direction.tolist()
    across = np.array((y * w - z * v, z * u - x * w, x * v - y * u))
    along = axis * (float(axis @ direction) * (1.0 - cos(angle)))
    turned: Array = direction * cos(angle) + across * sin(angle) + along
    return turned
