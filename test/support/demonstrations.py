# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Demonstrations with exact derivatives, to learn from in examples, tests and the benchmark."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, minimum_jerk

Array = NDArray[np.float64]

_JERK = np.polynomial.Polynomial((0.0, 0.0, 0.0, 10.0, -15.0, 6.0))  # of minimum_jerk

# Strokes of the letters: start t0 [s], length [m], direction at the start and at the end [rad].
# The speed of a stroke is a lognormal function of time, its direction turns with the distance.
_LETTERS: dict[str, tuple[tuple[float, float, float, float], ...]] = {
    'a': (
        (0.00, 0.045, 2.6, 5.6),
        (0.20, 0.050, 5.6, 8.2),
        (0.42, 0.040, 4.5, 4.9),
        (0.60, 0.022, 5.2, 7.1),
    ),
    'e': ((0.00, 0.030, -0.3, 0.5), (0.18, 0.050, 0.6, 3.6), (0.38, 0.065, 3.6, 6.6)),
    's': (
        (0.00, 0.030, 2.2, 3.8),
        (0.18, 0.040, 3.9, 6.3),
        (0.38, 0.050, 6.2, 3.4),
        (0.60, 0.020, 3.3, 2.4),
    ),
    'w': (
        (0.00, 0.050, -1.3, -1.1),
        (0.18, 0.045, 1.0, 1.3),
        (0.36, 0.045, -1.3, -1.1),
        (0.54, 0.052, 1.0, 1.4),
    ),
}

LETTERS = tuple(_LETTERS)
"""Letters that :func:`handwriting` can write."""

_STROKE_MU, _STROKE_SIGMA = -1.6, 0.30

# Joint angles of a walking leg over one cycle: mean, then cosine and sine
# amplitudes of the harmonics [rad].
_LEG_CYCLE: dict[str, tuple[float, tuple[float, ...], tuple[float, ...]]] = {
    'abduction': (0.03, (0.05, 0.015), (-0.02, 0.010)),
    'hip': (0.70, (0.34, -0.04, 0.01), (-0.06, 0.05, -0.01)),
    'knee': (-1.45, (0.10, -0.22, 0.04, 0.015), (0.32, -0.08, -0.05, 0.01)),
}


def straight_reach(
    start: ArrayLike, goal: ArrayLike, duration: float = 1.0, dt: float = 0.005
) -> Demonstration:
    """Point-to-point movement of least jerk (Flash & Hogan 1985).

    Parameters
    ----------
    start, goal : array_like (n,)
        End points.
    duration : float
        [s]
    dt : float
        Sampling interval [s].

    Returns
    -------
    Demonstration
        With velocities and accelerations.
    """
    start, goal = (
        np.atleast_1d(np.asarray(start, dtype=float)),
        np.atleast_1d(np.asarray(goal, dtype=float)),
    )
    times = _times(duration, dt)
    u, way = (times / duration)[:, None], goal - start
    position, velocity, acceleration = way * minimum_jerk(u), *(
        way * _JERK.deriv(order)(np.clip(u, 0.0, 1.0)) / duration**order for order in (1, 2))
    return Demonstration(times, start + position, velocity, acceleration)


def handwriting(letter: str = 'a', dt: float = 0.002) -> Demonstration:
    """Letter written with overlapping strokes of lognormal speed.

    The model of Plamondon, Biol. Cybern. 72 (1995), with direction turning along each stroke.

    Parameters
    ----------
    letter : str
        One of ``LETTERS``.
    dt : float
        Sampling interval [s].

    Returns
    -------
    Demonstration
        Two degrees of freedom [m], with velocities and accelerations.

    Raises
    ------
    ParameterError
        If there is no such letter.
    """
    if letter not in _LETTERS:
        raise ParameterError(f'letter must be one of {", ".join(LETTERS)}, not {letter!r}')
    strokes = _LETTERS[letter]
    times = _times(strokes[-1][0] + 0.62, dt)
    parts = np.sum([_stroke(times, *stroke) for stroke in strokes], axis=0)  # (3, m, 2)
    return Demonstration(times, parts[0], parts[1], parts[2], ('x', 'y'))


def joint_angles(duration: float = 0.8, dt: float = 0.002) -> Demonstration:
    """Three joint angles that reach through two via points, as overlapping minimum-jerk pieces.

    Parameters
    ----------
    duration : float
        [s]
    dt : float
        Sampling interval [s].

    Returns
    -------
    Demonstration
        Abduction, hip and knee [rad] of a leg that is lifted over an obstacle and put down.
    """
    pieces = (
        (0.00, 0.55, (0.10, 0.50, -0.90)),
        (0.25, 0.55, (-0.05, 0.35, 0.20)),
        (0.50, 0.50, (-0.08, -0.30, 0.55)),
    )
    times = _times(duration, dt)
    positions = np.tile([0.0, 0.7, -1.4], (len(times), 1))
    velocities, accelerations = np.zeros_like(positions), np.zeros_like(positions)
    for begin, length, change in pieces:
        u = np.clip((times / duration - begin) / length, 0.0, 1.0)[:, None]
        span, scale = np.asarray(change), length * duration
        positions += span * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        velocities += span * 30.0 * u**2 * (1.0 - u) ** 2 / scale
        accelerations += span * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / scale**2
    return Demonstration(times, positions, velocities, accelerations, ('abduction', 'hip', 'knee'))


def walking_joints(
    period: float = 0.5, cycles: float = 4.3, dt: float = 0.002, noise: float = 0.0, seed: int = 0
) -> Demonstration:
    """Joint angles of a walking leg, periodic, with one to four harmonics.

    Parameters
    ----------
    period : float
        [s]
    cycles : float
        Length of the recording in periods; need not be whole.
    dt : float
        Sampling interval [s].
    noise : float
        Standard deviation of white noise on the positions [rad]; with noise there are no
        derivatives.
    seed : int
        Seed of the noise.

    Returns
    -------
    Demonstration
        Abduction, hip and knee [rad].
    """
    times = _times(cycles * period, dt)
    omega = 2.0 * np.pi / period
    shape = (len(times), len(_LEG_CYCLE))
    positions, velocities, accelerations = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for j, (mean, cosines, sines) in enumerate(_LEG_CYCLE.values()):
        positions[:, j] = mean
        for h, (a, b) in enumerate(zip(cosines, sines, strict=True), start=1):
            c, s, rate = np.cos(h * omega * times), np.sin(h * omega * times), h * omega
            positions[:, j] += a * c + b * s
            velocities[:, j] += rate * (b * c - a * s)
            accelerations[:, j] -= rate**2 * (a * c + b * s)
    names = tuple(_LEG_CYCLE)
    if noise > 0.0:
        return Demonstration(
            times, positions + noise * np.random.default_rng(seed).normal(size=shape), names=names
        )
    return Demonstration(times, positions, velocities, accelerations, names)


def _times(duration: float, dt: float) -> Array:
    if not (np.isfinite(duration) and np.isfinite(dt) and 0.0 < dt and 8.0 * dt <= duration):
        raise ParameterError(
            f'duration = {duration!r} s must be at least eight intervals dt = {dt!r} s > 0'
        )
    return np.linspace(0.0, duration, int(round(duration / dt)) + 1)


def _stroke(times: Array, begin: float, length: float, first: float, last: float) -> Array:
    """Position, velocity and acceleration of one stroke, (3, m, 2)."""
    mu, sigma = _STROKE_MU, _STROKE_SIGMA
    since = np.maximum(times - begin, 1e-9)
    log = (np.log(since) - mu) / sigma
    covered = 0.5 * (
        1.0 + np.array([math.erf(v / math.sqrt(2.0)) for v in log])
    )  # share of the length
    rate = np.exp(-0.5 * log**2) / (sigma * math.sqrt(2.0 * math.pi) * since)  # [1/s]
    rate_dot = -rate / since * (1.0 + log / sigma)  # [1/s²]
    turn = last - first
    angle = first + turn * covered
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    position = (
        length
        / turn
        * np.stack([np.sin(angle) - math.sin(first), math.cos(first) - np.cos(angle)], axis=1)
    )
    velocity = length * rate[:, None] * along
    acceleration = length * (rate_dot[:, None] * along + (turn * rate**2)[:, None] * across)
    return np.stack([position, velocity, acceleration])
