# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Closed orbits of autonomous systems, found by following the flow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

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
    x = _flow(field, start, transient, step).y[:, -1]
    period = _time_of_return(field, x, step)
    states = _flow(field, x, period, step, np.linspace(0.0, period, count + 1)).y.T
    gap = float(np.linalg.norm(states[-1] - x))
    size = float(np.ptp(states, axis=0).max())
    if not gap <= 1e-4 * size:
        raise DataError(f'the orbit does not close: after {period:.6g} s the state is {gap:.3g} '
                        'away; give a longer transient')
    return Orbit(states[:-1].copy(), period)


def _flow(field: Field, start: ArrayLike, duration: float, step: float,
          times: Array | None = None, events: Callable[[float, Array], float] | None = None
          ) -> Any:
    return solve_ivp(lambda _, x: field(x), (0.0, duration), np.asarray(start, dtype=float),
                     'DOP853', times, events=events, rtol=1e-11, atol=1e-12, max_step=step)


def _time_of_return(field: Field, x0: Array, step: float) -> float:
    """Time until the state crosses the plane through x0 across the flow, close to x0."""
    normal, begun, size = field(x0), 0.0, 0.0

    def height(_: float, x: Array) -> float:
        return float((x - x0) @ normal)

    height.direction = 1.0  # type: ignore[attr-defined]
    x = x0
    for _ in range(1000):
        piece = _flow(field, x, 100.0 * step, step, events=height)
        size = max(size, float(np.linalg.norm(piece.y - x0[:, None], axis=0).max()))
        for t, at in zip(piece.t_events[0], piece.y_events[0], strict=True):
            if begun + t > step and np.linalg.norm(at - x0) < 0.1 * size:
                return float(begun + t)
        x, begun = piece.y[:, -1], begun + 100.0 * step
    raise DataError('the state did not come back to where it was within 100,000 steps')
