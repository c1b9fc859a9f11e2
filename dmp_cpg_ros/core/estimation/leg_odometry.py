# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the feet tell: a velocity of the body from each that stands, and the ground's plane.

The centre of a round foot of radius ρ that rolls on a plane of normal n moves at ω_shank × ρ n,
and with the body's velocity v, its angular velocity ω and the shank's s relative to it,

    v + ω × p + J q̇ = (ω + s) × ρ n    ⟹    v + ω × (p − ρ n) = s × ρ n − J q̇ ,

all in the base frame. The left side is what the filter predicts, the right side is measured from
joints alone. Without the rolling term the velocity of Mini Cheetah's legs would be 8 % too small.
A soft foot rolls on a smaller ρ the more it carries: two that carry a trot sink in twice as far as
four that stand, and a ρ of standing tells up to 2 % more than the speed of heavy robots.

The ground is a least-squares plane through the newest foothold of every leg, followed slowly
(Gehring et al., "Dynamic trotting on slopes for quadrupedal robots", IROS 2015). Footholds are
kept in ``odom``: over one stride leg odometry drifts by millimetres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, exp, hypot, isfinite, sin
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.gait.contact_feedback import quarter_weight
from dmp_cpg_ros.core.maths import Array, clamped
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.maths.rotations import Quaternion, turned
from dmp_cpg_ros.core.maths.vec3 import (
    Matrix,
    Triple,
    cross,
    minus,
    rotation,
    times,
    transposed_times,
    triple,
)
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs


class FootMotion(NamedTuple):
    """Where the feet touch the ground, and the velocities that they measure; a tuple per leg.

    Attributes
    ----------
    contact_in_base : tuple of (float, float, float)
        Contact points r = p − ρ n [m].
    velocity_in_base : tuple of (float, float, float)
        s × ρ n − J q̇ [m/s]: v + ω × r of a body whose foot does not slide.
    jacobian_in_base : tuple of matrices
        Of the feet's centres [m/rad].
    """

    contact_in_base: tuple[Triple, ...]
    velocity_in_base: tuple[Triple, ...]
    jacobian_in_base: tuple[Matrix, ...]


class LegOdometry:
    """Kinematics of all legs of a robot.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    legs : RobotLegs, optional
        Its legs, where others ask them too.
    """

    def __init__(self, description: RobotDescription, legs: RobotLegs | None = None) -> None:
        """Build the legs."""
        self.legs = legs or RobotLegs(description)
        self._signs = [triple(leg.axis_sign.tolist()) for leg in description.legs]
        self._radius = [leg.foot_radius for leg in description.legs]
        self._rolling = [leg.rolling_radius for leg in description.legs]
        self._quarter_weight = quarter_weight(description)
        self._soft = any(self._rolling)

    def motion(self, q: Sequence[float], q_dot: Sequence[float], normal_in_base: Triple,
               force: Sequence[float] | None = None) -> FootMotion:
        """Contact points and measured velocities of all feet.

        Parameters
        ----------
        q, q_dot : sequence of 12 floats
            Joint angles [rad] and velocities [rad/s].
        normal_in_base : tuple of float
            Normal n of the ground, upwards.
        force : sequence of four floats, optional
            Normal forces on the feet [N]; a quarter of the weight where they are not known.

        Returns
        -------
        FootMotion
        """
        n_x, n_y, n_z = normal_in_base
        contacts, velocities, jacobians = [], [], []
        radii = self._rolling_on(force) if self._soft else self._radius
        for i, (place, J) in enumerate(self.legs.at(q)):
            radius, angles = radii[i], q[3 * i : 3 * i + 3]
            rates = triple(q_dot[3 * i : 3 * i + 3])
            down = (radius * n_x, radius * n_y, radius * n_z)
            shank = shank_rate(self._signs[i], angles, rates)
            contacts.append(minus(place, down))
            velocities.append(minus(cross(shank, down), times(J, rates)))
            jacobians.append(J)
        return FootMotion(tuple(contacts), tuple(velocities), tuple(jacobians))

    def _rolling_on(self, force: Sequence[float] | None) -> list[float]:
        """ρ of the feet under what they carry [m]."""
        radii, full = [], 4.0 * self._quarter_weight
        for i, (radius, rolling) in enumerate(zip(self._radius, self._rolling, strict=True)):
            if rolling is not None:
                carried = self._quarter_weight if force is None or not isfinite(force[i]) else (
                    clamped(force[i], 0.0, full))
                radius = max(0.0, rolling[0] + (rolling[1] - rolling[0])
                             * (carried / self._quarter_weight - 1.0))
            radii.append(radius)
        return radii


def shank_rate(sign: Sequence[float], angle: Sequence[float], rate: Sequence[float]) -> Triple:
    """Angular velocity of the shank relative to the base, in the base [rad/s].

    Parameters
    ----------
    sign : sequence of float
        The leg's ``axis_sign``.
    angle, rate : sequence of float
        Joint angles [rad] and velocities [rad/s] of the leg.
    """
    pitching = sign[1] * rate[1] + sign[2] * rate[2]
    abduction = sign[0] * angle[0]
    return sign[0] * rate[0], cos(abduction) * pitching, sin(abduction) * pitching


def turn_rate_of_feet(contact_in_base: Array, velocity_in_base: Array, trust: Array,
                      otherwise: Array) -> Array:
    """Angular velocity of a body from the feet, for when its gyroscope cannot be believed.

    Least squares of v + ω × r_i = m_i, whose deviations go with 1/trust, and of another guess of
    ω: two feet tell nothing of a turn about the line between them, and one nothing at all.

    Parameters
    ----------
    contact_in_base, velocity_in_base : ndarray (n, 3)
        r_i [m] and m_i [m/s].
    trust : ndarray (n,)
        In the feet, not all 0.
    otherwise : ndarray (3,)
        What it is as far as the feet do not tell [rad/s].

    Returns
    -------
    ndarray (3,)
        ω in the base [rad/s].
    """
    weight = trust * trust
    r = contact_in_base - weight @ contact_in_base / weight.sum()
    m = velocity_in_base - weight @ velocity_in_base / weight.sum()
    damping, squares = np.array(DAMPING), float(weight @ (r * r).sum(axis=1))
    normal = np.diag(squares + damping) - (weight[:, None] * r).T @ r
    return np.linalg.solve(normal, weight @ np.cross(r, m) + damping * otherwise)


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


DAMPING = (5e-3, 5e-3, 1e-4)
"""Variance of what a foot tells of a velocity over that of a guess of the turn rates [m²]:
(0.1 m/s / 1.4 rad/s)² of rolling and pitching, for a foot that has just come down still moves, and
is far from the line between those that carry.
"""

STEEPEST = 0.7
"""Largest slope that is believed; 35 degrees."""

STANDING = 0.5
"""Trust in a contact from which its place counts as a foothold."""

NARROWEST = 1e-3
"""Spread of the footholds, squared, below which they tell no slope [m^2]."""


@made_often
@dataclass(frozen=True)
class TerrainState:
    """Footholds and plane.

    Attributes
    ----------
    foothold_in_world : tuple of (float, float, float)
        Where each foot stood last [m].
    slope : tuple of float
        ∂z/∂x and ∂z/∂y of the plane in ``odom``.
    """

    foothold_in_world: tuple[Triple, ...]
    slope: tuple[float, float]


def terrain_step(terrain: TerrainState, contact_in_world: Sequence[Triple], trust: Sequence[float],
                 dt: float, time_constant: float) -> TerrainState:
    """Take over new footholds and follow their plane.

    Parameters
    ----------
    terrain : TerrainState
        State one tick before.
    contact_in_world : sequence of four tuples of float
        Contact points now, of swinging feet too [m].
    trust : sequence of four floats
        How well each foot stands, in [0, 1].
    dt : float
        Time since the last tick [s].
    time_constant : float
        Of the low-pass [s].

    Returns
    -------
    TerrainState
    """
    footholds = tuple([contact_in_world[i] if stands >= STANDING else terrain.foothold_in_world[i]
                       for i, stands in enumerate(trust)])
    share = 1.0 - exp(-dt / time_constant)
    (x, y), (x_now, y_now) = terrain.slope, fitted_slope(footholds)
    return TerrainState(footholds, (x + share * (x_now - x), y + share * (y_now - y)))


def fitted_slope(points: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Slope of the least-squares plane z = a₀ + a₁ x + a₂ y through points x, y, z.

    Directions in which the points do not spread get no slope; slopes beyond ``STEEPEST`` are cut.
    """
    xs, ys, zs = zip(*points, strict=True)
    count = len(points)
    x_mean, y_mean, z_mean = sum(xs) / count, sum(ys) / count, sum(zs) / count
    xx, yy, xy, xz, yz = NARROWEST, NARROWEST, 0.0, 0.0, 0.0
    for x, y, z in points:
        x, y, z = x - x_mean, y - y_mean, z - z_mean
        xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
        yy, yz = yy + y * y, yz + y * z
    determinant = xx * yy - xy * xy
    if not determinant > 0.0:  # numbers so large that nothing is left of their differences
        return 0.0, 0.0
    a, b = (yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant
    scale = min(1.0, STEEPEST / max(hypot(a, b), 1e-12))
    return a * scale, b * scale


def levelled_by_feet(quaternion: Quaternion, terrain: TerrainState, share: float) -> Quaternion:
    """Orientation turned by a share of the angle by which the newest footholds seem to leave the
    plane: with a vertical that is only integrated, on ground that goes on as it was, it is the
    body's own that has drifted.

    Parameters
    ----------
    quaternion : tuple of four floats
        x, y, z, w.
    terrain : TerrainState
        Footholds, and the slope that is believed.
    share : float
        Of the angle.

    Returns
    -------
    tuple of four floats
    """
    (x, y), (x_now, y_now) = terrain.slope, fitted_slope(terrain.foothold_in_world)
    turn = transposed_times(rotation(quaternion),
                            (share * (y - y_now), share * (x_now - x), 0.0))
    return turned(quaternion, turn)


def normal_in_world(slope: tuple[float, float]) -> Triple:
    """Unit normal, upwards, of a plane with a slope."""
    a, b = slope
    length = (1.0 + a * a + b * b) ** 0.5
    return -a / length, -b / length, 1.0 / length
