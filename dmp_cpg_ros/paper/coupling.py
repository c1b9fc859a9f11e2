# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Couplings whose cost grows with the number of edges, or with the number of nodes.

Couplings of states are Σ_j K_ij (R(φ_ij) x_j − x_i); those of phase oscillators
Σ_j k_ij sin(φ_j + φ_ij − φ_i) (Kuramoto 1984), which is what the former amount to along the unit
circle.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array

from dmp_cpg_ros.core.canonical.graph import Array, CouplingGraph
from dmp_cpg_ros.core.canonical.phase import phase_rotation
from dmp_cpg_ros.core.errors import ParameterError


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
        if not (np.isfinite(gain) and gain > 0.0):
            raise ParameterError(f'gain = {gain!r} 1/s must be finite and greater than 0')
        places = np.zeros(count) if phases is None else np.asarray(phases, dtype=float)
        if places.shape != (count,) or not np.all(np.isfinite(places)):
            raise ParameterError(f'phases must be {count} finite numbers')
        self.count, self.bound, self._gain = count, gain * count, gain
        self.turned, self._turn = bool(places.any()), np.exp(-1j * places)

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2)."""
        z = np.ascontiguousarray(x).view(complex)[:, 0]
        rate = (self._gain * np.vdot(self._turn, z)) * self._turn - self.bound * z
        return rate.view(float).reshape(x.shape)


class _OnTheCircle:
    """Sine coupling: a coupling of states along the unit circle."""

    state_size = 1

    def __init__(self, of: EdgeCoupling | MeanFieldCoupling, bound: float) -> None:
        self._of, self.bound = of, bound
        self.count, self.symmetric, self.turned = of.count, of.symmetric, of.turned

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 1) → (N, 1) [rad/s]."""
        z = np.exp(-1j * x[:, 0])
        rate = self._of(z.view(float).reshape(-1, 2)).view(complex)[:, 0]
        return -(z.conj() * rate).imag[:, None]


class PhaseEdgeCoupling(_OnTheCircle):
    """Sine coupling over the edges of a CouplingGraph; ParameterError unless its K = k I."""

    def __init__(self, graph: CouplingGraph) -> None:
        if not np.array_equal(graph.gains, graph.gains[:, :1, :1] * np.eye(2)):
            raise ParameterError('phase oscillators need gains K = k I')
        super().__init__(of := EdgeCoupling(graph), of.bound)


class PhaseMeanFieldCoupling(_OnTheCircle):
    """All-to-all sine coupling with one gain; parameters as of MeanFieldCoupling."""

    def __init__(self, count: int, gain: float, phases: ArrayLike | None = None) -> None:
        # of Σ k sin(θ_j − θ_i) the Jacobian's norm is at most twice the largest row sum
        super().__init__(of := MeanFieldCoupling(count, gain, phases), 2.0 * of.bound)
