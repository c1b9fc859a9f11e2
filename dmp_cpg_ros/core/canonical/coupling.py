# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Coupling of oscillators: edges of a graph with their gains and phase offsets.

An edge (i, j) means that oscillator i feels K_ij (R(φ_ij) x_j − x_i), with φ_ij the phase by which
i leads j (paper, Section 5; Wang & Slotine 2005 for the block Laplacian).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from dmp_cpg_ros.core.canonical.phase import phase_rotation
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array

Edges = tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class CouplingGraph:
    """Directed edges with 2×2 gains and the phases at which the nodes lock.

    Attributes
    ----------
    size : int
        Number N of oscillators.
    edges : tuple of (int, int)
        Pairs (i, j): j acts on i. A bidirectional coupling is two edges.
    gains : ndarray (E, 2, 2)
        K_ij of each edge [1/s]; its symmetric part is positive definite.
    phases : ndarray (N,)
        Phase of each oscillator relative to oscillator 0 when locked [rad]; φ_ij = phases[i] −
        phases[j].

    Raises
    ------
    ParameterError
        If there is no node, shapes do not fit, an edge names a node that is not there, or a
        gain's symmetric part is not positive definite.
    """

    size: int
    edges: Edges
    gains: Array
    phases: Array

    def __post_init__(self) -> None:
        """Validate."""
        if self.size < 1:
            raise ParameterError(f'size = {self.size!r} must be at least 1')
        if self.gains.shape != (len(self.edges), 2, 2) or self.phases.shape != (self.size,):
            raise ParameterError(
                f'{len(self.edges)} edges and {self.size} nodes need gains '
                f'({len(self.edges)}, 2, 2) and phases ({self.size},), '
                f'not {self.gains.shape} and {self.phases.shape}')
        if not (np.all(np.isfinite(self.gains)) and np.all(np.isfinite(self.phases))):
            raise ParameterError('coupling gains and phase offsets must be finite')
        for i, j in self.edges:
            if not (0 <= i < self.size and 0 <= j < self.size and i != j):
                raise ParameterError(f'edge ({i}, {j}) must join two nodes 0 to {self.size - 1}')
        for edge, smallest in zip(self.edges, self._sizes[0], strict=True):
            if smallest <= 0.0:
                raise ParameterError(
                    f'gain of edge {edge} must have a positive definite symmetric part; '
                    f'its smallest eigenvalue is {smallest:.4g}')

    @cached_property
    def weights(self) -> Array | None:
        """k_ij of each edge, ndarray (E,) [1/s]; None where not every K_ij is k_ij I."""
        k = self.gains[:, 0, 0]
        return k if np.array_equal(self.gains, k[:, None, None] * np.eye(2)) else None

    def coupling_matrix(self) -> Array:
        """Matrix −L with ẋ = … − L x in the original coordinates (offsets included).

        Returns
        -------
        ndarray (2N, 2N)
        """
        return self._block_matrix(
            self.gains, self.gains @ _between(
                tuple(map(tuple, self.edges)), self.phases.tobytes()))

    def block_laplacian(self) -> Array:
        """Block Laplacian L in the co-rotated coordinates, where locked states are equal.

        Returns
        -------
        ndarray (2N, 2N)
            Σ over edges of K̃_ij at (i, i) and −K̃_ij at (i, j), with K̃_ij = R(φ_i)ᵀ K_ij R(φ_i)
            the gain as the locked coordinates x̃_i = R(φ_i)ᵀ x_i see it; K̃ = K for every K = a I
            + b S, such as k I.
        """
        return self._locked.copy()

    @cached_property
    def _locked(self) -> Array:
        turned = self.gains
        if self.weights is None:
            turns = np.array([phase_rotation(float(self.phases[i])) for i, _ in self.edges])
            turned = turns.swapaxes(1, 2) @ turned @ turns
        return -self._block_matrix(turned, turned)

    @cached_property
    def comparison(self) -> Array:
        """Diagonal Σ_j λ_min of K_ij's symmetric part, −‖K_ij‖ beside it, ndarray (N, N) [1/s]."""
        L = np.zeros((self.size, self.size))
        if not self.edges:
            return L
        for (i, j), weakest, strongest in zip(self.edges, *self._sizes, strict=True):
            L[i, i] += weakest
            L[i, j] -= strongest
        return L

    @cached_property
    def _sizes(self) -> tuple[Array, Array]:
        """λ_min of the symmetric part and ‖K_ij‖ of each edge, ndarray (E,) each [1/s]."""
        if self.weights is not None:
            return self.weights, np.abs(self.weights)
        symmetric = 0.5 * (self.gains + np.swapaxes(self.gains, 1, 2))
        return (np.asarray(np.linalg.eigvalsh(symmetric)[:, 0]),
                np.asarray(np.linalg.svd(self.gains, compute_uv=False)[:, 0]))

    @cached_property
    def strongest(self) -> float:
        """Largest entry of :attr:`comparison` [1/s]."""
        return float(np.abs(self.comparison).max())

    @cached_property
    def least_pull(self) -> float:
        """Smallest sum of a row of :attr:`comparison` [1/s]: 0 where couplings only average."""
        return float(self.comparison.sum(axis=1).min())

    def _block_matrix(self, felt: Array, seen: Array) -> Array:
        """Matrix (2N, 2N) of what nodes feel of themselves (E, 2, 2), negative, and of others."""
        matrix = np.zeros((2 * self.size, 2 * self.size))
        if self.edges:
            i, j = np.array(self.edges).T
            blocks = matrix.reshape(self.size, 2, self.size, 2).swapaxes(1, 2)
            np.subtract.at(blocks, (i, i), felt)
            np.add.at(blocks, (i, j), seen)
        return matrix


@lru_cache
def _between(edges: Edges, phases: bytes) -> Array:
    """Rotations R(φ_ij) of edges, ndarray (E, 2, 2)."""
    phi = np.frombuffer(phases)
    return np.array([phase_rotation(float(phi[i] - phi[j])) for i, j in edges]).reshape(-1, 2, 2)


def graph_from_edges(size: int, edges: Edges, gain: float | Array,
                     phases: Array | None = None) -> CouplingGraph:
    """Graph in which every edge has the same gain, or every edge a weight.

    Parameters
    ----------
    size : int
        Number of oscillators.
    edges : tuple of (int, int)
        Directed edges (i, j): j acts on i.
    gain : float, ndarray (E,) or ndarray (2, 2)
        k for K = k I, of all edges or of each, or K of all [1/s].
    phases : ndarray (N,), optional
        Locked phases [rad]; zeros without.

    Returns
    -------
    CouplingGraph
    """
    K = np.asarray(gain, dtype=float)
    if K.shape not in ((), (2, 2), (len(edges),)):
        raise ParameterError(f'a gain is a number, one for each of {len(edges)} edges, or a '
                             f'matrix (2, 2), not {K.shape}')
    K = K if K.ndim == 2 else K[..., None, None] * np.eye(2)
    gains = np.broadcast_to(K, (len(edges), 2, 2)).copy()
    return CouplingGraph(
        size, edges, gains, np.zeros(size) if phases is None else np.asarray(phases, float))


@lru_cache
def degrees(name: str, size: int) -> tuple[int, ...]:
    """How many nodes act on each node of a named graph. Those on which as many act are alike:
    some renumbering that leaves the graph as it is takes one to the other.
    """
    edges = topology(name, size)
    return tuple(sum(i == node for i, _ in edges) for node in range(size))


TOPOLOGIES = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')
"""Names of graphs."""


def topology(name: str, size: int) -> Edges:
    """Edges of a graph of ``TOPOLOGIES``.

    The star's centre is node 0; the directed ring passes the state on from i to i + 1.

    Raises
    ------
    ParameterError
        If the name is not known.
    """
    following = [(i, i + 1) for i in range(size - 1)]
    closing = [(size - 1, 0)] if size > 2 else []
    undirected: dict[str, Iterable[tuple[int, int]]] = {
        # lazy, for it is long where the others are short
        'all_to_all': ((i, j) for i in range(size) for j in range(i + 1, size)),
        'ring': following + closing,
        'path': following,
        'star': [(0, i) for i in range(1, size)],
    }
    if name == 'directed_ring':
        return tuple((j, i) for i, j in following + [(size - 1, 0)][:size - 1])
    if name not in undirected:
        raise ParameterError(f"topology '{name}' must be {', '.join(undirected)} or directed_ring")
    return tuple(edge for i, j in undirected[name] for edge in ((i, j), (j, i)))
