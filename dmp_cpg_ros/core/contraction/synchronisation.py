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

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.graph import CouplingGraph
from dmp_cpg_ros.core.contraction.connectivity import (
    comparison_laplacian,
    components,
    connectivity,
    left_null_weights,
    overshoot,
    slowest_rate,
)

Array = NDArray[np.float64]


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
    L = graph.block_laplacian()
    scalar = comparison_laplacian(graph)
    found = _best_bound(graph, L, scalar, growth)
    tiny = 1e-9 * (1.0 + float(np.abs(L).max()))
    felt = 0.0 if found.weights is None else float(
        np.abs(np.kron(found.weights, np.eye(2)) @ L).max())
    return replace(found, free_mean=felt <= tiny, overshoot=overshoot(scalar))


def _best_bound(graph: CouplingGraph, L: Array, scalar: Array, growth: float) -> Synchronisation:
    """Largest connectivity of those that are proved for the graph."""
    even = np.full(graph.size, 1.0 / graph.size)
    symmetric = np.allclose(L, L.T, rtol=0.0, atol=1e-12 * (1.0 + np.abs(L).max()))
    best = Synchronisation(connectivity(L, graph.size), growth, even,
                           'symmetric' if symmetric else 'projected')
    if symmetric:
        return _connected(best)
    weights = left_null_weights(scalar)
    if weights is not None:
        weighted = Synchronisation(connectivity(L, graph.size, weights), growth, weights,
                                   'weighted')
        best = max(best, weighted, key=lambda found: found.connectivity)
    hierarchical = _hierarchical(graph, L, scalar, growth)
    if hierarchical is not None and hierarchical.connectivity > best.connectivity:
        best = hierarchical
    return _connected(best)


def _connected(found: Synchronisation) -> Synchronisation:
    """Report a connectivity of rounding errors as what it is."""
    if found.connectivity > 1e-9:
        return found
    return Synchronisation(0.0, found.growth, None, 'not connected')


def _hierarchical(graph: CouplingGraph, L: Array, scalar: Array,
                  growth: float) -> Synchronisation | None:
    """Root component first, then each component driven by those before it.

    A driven component contracts towards its only solution, which is the root's, at the decay of
    its grounded Laplacian minus the growth; the hierarchy's rate is the smallest of all.
    """
    root, *others = components(graph)
    within = [2 * i + axis for i in root for axis in range(2)]
    L_root = L[np.ix_(within, within)]
    smallest = connectivity(L_root, len(root))
    xi = left_null_weights(scalar[np.ix_(root, root)]) if len(root) > 1 else None
    if xi is not None:
        smallest = max(smallest, connectivity(L_root, len(root), xi))
    for group in others:
        smallest = min(smallest, slowest_rate(scalar[np.ix_(group, group)]))
    if not others or not np.isfinite(smallest) or smallest <= 1e-9:
        return None
    return Synchronisation(float(smallest), growth, None, 'hierarchical')
