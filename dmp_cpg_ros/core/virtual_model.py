# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Virtual model of the body: springs and dampers that hold it at its height, level, and at speed.

    f = m (a_ref + g u),    M = I (−k_a (roll, pitch) − b_a ω,  b_ψ (γ_ref − ω_z))

(Pratt et al. 2001; Ajallooeian et al. 2013, as the paper's experiment), in the frame of the
ground, where u is the direction away from gravity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.bounce import LEVEL, Bounce
from dmp_cpg_ros.core.gait import GRAVITY
from dmp_cpg_ros.core.posture_parameters import PostureParameters
from dmp_cpg_ros.core.robot_description import RobotDescription

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodyMotion:
    """What the virtual model takes of the body, in the frame of the ground.

    Attributes
    ----------
    R_ground_base : ndarray (3, 3)
        Its third row holds the tilt against the ground.
    upward_in_ground : ndarray (3,)
        Direction away from gravity; (0, 0, 1) on level ground.
    velocity, rate : ndarray (3,)
        Linear [m/s] and angular [rad/s].
    height : float
        Of the centre of mass over the stance feet's ground [m].
    """

    R_ground_base: Array
    upward_in_ground: Array
    velocity: Array
    rate: Array
    height: float


class VirtualModel:
    """Springs and dampers scaled by one robot's mass, inertia and leg length.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    leg_length : float
        Standing height of the hips [m].
    """

    def __init__(self, description: RobotDescription, leg_length: float) -> None:
        """Keep the scales."""
        self._mass, self._rate = description.mass, (GRAVITY / leg_length) ** 0.5
        self._inertia = np.diag(description.base_inertia).copy()
        self.height = description.stance_height + float(description.com_in_base[2])

    def wrench(
        self, p: PostureParameters, body: BodyMotion, r: Array, bounce: Bounce = LEVEL
    ) -> Array:
        """Force [N] and moment [N m] about the centre of mass in the frame of the ground.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        body : BodyMotion
            The body.
        r : ndarray (3,)
            Reference v_x, v_y [m/s], γ [rad/s].
        bounce : Bounce
            Planned motion along the normal of the ground.

        Returns
        -------
        ndarray (6,)
        """
        rate, squared = self._rate, self._rate * self._rate
        roll, pitch = body.R_ground_base[2, 1], -body.R_ground_base[2, 0]  # for small angles
        push = rate * p.velocity_gain * (r[:2] - body.velocity[:2])
        lift = (
            squared * p.height_stiffness * (self.height + bounce.height - body.height)
            + rate * p.height_damping * (bounce.velocity - body.velocity[2])
            + bounce.acceleration
        )
        turn = (
            -squared * p.attitude_stiffness * roll - rate * p.attitude_damping * body.rate[0],
            -squared * p.attitude_stiffness * pitch - rate * p.attitude_damping * body.rate[1],
            rate * p.yaw_rate_gain * (r[2] - body.rate[2]),
        )
        force = self._mass * (
            np.array((push[0], push[1], lift)) + GRAVITY * body.upward_in_ground
        )
        return np.concatenate([force, self._inertia * np.array(turn)])
