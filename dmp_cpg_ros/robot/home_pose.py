# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint angles of a robot that stands with its feet below its hip joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG

TOLERANCE = 1e-6  # [m] of the foot's place


def home_joint_position(description: RobotDescription) -> NDArray[np.float64]:
    """Return the standing pose.

    Abduction is zero; hip and knee put the centre of the foot straight below the hip joint (in the
    plane of the leg) so that it touches the ground at the stance height.

    Returns
    -------
    ndarray (12,)
        Joint angles [rad].

    Raises
    ------
    ParameterError
        If a leg cannot reach the ground from the stance height, or only beyond a joint limit.
    """
    return np.concatenate([_leg(leg, description.stance_height) for leg in description.legs])


def _leg(leg: LegGeometry, height: float) -> NDArray[np.float64]:
    kinematics = LegKinematics(leg)
    foot_in_base = leg.hip_in_base + leg.hip_offset
    foot_in_base[1] = leg.hip_in_base[1] + kinematics.lateral_offset
    foot_in_base[2] = leg.foot_radius - height
    angles = kinematics.inverse(foot_in_base)
    if np.linalg.norm(kinematics.foot_in_base(angles) - foot_in_base) > TOLERANCE:
        reach = kinematics.thigh_length + kinematics.shank_length
        down = leg.hip_in_base[2] + leg.hip_offset[2] - foot_in_base[2]
        raise ParameterError(
            f'leg {leg.name} cannot stand at a base height of {height:g} m: its hip joint would '
            f'be {down:.3f} m over the foot, the leg is {reach:.3f} m long')
    for angle, low, high, joint in zip(angles, leg.position_lower, leg.position_upper,
                                       JOINTS_OF_LEG, strict=True):
        if not low <= angle <= high:
            raise ParameterError(
                f'leg {leg.name}: standing at {height:g} m needs {angle:.3f} rad at the {joint}, '
                f'its limits are {low:.3f} to {high:.3f} rad')
    return angles
