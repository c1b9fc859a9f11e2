# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The levelled frame: at the base, with its heading, z up."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, cross, upward


def level_from_base(quaternion: Sequence[float]) -> Matrix:
    """Rotation from ``base_link`` to a frame of the same heading with z up.

    Parameters
    ----------
    quaternion : sequence of four floats
        Orientation of ``base_link`` in ``odom``, x, y, z, w.

    Returns
    -------
    tuple of rows
        R_level_base.
    """
    return frame_of(upward(quaternion))


def frame_of(z_in_base: Triple) -> Matrix:
    """Rotation from the base to the frame of a z axis with the base's heading."""
    x, y, z = z_in_base
    forward_x, forward_y, forward_z = 1.0 - x * x, -x * y, -x * z
    length = sqrt(forward_x * forward_x + forward_y * forward_y + forward_z * forward_z) + 1e-12
    forward = (forward_x / length, forward_y / length, forward_z / length)
    return forward, cross(z_in_base, forward), z_in_base
