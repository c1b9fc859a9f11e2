# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plan of the height of the centre of mass in a gait with flight phases.

Where no foot stands, the body falls freely, so it needs a vertical velocity at take-off. With
flights of duration t_f and stances of duration t_s in turn, and a constant force in stance,
momentum over a period demands z̈ = −g in flight and z̈ = g t_f / t_s in stance, hence a take-off
at g t_f / 2. Feet leave and meet the ground at the height of the gait's path; the legs are
compressed by g t_f t_s / 8 in the middle of stance. A body that was planned to stay at its height
would come down early, on feet that are still swinging forward, and stumble.
"""

from __future__ import annotations

from math import floor, pi
from typing import NamedTuple

from dmp_cpg_ros.core.maths.constants import GRAVITY


class Bounce(NamedTuple):
    """Planned motion of the body up and down, about the height of the gait's path.

    Attributes
    ----------
    height : float
        z [m].
    velocity : float
        ż [m/s].
    acceleration : float
        z̈ [m/s^2].
    """

    height: float
    velocity: float
    acceleration: float

    def mixed(self, other: Bounce, weight: float) -> Bounce:
        """Weighted mean with another."""
        return Bounce(*(a + weight * (b - a) for a, b in zip(self, other, strict=True)))


LEVEL = Bounce(0.0, 0.0, 0.0)
"""Plan of a gait without flight phases."""


def planned_bounce(cycle_position: float, groups: int, duty: float, omega: float) -> Bounce:
    """Bounce of the body, from where any leg is in its cycle.

    Parameters
    ----------
    cycle_position : float
        0 at the leg's mid-swing, in [−1/2, 1/2].
    groups : int
        As from :func:`~dmp_cpg_ros.core.gait.lags.stance_groups`.
    duty : float
        Duty factor β; there are flights where groups · β < 1.
    omega : float
        Angular frequency of the gait [rad/s].
    """
    if groups * duty >= 1.0 or groups == 0:
        return LEVEL
    cycle = 2.0 * pi / omega
    period = 1.0 / groups
    # from the nearest middle of a stance, in cycles
    apart = cycle_position - 0.5 - period * floor((cycle_position - 0.5) / period + 0.5)
    stance = duty * cycle
    flight = period * cycle - stance
    if abs(apart) <= 0.5 * duty:
        t, thrust = apart * cycle, GRAVITY * flight / stance
        return Bounce(0.5 * thrust * (t * t - 0.25 * stance * stance), thrust * t, thrust)
    t = (apart - 0.5 * period if apart > 0.0 else apart + 0.5 * period) * cycle
    return Bounce(0.5 * GRAVITY * (0.25 * flight * flight - t * t), -GRAVITY * t, -GRAVITY)
