# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Virtual model: springs and dampers on the body, how the stance feet share their wrench, and the
plan of the centre of mass.

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

In a gait that at times stands on one side only the body sways from side to side.

While all feet that stand are on one side, at y_s from the middle, the ground's force passes level
through the centre of mass only if it leans inward by y_s / h: the body must swing like the linear
inverted pendulum (Kajita, Kanehiro, Kaneko, Yokoi, Hirukawa 2001),

    ÿ = (g / h) (y − p) ,

with p = y_s there and 0 wherever feet on both sides can share the load. Of the periodic solution
the fundamental is taken: with p_1 that of p, at the gait's frequency ω,

    y_1 = p_1 (g / h) / (ω² + g / h) .

A side stands alone while both legs of the other one swing. For swings of 1 − β and legs that are Δ
cycles apart that is a share w = 1 − β − Δ of the cycle around the middle of the two swings, and
w' = 1 − β − (1 − Δ) half a cycle later, where these are positive, so that with c the place of that
middle

    p_1 = (2 / π) y_s (sin π w − sin π w') cos 2π c .

A trot, a walk, a bound and a pronk do not sway; an amble does a little, a pace much. A body that
was planned not to sway would take its sway for a push: it would place its feet as if to catch it,
and the wider they are the more force across they need, until friction does not yield that force
any more. Placement therefore answers what differs from the plan, standing feet go along with it,
and the forces accelerate the body as it says. They do not follow its velocity: a force that damps
the sway as well bears stronger pushes. Nor is there a plan for a body that goes sideways, which is
caught anyway by the feet that go ahead of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin, sqrt
from typing import NamedTuple

from dmp_cpg_ros.core.balance.parameters import PostureParameters
from dmp_cpg_ros.core.gait.com_height import LEVEL, Bounce
from dmp_cpg_ros.core.maths import clamped
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, cross, inverse, times, triple
from dmp_cpg_ros.core.robot_model.description import RobotDescription


class LateralPlan(NamedTuple):
    """Planned lateral motion of the centre of mass, about the middle.

    Attributes
    ----------
    place : float
        y [m].
    velocity : float
        ẏ [m/s].
    acceleration : float
        ÿ [m/s^2].
    """

    place: float
    velocity: float
    acceleration: float


SIDEWAYS = 0.3
"""Speed sideways from which no sway is planned, in √(g l)."""

STRAIGHT = LateralPlan(0.0, 0.0, 0.0)
"""Plan of a gait without single-side stance."""


def lateral_plan(cycle_position: Sequence[float], duty: float, omega: float,
                 across: Sequence[float], height: float) -> LateralPlan:
    """Lateral plan, from where its legs are in their cycles.

    Parameters
    ----------
    cycle_position : sequence of four floats
        0 at mid-swing, in [−1/2, 1/2].
    duty : float
        Duty factor β.
    omega : float
        Angular frequency of the gait [rad/s].
    across : sequence of four floats
        Footholds' places to the left of the middle [m].
    height : float
        Of the centre of mass [m].

    Returns
    -------
    LateralPlan
    """
    along = quadrature = 0.0
    (fl, fr, rl, rr), (y_fl, y_fr, y_rl, y_rr) = cycle_position, across
    for front, hind, standing in ((fr, rr, y_fl + y_rl), (fl, rl, y_fr + y_rr)):
        amplitude, middle = _both_swing(front, hind, 1.0 - duty)
        if amplitude != 0.0:
            amplitude *= 0.5 * standing
            along += amplitude * cos(2.0 * pi * middle)
            quadrature += amplitude * sin(2.0 * pi * middle)
    if along == quadrature == 0.0:
        return STRAIGHT
    pendulum = GRAVITY / height
    share = pendulum / (omega * omega + pendulum)
    y = share * along
    return LateralPlan(y, -omega * share * quadrature, -omega * omega * y)


def _both_swing(front: float, hind: float, swing: float) -> tuple[float, float]:
    """Amplitude of the fundamental of 'both legs of a side swing', and the place in the cycle of
    the middle of their swings.
    """
    apart = (front - hind + 0.5) % 1.0 - 0.5
    together = max(0.0, swing - abs(apart))
    opposite = max(0.0, swing - 1.0 + abs(apart))
    return 2.0 / pi * (sin(pi * together) - sin(pi * opposite)), hind + 0.5 * apart


def contact_weights(cycle_position: Sequence[float], duty: float, activity: Sequence[float],
                    transfer: float) -> list[float]:
    """Contact schedule weights: how much load each foot may take, a trapezoid over its stance.

    Parameters
    ----------
    cycle_position : sequence of n floats
        0 at mid-swing, in [−1/2, 1/2).
    duty : float
        Duty factor β.
    activity : sequence of n floats
        Swing activity; a leg that does not swing carries.
    transfer : float
        Fraction of the cycle over which a foot takes and gives load.

    Returns
    -------
    list of n floats
        In [0, 1].
    """
    lift_off, weights = 0.5 * (1.0 - duty), []
    for i, position in enumerate(cycle_position):
        planned = clamped((abs(position) - lift_off) / transfer, 0.0, 1.0)
        weights.append(max(planned, 1.0 - activity[i]))
    return weights


def ground_height(feet: Sequence[Triple], load: Sequence[float]) -> float:
    """Height of the feet that carry, by what they carry in shares; of the lowest where none does.

    Parameters
    ----------
    feet : sequence of n tuples of float
        Places [m].
    load : sequence of n floats
        As from :func:`contact_weights`.

    Returns
    -------
    float
        [m]
    """
    total = sum(load)
    if total <= 1e-6:
        return min([z for _, _, z in feet])
    return sum([share * feet[i][2] for i, share in enumerate(load)]) / total


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

    def push_rate(self, p: PostureParameters) -> float:
        """Force per mass and error of the horizontal velocity [1/s]."""
        return self._rate * p.velocity_gain

    def wrench(self, p: PostureParameters, body: BodyMotion, r: Triple, bounce: Bounce = LEVEL,
               acceleration: tuple[float, float] = (0.0, 0.0)) -> tuple[Triple, Triple]:
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
        acceleration : tuple of float
            Planned, along and across the way [m/s^2].

        Returns
        -------
        force, moment : tuple of float
        """
        rate, squared = self._rate, self._rate * self._rate
        z_x, z_y, _ = body.R_ground_base[2]
        roll, pitch = z_y, -z_x  # for small angles
        push = self.push_rate(p)
        lift = (
            squared * p.height_stiffness * (self.height + bounce.height - body.height)
            + rate * p.height_damping * (bounce.velocity - body.velocity[2])
            + bounce.acceleration)
        stiffness, damping = squared * p.attitude_stiffness, rate * p.attitude_damping
        mass, (up_x, up_y, up_z) = self._mass, body.upward_in_ground
        i_x, i_y, i_z = self._inertia
        return (
            (
                mass * (push * (r[0] - body.velocity[0]) + acceleration[0] + GRAVITY * up_x),
                mass * (push * (r[1] - body.velocity[1]) + acceleration[1] + GRAVITY * up_y),
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
    for i, foot in enumerate(feet):
        (x, y, z), share = cross(turn, foot), load[i]
        x, y, z = share * (pull_x + x), share * (pull_y + y), share * (pull_z + z)
        z = clamped(z, 0.0, largest * share)
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
    for i, (x, y, z) in enumerate(feet):
        share = load[i]
        c_x, c_y, c_z = c_x + share * x, c_y + share * y, c_z + share * z
    c_x, c_y, c_z = c_x / total, c_y / total, c_z / total
    inertia = total + damping
    # what damping leaves of the moments of c itself, and of the force's about the centre of mass
    left, given = total * damping / inertia, total / inertia
    xx, yy, zz = left * c_x * c_x, left * c_y * c_y, left * c_z * c_z
    xy, xz, yz = left * c_x * c_y, left * c_x * c_z, left * c_y * c_z
    for i, (x, y, z) in enumerate(feet):
        x, y, z, share = x - c_x, y - c_y, z - c_z, load[i]
        xx, yy, zz = xx + share * x * x, yy + share * y * y, zz + share * z * z
        xy, xz, yz = xy + share * x * y, xz + share * x * z, yz + share * y * z
    d_x, d_y, d_z = importance
    a, b, c = damping / (d_x * d_x), damping / (d_y * d_y), damping / (d_z * d_z)
    spread = ((yy + zz + a, -xy, -xz), (-xy, xx + zz + b, -yz), (-xz, -yz, xx + yy + c))
    x, y, z = cross((c_x, c_y, c_z), force)
    turn = times(
        inverse(spread), (moment[0] - given * x, moment[1] - given * y, moment[2] - given * z))
    x, y, z = cross(turn, (c_x, c_y, c_z))
    return (
        ((force[0] - total * x) / inertia, (force[1] - total * y) / inertia,
         (force[2] - total * z) / inertia),
        turn)
