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
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.canonical.graph import CouplingGraph
from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]


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

    A real matrix acts on z = x₁ + i x₂ as p z + q z̄, with q = 0 when it commutes with rotations:
    edges are one or two products, and a sum over each node's own stretch of the list.

    Parameters
    ----------
    graph : CouplingGraph
        Couplings.
    """

    state_size = 2

    def __init__(self, graph: CouplingGraph) -> None:
        """Sort the edges by the node that they act on."""
        self.count = graph.size
        pairs = np.array(graph.edges, dtype=np.intp).reshape(-1, 2)
        order = np.argsort(pairs[:, 0], kind='stable')
        to, self._from = pairs[order].T
        self._nodes, self._starts = np.unique(to, return_index=True)
        offset = graph.phases[to] - graph.phases[self._from]
        p, q = _complex_form(graph.gains[order])
        # R(φ) turns the phase on, which is clockwise: z → exp(−iφ) z
        self._p, q_seen = p * np.exp(-1j * offset), q * np.exp(1j * offset)
        self._own_p, self._own_q = self._summed(p), self._summed(q)
        self._q = q_seen if np.any(q != 0.0) else None
        size = np.abs(p) + np.abs(q)
        incoming = self._summed(size).real
        self.bound = float((np.abs(self._own_p) + np.abs(self._own_q) + incoming).max(initial=0.0))
        self.turned = bool(np.any(np.abs(np.exp(1j * offset) - 1.0) > 1e-12))
        self.symmetric = _is_symmetric(to, self._from, self._p, q_seen, self.count) and bool(
            np.all(np.abs(self._own_p.imag) <= 1e-12 * max(self.bound, 1.0)))

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2)."""
        z = np.ascontiguousarray(x).view(complex)[:, 0]
        seen = z[self._from]
        along = self._p * seen
        if self._q is None:
            rate = self._summed(along) - self._own_p * z
        else:
            along += self._q * seen.conj()
            rate = self._summed(along) - self._own_p * z - self._own_q * z.conj()
        return rate.view(float).reshape(x.shape)

    def _summed(self, along_edges: NDArray[np.generic]) -> NDArray[np.complex128]:
        total = np.zeros(self.count, dtype=complex)
        if len(self._nodes) == self.count:
            np.add.reduceat(along_edges, self._starts, out=total)
        elif len(self._nodes):
            total[self._nodes] = np.add.reduceat(along_edges, self._starts)
        return total


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
        """Turn the phases into complex factors."""
        if not (np.isfinite(gain) and gain > 0.0):
            raise ParameterError(f'gain = {gain!r} 1/s must be finite and greater than 0')
        places = np.zeros(count) if phases is None else np.asarray(phases, dtype=float)
        if places.shape != (count,) or not np.all(np.isfinite(places)):
            raise ParameterError(f'phases must be {count} finite numbers')
        self.count, self.bound = count, gain * count
        self._pull = gain * count
        self._turn = None if not places.any() else np.exp(-1j * places)
        self.turned = self._turn is not None
        self._gain = gain

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2)."""
        z = np.ascontiguousarray(x).view(complex)[:, 0]
        if self._turn is None:
            rate = self._gain * z.sum() - self._pull * z
        else:
            rate = (self._gain * np.vdot(self._turn, z)) * self._turn - self._pull * z
        return rate.view(float).reshape(x.shape)


def _complex_form(matrices: Array) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Numbers p, q with (B x as complex) = p z + q z̄, for real matrices B (E, 2, 2)."""
    a, b, c, d = matrices.reshape(-1, 4).T
    return 0.5 * ((a + d) + 1j * (c - b)), 0.5 * ((a - d) + 1j * (c + b))


def _is_symmetric(to: NDArray[np.intp], seen: NDArray[np.intp], p: NDArray[np.complex128],
                  q: NDArray[np.complex128], count: int) -> bool:
    """Whether every edge has its reverse with the transposed matrix (p̄ and q)."""
    forwards, backwards = to * count + seen, seen * count + to
    a, b = np.argsort(forwards), np.argsort(backwards)
    return bool(np.array_equal(forwards[a], backwards[b])
                and len(np.unique(forwards)) == len(forwards)
                and np.allclose(p[a], p[b].conj(), rtol=1e-12, atol=0.0)
                and np.allclose(q[a], q[b], rtol=1e-12, atol=1e-300))


class PhaseEdgeCoupling:
    """Sine coupling over a list of edges.

    Parameters
    ----------
    graph : CouplingGraph
        Couplings with gains K = k I.

    Raises
    ------
    ParameterError
        If a gain is not a multiple of the identity.
    """

    state_size = 1

    def __init__(self, graph: CouplingGraph) -> None:
        """Take the edges as they act on points of the unit circle."""
        scalars = graph.gains[:, 0, 0]
        if not np.array_equal(graph.gains, scalars[:, None, None] * np.eye(2)):
            raise ParameterError('phase oscillators need gains K = k I')
        self._on_circle = EdgeCoupling(graph)
        self.count, self.bound = graph.size, self._on_circle.bound
        self.symmetric, self.turned = self._on_circle.symmetric, self._on_circle.turned

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 1) → (N, 1) [rad/s]."""
        return _along_the_circle(self._on_circle, x)


class PhaseMeanFieldCoupling:
    """All-to-all sine coupling with one gain; parameters as of MeanFieldCoupling."""

    state_size = 1
    symmetric = True

    def __init__(self, count: int, gain: float, phases: ArrayLike | None = None) -> None:
        """Take the mean field of points of the unit circle."""
        self._on_circle = MeanFieldCoupling(count, gain, phases)
        # of Σ k sin(θ_j − θ_i) the Jacobian's norm is at most twice the largest row sum
        self.count, self.bound = count, 2.0 * self._on_circle.bound
        self.turned = self._on_circle.turned

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 1) → (N, 1) [rad/s]."""
        return _along_the_circle(self._on_circle, x)


def _along_the_circle(coupling: EdgeCoupling | MeanFieldCoupling, x: Array) -> Array:
    z = np.exp(-1j * x[:, 0])
    rate = coupling(z.view(float).reshape(-1, 2)).view(complex)[:, 0]
    return -(z.conj() * rate).imag[:, None]
