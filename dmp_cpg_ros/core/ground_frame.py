# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frame of the ground: at the base, with its heading, z along the normal of the ground.

A controller that works in this frame holds the body parallel to a slope, keeps its height along
the normal, and its friction cones stand on the ground. On level ground, or without an estimate of
it, the frame is level; of a slight slope it takes a part only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.levelling import frame_of
from dmp_cpg_ros.core.robot_state import RobotState
from dmp_cpg_ros.core.rotations import rotation_matrix

Array = NDArray[np.float64]

SLIGHT = 0.03
"""Slope of which half is followed, more of steeper ones and little of the few tenths of a degree
that soft ground and compliant feet feign.
"""

UPWARD = np.array((0.0, 0.0, 1.0))


def ground_from_base(state: RobotState, following: float = 1.0) -> tuple[Array, Array]:
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
    R_ground_base : ndarray (3, 3)
        Its third row is the frame's z axis in the base.
    upward_in_ground : ndarray (3,)
        Direction away from gravity.
    """
    R_world_base = rotation_matrix(state.base_quaternion)
    normal, vertical = state.ground_normal_in_world, R_world_base[2]
    if normal is None or following == 0.0:
        return frame_of(vertical), UPWARD.copy()
    slope = normal / normal[2] - UPWARD
    squared = float(slope @ slope)
    leaning = UPWARD + following * squared / (squared + SLIGHT**2) * slope
    leaning /= np.sqrt(leaning @ leaning)
    R_ground_base = frame_of(leaning @ R_world_base)
    return R_ground_base, R_ground_base @ vertical


def lean(upward_in_ground: Array, height: float) -> Array:
    """Where the vertical through a point at a height meets the ground, relative to its foot.

    Feet that stand around this place carry the body evenly: on a slope it lies downhill.

    Parameters
    ----------
    upward_in_ground : ndarray (3,)
        As from :func:`ground_from_base`.
    height : float
        Of the centre of mass over the ground, along its normal [m].

    Returns
    -------
    ndarray (2,)
        In the frame of the ground [m].
    """
    return -height * upward_in_ground[:2] / max(float(upward_in_ground[2]), 0.3)
