# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the body is, from orientation, joint angles and joint torques alone; and how to carry it."""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, inf

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.legs import RobotLegs
from dmp_cpg_ros.core.robot_model.state import RobotState

Array = NDArray[np.float64]

CERTAIN_SUPPORT = 0.5
"""Share of the weight on the contact sensors from which the joint torques need not be asked."""


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
        Share of the weight that the feet carry, by the contact sensors, or by the joint torques
        where these say more and the sensors little.
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
    legs : RobotLegs, optional
        Its legs, where others ask them too.
    """

    def __init__(self, description: RobotDescription, legs: RobotLegs | None = None) -> None:
        """Prepare the legs."""
        self._legs = legs or RobotLegs(description)
        self._radius = [leg.foot_radius for leg in description.legs]
        self._com_in_base = description.com_in_base
        self._weight = description.mass * GRAVITY
        self._limit = np.concatenate([leg.torque_limit for leg in description.legs])

    def condition(self, state: RobotState) -> BodyCondition:
        """Condition in a measured state."""
        x, y, z, w = state.base_quaternion.tolist()
        down_x, down_y = 2.0 * (w * y - x * z), -2.0 * (y * z + w * x)
        down_z = 2.0 * (x * x + y * y) - 1.0
        legs, height = self._legs.at(state.joint_position.tolist()), -inf
        for ((foot_x, foot_y, foot_z), _), radius in zip(legs, self._radius, strict=True):
            height = max(height, down_x * foot_x + down_y * foot_y + down_z * foot_z + radius)
        down = np.array((down_x, down_y, down_z))
        support = sum(state.foot_force.tolist()) / self._weight
        if support < CERTAIN_SUPPORT:
            support = max(support, self._pressed(state, down))
        return BodyCondition(down, acos(min(max(-down_z, -1.0), 1.0)), height, support)

    def _pressed(self, state: RobotState, down: Array) -> float:
        """Share of the weight that the joint torques press onto the ground.

        Forces are those of statics, f = −J⁻ᵀ τ at each foot, damped near singular postures.
        """
        J = self._jacobians(state)
        tau = state.joint_effort.reshape(4, 3, 1)
        damped = J @ J.transpose(0, 2, 1) + 1e-4 * np.eye(3)
        forces = -np.linalg.solve(damped, J @ tau)[:, :, 0]
        return float(np.maximum(-(forces @ down), 0.0).sum()) / self._weight

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
        feet = np.array([foot for foot, _ in self._legs.at(state.joint_position.tolist())])
        arms = feet - self._com_in_base
        arms -= np.outer(arms @ up, up)
        balance = np.concatenate((np.ones((1, 4)), arms.T))
        normal = balance @ balance.T + 1e-9 * np.eye(4)
        wanted = np.array((share * self._weight, 0.0, 0.0, 0.0))
        force = np.clip(balance.T @ np.linalg.solve(normal, wanted), 0.0, self._weight)
        torque = -np.einsum('lij,i,l->lj', self._jacobians(state), up, force).ravel()
        return np.asarray(np.clip(torque, -self._limit, self._limit))

    def _jacobians(self, state: RobotState) -> Array:
        return np.array([J for _, J in self._legs.at(state.joint_position.tolist())])
