# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot's lengths, and speeds by them: what a gait is scaled with."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from dmp_cpg_ros.core.maths.constants import GRAVITY

LATERAL_WEIGHT = 2.0
"""Weight of speed across the body in the speed by which a gait chooses its cadence."""


@dataclass(frozen=True)
class BodyScale:
    """Lengths by which a robot's speeds are made dimensionless.

    Attributes
    ----------
    leg_length : float
        Standing height l of the hips [m].
    hip_radius : float
        Horizontal distance from the base's origin to a foot [m]: a turn at γ moves a foot at γ
        times this.
    room_ahead : float
        How far a foot comes ahead of its neutral place [m].
    room_across : float
        Distance of a neutral place from the middle [m].
    rolling : float
        (I_xx/I_yy) (y/x), with I the body's inertia and x, y the distances of its feet.
    swing : float
        Acceleration that the hips can give the feet [m/s^2]; infinite where it is not known.
    """

    leg_length: float
    hip_radius: float
    room_ahead: float = inf
    room_across: float = inf
    rolling: float = 1.0
    swing: float = inf

    def speed(self, dimensionless: float) -> float:
        """Speed u √(g l) of a dimensionless one u [m/s]."""
        return dimensionless * (GRAVITY * self.leg_length) ** 0.5

    def foot_speed(self, v_x: float, v_y: float, gamma: float, apart: float = 1.0,
                   backwards: float = 1.0) -> float:
        """Speed by which a gait chooses its cadence: a bound on that of any stance foot [m/s].

        Speed sideways and from turning counts ``LATERAL_WEIGHT`` times: across the body the feet
        have about half the room. By a highest speed it counts 1/``rolling`` times where a gait's
        legs swing together, with ``apart`` 0, and speed backwards ``backwards`` times; both are
        the gait's.
        """
        weight = LATERAL_WEIGHT
        if apart < 1.0:
            weight += (1.0 - apart) * max(0.0, 1.0 / self.rolling - weight)
        v_x *= 1.0 if v_x >= 0.0 else backwards
        across = weight * v_y
        return float(
            (v_x * v_x + across * across) ** 0.5 + weight * abs(gamma) * self.hip_radius)
