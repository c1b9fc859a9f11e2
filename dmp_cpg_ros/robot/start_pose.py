# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How a simulated robot may be found: standing, lying on its belly, or fallen somehow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.modes.motion_library import lying_posture
from dmp_cpg_ros.core.robot_model.description import RobotDescription

Vector = NDArray[np.float64]

START_POSES = ('standing', 'lying', 'fallen')
"""Valid start poses."""

LYING_SETTLES_S = 0.3
FALLEN_SETTLES_S = 1.6
"""Time that the robot is given to come to rest on the ground before its clock starts [s]."""

DROP_CLEARANCE = 0.05  # [m] over the ground of the lowest point that a fallen robot can have


@dataclass(frozen=True)
class StartPose:
    """Where the robot is put, and how it comes to rest.

    Attributes
    ----------
    base_position : ndarray (3,)
        In ``odom`` [m].
    base_quaternion : ndarray (4,)
        w, x, y, z, as MuJoCo has it.
    joint_position : ndarray (12,)
        [rad]
    limp : bool
        Whether the joints are only damped while it comes to rest, instead of holding.
    settling_s : float
        [s]
    """

    base_position: Vector
    base_quaternion: Vector
    joint_position: Vector
    limp: bool
    settling_s: float


def start_pose(name: str, description: RobotDescription, seed: int) -> StartPose:
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
        upright = np.array((1.0, 0.0, 0.0, 0.0))
        return StartPose(place, upright, lying_posture(description), False, LYING_SETTLES_S)
    if name == 'fallen':
        rng = np.random.default_rng(seed)
        quaternion = rng.normal(size=4)
        joints = np.concatenate(
            [rng.uniform(leg.position_lower, leg.position_upper) for leg in description.legs]
        )
        hips = [np.linalg.norm(leg.hip_in_base) + np.linalg.norm(leg.hip_offset)
                + np.linalg.norm(leg.thigh) + np.linalg.norm(leg.shank)
                for leg in description.legs]
        place = np.array((0.0, 0.0, float(max(hips)) + DROP_CLEARANCE))
        quaternion /= np.linalg.norm(quaternion)
        return StartPose(place, quaternion, joints, True, FALLEN_SETTLES_S)
    raise ParameterError(f"start_pose = '{name}' must be one of {', '.join(START_POSES)}")
