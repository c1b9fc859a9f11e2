# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Kinematics of an abduction-hip-knee leg: forward, Jacobian, inverse, all in closed form.

    p = Rx(s₀ q₀) (o + Ry(s₁ q₁) (t + Ry(s₂ q₂) c)),    foot_in_base = hip_in_base + p

with o, t, c the offsets of :class:`~dmp_cpg_ros.core.robot_model.description.LegGeometry`. Plain
floats instead of arrays: each function runs for every leg at every tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, atan2, cos, hypot, pi, sin, sqrt, tau

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.maths import clamped
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, triple
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.state import Array


class LegKinematics:
    """Kinematics of one leg.

    Parameters
    ----------
    geometry : LegGeometry
        The leg.

    Attributes
    ----------
    lateral_offset : float
        Sideways distance from the abduction axis to the leg's plane [m], positive to the left.
    thigh_length, shank_length : float
        In the leg's plane [m].
    """

    def __init__(self, geometry: LegGeometry) -> None:
        """Reduce the geometry to a planar two-link chain that is swung about x."""
        self.geometry = geometry
        self._hip, self._o, self._t, self._c, self._s = (
            triple([float(value) for value in vector])
            for vector in (geometry.hip_in_base, geometry.hip_offset, geometry.thigh,
                           geometry.shank, geometry.axis_sign))
        self.lateral_offset = self._o[1] + self._t[1] + self._c[1]
        self.thigh_length = hypot(self._t[0], self._t[2])
        self.shank_length = hypot(self._c[0], self._c[2])
        self._thigh_angle = atan2(-self._t[0], -self._t[2])  # about +y, from straight down
        self._shank_angle = atan2(-self._c[0], -self._c[2])
        self._chain_of = (*self._s, self._t[0], self._t[2], self._c[0], self._c[2],
                          self._o[0], self._o[2], self.lateral_offset)
        self._reach = (abs(self.thigh_length - self.shank_length) + 1e-3,
                       self.thigh_length + self.shank_length - 1e-3)

    def foot_in_base(self, q: Array | Sequence[float]) -> Array:
        """Position of the foot's centre.

        Parameters
        ----------
        q : array_like (3,)
            Abduction, hip, knee [rad].

        Returns
        -------
        ndarray (3,)
            In ``base_link`` [m].
        """
        return np.array(self.foot(q))

    def foot(self, q: Array | Sequence[float]) -> Triple:
        """:meth:`foot_in_base` as a tuple."""
        return self._foot(self._chain(q))

    def jacobian_in_base(self, q: Array | Sequence[float]) -> Array:
        """Jacobian of :meth:`foot_in_base`.

        Returns
        -------
        ndarray (3, 3)
            ∂ foot_in_base / ∂ q [m/rad].
        """
        return np.array(self.jacobian(q))

    def jacobian(self, q: Array | Sequence[float]) -> Matrix:
        """:meth:`jacobian_in_base` as a tuple."""
        return self._jacobian(self._chain(q))

    def foot_and_jacobian(self, q: Array | Sequence[float]) -> tuple[Triple, Matrix]:
        """:meth:`foot_in_base` and :meth:`jacobian_in_base` for the price of one, as tuples."""
        chain = self._chain(q)
        return self._foot(chain), self._jacobian(chain)

    def _foot(self, chain: tuple[float, ...]) -> Triple:
        hip_x, hip_y, hip_z = self._hip
        return hip_x + chain[0], hip_y + chain[1], hip_z + chain[2]

    def _jacobian(self, chain: tuple[float, ...]) -> Matrix:
        _, y, z, reach_x, reach_z, shank_x, shank_z, s0, c0 = chain
        sign_0, sign_1, sign_2 = self._s
        return ((0.0, sign_1 * reach_z, sign_2 * shank_z),
                (-sign_0 * z, sign_1 * s0 * reach_x, sign_2 * s0 * shank_x),
                (sign_0 * y, -sign_1 * c0 * reach_x, -sign_2 * c0 * shank_x))

    def inverse(self, foot_in_base: ArrayLike) -> Array:
        """Joint angles that bring the foot to a point; a point out of reach is brought to the
        nearest reach.

        The solution bends the knee the way of ``geometry.knee_sign`` with the foot below the hip.

        Parameters
        ----------
        foot_in_base : array_like (3,)
            [m]

        Returns
        -------
        ndarray (3,)
            Abduction, hip, knee [rad].
        """
        return np.array(self.angles(triple(np.asarray(foot_in_base, dtype=float).tolist())))

    def angles(self, foot_in_base: Triple) -> Triple:
        """:meth:`inverse` for and as a tuple."""
        (px, py, pz), (hip_x, hip_y, hip_z), (o_x, _, o_z) = foot_in_base, self._hip, self._o
        (shortest, longest), (sign_0, sign_1, sign_2) = self._reach, self._s
        px, py, pz, beside = px - hip_x, py - hip_y, pz - hip_z, self.lateral_offset
        squared = py * py + pz * pz - beside * beside
        depth = -sqrt(1e-8 if squared < 1e-8 else squared)
        q0 = atan2(pz, py) - atan2(depth, beside)
        x, z = px - o_x, depth - o_z
        length = clamped(hypot(x, z), shortest, longest)
        a, b = self.thigh_length, self.shank_length
        bend = acos(clamped((length * length - a * a - b * b) / (2.0 * a * b), -1.0, 1.0))
        knee = self.geometry.knee_sign * bend
        hip = atan2(-x, -z) - atan2(b * sin(knee), a + b * cos(knee))
        return (sign_0 * _wrapped(q0), sign_1 * _wrapped(hip - self._thigh_angle),
                sign_2 * _wrapped(knee - self._shank_angle + self._thigh_angle))

    def _chain(self, q: Array | Sequence[float]) -> tuple[float, ...]:
        q0, q1, q2 = q
        sign_0, sign_1, sign_2, t_x, t_z, c_x, c_z, o_x, o_z, plane_y = self._chain_of
        s0, c0 = sin(sign_0 * q0), cos(sign_0 * q0)
        angle_1 = sign_1 * q1
        s1, c1 = sin(angle_1), cos(angle_1)
        angle_2 = angle_1 + sign_2 * q2
        s2, c2 = sin(angle_2), cos(angle_2)
        shank_x, shank_z = c2 * c_x + s2 * c_z, c2 * c_z - s2 * c_x
        reach_x, reach_z = c1 * t_x + s1 * t_z + shank_x, c1 * t_z - s1 * t_x + shank_z
        plane_z = o_z + reach_z
        return (o_x + reach_x, c0 * plane_y - s0 * plane_z, s0 * plane_y + c0 * plane_z,
                reach_x, reach_z, shank_x, shank_z, s0, c0)


def _wrapped(angle: float) -> float:
    return (angle + pi) % tau - pi


class RobotLegs:
    """Feet and Jacobians of all legs of a robot; those of the last joint angles are kept.

    Estimator, sense of the body, posture controller and legs ask for the same measured angles in
    turn, so they share one of these.

    Parameters
    ----------
    description : RobotDescription
        The robot.

    Attributes
    ----------
    kinematics : list of LegKinematics
        Of each leg.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Build the legs."""
        self.kinematics = [LegKinematics(leg) for leg in description.legs]
        self._at: list[float] = []
        self._found: tuple[tuple[Triple, Matrix], ...] = ()

    def at(self, q: Sequence[float]) -> tuple[tuple[Triple, Matrix], ...]:
        """Foot in the base and Jacobian of each leg, as tuples.

        Parameters
        ----------
        q : sequence of 12 floats
            Joint angles [rad].

        Returns
        -------
        tuple of (foot_in_base, jacobian_in_base)
            As of :meth:`~dmp_cpg_ros.core.robot_model.kinematics.LegKinematics.foot_and_jacobian`.
        """
        if q != self._at:
            self._at = list(q)
            self._found = tuple([leg.foot_and_jacobian(q[3 * i:3 * i + 3])
                                 for i, leg in enumerate(self.kinematics)])
        return self._found

    def foot(self, i: int, q: Sequence[float]) -> Triple:
        """Foot of leg ``i`` in the base at its three joint angles [rad], as of :meth:`at`."""
        known = q == self._at[3 * i:3 * i + 3]
        return self._found[i][0] if known else self.kinematics[i].foot(q)
