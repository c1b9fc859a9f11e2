# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far feet slid over the ground, from joint angles, body motion and contact forces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.motion import common_rows, rotations
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics

Array = NDArray[np.float64]


def foot_slip(recording: Recording, robot: RobotDescription, contact_force: float) -> Array | None:
    """Distance that each foot's contact point slid horizontally while it carried load.

    The contact point is the lowest point of the foot's sphere: a foot that rolls without sliding
    does not slip.

    Parameters
    ----------
    recording : Recording
        Needs joints, odometry and foot forces.
    robot : RobotDescription
        Leg geometry.
    contact_force : float
        Load from which a foot counts as standing [N].

    Returns
    -------
    ndarray (4,) or None
        [m]; None where a topic is missing.
    """
    joints, odometry, feet = recording.joints, recording.odometry, recording.feet
    rows = common_rows(joints.time, odometry.time, feet.time)
    if len(rows[0]) < 2:
        return None
    time = joints.time[rows[0]]
    R = rotations(odometry.quaternion[rows[1]])
    slips = []
    for i, leg in enumerate(robot.legs):
        q, q_dot = (
            series[rows[0], 3 * i : 3 * i + 3] for series in (joints.position, joints.velocity)
        )
        loaded = feet.force[rows[2], i] > contact_force
        foot = odometry.position_in_world[rows[1]] + np.einsum(
            'nij,nj->ni', R, feet_in_base(leg, q))
        rate = np.einsum(
            'nij,nj->ni', R, odometry.rate_in_base[rows[1]] + shank_rate_in_base(leg, q, q_dot))
        slips.append(_slid(time, foot[:, :2], rate, loaded, leg.foot_radius))
    return np.array(slips)


def feet_in_base(leg: LegGeometry, q: Array) -> Array:
    """Foot positions of a leg's joint angles: (n, 3) → (n, 3) [m]."""
    kinematics = LegKinematics(leg)
    return np.array([kinematics.foot_in_base(row) for row in q]).reshape(-1, 3)


def shank_rate_in_base(leg: LegGeometry, q: Array, q_dot: Array) -> Array:
    """Angular velocity of the shank relative to the base: (n, 3), (n, 3) → (n, 3) [rad/s]."""
    angle, sign = leg.axis_sign[0] * q[:, 0], leg.axis_sign
    pitching = sign[1] * q_dot[:, 1] + sign[2] * q_dot[:, 2]
    return np.stack(
        [sign[0] * q_dot[:, 0], np.cos(angle) * pitching, np.sin(angle) * pitching], axis=1
    )


def _slid(
    time: Array, foot_xy: Array, rate: Array, loaded: NDArray[np.bool_], radius: float
) -> float:
    rolling = radius * np.stack([rate[:, 1], -rate[:, 0]], axis=1)  # ω × (radius ẑ)
    rolled = 0.5 * (rolling[1:] + rolling[:-1]) * np.diff(time)[:, None]
    steps = np.hypot(*(np.diff(foot_xy, axis=0) - rolled).T)
    return float(steps[loaded[1:] & loaded[:-1]].sum())
