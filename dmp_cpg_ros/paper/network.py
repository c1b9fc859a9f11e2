# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A network of any oscillators with any coupling and inhibition, for a few nodes or ten thousand.

    ẋ_i = f(x_i; ω_i) + Σ_j K_ij (R(φ_ij) x_j − x_i) + α_i (x_{i,d} − x_i)

(paper eqs. hetero, inhibitedCanonicalSystem). The four oscillators of a gait have their own,
faster step in :mod:`~dmp_cpg_ros.core.canonical.system`, which is exact in the linear part.

The cost of a coupling grows with the number of edges, or with the number of nodes.

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
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph
from dmp_cpg_ros.core.canonical.phase import phase_rotation
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import check_positive
from dmp_cpg_ros.paper.jacobians import Array, Field
from dmp_cpg_ros.paper.oscillators import OscillatorFamily

DAMPING = 2.0 / 13.0
"""Damping ε of the Chebyshev polynomials, as published: a strip along the real axis is stable."""


class Coupling(Protocol):
    """What every oscillator receives from the others.

    Attributes
    ----------
    count, state_size : int
        Number N of nodes and dimension n of their states.
    bound : float
        Bound on the norm of its Jacobian [1/s].
    symmetric : bool
        Whether its Jacobian is symmetric, so that all rates are real.
    turned : bool
        Whether nodes see one another turned by phase offsets.
    """

    count: int
    state_size: int
    bound: float
    symmetric: bool
    turned: bool

    def __call__(self, x: Array) -> Array:
        """Σ_j K_ij (R(φ_ij) x_j − x_i) of every node, ndarray (N, n) → (N, n) [1/s]."""


class EdgeCoupling:
    """Σ_j K_ij (R(φ_ij) x_j − x_i) over a list of edges (paper eq. coupledDMPs and Section 5).

    A sparse matrix with two blocks for each edge.

    Parameters
    ----------
    graph : CouplingGraph
        Couplings.
    """

    state_size = 2

    def __init__(self, graph: CouplingGraph) -> None:
        self.count = graph.size
        to, of = np.array(graph.edges, dtype=np.intp).reshape(-1, 2).T
        offsets = (graph.phases[to] - graph.phases[of]).tolist()
        turns = np.array([phase_rotation(phi) for phi in offsets]).reshape(-1, 2, 2)
        blocks = np.concatenate([graph.gains @ turns, -graph.gains])
        rows, columns = (np.broadcast_to(2 * nodes[:, None, None] + within, blocks.shape).ravel()
                         for nodes, within in ((np.concatenate([to, to]), [[0], [1]]),
                                               (np.concatenate([of, to]), [[0, 1]])))
        self._matrix = coo_array(
            (blocks.ravel(), (rows, columns)), (2 * self.count, 2 * self.count)).tocsr()
        self._matrix.eliminate_zeros()
        norms = np.linalg.norm(graph.gains, 2, axis=(1, 2))
        self.bound = 2.0 * float(np.bincount(to, norms, self.count).max(initial=0.0))
        self.turned = bool(np.any(np.abs(turns - np.eye(2)) > 1e-12))
        skew = abs(self._matrix - self._matrix.T)
        self.symmetric = bool(skew.max() <= 1e-12 * max(self.bound, 1.0))

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2)."""
        return np.asarray(self._matrix @ x.ravel()).reshape(x.shape)


class MeanFieldCoupling:
    """All-to-all coupling with one gain, at a cost that grows with N instead of N².

        Σ_{j≠i} k (R(φ_ij) x_j − x_i) = k R(φ_i) Σ_j R(φ_j)ᵀ x_j − k N x_i

    Parameters
    ----------
    count : int
        Number N of nodes.
    gain : float
        k > 0 of every coupling [1/s].
    phases : array_like, optional
        Phases (N,) at which the nodes lock [rad]; zeros without.

    Raises
    ------
    ParameterError
        If the gain is not positive, or the phases are not N finite numbers.
    """

    state_size = 2
    symmetric = True

    def __init__(self, count: int, gain: float, phases: ArrayLike | None = None) -> None:
        check_positive(gain=gain)
        places = np.zeros(count) if phases is None else np.asarray(phases, dtype=float)
        if places.shape != (count,) or not np.all(np.isfinite(places)):
            raise ParameterError(f'phases must be {count} finite numbers')
        self.count, self.bound, self._gain = count, gain * count, gain
        self.turned, self._turn = bool(places.any()), np.exp(-1j * places)

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2)."""
        z = np.ascontiguousarray(x, dtype=float).view(complex)[:, 0]
        rate = (self._gain * np.vdot(self._turn, z)) * self._turn - self.bound * z
        return rate.view(float).reshape(x.shape)


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
            raise ParameterError(f'target {self.target.shape} must have shape {shape}')
        if coupling is None:
            return
        if (coupling.count, coupling.state_size) != shape:
            raise ParameterError(f'the coupling does not fit oscillators of shape {shape}')
        if coupling.turned and not oscillators.rotation_invariant:
            raise ParameterError('phase offsets need rotation invariant oscillators')

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
