# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a walking body goes slower than its reference, and stays so.

What is granted is what the legs can do, by the gait's tables and the robot's scale. A body may
still fall short of it: heavy ones do in a pronk at its limit, and others on a slope, in sand, or
with a weak drive. Speed keeping makes up for what it can; what is left is only told.
"""

from __future__ import annotations

from math import exp, hypot
from typing import NamedTuple

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Pair

MEAN_S = 1.5
"""Time constant of both means [s]: some cycles of a gait, and that of speed keeping."""

SHARE = 0.9
"""Share of the reference below which the body falls short."""

LASTS_S = 4.0
"""Time for which it has to before it is told [s]."""

SLOWEST = 0.1
"""Speed in √(g l) below which nothing is told: a body that hardly walks."""


class Shortfall(NamedTuple):
    """How fast the body goes beside its reference.

    Attributes
    ----------
    asked : float
        Speed of the reference, in the mean [m/s].
    goes : float
        Speed of the body along it, in the mean [m/s].
    for_s : float
        Time for which the latter has been less than ``SHARE`` of the former [s].
    """

    asked: float = 0.0
    goes: float = 0.0
    for_s: float = 0.0

    @property
    def lasts(self) -> bool:
        """Whether it is to be told."""
        return self.for_s >= LASTS_S

    def step(self, r: Array, velocity: Pair | None, leg_length: float, dt: float) -> Shortfall:
        """Advance by a tick.

        Parameters
        ----------
        r : ndarray (3,)
            Reference v_x, v_y [m/s], γ [rad/s].
        velocity : tuple of float or None
            Of the body over the ground less its planned sway, ahead and to the left [m/s]; None
            while it does not balance, which begins the means anew.
        leg_length : float
            l [m].
        dt : float
            Time since the last tick [s].
        """
        v_x, v_y, _ = r.tolist()
        speed = hypot(v_x, v_y)
        if velocity is None or speed == 0.0:
            return NO_SHORTFALL
        kept = exp(-dt / MEAN_S)
        along = (velocity[0] * v_x + velocity[1] * v_y) / speed
        asked, goes = speed + (self.asked - speed) * kept, along + (self.goes - along) * kept
        short = asked > SLOWEST * (GRAVITY * leg_length) ** 0.5 and goes < SHARE * asked
        return Shortfall(asked, goes, self.for_s + dt if short else 0.0)


NO_SHORTFALL = Shortfall()
