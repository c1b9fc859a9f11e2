# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Start poses of a simulated robot: standing at home, lying on its belly, or fallen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.modes.motion_library import lying_posture
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG

START_POSES = ('standing', 'lying', 'fallen')
"""Valid start poses."""

LYING_SETTLES_S = 0.3
FALLEN_SETTLES_S = 1.6
"""Time that the robot is given to come to rest on the ground before its clock starts [s]."""

UPRIGHT = np.array((1.0, 0.0, 0.0, 0.0))
"""Quaternion w, x, y, z of a level base."""

DROP_CLEARANCE = 0.05  # [m] over the ground of the lowest point that a fallen robot can have

TOLERANCE = 1e-6  # [m] of the foot's place


@dataclass(frozen=True)
class StartPose:
    """Where the robot is put, and how it comes to rest.

    Attributes
    ----------
    base_position : ndarray (3,)
        In ``world`` [m].
    base_quaternion : ndarray (4,)
        w, x, y, z, as MuJoCo has it.
    joint_position : ndarray (12,)
        [rad]
    limp : bool
        Whether the joints are only damped while it comes to rest, instead of holding.
    settling_s : float
        0 for a robot that is at rest where it is put [s].
    """

    base_position: Array
    base_quaternion: Array
    joint_position: Array
    limp: bool = False
    settling_s: float = 0.0


def start_pose_of(name: str, description: RobotDescription, seed: int) -> StartPose:
    """Return the pose of a name.

    Parameters
    ----------
    name : str
        ``lying`` or ``fallen``; ``standing`` is the robot's own business.
    description : RobotDescription
        The robot.
    seed : int
        Of a fall: any orientation and any joint angles within the limits, dropped and settled.

    Raises
    ------
    ParameterError
        If there is no such pose.
    """
    if name == 'lying':
        place = np.array((0.0, 0.0, description.belly_depth))
        return StartPose(place, UPRIGHT, lying_posture(description), False, LYING_SETTLES_S)
    if name == 'fallen':
        rng = np.random.default_rng(seed)
        quaternion = rng.normal(size=4)
        joints = np.concatenate(
            [rng.uniform(leg.position_lower, leg.position_upper) for leg in description.legs])
        reach = max(sum(float(np.linalg.norm(part)) for part in (
            leg.hip_in_base, leg.hip_offset, leg.thigh, leg.shank)) for leg in description.legs)
        return StartPose(np.array((0.0, 0.0, reach + DROP_CLEARANCE)),
                         quaternion / np.linalg.norm(quaternion), joints, True, FALLEN_SETTLES_S)
    raise ParameterError(f"start_pose = '{name}' must be one of {', '.join(START_POSES)}")


def home_joint_position(description: RobotDescription) -> Array:
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
    return np.concatenate([_home_of_leg(leg, description.stance_height)
                           for leg in description.legs])


def _home_of_leg(leg: LegGeometry, height: float) -> Array:
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
    for i, joint in enumerate(JOINTS_OF_LEG):
        low, high = leg.position_lower[i], leg.position_upper[i]
        if not low <= angles[i] <= high:
            raise ParameterError(
                f'leg {leg.name}: standing at {height:g} m needs {angles[i]:.3f} rad at the '
                f'{joint}, its limits are {low:.3f} to {high:.3f} rad')
    return angles
