# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Virtual model: springs and dampers on the body, and how the stance feet share their wrench.

    f = m (a_ref + g u),    M = I (−k_a (roll, pitch) − b_a ω,  b_ψ (γ_ref − ω_z))

(Pratt et al. 2001; Ajallooeian et al. 2013, as the paper's experiment), in the frame of the
ground, where u is the direction away from gravity.

The stance feet share this wrench within friction cones: weighted least squares (the minimum of
Σ|f_i|²/w_i that yields the wrench), then each force is brought into its cone: 0 ≤ f_z ≤ f_max and
|f_xy| ≤ μ f_z. The limits therefore always hold; the wrench is met where they allow it.

The minimum is f_i = w_i (λ + κ × p_i), with two multipliers λ and κ of the wrench. With
S = Σ w_i, the feet's mean c = Σ w_i p_i / S, a damping δ and the importance d of the moments, the
wrench (f, m) is met by

    (S + δ) λ + S κ × c = f ,    S c × λ + (Σ w_i (|p_i|² I − p_i p_iᵀ) + δ diag(d)⁻²) κ = m ,

of which λ is eliminated: three equations are left, with the feet's second moments about c.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

from dmp_cpg_ros.core.balance.parameters import PostureParameters
from dmp_cpg_ros.core.gait.com_height import LEVEL, Bounce
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, cross, inverse, times, triple
from dmp_cpg_ros.core.robot_model.description import RobotDescription

REGULARISATION = 1e-4
"""Damping of the least squares, relative to the mean of the weights; keeps one or two stance
feet well posed.
"""

EQUAL = (1.0, 1.0, 1.0)


class BodyMotion(NamedTuple):
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

    def wrench(self, p: PostureParameters, body: BodyMotion, r: Triple, bounce: Bounce = LEVEL,
               sway_acceleration: float = 0.0) -> tuple[Triple, Triple]:
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
            + bounce.acceleration)
        stiffness, damping = squared * p.attitude_stiffness, rate * p.attitude_damping
        mass, (up_x, up_y, up_z) = self._mass, body.upward_in_ground
        i_x, i_y, i_z = self._inertia
        return (
            (
                mass * (push * (r[0] - body.velocity[0]) + GRAVITY * up_x),
                mass * (push * (r[1] - body.velocity[1]) + sway_acceleration + GRAVITY * up_y),
                mass * (lift + GRAVITY * up_z)),
            (
                -i_x * (stiffness * roll + damping * body.rate[0]),
                -i_y * (stiffness * pitch + damping * body.rate[1]),
                i_z * rate * p.yaw_rate_gain * (r[2] - body.rate[2])))


def distribute(force: Triple, moment: Triple, feet: Sequence[Triple], load: Sequence[float],
               friction: float, largest: float, importance: Triple = EQUAL) -> list[Triple]:
    """Forces of the ground on the feet.

    Parameters
    ----------
    force, moment : tuple of float
        Wanted force [N] and moment about the centre of mass [N m], z up.
    feet : sequence of n tuples of float
        Feet relative to the centre of mass in the same frame [m].
    load : sequence of n floats
        Weight of each foot in [0, 1]; 0 takes no force.
    friction : float
        μ of the cones.
    largest : float
        Largest normal force of a fully loaded foot [N]; scaled by ``load``.
    importance : tuple of float, optional
        Weights of the moment's components relative to the force's, where not all of them can be
        met [1/m]: one or two feet cannot turn the body about the line through them but by a
        horizontal force.

    Returns
    -------
    list of n tuples of float
        f_i [N].
    """
    total = sum(load)
    if total <= 0.0:
        return [(0.0, 0.0, 0.0)] * len(feet)
    pull, turn = _multipliers(force, moment, feet, load, total, importance)
    (pull_x, pull_y, pull_z), forces = pull, []
    for foot, share in zip(feet, load, strict=True):
        x, y, z = cross(turn, foot)
        x, y, z = share * (pull_x + x), share * (pull_y + y), share * (pull_z + z)
        z = min(max(z, 0.0), largest * share)
        tangential, allowed = sqrt(x * x + y * y), friction * z
        if tangential > allowed:
            x, y = x * (allowed / tangential), y * (allowed / tangential)
        forces.append((x, y, z))
    return forces


def _multipliers(force: Triple, moment: Triple, feet: Sequence[Triple], load: Sequence[float],
                 total: float, importance: Triple) -> tuple[Triple, Triple]:
    """λ and κ of the module's text."""
    damping = REGULARISATION * max(total / len(feet), 1e-9)
    c_x = c_y = c_z = 0.0
    for (x, y, z), share in zip(feet, load, strict=True):
        c_x, c_y, c_z = c_x + share * x, c_y + share * y, c_z + share * z
    c_x, c_y, c_z = c_x / total, c_y / total, c_z / total
    # what damping leaves of the moments of c itself
    left = total * damping / (total + damping)
    xx, yy, zz = left * c_x * c_x, left * c_y * c_y, left * c_z * c_z
    xy, xz, yz = left * c_x * c_y, left * c_x * c_z, left * c_y * c_z
    for (x, y, z), share in zip(feet, load, strict=True):
        x, y, z = x - c_x, y - c_y, z - c_z
        xx, yy, zz = xx + share * x * x, yy + share * y * y, zz + share * z * z
        xy, xz, yz = xy + share * x * y, xz + share * x * z, yz + share * y * z
    d_x, d_y, d_z = importance
    a, b, c = damping / (d_x * d_x), damping / (d_y * d_y), damping / (d_z * d_z)
    spread = ((yy + zz + a, -xy, -xz), (-xy, xx + zz + b, -yz), (-xz, -yz, xx + yy + c))
    given = total / (total + damping)  # of the force's moment about the centre of mass
    x, y, z = cross((c_x, c_y, c_z), force)
    turn = times(
        inverse(spread), (moment[0] - given * x, moment[1] - given * y, moment[2] - given * z))
    x, y, z = cross(turn, (c_x, c_y, c_z))
    inertia = total + damping
    return (
        ((force[0] - total * x) / inertia, (force[1] - total * y) / inertia,
         (force[2] - total * z) / inertia),
        turn)
