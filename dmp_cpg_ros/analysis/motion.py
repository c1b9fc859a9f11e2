# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Queries on body motion and on time series in general."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.recording import OdometrySeries

Array = NDArray[np.float64]


def rotations(quaternion: Array) -> Array:
    """Rotation matrices R_world_base of quaternions x, y, z, w: (n, 4) → (n, 3, 3)."""
    x, y, z, w = quaternion.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=-1),
            np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=-1),
            np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=-1),
        ],
        axis=-2,
    )


def roll_pitch_yaw(quaternion: Array) -> Array:
    """Angles about x, y, z in the order yaw, pitch, roll; yaw unwrapped: (n, 4) → (n, 3) [rad]."""
    R = rotations(quaternion)
    roll = np.arctan2(R[:, 2, 1], R[:, 2, 2])
    pitch = -np.arcsin(np.clip(R[:, 2, 0], -1.0, 1.0))
    yaw = np.unwrap(np.arctan2(R[:, 1, 0], R[:, 0, 0]))
    return np.stack([roll, pitch, yaw], axis=1)


def tilt(quaternion: Array) -> Array:
    """Angle between the base's z axis and the vertical, ndarray (n,) [rad]."""
    return np.arccos(np.clip(rotations(quaternion)[:, 2, 2], -1.0, 1.0))


def velocity_in_heading(odometry: OdometrySeries) -> Array:
    """Velocity of the base in the horizontal frame that turns with its yaw, ndarray (n, 3) [m/s].

    This is the frame in which v is commanded: pitching and rolling do not leak into it.
    """
    v = np.einsum('nij,nj->ni', rotations(odometry.quaternion), odometry.velocity_in_base)
    yaw = roll_pitch_yaw(odometry.quaternion)[:, 2]
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack([c * v[:, 0] + s * v[:, 1], -s * v[:, 0] + c * v[:, 1], v[:, 2]], axis=1)


def yaw_rate(odometry: OdometrySeries) -> Array:
    """Turn rate about the vertical, ndarray (n,) [rad/s]."""
    return np.einsum('nj,nj->n', rotations(odometry.quaternion)[:, 2], odometry.rate_in_base)


def held(time: Array, values: Array, at: Array) -> Array:
    """Values at other times: each sample holds until the next; before the first, the first."""
    return values[np.clip(np.searchsorted(time, at, side='right') - 1, 0, None)]


def integral(time: Array, values: Array) -> Array:
    """Running integral by the trapezoidal rule, starting at 0: (n,), (n, ...) → (n, ...)."""
    dt = np.diff(time).reshape(-1, *(1,) * (values.ndim - 1))
    steps = 0.5 * (values[1:] + values[:-1]) * dt
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(steps, axis=0)])


def mean_between(time: Array, values: Array, start: float, end: float) -> Array:
    """Time averages of (n, k) over [start, end], ndarray (k,)."""
    running = integral(time, values)
    ends = [np.array([np.interp(t, time, column) for column in running.T]) for t in (start, end)]
    return (ends[1] - ends[0]) / (end - start)


def smoothed(time: Array, values: Array, window: float) -> Array:
    """Centred moving average over a window [s], narrower at the ends, which stay."""
    if len(time) < 3:
        return values
    n = len(time)
    index = np.arange(n)
    half = np.minimum(
        round(0.5 * window / float(np.median(np.diff(time)))), np.minimum(index, n - 1 - index)
    )
    running = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    width = (2 * half + 1).reshape(-1, *(1,) * (values.ndim - 1))
    return (running[index + half + 1] - running[index - half]) / width


def root_mean_square(values: Array) -> list[float]:
    """Root mean squares of the columns of (n, k)."""
    return list(np.sqrt((values**2).mean(axis=0)).tolist())


def common_rows(*times: Array) -> list[NDArray[np.int64]]:
    """Rows of several series that bear the same stamps."""
    common = times[0]
    for time in times[1:]:
        common = np.intersect1d(common, time)
    return [np.searchsorted(time, common) for time in times]


def stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches in which a mask (n,) holds: their first rows and the rows past their last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return [(int(first), int(past)) for first, past in zip(edges[::2], edges[1::2], strict=True)]
