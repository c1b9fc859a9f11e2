# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What standing legs can still bear: margins of the capture point in the support polygon.

The body as a linear inverted pendulum, c̈ = ω₀² (c − p) with ω₀ = √(g/h), c over the ground and p
the centre of pressure, has the divergent component (extrapolated centre of mass, capture point)

    ξ = c + ċ/ω₀ ,    ξ̇ = ω₀ (ξ − p)

(Hof, Gazendam & Sinke 2005; Pratt et al. 2006). Feet without ankles keep p in the polygon of the
feet, so that the body can be brought to rest over it only if ξ is inside: v/ω₀ ≤ d towards an edge
at the distance d. Where feet slip it is less. With friction μ the ground's force decelerates the
body by μ g at most, as if p were never further than μ h ahead. The body brakes with that until it
is μ h before the edge, and from there p is on the edge: v² ≤ 2 μ g (d − μ h) + (μ h ω₀)², so that

    v/ω₀ ≤ s(d) = √(μ h (2 d − μ h))  for d > μ h,  else d ,

and the way is not longer than the legs reach. The margin of an edge is s(d) − v/ω₀.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.state import LEGS

EDGES = {'front': ('fl', 'fr'), 'right': ('fr', 'rr'), 'rear': ('rr', 'rl'), 'left': ('rl', 'fl')}
"""Edges of the support polygon by the legs at their ends, clockwise seen from above."""

WIDE = (1e3,) * len(EDGES)
"""Margins of a body of which nothing is known: no push [m]."""

_ENDS = tuple((LEGS.index(a), LEGS.index(b)) for a, b in EDGES.values())


def support_margins(feet: Sequence[Sequence[float]], under: tuple[float, float],
                    velocity: tuple[float, float], height: float, friction: float, reach: float
                    ) -> tuple[float, ...]:
    """Margins to the four edges [m]; negative where standing legs cannot bear the velocity.

    Parameters
    ----------
    feet : sequence of four sequences of float
        Their x and y relative to the centre of mass in the frame of the ground [m].
    under : tuple of float
        Where the vertical through the centre of mass meets the ground, in the same frame [m].
    velocity : tuple of float
        Of the centre of mass, beside the planned one [m/s].
    height : float
        Of the centre of mass over the ground [m].
    friction : float
        μ.
    reach : float
        Way of the body that all legs allow [m].

    Returns
    -------
    tuple of float
        In the order of ``EDGES``.
    """
    time, cone, margins = sqrt(height / GRAVITY), friction * height, []
    (c_x, c_y), (v_x, v_y) = under, velocity
    for a, b in _ENDS:
        x, y = feet[a][0], feet[a][1]
        along_x, along_y = feet[b][0] - x, feet[b][1] - y
        length = max(hypot(along_x, along_y), 1e-6)
        out_x, out_y = -along_y / length, along_x / length
        distance = (x - c_x) * out_x + (y - c_y) * out_y
        way = distance if distance <= cone else sqrt(cone * (2.0 * distance - cone))
        margins.append(min(way, reach) - time * (v_x * out_x + v_y * out_y))
    return tuple(margins)
