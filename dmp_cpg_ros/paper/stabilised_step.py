# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Explicit time steps that many cheap stages make stable: nothing is stored, factorised or solved.

Both are of order two, keep every equilibrium of the field, and evaluate it once a stage.

- :func:`chebyshev_step`: Runge-Kutta-Chebyshev (Sommeijer, Shampine & Verwer, *RKC: an explicit
  solver for parabolic PDEs*, J. Comput. Appl. Math. 88 (1998)), for rates along the negative real
  axis: h λ ≤ 0.65 (s² − 1) with s stages.
- :func:`contractive_step`: the optimal strong-stability-preserving method of order two (Ketcheson,
  *Highly efficient strong stability preserving Runge-Kutta methods*, SIAM J. Sci. Comput. 30
  (2008)), for rates in a disc: it contracts in every norm in which the Euler step of length
  h / (s − 1) does, as that of a directed coupling K = k I does.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Field = Callable[[Array], Array]

DAMPING = 2.0 / 13.0
"""Damping ε of the Chebyshev polynomials, as published: a strip along the real axis is stable."""


def chebyshev_stages(dt: float, fastest: float) -> int:
    """Stages with which :func:`chebyshev_step` is stable for rates up to ``fastest`` [1/s]."""
    return max(2, ceil(sqrt(1.0 + dt * fastest / 0.653)))


def contractive_stages(dt: float, fastest: float) -> int:
    """Stages with which :func:`contractive_step` is stable for rates up to ``fastest`` [1/s]."""
    return max(2, 1 + ceil(0.5 * dt * fastest))


def chebyshev_step(field: Field, x: Array, dt: float, stages: int) -> Array:
    """One step of length dt [s] with at least two stages.

    Parameters
    ----------
    field : callable
        ẋ as a function of x.
    x : ndarray
        State.
    dt : float
        [s]
    stages : int
        As from :func:`chebyshev_stages`.

    Returns
    -------
    ndarray
        State one step later.
    """
    first, rest = _chebyshev_coefficients(stages)
    start = dt * field(x)
    before, here = x, x + first * start
    for start_share, mu, nu, mu_rate, start_rate in rest:
        following = dt * mu_rate * field(here)
        following += start_share * x
        following += mu * here
        following += nu * before
        following += start_rate * start
        before, here = here, following
    return here


def contractive_step(field: Field, x: Array, dt: float, stages: int) -> Array:
    """One step of length dt [s] with at least two stages; arguments as of chebyshev_step."""
    part = dt / (stages - 1)
    here = x
    for _ in range(stages):
        here = here + part * field(here)
    return x / stages + (1.0 - 1.0 / stages) * here


@lru_cache(maxsize=256)
def _chebyshev_coefficients(
        s: int) -> tuple[float, tuple[tuple[float, float, float, float, float], ...]]:
    """μ̃₁, and for j = 2 … s: 1 − μ_j − ν_j, μ_j, ν_j, μ̃_j, γ̃_j (Sommeijer et al., eq. 2.2-2.5)."""
    w0 = 1.0 + DAMPING / s**2
    T, dT, ddT = [1.0, w0], [0.0, 1.0], [0.0, 0.0]
    for _ in range(2, s + 1):
        ddT.append(4.0 * dT[-1] + 2.0 * w0 * ddT[-1] - ddT[-2])
        dT.append(2.0 * T[-1] + 2.0 * w0 * dT[-1] - dT[-2])
        T.append(2.0 * w0 * T[-1] - T[-2])
    w1 = dT[s] / ddT[s]
    b = [0.0, 0.0] + [ddT[j] / dT[j]**2 for j in range(2, s + 1)]
    b[0], b[1] = b[2], 1.0 / w0
    rows = []
    for j in range(2, s + 1):
        mu, nu, mu_rate = 2.0 * b[j] * w0 / b[j - 1], -b[j] / b[j - 2], 2.0 * b[j] * w1 / b[j - 1]
        rows.append((1.0 - mu - nu, mu, nu, mu_rate, -(1.0 - b[j - 1] * T[j - 1]) * mu_rate))
    return b[1] * w1, tuple(rows)
