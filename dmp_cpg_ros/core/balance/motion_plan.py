# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the reference has the body do: its acceleration, and the velocity that it can have by now.

In the turning frame of the body the reference (v, γ) is the acceleration

    a = v̇ + γ ẑ × v ,

of which the second part holds a curve: a body that is not pushed to its centre goes straight on.
The virtual model adds m a to its force, and the feet that hold the curve come down outside of
their neutral places by h/g γ ẑ × v, where the ground's force points through the centre of mass and
does not roll the body (Kajita et al. 2001). v̇ is too short for a foot to be placed for.

The legs follow the reference as far as they swing already, and the virtual model's damper, of rate
k, brings the body there: v̂̇ = k (s v − v̂), with s the legs' mean activity. Speed keeping integrates
what differs from v̂; it would take the delay of every start for a load.
"""

from __future__ import annotations

from math import exp, hypot
from typing import NamedTuple

from dmp_cpg_ros.core.maths.vec3 import Pair, Triple


class MotionPlan(NamedTuple):
    """The plan of a tick, x and y in the body's frame.

    Attributes
    ----------
    velocity : pair of float, optional
        v of the tick [m/s]; None before the first.
    expected : pair of float
        v̂ [m/s].
    acceleration : pair of float
        a, while legs swing [m/s^2].
    curve : pair of float
        Its part γ ẑ × v.
    """

    velocity: Pair | None = None
    expected: Pair = (0.0, 0.0)
    acceleration: Pair = (0.0, 0.0)
    curve: Pair = (0.0, 0.0)

    @property
    def behind(self) -> float:
        """How far the body is behind its reference by plan, |v − v̂| [m/s]."""
        v_x, v_y = self.velocity or self.expected
        return hypot(v_x - self.expected[0], v_y - self.expected[1])

    def followed(self, reference: Triple, moving: float, rate: float, most: float,
                 dt: float) -> MotionPlan:
        """Plan of the next tick.

        Parameters
        ----------
        reference : tuple of float
            v_x, v_y [m/s], γ [rad/s].
        moving : float
            Mean activity s of the legs.
        rate : float
            k [1/s].
        most : float
            Largest acceleration that friction bears [m/s^2].
        dt : float
            [s]
        """
        v_x, v_y, gamma = reference
        if self.velocity is None or dt <= 0.0:
            change, expected = (0.0, 0.0), self.expected if self.velocity else (v_x, v_y)
        else:
            change = (v_x - self.velocity[0]) / dt, (v_y - self.velocity[1]) / dt
            kept, (was_x, was_y) = exp(-rate * dt), self.expected
            expected = (moving * v_x + (was_x - moving * v_x) * kept,
                        moving * v_y + (was_y - moving * v_y) * kept)
        curve = _shortened(-gamma * v_y, gamma * v_x, moving, most)
        return MotionPlan((v_x, v_y), expected, _shortened(
            change[0] - gamma * v_y, change[1] + gamma * v_x, moving, most), curve)


def _shortened(x: float, y: float, share: float, most: float) -> Pair:
    """Share of a vector that is at most so long."""
    length = hypot(x, y)
    share *= min(1.0, most / length) if length > 0.0 else 1.0
    return share * x, share * y
