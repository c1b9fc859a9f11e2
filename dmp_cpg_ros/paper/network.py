# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A network of any oscillators with any coupling and inhibition, for a few nodes or ten thousand.

    ẋ_i = f(x_i; ω_i) + Σ_j K_ij (R(φ_ij) x_j − x_i) + α_i (x_{i,d} − x_i)

(paper eqs. hetero, inhibitedCanonicalSystem). The four oscillators of a gait have their own,
faster step in :mod:`~dmp_cpg_ros.core.canonical.system`, which is exact in the linear part.

The time steps here are explicit ones that many cheap stages make stable: nothing is stored,
factorised or solved. Both are of order two, keep every equilibrium of the field, and evaluate it
once a stage.

- :func:`chebyshev_step`: Runge-Kutta-Chebyshev (Sommeijer, Shampine & Verwer, *RKC: an explicit
  solver for parabolic PDEs*, J. Comput. Appl. Math. 88 (1998)), for rates along the negative real
  axis: h λ ≤ 0.65 (s² − 1) with s stages.
- :func:`contractive_step`: the optimal strong-stability-preserving method of order two (Ketcheson,
  *Highly efficient strong stability preserving Runge-Kutta methods*, SIAM J. Sci. Comput. 30
  (2008)), for rates in a disc: it contracts in every norm in which the Euler step of length
  h / (s − 1) does, as that of a directed coupling K = k I does.
"""

from __future__ import annotations

from functools import lru_cache, partial
from math import ceil, sqrt

import numpy as np

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.coupling import Coupling
from dmp_cpg_ros.paper.jacobians import Array, Field
from dmp_cpg_ros.paper.oscillators import OscillatorFamily

DAMPING = 2.0 / 13.0
"""Damping ε of the Chebyshev polynomials, as published: a strip along the real axis is stable."""


class OscillatorNetwork:
    """Vector field and time step; the state stays with the caller.

    Parameters
    ----------
    oscillators : OscillatorFamily
        The N oscillators.
    coupling : Coupling, optional
        What they receive from one another; nothing without.
    target : ndarray (N, n), optional
        x_{i,d}, where inhibition pulls each node; zeros without.

    Raises
    ------
    ParameterError
        If sizes differ, or phase offsets turn the states of oscillators that are not rotation
        invariant.
    """

    def __init__(self, oscillators: OscillatorFamily, coupling: Coupling | None = None,
                 target: Array | None = None) -> None:
        self.oscillators, self.coupling = oscillators, coupling
        shape = (oscillators.count, oscillators.state_size)
        self.target = np.zeros(shape) if target is None else np.asarray(target, dtype=float)
        if self.target.shape != shape:
            raise ParameterError(f'the target of inhibition must have shape {shape}, not '
                                 f'{self.target.shape}')
        if coupling is None:
            return
        if (coupling.count, coupling.state_size) != shape:
            raise ParameterError(f'a coupling of {coupling.count} states of size '
                                 f'{coupling.state_size} does not fit oscillators {shape}')
        if coupling.turned and not oscillators.rotation_invariant:
            raise ParameterError('phase offsets need oscillators that are rotation invariant, '
                                 'such as Andronov-Hopf or phase oscillators')

    def field(self, x: Array, gains: Array | None = None) -> Array:
        """Vector field ẋ.

        Parameters
        ----------
        x : ndarray (N, n)
            States.
        gains : ndarray (N,), optional
            Inhibition gains α_i ≥ 0 that act now [1/s]; none without.

        Returns
        -------
        ndarray (N, n)
            [1/s]
        """
        rate = self.oscillators.field(x)
        if self.coupling is not None:
            rate = rate + self.coupling(x)
        return rate if gains is None else rate + gains[:, None] * (self.target - x)

    def step(self, x: Array, dt: float, gains: Array | None = None) -> Array:
        """Advance by one time step, of order two and stable however large the gains are.

        The number of stages follows from the fastest rate: it grows with its square root when all
        couplings are symmetric, and in proportion when they are not.

        Parameters
        ----------
        x : ndarray (N, n)
            States.
        dt : float
            [s]
        gains : ndarray (N,), optional
            Inhibition gains that act during the step [1/s].

        Returns
        -------
        ndarray (N, n)
        """
        fastest, field = self.oscillators.stiffness(x), partial(self.field, gains=gains)
        if self.coupling is not None:
            fastest += self.coupling.bound
        if gains is not None:
            fastest += float(gains.max())
        if self.coupling is None or self.coupling.symmetric:
            return chebyshev_step(field, x, dt, chebyshev_stages(dt, fastest))
        return contractive_step(field, x, dt, contractive_stages(dt, fastest))


def chebyshev_stages(dt: float, fastest: float) -> int:
    """Stages with which :func:`chebyshev_step` is stable for rates up to ``fastest`` [1/s]."""
    return max(2, ceil(sqrt(1.0 + dt * fastest / 0.653)))


def contractive_stages(dt: float, fastest: float) -> int:
    """Stages with which :func:`contractive_step` is stable for rates up to ``fastest`` [1/s]."""
    return max(2, 1 + ceil(0.5 * dt * fastest))


def chebyshev_step(field: Field, x: Array, dt: float, stages: int) -> Array:
    """State ``x`` one step of length dt [s] later, with at least two stages."""
    first, rest = _chebyshev_coefficients(stages)
    start = dt * field(x)
    before, here = x, x + first * start
    for start_share, mu, nu, mu_rate, start_rate in rest:
        before, here = here, (dt * mu_rate * field(here) + start_share * x + mu * here
                              + nu * before + start_rate * start)
    return here


def contractive_step(field: Field, x: Array, dt: float, stages: int) -> Array:
    """State ``x`` one step of length dt [s] later, with at least two stages."""
    here = x
    for _ in range(stages):
        here = here + dt / (stages - 1) * field(here)
    return x / stages + (1.0 - 1.0 / stages) * here


@lru_cache(maxsize=256)
def _chebyshev_coefficients(s: int) -> tuple[float, tuple[tuple[float, ...], ...]]:
    """μ̃₁, and for j = 2 … s: 1 − μ_j − ν_j, μ_j, ν_j, μ̃_j, γ̃_j (Sommeijer et al., eq. 2.2-2.5)."""
    w0 = 1.0 + DAMPING / s**2
    T, dT, ddT = [1.0, w0], [0.0, 1.0], [0.0, 0.0]
    for _ in range(2, s + 1):
        ddT.append(4.0 * dT[-1] + 2.0 * w0 * ddT[-1] - ddT[-2])
        dT.append(2.0 * T[-1] + 2.0 * w0 * dT[-1] - dT[-2])
        T.append(2.0 * w0 * T[-1] - T[-2])
    w1 = dT[s] / ddT[s]
    b = [ddT[2] / dT[2]**2, 1.0 / w0, *(ddT[j] / dT[j]**2 for j in range(2, s + 1))]
    rows = []
    for j in range(2, s + 1):
        mu, nu, mu_rate = 2.0 * b[j] * w0 / b[j - 1], -b[j] / b[j - 2], 2.0 * b[j] * w1 / b[j - 1]
        rows.append((1.0 - mu - nu, mu, nu, mu_rate, -(1.0 - b[j - 1] * T[j - 1]) * mu_rate))
    return b[1] * w1, tuple(rows)
