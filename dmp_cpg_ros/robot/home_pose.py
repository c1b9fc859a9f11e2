# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint angles of a robot that stands with its feet below its hip joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_description import LegGeometry, RobotDescription


def home_joint_position(description: RobotDescription) -> NDArray[np.float64]:
    """Return the standing pose.

    Abduction is zero; hip and knee put the centre of the foot straight below the hip joint (in the plane
    of the leg) at the stance height.

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
    """Solve the planar two-link leg; rotations about +y take z to x."""
    down = height - leg.foot_radius + leg.hip_in_base[2] + leg.hip_offset[2]
    thigh, shank = np.hypot(leg.thigh[0], leg.thigh[2]), np.hypot(leg.shank[0], leg.shank[2])
    if not abs(thigh - shank) < down < thigh + shank:
        raise ParameterError(
            f'leg {leg.name} cannot stand at a base height of {height:g} m: its hip joint would be {down:.3f} m '
            f'over the foot, possible are {abs(thigh - shank):.3f} to {thigh + shank:.3f} m')
    bend = leg.knee_sign * np.arccos(
        (down**2 - thigh**2 - shank**2) / (2 * thigh * shank))
    # Angles about +y from straight down to the thigh and to the shank.
    thigh_angle = -np.arctan2(shank * np.sin(bend), thigh + shank * np.cos(bend))
    zero_thigh, zero_shank = _angle_from_down(leg.thigh), _angle_from_down(leg.shank)
    hip = leg.axis_sign[1] * _wrapped(thigh_angle - zero_thigh)
    knee = leg.axis_sign[2] * _wrapped(bend - (zero_shank - zero_thigh))
    angles = np.array([0.0, hip, knee])
    for angle, low, high, joint in zip(angles, leg.position_lower, leg.position_upper,
                                       ('abduction', 'hip', 'knee')):
        if not low <= angle <= high:
            raise ParameterError(f'leg {leg.name}: standing at {height:g} m needs {angle:.3f} rad at the {joint}, '
                                 f'its limits are {low:.3f} to {high:.3f} rad')
    return angles


def _angle_from_down(vector: NDArray[np.float64]) -> float:
    """Return the rotation about +y that takes straight down to a vector's direction."""
    return float(np.arctan2(-vector[0], -vector[2]))


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)
