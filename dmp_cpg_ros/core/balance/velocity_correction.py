# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Integral correction of velocity and heading, applied to the velocity of the standing feet."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, exp, hypot, isnan, pi
from typing import NamedTuple

from dmp_cpg_ros.core.balance.parameters import PostureParameters
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Triple, rotation

SLOWEST = 0.3
"""Froude speed below which the limit of the correction shrinks no more."""


class VelocityCorrection(NamedTuple):
    """Integral velocity and heading correction, slow: added to the velocity of the standing feet.

    Attributes
    ----------
    correction : tuple of float
        Correction of the stance velocity, v_x and v_y [m/s].
    heading_error : float
        Commanded minus measured heading [rad].
    yaw : float
        Heading at the last tick [rad]; NaN before the first.
    """

    correction: tuple[float, float]
    heading_error: float
    yaw: float

    def integrated(
        self, p: PostureParameters, leg_length: float, moving: float,
        quaternion: Sequence[float], velocity: Triple, r: Triple, dt: float,
    ) -> VelocityCorrection:
        """Integrate the errors of velocity and heading while the legs move; forget them at rest.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        leg_length : float
            Standing height of the hips [m].
        moving : float
            Mean activity of the legs.
        quaternion : sequence of four floats
            Orientation of the base, x, y, z, w.
        velocity : tuple of float
            Of the base in the levelled frame [m/s].
        r : tuple of float
            Reference v_x, v_y [m/s], γ [rad/s].
        dt : float
            [s]
        """
        R = rotation(quaternion)
        yaw = atan2(R[1][0], R[0][0])
        slowest = SLOWEST * (GRAVITY * leg_length) ** 0.5
        limit = p.speed_correction_limit * max(hypot(r[0], r[1]), slowest)
        gain = p.speed_integral * (GRAVITY / leg_length) ** 0.5 * moving * dt
        kept = exp(-(1.0 - moving) * p.activity_rate * dt)
        along, across = (
            min(max(before + gain * (wanted - is_now), -limit), limit) * kept
            for before, wanted, is_now in zip(self.correction, r[:2], velocity[:2], strict=True))
        turn = 0.0 if isnan(self.yaw) else (yaw - self.yaw + pi) % (2.0 * pi) - pi
        error = (self.heading_error + r[2] * dt - turn) * moving
        return VelocityCorrection(
            (along, across), min(max(error, -p.heading_limit), p.heading_limit), yaw)

    def acting(self, p: PostureParameters, leg_length: float, moving: float) -> Triple:
        """Correction of v_x, v_y [m/s], γ [rad/s] that the legs apply."""
        turn = p.heading_gain * (GRAVITY / leg_length) ** 0.5 * self.heading_error
        return moving * self.correction[0], moving * self.correction[1], moving * turn
