# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Closed orbits of autonomous systems, found by following the flow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.paper.jacobians import Field

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Orbit:
    """States of one period, equally spaced in time; the last is one step before the first.

    Attributes
    ----------
    states : ndarray (m, n)
        States, m even.
    period : float
        T [s].
    """

    states: Array
    period: float


def runge_kutta_step(field: Field, x: Array, h: float) -> Array:
    """One step of the classical fourth-order Runge-Kutta method."""
    k1 = field(x)
    k2 = field(x + 0.5 * h * k1)
    k3 = field(x + 0.5 * h * k2)
    return x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + field(x + h * k3))


def find_orbit(field: Field, start: ArrayLike, transient: float, step: float,
               count: int = 800) -> Orbit:
    """Follow the flow onto an attracting orbit and once around it.

    Parameters
    ----------
    field : callable
        f: ndarray (n,) → ndarray (n,) [1/s].
    start : array_like (n,)
        State in the orbit's basin.
    transient : float
        Time after which the state is taken to be on the orbit [s].
    step : float
        Step while following; a small part of the period [s].
    count : int
        Number of states that are returned, even.

    Returns
    -------
    Orbit

    Raises
    ------
    DataError
        If the state does not come back within 100,000 steps or the orbit does not close.
    """
    x = np.asarray(start, dtype=float)
    for _ in range(int(np.ceil(transient / step))):
        x = runge_kutta_step(field, x, step)
    period = _time_of_return(field, x, step)
    h = period / count
    states = [x]
    for _ in range(count):
        states.append(runge_kutta_step(field, states[-1], h))
    gap = float(np.linalg.norm(states[-1] - x))
    size = float(np.ptp(np.stack(states), axis=0).max())
    if not gap <= 1e-4 * size:
        raise DataError(f'the orbit does not close: after {period:.6g} s the state is {gap:.3g} '
                        'away; give a longer transient')
    return Orbit(np.stack(states[:-1]), period)


def _time_of_return(field: Field, x0: Array, step: float) -> float:
    """Time until the state crosses the plane through x0 across the flow, close to x0."""
    normal = field(x0)

    def height(x: Array) -> float:
        return float((x - x0) @ normal)

    x, farthest = x0, 0.0
    for k in range(1, 100_000):
        following = runge_kutta_step(field, x, step)
        distance = float(np.linalg.norm(following - x0))
        farthest = max(farthest, distance)
        if height(x) < 0.0 <= height(following) and distance < 0.1 * farthest:
            low, high = 0.0, step
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = ((middle, high) if height(runge_kutta_step(field, x, middle)) < 0.0
                             else (low, middle))
            return (k - 1) * step + high
        x = following
    raise DataError('the state did not come back to where it was within 100,000 steps')
