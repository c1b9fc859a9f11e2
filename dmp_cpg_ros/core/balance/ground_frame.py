# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frame of the ground: at the base, with its heading, z along the normal of the ground.

A controller that works in this frame holds the body parallel to a slope, keeps its height along
the normal, and its friction cones stand on the ground. On level ground, or without an estimate of
it, the frame is level; of a slight slope it takes a part only.
"""

from __future__ import annotations

from math import sqrt

from dmp_cpg_ros.core.maths.vec3 import (
    Matrix,
    Triple,
    heading_frame,
    rotation,
    times,
    transposed_times,
)
from dmp_cpg_ros.core.robot_model.state import RobotState

SLIGHT = 0.03
"""Slope of which half is followed, more of steeper ones and little of the few tenths of a degree
that soft ground and compliant feet feign.
"""


def ground_from_base(state: RobotState, following: float = 1.0) -> tuple[Matrix, Triple]:
    """Rotation from ``base_link`` to the frame of the ground, and the vertical in that frame.

    Parameters
    ----------
    state : RobotState
        Orientation of the base, and the normal of the ground where it is known.
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
    R_world_base = rotation(state.base_quaternion.tolist())
    normal, vertical = state.ground_normal_in_world, R_world_base[2]
    if normal is None or following == 0.0:
        return heading_frame(vertical), (0.0, 0.0, 1.0)
    x, y, z = normal.tolist()
    x, y = x / z, y / z
    squared = x * x + y * y
    share = following * squared / (squared + SLIGHT**2)
    length = sqrt(share * share * squared + 1.0)
    leaning = (share * x / length, share * y / length, 1.0 / length)
    R_ground_base = heading_frame(transposed_times(R_world_base, leaning))
    return R_ground_base, times(R_ground_base, vertical)


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
