# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the body is, from orientation, joint angles and joint torques alone; and how to carry it."""

from __future__ import annotations

from dataclasses import dataclass
from math import acos

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.gait import GRAVITY
from dmp_cpg_ros.core.leg_kinematics import LegKinematics
from dmp_cpg_ros.core.robot_description import RobotDescription
from dmp_cpg_ros.core.robot_state import RobotState

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BodyCondition:
    """Condition of the body at one tick.

    Attributes
    ----------
    down_in_base : ndarray (3,)
        Direction of gravity seen in ``base_link``; (0, 0, −1) when level.
    tilt : float
        Angle between the base's z and the vertical [rad].
    height : float
        Height of ``base_link`` over the sole of the lowest foot [m].
    support : float
        Share of the weight that the feet carry, by the joint torques or by the contact sensors,
        whichever say more.
    """

    down_in_base: Array
    tilt: float
    height: float
    support: float


class BodySense:
    """Reads the condition of one robot's body.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Prepare the legs."""
        self._legs = [LegKinematics(leg) for leg in description.legs]
        self._radius = np.array([leg.foot_radius for leg in description.legs])
        self._com_in_base = description.com_in_base
        self._weight = description.mass * GRAVITY
        self._limit = np.concatenate([leg.torque_limit for leg in description.legs])

    def condition(self, state: RobotState) -> BodyCondition:
        """Condition in a measured state.

        Forces are those of statics, f = −J⁻ᵀ τ at each foot, damped near singular postures.
        """
        x, y, z, w = state.base_quaternion.tolist()
        down = np.array(
            (2.0 * (w * y - x * z), -2.0 * (y * z + w * x), 2.0 * (x * x + y * y) - 1.0)
        )
        q = state.joint_position.reshape(4, 3).tolist()
        feet = np.array([leg.foot_in_base(a) for leg, a in zip(self._legs, q, strict=True)])
        J = self._jacobians(q)
        tau = state.joint_effort.reshape(4, 3, 1)
        J_T = J.transpose(0, 2, 1)
        damped = J @ J_T + 1e-4 * np.eye(3)
        forces = -np.linalg.solve(damped, J @ tau)[:, :, 0]
        pressed = float(np.maximum(-(forces @ down), 0.0).sum())
        return BodyCondition(
            down,
            acos(min(max(-float(down[2]), -1.0), 1.0)),
            float((feet @ down + self._radius).max()),
            max(pressed, float(state.foot_force.sum())) / self._weight,
        )

    def carrying_torque(self, state: RobotState, share: float) -> Array:
        """Joint torques (12,) with which the feet carry a share of the weight [N m].

        Vertical forces of least norm without a moment about the centre of mass, none of them
        pulling.
        """
        if share <= 0.0:
            return np.zeros(12)
        x, y, z, w = state.base_quaternion.tolist()
        up = np.array(
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        )
        q = state.joint_position.reshape(4, 3).tolist()
        feet = np.array([leg.foot_in_base(a) for leg, a in zip(self._legs, q, strict=True)])
        arms = feet - self._com_in_base
        arms -= np.outer(arms @ up, up)
        balance = np.concatenate((np.ones((1, 4)), arms.T))
        normal = balance @ balance.T + 1e-9 * np.eye(4)
        wanted = np.array((share * self._weight, 0.0, 0.0, 0.0))
        force = np.clip(balance.T @ np.linalg.solve(normal, wanted), 0.0, self._weight)
        torque = -np.einsum('lij,i,l->lj', self._jacobians(q), up, force).ravel()
        return np.asarray(np.clip(torque, -self._limit, self._limit))

    def _jacobians(self, q: list[list[float]]) -> Array:
        return np.array([leg.jacobian_in_base(a) for leg, a in zip(self._legs, q, strict=True)])
