# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The levelled frame: at the base, with its heading, z up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def level_from_base(quaternion: Array) -> Array:
    """Rotation from ``base_link`` to a frame of the same heading with z up.

    Parameters
    ----------
    quaternion : ndarray (4,)
        Orientation of ``base_link`` in ``odom``, x, y, z, w.

    Returns
    -------
    ndarray (3, 3)
        R_level_base.
    """
    x, y, z, w = quaternion.tolist()
    z_world = np.array((2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)))
    return frame_of(z_world)


def frame_of(z_in_base: Array) -> Array:
    """Rotation (3, 3) from the base to the frame of a z axis (3,) with the base's heading."""
    forward = np.array((1.0, 0.0, 0.0)) - z_in_base[0] * z_in_base
    forward /= np.sqrt(forward @ forward) + 1e-12
    left = np.array(
        (
            z_in_base[1] * forward[2] - z_in_base[2] * forward[1],
            z_in_base[2] * forward[0] - z_in_base[0] * forward[2],
            z_in_base[0] * forward[1] - z_in_base[1] * forward[0],
        )
    )
    return np.stack((forward, left, z_in_base))
