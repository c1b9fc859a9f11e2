# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frame of the ground under a body, and what its slope and the body's tilt do to footholds."""

from __future__ import annotations

from math import hypot, sqrt

from dmp_cpg_ros.core.maths import Array, vec3
from dmp_cpg_ros.core.maths.vec3 import Matrix, Pair, Triple

SLIGHT = 0.03
"""Slope of which half is followed, more of steeper ones and little of the few tenths of a degree
that soft ground and compliant feet feign.
"""

STEEP = (0.05, 0.1)
"""Slopes between which feet come to be placed by how a body is tilted on them, too."""

STEPPED = 0.35
"""How rough ground is, in heights of the centre of mass, whose slope is of steps: astride one, a
body that was placed by its tilt went over the foot that the edge held.
"""


def ground_from_base(R_world_base: Matrix, normal_in_world: Array | None, following: float = 1.0
                     ) -> tuple[Matrix, Triple]:
    """Rotation from ``base_link`` to the frame of the ground, and the vertical in that frame.

    Parameters
    ----------
    R_world_base : tuple of rows
        Orientation of the base.
    normal_in_world : ndarray (3,) or None
        Of the ground, where it is known.
    following : float
        Share of a steep slope that the frame takes; 0 is level. Of a slope s it takes this times
        s²/(s² + ``SLIGHT``²).

    Returns
    -------
    R_ground_base : tuple of rows
        The third is the frame's z axis in the base.
    upward_in_ground : tuple of float
        Direction away from gravity.
    """
    vertical = R_world_base[2]
    if normal_in_world is None or following == 0.0:
        return vec3.heading_frame(vertical), (0.0, 0.0, 1.0)
    x, y, z = normal_in_world.tolist()
    x, y = x / z, y / z
    squared = x * x + y * y
    share = following * squared / (squared + SLIGHT**2)
    length = sqrt(share * share * squared + 1.0)
    leaning = (share * x / length, share * y / length, 1.0 / length)
    R_ground_base = vec3.heading_frame(vec3.transposed_times(R_world_base, leaning))
    return R_ground_base, vec3.times(R_ground_base, vertical)


def lean(upward_in_ground: Triple, height: float) -> tuple[float, float]:
    """Where the vertical through a point at a height meets the ground, relative to its foot.

    Feet that stand around this place carry the body evenly: on a slope it lies downhill.

    Parameters
    ----------
    upward_in_ground : tuple of float
        As from :func:`ground_from_base`.
    height : float
        Of the centre of mass over the ground, along its normal [m].

    Returns
    -------
    tuple of float
        x and y in the frame of the ground [m].
    """
    x, y, z = upward_in_ground
    depth = -height / max(z, 0.3)
    return depth * x, depth * y


def turned_back(beside: Pair, under: Pair, normal_in_base: Triple, height: float,
                rough: float = 0.0) -> Pair:
    """Shift of footholds in a base that is tilted against the ground, from that in its frame.

    A tilt takes the neutral places along, by h sin θ away from the side to which the body falls.
    Where hills change faster than the body and the estimate of their slope follow, it is as large
    as the slope, and what leans the feet downhill made them stand beyond the body. On slopes below
    the first of ``STEEP`` and on ground that is ``STEPPED`` the shift stays as it is.

    Parameters
    ----------
    beside : pair of float
        Shift in the frame of the ground [m].
    under : pair of float
        As from :func:`lean` [m].
    normal_in_base : tuple of float
        Of the ground; (0, 0, 1) where the body is parallel to it.
    height : float
        h, of the centre of mass over the ground [m].
    rough : float
        Height of what the feet are lifted over [m].

    Returns
    -------
    pair of float
        [m]
    """
    gentle, steep = STEEP
    share = (hypot(*under) / height - gentle) / (steep - gentle)
    even = 1.0 - rough / (STEPPED * height)
    if share <= 0.0 or even <= 0.0:
        return beside
    way = -height * min(share, 1.0) * even
    return beside[0] + way * normal_in_base[0], beside[1] + way * normal_in_base[1]
