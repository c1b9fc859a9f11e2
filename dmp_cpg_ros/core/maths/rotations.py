# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rotations as matrices and as quaternions x, y, z, w; plain floats where a tick needs them."""

from __future__ import annotations

from collections.abc import Iterable
from math import asin, atan2, cos, sin, sqrt

from dmp_cpg_ros.core.maths import Array

Quaternion = tuple[float, float, float, float]
"""Orientation x, y, z, w, of length 1."""


def turned(quaternion: Iterable[float], rotation_vector: Iterable[float]) -> Quaternion:
    """Turn a quaternion by a rotation vector in its own (the body's) frame: q ⊗ exp(φ/2).

    Parameters
    ----------
    quaternion : iterable of four floats
        Of length 1.
    rotation_vector : iterable of three floats
        φ, axis times angle [rad].

    Returns
    -------
    tuple of four floats
        Of length 1.
    """
    x, y, z, w = quaternion
    a, b, c = rotation_vector
    angle = sqrt(a * a + b * b + c * c)
    scale = sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    a, b, c, d = a * scale, b * scale, c * scale, cos(0.5 * angle)
    qx = w * a + x * d + y * c - z * b
    qy = w * b - x * c + y * d + z * a
    qz = w * c + x * b - y * a + z * d
    qw = w * d - x * a - y * b - z * c
    length = sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    return qx / length, qy / length, qz / length, qw / length


def roll_pitch_yaw(quaternion: Array) -> tuple[float, float, float]:
    """Angles about x, y, z in the order yaw, pitch, roll [rad]."""
    x, y, z, w = quaternion.tolist()
    roll = atan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    pitch = asin(min(max(2.0 * (w * y - x * z), -1.0), 1.0))
    yaw = atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw


def levelled(upward_in_base: Array) -> Quaternion:
    """Quaternion of zero heading whose vertical is seen in the base as a given direction.

    Parameters
    ----------
    upward_in_base : ndarray (3,)
        Any length but 0: the reading of an accelerometer at rest.

    Returns
    -------
    tuple of four floats
    """
    x, y, z = upward_in_base.tolist()
    roll, pitch = atan2(y, z), atan2(-x, sqrt(y * y + z * z))
    sr, cr, sp, cp = sin(0.5 * roll), cos(0.5 * roll), sin(0.5 * pitch), cos(0.5 * pitch)
    return sr * cp, cr * sp, -sr * sp, cr * cp
