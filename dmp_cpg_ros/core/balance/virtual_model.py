# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Virtual model of the body: springs and dampers that hold it at its height, level, and at speed.

    f = m (a_ref + g u),    M = I (−k_a (roll, pitch) − b_a ω,  b_ψ (γ_ref − ω_z))

(Pratt et al. 2001; Ajallooeian et al. 2013, as the paper's experiment), in the frame of the
ground, where u is the direction away from gravity.
"""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.balance.parameters import PostureParameters
from dmp_cpg_ros.core.gait.com_height import LEVEL, Bounce
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, triple
from dmp_cpg_ros.core.robot_model.description import RobotDescription


@dataclass(frozen=True)
class BodyMotion:
    """What the virtual model takes of the body, in the frame of the ground.

    Attributes
    ----------
    R_ground_base : tuple of rows
        The third holds the tilt against the ground.
    upward_in_ground : tuple of float
        Direction away from gravity; (0, 0, 1) on level ground.
    velocity, rate : tuple of float
        Linear [m/s] and angular [rad/s].
    height : float
        Of the centre of mass over the stance feet's ground [m].
    """

    R_ground_base: Matrix
    upward_in_ground: Triple
    velocity: Triple
    rate: Triple
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
        self._inertia = triple(description.base_inertia.diagonal().tolist())
        self.height = description.stance_height + float(description.com_in_base[2])

    def wrench(
        self, p: PostureParameters, body: BodyMotion, r: Triple, bounce: Bounce = LEVEL,
        sway_acceleration: float = 0.0,
    ) -> tuple[Triple, Triple]:
        """Force [N] and moment [N m] about the centre of mass in the frame of the ground.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        body : BodyMotion
            The body.
        r : tuple of float
            Reference v_x, v_y [m/s], γ [rad/s].
        bounce : Bounce
            Planned motion along the normal of the ground.
        sway_acceleration : float
            Planned acceleration across the way [m/s^2].

        Returns
        -------
        force, moment : tuple of float
        """
        rate, squared = self._rate, self._rate * self._rate
        z_x, z_y, _ = body.R_ground_base[2]
        roll, pitch = z_y, -z_x  # for small angles
        push = rate * p.velocity_gain
        lift = (
            squared * p.height_stiffness * (self.height + bounce.height - body.height)
            + rate * p.height_damping * (bounce.velocity - body.velocity[2])
            + bounce.acceleration
        )
        stiffness, damping = squared * p.attitude_stiffness, rate * p.attitude_damping
        mass, (up_x, up_y, up_z) = self._mass, body.upward_in_ground
        i_x, i_y, i_z = self._inertia
        return (
            (
                mass * (push * (r[0] - body.velocity[0]) + GRAVITY * up_x),
                mass * (push * (r[1] - body.velocity[1]) + sway_acceleration + GRAVITY * up_y),
                mass * (lift + GRAVITY * up_z),
            ),
            (
                -i_x * (stiffness * roll + damping * body.rate[0]),
                -i_y * (stiffness * pitch + damping * body.rate[1]),
                i_z * rate * p.yaw_rate_gain * (r[2] - body.rate[2]),
            ),
        )
