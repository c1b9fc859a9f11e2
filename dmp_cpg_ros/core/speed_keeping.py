# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A slow loop that keeps speed and heading: it corrects the velocity of the standing feet."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, exp, isnan

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.gait import GRAVITY
from dmp_cpg_ros.core.phase import wrapped
from dmp_cpg_ros.core.posture_parameters import PostureParameters

Array = NDArray[np.float64]

SLOWEST = 0.3
"""Froude speed below which the limit of the correction shrinks no more."""


@dataclass(frozen=True)
class SpeedKeeping:
    """State of the loop.

    Attributes
    ----------
    correction : ndarray (2,)
        Correction of the stance velocity [m/s].
    heading_error : float
        Commanded minus measured heading [rad].
    yaw : float
        Heading at the last tick [rad]; NaN before the first.
    """

    correction: Array
    heading_error: float
    yaw: float

    def following(
        self, p: PostureParameters, leg_length: float, moving: float, quaternion: Array,
        velocity: Array, r: Array, dt: float,
    ) -> SpeedKeeping:
        """Integrate the errors of speed and heading while the legs move; forget them at rest.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        leg_length : float
            Standing height of the hips [m].
        moving : float
            Mean activity of the legs.
        quaternion : ndarray (4,)
            Orientation of the base, x, y, z, w.
        velocity : ndarray (3,)
            Of the base in the levelled frame [m/s].
        r : ndarray (3,)
            Reference.
        dt : float
            [s]
        """
        x, y, z, w = quaternion.tolist()
        yaw = atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
        slowest = SLOWEST * (GRAVITY * leg_length) ** 0.5
        limit = p.speed_correction_limit * max(float(np.hypot(r[0], r[1])), slowest)
        gain = p.speed_integral * (GRAVITY / leg_length) ** 0.5 * moving * dt
        wanted = self.correction + gain * (r[:2] - velocity[:2])
        correction = np.clip(wanted, -limit, limit) * exp(-(1.0 - moving) * p.activity_rate * dt)
        turned = 0.0 if isnan(self.yaw) else float(wrapped(yaw - self.yaw))
        error = (self.heading_error + float(r[2]) * dt - turned) * moving
        return SpeedKeeping(
            correction, min(max(error, -p.heading_limit), p.heading_limit), yaw
        )

    def acting(self, p: PostureParameters, leg_length: float, moving: float) -> Array:
        """Correction of v_x, v_y [m/s], γ [rad/s] that the legs apply, ndarray (3,)."""
        turn = p.heading_gain * (GRAVITY / leg_length) ** 0.5 * self.heading_error
        return moving * np.array((self.correction[0], self.correction[1], turn))
