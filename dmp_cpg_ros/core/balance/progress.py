# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far the feet that lead the way are behind, which an obstacle holds up."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, pi

from dmp_cpg_ros.core.maths.vec3 import Pair, Triple

SLOWEST = 0.02
"""Speed below which no foot is ahead of the others [m/s]."""


def feet_behind(planned: Pair, beside: Pair, feet: Sequence[Triple],
                footholds: Sequence[Triple], positions: Sequence[float], duty: float,
                omega: float) -> float:
    """How far the standing feet that lead the way are behind their places, in the mean.

    A foot that stands t after mid-stance is to be at p − v t, with p its place then and v the
    velocity of the body. Where an obstacle holds the swings up, the feet come down short of it.

    Parameters
    ----------
    planned : tuple of float
        Velocity that the body is to have by now [m/s].
    beside : tuple of float
        How far from their footholds the feet are to be, for a slope or a curve [m].
    feet, footholds : sequence of four tuples of float
        Measured, and at mid-stance, in the frame of the ground [m].
    positions : sequence of four floats
        In the cycle, 0 at mid-swing, ±1/2 at mid-stance.
    duty, omega : float
        Share of stance, and rate of the cycle [rad/s].

    Returns
    -------
    float
        [m]
    """
    v_x, v_y = planned
    speed = hypot(v_x, v_y)
    if speed < SLOWEST:
        return 0.0
    along_x, along_y = v_x / speed, v_y / speed
    period, behind, count = 2.0 * pi / omega, 0.0, 0
    for i, foothold in enumerate(footholds):
        foot, position = feet[i], positions[i]
        leads = along_x * foothold[0] + along_y * foothold[1] > 0.0
        if not leads or abs(position) < 0.5 * (1.0 - duty):
            continue
        since = (position - 0.5 if position > 0.0 else position + 0.5) * period
        behind += (along_x * (foothold[0] + beside[0] - foot[0])
                   + along_y * (foothold[1] + beside[1] - foot[1]) - speed * since)
        count += 1
    return behind / count if count else 0.0
