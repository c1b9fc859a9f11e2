# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motion of the base and the feet, and the averages and stretches of what was recorded."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.recording import (
    Array,
    FootForceSeries,
    JointSeries,
    OdometrySeries,
    Recording,
    Series,
    taken,
)
from dmp_cpg_ros.core.robot_model import world
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription

BLOCK = 1 << 16
"""Rows that are worked on at a time."""


def rotations(quaternion: Array) -> Array:
    """Rotation matrices R_world_base of quaternions x, y, z, w: (n, 4) → (n, 3, 3)."""
    x, y, z, w = quaternion.T
    rows = ((1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))
    return np.ascontiguousarray(np.moveaxis(np.array(rows), -1, 0))


def roll_pitch_yaw(quaternion: Array) -> Array:
    """Angles about x, y, z in the order yaw, pitch, roll; yaw unwrapped: (n, 4) → (n, 3) [rad]."""
    angles = _in_blocks(_angles, quaternion)
    angles[:, 2] = np.unwrap(angles[:, 2])
    return angles


def rotated(quaternion: Array, vector: Array) -> Array:
    """Vectors of the base in the world: (n, 4), (n, 3) → (n, 3)."""
    return _in_blocks(lambda of, v: np.einsum('nij,nj->ni', rotations(of), v), quaternion, vector)


def _angles(quaternion: Array) -> Array:
    R = rotations(quaternion)
    return np.stack([np.arctan2(R[:, 2, 1], R[:, 2, 2]),
                     -np.arcsin(np.clip(R[:, 2, 0], -1.0, 1.0)),
                     np.arctan2(R[:, 1, 0], R[:, 0, 0])], axis=1)


def _in_blocks(of_rows: Callable[..., Array], *values: Array) -> Array:
    """A function of rows for all of them, some at a time: an hour's matrices take much memory."""
    starts = range(0, max(len(values[0]), 1), BLOCK)
    return np.concatenate([of_rows(*(of[k : k + BLOCK] for of in values)) for k in starts])


def tilt(quaternion: Array) -> Array:
    """Angle between the base's z axis and the vertical, ndarray (n,) [rad]."""
    return _in_blocks(lambda of: np.arccos(np.clip(rotations(of)[:, 2, 2], -1.0, 1.0)), quaternion)


def velocity_in_world(odometry: OdometrySeries) -> Array:
    """Velocity of the base, ndarray (n, 3) [m/s]."""
    return rotated(odometry.quaternion, odometry.velocity_in_base)


def velocity_in_heading(odometry: OdometrySeries) -> Array:
    """Velocity of the base in the horizontal frame that turns with its yaw, ndarray (n, 3) [m/s].

    This is the frame in which v is commanded: pitching and rolling do not leak into it.
    """
    def turned(quaternion: Array, velocity: Array, yaw: Array) -> Array:
        v, c, s = rotated(quaternion, velocity), np.cos(yaw), np.sin(yaw)
        return np.stack([c * v[:, 0] + s * v[:, 1], -s * v[:, 0] + c * v[:, 1], v[:, 2]], axis=1)

    return _in_blocks(turned, odometry.quaternion, odometry.velocity_in_base,
                      roll_pitch_yaw(odometry.quaternion)[:, 2].copy())


def yaw_rate(odometry: OdometrySeries) -> Array:
    """Turn rate about the vertical, ndarray (n,) [rad/s]."""
    return _in_blocks(lambda of, rate: np.einsum('nj,nj->n', rotations(of)[:, 2], rate),
                      odometry.quaternion, odometry.rate_in_base)


def held(time: Array, values: Array, at: ArrayLike) -> Array:
    """Values at another time or others: each holds until the next; before the first, the first."""
    return values[np.clip(np.searchsorted(time, at, side='right') - 1, 0, None)]


def integral(time: Array, values: Array) -> Array:
    """Running integral by the trapezoidal rule, starting at 0: (n,), (n, ...) → (n, ...)."""
    dt = np.diff(time).reshape(-1, *(1,) * (values.ndim - 1))
    steps = 0.5 * (values[1:] + values[:-1]) * dt
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(steps, axis=0)])


def mean_between(time: Array, values: Array, start: float, end: float) -> Array:
    """Time averages of (n, k) over [start, end], ndarray (k,)."""
    first, past = np.searchsorted(time, (start, end), side='right')
    near = slice(max(first - 1, 0), past + 1)
    time, values = time[near], values[near]
    ends = np.array([np.interp((start, end), time, of) for of in integral(time, values).T])
    return (ends[:, 1] - ends[:, 0]) / (end - start)


def smoothed(time: Array, values: Array, window: float) -> Array:
    """Centred moving average over a window [s], narrower at the ends, which stay."""
    if len(time) < 3:
        return values
    index = np.arange(len(time))
    half = np.minimum(round(0.5 * window / float(np.median(np.diff(time)))),
                      np.minimum(index, index[::-1]))
    first, past, width, means = index - half, index + half + 1, 2 * half + 1, np.empty_like(values)
    for place in np.ndindex(values.shape[1:]):
        at = (slice(None), *place)
        running = np.concatenate([[0.0], np.cumsum(values[at])])
        means[at] = (running[past] - running[first]) / width
    return means


def thinned(time: Array, value: Array, most: int) -> tuple[Array, Array]:
    """Line of at most so many points, with the extremes of what is left out: (n,), (n,)."""
    if len(time) <= most:
        return time, value
    parts = np.array_split(np.arange(len(time)), most // 2)
    rows = np.sort([part[pick(value[part])] for part in parts for pick in (np.argmin, np.argmax)])
    return time[rows], value[rows]


def root_mean_square(values: Array) -> list[float]:
    """Root mean squares of the columns of (n, k)."""
    return list(np.sqrt((values**2).mean(axis=0)).tolist())


def common_rows(*times: Array) -> list[NDArray[np.int64]]:
    """Rows of several series that bear the same stamps."""
    common = reduce(np.intersect1d, times)
    return [np.searchsorted(time, common) for time in times]


def matched(*series: Series) -> list[Any]:
    """Several series, each reduced to the rows with stamps that all of them have."""
    if all(np.array_equal(of.time, series[0].time) for of in series):
        return list(series)
    rows = common_rows(*(of.time for of in series))
    return [taken(of, own) for of, own in zip(series, rows, strict=True)]


def stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Stretches in which a mask (n,) holds: their first rows and the rows past their last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return [(int(first), int(past)) for first, past in zip(edges[::2], edges[1::2], strict=True)]


def spans(time: Array, mask: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Times (n,) at which the stretches of a mask (n,) begin, and those at which they are over."""
    return [(float(time[first]), float(time[min(past, len(time) - 1)]))
            for first, past in stretches(mask)]


def foot_slip(recording: Recording, robot: RobotDescription, contact_force: float) -> Array | None:
    """Distance that each foot's contact point slid horizontally while it carried load.

    The contact point is the lowest point of the foot's sphere: a foot that rolls without sliding
    does not slip. Its way is averaged over ``SLIP_WINDOW``: the noise of the joints' sensors is no
    slip.

    Parameters
    ----------
    recording : Recording
        Needs joints, odometry and foot forces.
    robot : RobotDescription
        Leg geometry.
    contact_force : float
        Load from which a foot counts as standing [N].

    Returns
    -------
    ndarray (4,) or None
        [m]; None where a topic is missing.
    """
    joints, odometry, feet = matched(recording.joints, recording.odometry, recording.feet)
    if len(joints.time) < 2:
        return None
    slips = np.zeros(len(robot.legs))
    for first in range(0, len(joints.time) - 1, ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE + 1)
        slips += _foot_slip(taken(joints, rows), taken(odometry, rows), taken(feet, rows), robot,
                            contact_force)
    return slips


ROWS_AT_ONCE = 100_000
"""Rows of a long recording that are worked on together."""

SLIP_WINDOW = 0.04
"""Time over which the way of a standing foot is averaged before it is measured [s]."""


def _foot_slip(joints: JointSeries, odometry: OdometrySeries, feet: FootForceSeries,
               robot: RobotDescription, contact_force: float) -> Array:
    time, slips = joints.time, []
    for i, leg in enumerate(robot.legs):
        q, q_dot = (of[:, 3 * i : 3 * i + 3] for of in (joints.position, joints.velocity))
        rate = rotated(odometry.quaternion,
                       odometry.rate_in_base + shank_rate_in_base(leg, q, q_dot))
        rolling = leg.foot_radius * np.stack([rate[:, 1], -rate[:, 0]], axis=1)  # ω × (radius ẑ)
        foot = feet_in_world(leg, q, odometry)[:, :2]
        stances = (slice(*rows) for rows in stretches(feet.force[:, i] > contact_force))
        slips.append(sum(_length(time[rows], foot[rows] - integral(time[rows], rolling[rows]))
                         for rows in stances))
    return np.array(slips)


def _length(time: Array, place: Array) -> float:
    """Length of the way through places (n, 2) that are averaged, from one window to the next."""
    place = smoothed(time, place, SLIP_WINDOW)
    window = SLIP_WINDOW * np.arange(1, round((time[-1] - time[0]) / SLIP_WINDOW))
    rows = [0, *np.searchsorted(time, time[0] + window), len(time) - 1]
    return float(np.hypot(*np.diff(place[rows], axis=0).T).sum())


def feet_in_world(leg: LegGeometry, q: Array, odometry: OdometrySeries) -> Array:
    """Places of a leg's foot, (n, 3) [m], of its joint angles (n, 3) and the base at each."""
    return odometry.position_in_world + rotated(
        odometry.quaternion, _in_blocks(partial(feet_in_base, leg), q))


def feet_in_base(leg: LegGeometry, q: Array) -> Array:
    """Foot positions of a leg's joint angles: (n, 3) → (n, 3) [m]."""
    roll, hip, knee = (leg.axis_sign * q).T
    x, z = _about_y(knee, leg.shank[0], leg.shank[2])
    x, z = _about_y(hip, leg.thigh[0] + x, leg.thigh[2] + z)
    x, y, z = np.array([x, np.zeros(len(x)), z]) + leg.hip_offset[:, None]
    y, c, s = y + leg.thigh[1] + leg.shank[1], np.cos(roll), np.sin(roll)
    return leg.hip_in_base + np.stack([x, c * y - s * z, s * y + c * z], axis=1)


def _about_y(angle: Array, x: Any, z: Any) -> tuple[Array, Array]:
    """Coordinates x and z after a rotation about y [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return c * x + s * z, c * z - s * x


def shank_rate_in_base(leg: LegGeometry, q: Array, q_dot: Array) -> Array:
    """Angular velocity of the shank relative to the base: (n, 3), (n, 3) → (n, 3) [rad/s]."""
    rolling, pitching = leg.axis_sign[0] * q_dot[:, 0], q_dot[:, 1:] @ leg.axis_sign[1:]
    angle = leg.axis_sign[0] * q[:, 0]
    return np.stack([rolling, np.cos(angle) * pitching, np.sin(angle) * pitching], axis=1)


def height_over_ground(odometry: OdometrySeries, context: RunContext) -> Array:
    """Height of the base over the ground below its hips.

    Parameters
    ----------
    odometry : OdometrySeries
        The base's way.
    context : RunContext
        World and robot; without a robot the ground below the base's origin is taken.

    Returns
    -------
    ndarray (n,)
        [m]
    """
    place = odometry.position_in_world
    if context.world.is_flat or not place.size:
        return place[:, 2]
    legs = () if context.robot is None else context.robot.legs
    hips = np.array([leg.hip_in_base for leg in legs] or [np.zeros(3)])
    hips_in_world = place[:, None] + np.einsum('nij,lj->nli', rotations(odometry.quaternion), hips)
    return world.height_over_ground(context.world, place, hips_in_world)
