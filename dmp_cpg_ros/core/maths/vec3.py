# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Vectors and matrices of three as tuples of floats, for code that runs at every tick.

NumPy needs about a microsecond for any operation on three numbers, plain floats a tenth of that.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import sqrt

Triple = tuple[float, float, float]
"""A vector."""

Pair = tuple[float, float]
"""A horizontal vector."""

Matrix = tuple[Triple, Triple, Triple]
"""A matrix (3, 3), by rows."""


def triple(values: Iterable[float]) -> Triple:
    """Vector of three numbers, such as those of ``array.tolist()``."""
    x, y, z = values
    return x, y, z


def pair(values: Iterable[float]) -> Pair:
    """As :func:`triple` for two numbers."""
    x, y = values
    return x, y


def plus(a: Triple, b: Triple) -> Triple:
    """Sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a: Triple, b: Triple) -> Triple:
    """Difference a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def moved(a: Triple, rate: Triple, time: float) -> Triple:
    """Where a is after a time: a + rate · time."""
    return a[0] + rate[0] * time, a[1] + rate[1] * time, a[2] + rate[2] * time


def dot(a: Triple, b: Triple) -> float:
    """Scalar product a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Triple, b: Triple) -> Triple:
    """Vector product a × b."""
    ax, ay, az = a
    bx, by, bz = b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def times(M: Matrix, v: Triple) -> Triple:
    """Product M v."""
    (a, b, c), (d, e, f), (g, h, i) = M
    x, y, z = v
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def transposed_times(M: Matrix, v: Triple) -> Triple:
    """Product Mᵀ v."""
    (a, b, c), (d, e, f), (g, h, i) = M
    x, y, z = v
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z


def inverse(M: Matrix) -> Matrix:
    """Inverse by cofactors; raises ZeroDivisionError for a matrix that is plainly singular."""
    (a, b, c), (d, e, f), (g, h, i) = M
    A, B, C = e * i - f * h, f * g - d * i, d * h - e * g
    scale = 1.0 / (a * A + b * B + c * C)
    return (
        (A * scale, (c * h - b * i) * scale, (b * f - c * e) * scale),
        (B * scale, (a * i - c * g) * scale, (c * d - a * f) * scale),
        (C * scale, (b * g - a * h) * scale, (a * e - b * d) * scale))


def rotation(quaternion: Sequence[float]) -> Matrix:
    """Rotation matrix of a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)))


def upward(quaternion: Sequence[float]) -> Triple:
    """Third row of :func:`rotation`: the world's z axis seen in the body."""
    x, y, z, w = quaternion
    return 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)


def heading_frame(z_in_base: Triple) -> Matrix:
    """Rotation from the base to the frame of the base's heading with a given z axis."""
    x, y, z = z_in_base
    forward_x, forward_y, forward_z = 1.0 - x * x, -x * y, -x * z
    length = sqrt(forward_x * forward_x + forward_y * forward_y + forward_z * forward_z) + 1e-12
    forward = (forward_x / length, forward_y / length, forward_z / length)
    return forward, cross(z_in_base, forward), z_in_base


def damped_solution(J: Matrix, velocity: Triple) -> Triple:
    """q̇ [rad/s], three numbers, of J q̇ = v by Cramer's rule, with J (3, 3) [m] and v [m/s]; damped
    near singular matrices.
    """
    (a, b, c), (d, e, f), (g, h, i) = J
    x, y, z = velocity
    minor_0, minor_1, minor_2 = e * i - f * h, f * g - d * i, d * h - e * g
    determinant = a * minor_0 + b * minor_1 + c * minor_2
    inverse = determinant / (determinant * determinant + 1e-12)
    return (
        (x * minor_0 + b * (f * z - y * i) + c * (y * h - e * z)) * inverse,
        (a * (y * i - f * z) + x * minor_1 + c * (d * z - y * g)) * inverse,
        (a * (e * z - y * h) + b * (y * g - d * z) + x * minor_2) * inverse)
