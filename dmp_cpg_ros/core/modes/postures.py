# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whole-body postures between lying and standing, from the legs' geometry alone.

Between the two the feet stay on the ground: at base height h a foot's centre is at z = r − h in
``base_link``. The stance has the feet below the hips. Near the ground a leg cannot fold far enough
for that, so the feet go outwards (abduction), and behind the hips where abduction does not
suffice, by as little as the fully folded leg needs.
"""

from __future__ import annotations

from math import asin, atan2, cos, hypot, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.transformation.leg import nominal_foothold

Array = NDArray[np.float64]

LIMIT_MARGIN = 0.08
"""Distance that goals keep from the joint limits [rad]."""


LARGEST_BEND = 2.65
"""Angle between thigh and shank beyond which a leg would fold into itself [rad]."""


def standing_posture(description: RobotDescription) -> Array:
    """Joint angles (12,) of the gait's stance: every foot at its nominal foothold [rad]."""
    return np.concatenate(
        [
            within_limits(leg, LegKinematics(leg).inverse(nominal_foothold(description, leg.name)))
            for leg in description.legs
        ]
    )


def lying_posture(description: RobotDescription) -> Array:
    """Joint angles (12,) of a robot on its belly, legs folded, soles at the ground [rad]."""
    return raised_posture(description, 0.0)


def raised_posture(description: RobotDescription, share: float) -> Array:
    """Joint angles on the way from lying to standing.

    The height rises linearly with the share, and the feet slide from beside the hips to their
    footholds mostly while the body is low and little loads them.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    share : float
        0: on the belly; 1: standing.

    Returns
    -------
    ndarray (12,)
        [rad]
    """
    low, high = lying_height(description), description.stance_height
    height = low + (high - low) * share
    angles = []
    for leg in description.legs:
        foot = nominal_foothold(description, leg.name)
        foot[:2] += (1.0 - share) ** 2 * (_lying_foot(leg, low) - foot)[:2]
        foot[2] = leg.foot_radius - height
        angles.append(within_limits(leg, LegKinematics(leg).inverse(foot)))
    return np.concatenate(angles)


def lying_height(description: RobotDescription) -> float:
    """Height of ``base_link`` when the robot lies on its belly [m]."""
    return description.belly_depth


def within_limits(leg: LegGeometry, angles: Array) -> Array:
    """Clip a leg's angles (3,) to its joint limits less ``LIMIT_MARGIN`` [rad]."""
    return np.clip(
        angles, leg.position_lower + LIMIT_MARGIN, leg.position_upper - LIMIT_MARGIN
    )


def folded_length(leg: LegGeometry) -> float:
    """Distance from hip joint to foot with the knee bent as far as its limits allow [m]."""
    kinematics = LegKinematics(leg)
    a, b = kinematics.thigh_length, kinematics.shank_length
    lengths = [sqrt(a * a + b * b + 2.0 * a * b * cos(LARGEST_BEND))]
    for knee in (leg.position_lower[2] + LIMIT_MARGIN, leg.position_upper[2] - LIMIT_MARGIN):
        turn = leg.axis_sign[2] * knee
        c, s = cos(turn), sin(turn)
        x = leg.thigh[0] + c * leg.shank[0] + s * leg.shank[2]
        z = leg.thigh[2] + c * leg.shank[2] - s * leg.shank[0]
        lengths.append(hypot(float(x), float(z)))
    return max(lengths[0], min(lengths[1:]))


def _lying_foot(leg: LegGeometry, height: float) -> Array:
    """Foot of a folded leg at the ground beside (or behind) its hip, in ``base_link``."""
    kinematics = LegKinematics(leg)
    side = 1.0 if kinematics.lateral_offset >= 0.0 else -1.0
    lateral, length = abs(kinematics.lateral_offset), folded_length(leg)
    down = length - float(leg.hip_offset[2])  # of the foot below the abduction axis, in the plane
    z = leg.foot_radius - height - float(leg.hip_in_base[2])
    radius = hypot(lateral, down)
    outward = atan2(down, lateral) + asin(min(max(z / radius, -1.0), 1.0))
    limit = min(abs(leg.position_lower[0]), abs(leg.position_upper[0])) - LIMIT_MARGIN
    behind = 0.0
    if outward > limit:
        outward = limit
        down = (lateral * sin(outward) - z) / cos(outward)
        reach = down + float(leg.hip_offset[2])
        behind = sqrt(max(length * length - reach * reach, 0.0))
    y = lateral * cos(outward) + down * sin(outward)
    x = float(leg.hip_in_base[0] + leg.hip_offset[0]) - behind
    return np.array((x, float(leg.hip_in_base[1]) + side * y, leg.foot_radius - height))


def leg_angles(leg: LegGeometry, outward: float, hip: float, bend: float) -> Array:
    """Joint angles of a leg by what they mean, within its limits.

    Parameters
    ----------
    leg : LegGeometry
        The leg.
    outward : float
        Abduction away from the middle of the body for a leg that hangs down [rad].
    hip : float
        How far the thigh is swung from straight down towards where the knee points [rad].
    bend : float
        Angle between the directions of thigh and shank; 0: straight [rad].

    Returns
    -------
    ndarray (3,)
        Abduction, hip, knee [rad].
    """
    side = 1.0 if LegKinematics(leg).lateral_offset >= 0.0 else -1.0
    thigh_zero = atan2(-float(leg.thigh[0]), -float(leg.thigh[2]))
    shank_zero = atan2(-float(leg.shank[0]), -float(leg.shank[2]))
    thigh = -leg.knee_sign * hip - thigh_zero  # about +y: the knee points against its bend
    shank = leg.knee_sign * bend - shank_zero + thigh_zero
    return within_limits(leg, leg.axis_sign * np.array((side * outward, thigh, shank)))
