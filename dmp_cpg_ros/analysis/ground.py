# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How high the base was over the ground that it walked on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.motion import rotations
from dmp_cpg_ros.analysis.recording import OdometrySeries
from dmp_cpg_ros.core.robot_model import world

Array = NDArray[np.float64]


def height_over_ground(odometry: OdometrySeries, context: RunContext) -> Array:
    """Height of the base over the ground below its hips.

    Parameters
    ----------
    odometry : OdometrySeries
        The base's way.
    context : RunContext
        World and robot; without a robot the ground below the base's origin is taken.

    Returns
    -------
    ndarray (n,)
        [m]
    """
    place = odometry.position_in_world
    if context.world.is_flat or not place.size:
        return place[:, 2]
    hips = np.zeros((1, 3))
    if context.robot is not None:
        hips = np.array([leg.hip_in_base for leg in context.robot.legs])
    hips_in_world = place[:, None] + np.einsum('nij,lj->nli', rotations(odometry.quaternion), hips)
    return world.height_over_ground(context.world, place, hips_in_world)
