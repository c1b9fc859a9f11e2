# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Synchronisation (Theorem 4) on any graph, with the eigenvalue read correctly.

Condition (eigcond): the connectivity of L_K exceeds max_i λ_max(A_is). For a bidirectional graph
the connectivity is the smallest eigenvalue of L_K that is not one of the n zeros. Where the graph
is directed, only what can be proved is certified: the projected measure −μ(−V L Vᵀ), the same in
weights ξ (ξᵀL = 0), or a hierarchy of components that follow a root (Propositions 2 and 3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph
from dmp_cpg_ros.core.maths import Array


@dataclass(frozen=True)
class Synchronisation:
    """Both sides of the synchronisation condition.

    Attributes
    ----------
    connectivity : float
        Decay of disagreement by the coupling alone [1/s].
    growth : float
        max_i λ_max(A_is), growth of disagreement by the oscillators [1/s].
    weights : ndarray (N,) or None
        ξ, adding up to 1, of the norm (Σ ξ_i |x_i − x̄|²)^½ in which disagreement shrinks; None
        when components of the graph shrink one after the other.
    method : str
        How the connectivity was bounded: ``symmetric``, ``projected``, ``weighted``,
        ``hierarchical`` or ``not connected``.
    free_mean : bool
        Whether Σ ξ_i x_i feels no coupling, (ξ ⊗ I)ᵀ L_K = 0.
    overshoot : float
        Largest Σ_j (‖K_ij‖ − λ_min(K_ij)) of a node [1/s]: how fast the couplings may drive states
        out of a disc; 0 for K_ij = k_ij I.
    """

    connectivity: float
    growth: float
    weights: Array | None
    method: str
    free_mean: bool = True
    overshoot: float = 0.0

    @property
    def rate(self) -> float:
        """λ: disagreement shrinks like exp(−λt) from every initial state [1/s]."""
        return self.connectivity - self.growth

    @property
    def synchronises(self) -> bool:
        """Whether the condition holds."""
        return self.rate > 0.0


def synchronisation(graph: CouplingGraph, growth: float) -> Synchronisation:
    """Theorem 4's condition, by the best bound that is proved for the graph.

    Parameters
    ----------
    graph : CouplingGraph
        Couplings; the oscillators are identical up to their places.
    growth : float
        max_i λ_max(A_is) over the region that the states stay in; ρr² everywhere [1/s].

    Returns
    -------
    Synchronisation
        Not synchronising (connectivity 0) when no node reaches all others.
    """
    return replace(_without_growth(graph), growth=growth)


@lru_cache(maxsize=64)
def _without_growth(graph: CouplingGraph) -> Synchronisation:
    """What the couplings give, kept: gaits and oscillators change more often than they do."""
    L = graph.block_laplacian()
    scalar = comparison_laplacian(graph)
    found = _best_bound(graph, L, scalar)
    tiny = 1e-9 * (1.0 + float(np.abs(L).max()))
    felt = 0.0 if found.weights is None else float(
        np.abs(found.weights.dot(L.reshape(graph.size, -1))).max())
    return replace(found, free_mean=felt <= tiny, overshoot=overshoot(scalar))


def _best_bound(graph: CouplingGraph, L: Array, scalar: Array) -> Synchronisation:
    """Largest connectivity of those that are proved for the graph."""
    even = np.full(graph.size, 1.0 / graph.size)
    symmetric = bool(np.abs(L - L.T).max() <= 1e-12 * (1.0 + np.abs(L).max()))
    best = Synchronisation(connectivity(L, graph.size), 0.0, even,
                           'symmetric' if symmetric else 'projected')
    if symmetric:
        return _connected(best)
    weights = left_null_weights(scalar)
    weighted = None if weights is None else Synchronisation(
        connectivity(L, graph.size, weights), 0.0, weights, 'weighted')
    for other in (weighted, _hierarchical(graph, L, scalar)):
        if other is not None and other.connectivity > best.connectivity * (1.0 + _TINY):
            best = other  # of equal ones the first, however they are rounded
    return _connected(best)


def _connected(found: Synchronisation) -> Synchronisation:
    """Report a connectivity of rounding errors as what it is."""
    if found.connectivity > 1e-9:
        return found
    return Synchronisation(0.0, 0.0, None, 'not connected')


def _hierarchical(graph: CouplingGraph, L: Array, scalar: Array) -> Synchronisation | None:
    """Root component first, then each component driven by those before it.

    A driven component contracts towards its only solution, which is the root's, at the decay of
    its grounded Laplacian minus the growth; the hierarchy's rate is the smallest of all.
    """
    root, *others = components(graph)
    smallest, _ = _of_root(L, scalar, root)
    for group in others:
        smallest = min(smallest, slowest_rate(scalar[np.ix_(group, group)]))
    if not others or not np.isfinite(smallest) or smallest <= 1e-9:
        return None
    return Synchronisation(float(smallest), 0.0, None, 'hierarchical')


def _of_root(L: Array, scalar: Array, root: list[int]) -> tuple[float, Array]:
    """Connectivity of a root component, and the better of even and natural weights."""
    even, within = np.full(len(root), 1.0 / len(root)), [2 * i + axis for i in root
                                                         for axis in range(2)]
    natural = left_null_weights(scalar[np.ix_(root, root)]) if len(root) > 1 else None
    return max(((connectivity(L[np.ix_(within, within)], len(root), xi), xi)
                for xi in (even, natural) if xi is not None), key=lambda found: found[0])


_TINY = 1e-9


def synchronisation_complement(size: int, dimension: int = 2,
                               weights: Array | None = None) -> Array:
    """Matrix V with orthonormal rows whose null space is where all (√ξ-weighted) nodes agree.

    Parameters
    ----------
    size : int
        Number N of nodes.
    dimension : int
        State dimension n of one node.
    weights : ndarray (N,), optional
        ξ > 0; equal without.

    Returns
    -------
    ndarray ((N−1)n, Nn)
    """
    return _complement((np.ones(size) if weights is None else np.sqrt(weights)).tobytes(),
                       dimension)


@lru_cache(maxsize=64)
def _complement(direction: bytes, dimension: int) -> Array:
    across = np.linalg.svd(np.frombuffer(direction)[None])[2][1:]            # (N-1, N)
    V = np.kron(across, np.eye(dimension))
    V.flags.writeable = False
    return V


def connectivity(L: Array, size: int, weights: Array | None = None) -> float:
    """Smallest decay of the disagreement Σ ξ_i |x_i − x̄|² under ẋ = −L x.

    Parameters
    ----------
    L : ndarray (Nn, Nn)
        Block Laplacian, L (1 ⊗ z) = 0; it need not be symmetric.
    size : int
        Number N of nodes.
    weights : ndarray (N,), optional
        ξ > 0 of the disagreement, x̄ the ξ-weighted mean; equal without. Any ξ gives a true bound;
        the left null vector of a directed graph's Laplacian is the natural one.

    Returns
    -------
    float
        λ_min(V L_K Vᵀ) in the weighted coordinates [1/s]; for a symmetric L_K without weights the
        smallest eigenvalue that is not one of the n zeros.
    """
    dimension = len(L) // size
    V = synchronisation_complement(size, dimension, weights)
    if len(V) == 0:
        return float('inf')
    if weights is not None:
        root = np.repeat(np.sqrt(weights), dimension)
        L = root[:, None] * L / root[None, :]
    return float(np.linalg.eigvalsh(V @ (0.5 * (L + L.T)) @ V.T)[0])


def comparison_laplacian(graph: CouplingGraph) -> Array:
    """Scalar Laplacian that bounds the couplings node by node.

    |x_i − z| falls at least like this matrix says: λ_min of K_ij's symmetric part on the diagonal,
    −‖K_ij‖ beside it. For gains K_ij = k_ij I it is the graph's own weighted Laplacian.

    Returns
    -------
    ndarray (N, N)
        [1/s]
    """
    return graph.comparison.copy()


def overshoot(laplacian: Array) -> float:
    """Largest Σ_j (‖K_ij‖ − λ_min(K_ij)) of a node [1/s], from the comparison Laplacian.

    The disc |x| ≤ R cannot be left when ρ(R² − r²) is not below it; it is 0 for K_ij = k_ij I.
    """
    most = -float(laplacian.sum(axis=1).min(initial=0.0))
    return most if most > 1e-9 * (1.0 + float(np.abs(laplacian).max(initial=0.0))) else 0.0


def invariant_radius(radius: float, overshot: float, rho: float) -> float:
    """R of the disc |x| ≤ R that no oscillator of a radius r leaves, from :func:`overshoot` and ρ
    [1/s]: R² = r² + overshoot/ρ.
    """
    return radius if overshot == 0.0 else float(np.sqrt(radius**2 + overshot / rho))


def slowest_rate(M: Array) -> float:
    """Smallest decay rate of u̇ = −M u for a matrix with no positive entry off its diagonal.

    The eigenvalue of smallest real part of such a matrix is real (Perron-Frobenius; Berman &
    Plemmons 1994, chapter 6), and positive exactly when M is a nonsingular M-matrix. With its
    eigenvector v > 0 the norm max_i |x_i|/v_i shrinks at that rate: the matrix measure of a
    weighted norm, and for a symmetric M the same number as in the 2-norm.

    Returns
    -------
    float
        [1/s]
    """
    if _same(M, M.T):
        return float(np.linalg.eigvalsh(M)[0])
    return float(np.linalg.eigvals(M).real.min())


def _same(M: Array, other: Array) -> bool:
    """Whether all entries are the same numbers, but perhaps not where a zero is negative."""
    return M.tobytes() == other.tobytes()


def grounded_connectivity(graph: CouplingGraph, gains: Array) -> float:
    """Decay of everything when nodes are held by gains α: that of L_K + diag(α).

    Parameters
    ----------
    graph : CouplingGraph
        Couplings.
    gains : ndarray (N,)
        α_i ≥ 0 [1/s].

    Returns
    -------
    float
        The better of λ_min(L_K + diag α) in the 2-norm and the weighted max-norm [1/s].
    """
    M = comparison_laplacian(graph)
    M.ravel()[::len(M) + 1] += gains
    slowest = slowest_rate(M)
    if graph.weights is None:
        L = graph.block_laplacian()
        symmetric = 0.5 * (L + L.T) + np.diag(np.repeat(gains, 2))
    elif _same(M, M.T):
        return slowest
    else:
        symmetric = 0.5 * (M + M.T)  # the same, for K_ij = k_ij I, in both directions of a state
    return max(float(np.linalg.eigvalsh(symmetric)[0]), slowest)


def left_null_weights(laplacian: Array) -> Array | None:
    """Weights ξ with ξᵀ L = 0 and Σ ξ = 1 of a strongly connected scalar Laplacian.

    Returns
    -------
    ndarray (N,) or None
        None when the graph is not strongly connected, so that no ξ > 0 exists.
    """
    xi = np.abs(np.linalg.svd(laplacian.T)[2][-1])
    xi /= xi.sum()
    return xi if xi.min() > _TINY else None


def cascade_weights(graph: CouplingGraph, share: float) -> Array:
    """Weights ξ in which a graph of components that follow one another is nearly as connected as
    each of them.

    In weighted coordinates the couplings between components shrink with the root of the share,
    so that what is left is the blocks. A grounded block M with Perron vectors M v = λv and
    Mᵀw = λw has λ_min of its symmetric part equal to λ in the weights w_i/v_i: (w_i v_i)^½ > 0 is
    an eigenvector from both sides.

    Parameters
    ----------
    graph : CouplingGraph
        Couplings; a root reaches all.
    share : float
        Weight of each component as a share of the one before it, ≪ 1.

    Returns
    -------
    ndarray (N,)
        ξ > 0, adding up to 1.
    """
    scalar, (root, *others) = comparison_laplacian(graph), components(graph)
    xi = np.zeros(graph.size)
    _, xi[root] = _of_root(graph.block_laplacian(), scalar, root)
    for place, group in enumerate(others, 1):
        M = scalar[np.ix_(group, group)]
        right, left = (np.abs(vectors[:, values.real.argmin()].real)
                       for values, vectors in map(np.linalg.eig, (M, M.T)))
        xi[group] = share**place * left / right / (left / right).max()
    return xi / xi.sum()


def components(graph: CouplingGraph) -> list[list[int]]:
    """Strongly connected components in an order in which no component acts on an earlier one.

    Returns
    -------
    list of list of int
        The first component is a root: nothing outside acts on it.
    """
    reach = np.eye(graph.size, dtype=bool)                  # [i, j]: j acts on i
    for i, j in graph.edges:
        reach[i, j] = True
    for k in range(graph.size):
        reach |= reach[:, k:k + 1] & reach[k:k + 1, :]
    groups: list[list[int]] = []
    for i in range(graph.size):
        if not any(i in group for group in groups):
            groups.append([int(j) for j in np.flatnonzero(reach[i] & reach[:, i])])
    return sorted(groups, key=lambda group: int(np.count_nonzero(reach[group[0]])))
