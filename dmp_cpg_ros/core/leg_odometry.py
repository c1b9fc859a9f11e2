# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What standing legs tell about the motion of the body: one velocity per foot.

The centre of a round foot of radius ρ that rolls on a plane of normal n moves at ω_shank × ρ n,
and with the body's velocity v, its angular velocity ω and the shank's s relative to it,

    v + ω × p + J q̇ = (ω + s) × ρ n    ⟹    v + ω × (p − ρ n) = s × ρ n − J q̇ ,

all in the base frame. The left side is what the filter predicts, the right side is measured from
joints alone. Without the rolling term the velocity of Mini Cheetah's legs would be 8 % too small.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.leg_kinematics import LegKinematics
from dmp_cpg_ros.core.robot_description import RobotDescription

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FootMotion:
    """Where the feet touch the ground, and the velocities that they measure.

    Attributes
    ----------
    contact_in_base : ndarray (4, 3)
        Contact points r = p − ρ n [m].
    velocity_in_base : ndarray (4, 3)
        s × ρ n − J q̇ [m/s]: v + ω × r of a body whose foot does not slide.
    jacobian_in_base : ndarray (4, 3, 3)
        Of the feet's centres [m/rad].
    """

    contact_in_base: Array
    velocity_in_base: Array
    jacobian_in_base: Array


class LegOdometry:
    """Kinematics of all legs of a robot.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Build the legs."""
        self.kinematics = [LegKinematics(leg) for leg in description.legs]
        self._signs = [tuple(leg.axis_sign.tolist()) for leg in description.legs]
        self._radius = np.array([[leg.foot_radius] for leg in description.legs])

    def motion(self, q: Array, q_dot: Array, normal_in_base: Array) -> FootMotion:
        """Contact points and measured velocities of all feet.

        Parameters
        ----------
        q, q_dot : ndarray (12,)
            Joint angles [rad] and velocities [rad/s].
        normal_in_base : ndarray (3,)
            Normal n of the ground, upwards.

        Returns
        -------
        FootMotion
        """
        angles, rates = q.reshape(4, 3).tolist(), q_dot.reshape(4, 3).tolist()
        chains = [
            leg.foot_and_jacobian(angle)
            for leg, angle in zip(self.kinematics, angles, strict=True)
        ]
        feet, J = np.array([foot for foot, _ in chains]), np.array([leg for _, leg in chains])
        shank = np.array(
            [
                shank_rate(sign, angle, rate)
                for sign, angle, rate in zip(self._signs, angles, rates, strict=True)
            ]
        )
        radius = self._radius * normal_in_base
        moving = (J @ q_dot.reshape(4, 3, 1))[:, :, 0]
        rolling = np.empty((4, 3))
        rolling[:, 0] = shank[:, 1] * radius[:, 2] - shank[:, 2] * radius[:, 1]
        rolling[:, 1] = shank[:, 2] * radius[:, 0] - shank[:, 0] * radius[:, 2]
        rolling[:, 2] = shank[:, 0] * radius[:, 1] - shank[:, 1] * radius[:, 0]
        return FootMotion(feet - radius, rolling - moving, J)


def shank_rate(
    sign: tuple[float, ...], angle: list[float], rate: list[float]
) -> tuple[float, float, float]:
    """Angular velocity of the shank relative to the base, in the base [rad/s].

    Parameters
    ----------
    sign : tuple of float
        The leg's ``axis_sign``.
    angle, rate : list of float
        Joint angles [rad] and velocities [rad/s] of the leg.
    """
    pitching = sign[1] * rate[1] + sign[2] * rate[2]
    abduction = sign[0] * angle[0]
    return sign[0] * rate[0], cos(abduction) * pitching, sin(abduction) * pitching


def turn_rate_of_feet(contact_in_base: Array, velocity_in_base: Array, trust: Array) -> Array:
    """Angular velocity of a body from the feet alone, for when its gyroscope is silent.

    Least squares of v + ω × r_i = m_i, weighted by the trust and slightly damped: two feet tell
    nothing of a turn about the line between them, and one tells nothing at all.

    Parameters
    ----------
    contact_in_base, velocity_in_base : ndarray (n, 3)
        r_i [m] and m_i [m/s].
    trust : ndarray (n,)
        Weights, not all 0.

    Returns
    -------
    ndarray (3,)
        ω in the base [rad/s].
    """
    weight = trust / trust.sum()
    r = contact_in_base - weight @ contact_in_base
    m = velocity_in_base - weight @ velocity_in_base
    squares = float(weight @ (r * r).sum(axis=1)) + 1e-4
    normal = squares * np.eye(3) - (weight[:, None] * r).T @ r
    return np.linalg.solve(normal, weight @ np.cross(r, m))


def force_from_torque(jacobian: Array, torque: Array, normal_in_base: Array) -> float:
    """Normal force on a foot from the joint torques alone, for when its sensor is silent.

    Statics: τ + Jᵀ f = 0 for a massless leg; weight and acceleration of the leg are left out.

    Parameters
    ----------
    jacobian : ndarray (3, 3)
        Of the foot's centre [m/rad].
    torque : ndarray (3,)
        Joint torques [N m].
    normal_in_base : ndarray (3,)
        Normal of the ground.

    Returns
    -------
    float
        [N]; 0 for a leg so straight that the torques do not tell.
    """
    if abs(float(np.linalg.det(jacobian))) < 1e-6:
        return 0.0
    return float(normal_in_base @ np.linalg.solve(jacobian.T, -torque))
