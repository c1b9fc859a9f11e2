# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Synchronisation under other norms: the matrix-measure form of Theorem 4 (second remark after it).

The remark prints max_i μ(A_i) + μ(−V L_K Vᵀ) < 0 for any matrix measure. Subadditivity gives
μ(V Ā Vᵀ) + μ(−V L Vᵀ) with Ā = diag(A_1, …, A_N), and μ(V Ā Vᵀ) ≤ max_i μ(A_i) holds in the
2-norm, where V has orthonormal rows, but *not* in the 1- and ∞-norm when N ≥ 3 (a test has the
counterexample). Here the whole matrix V(Ā − L)Vᵀ is measured instead, for every Ā whose blocks lie
in the hull of given matrices: a measure is convex, so the worst case is at a vertex.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.contraction.synchronisation import synchronisation_complement
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.matrix_measure import matrix_measure

Array = NDArray[np.float64]

_MOST_CASES = 200_000


def coupling_measure(L: Array, size: int, norm: float = 2, Theta: Array | None = None) -> float:
    """μ(−V L Vᵀ), how fast the coupling alone makes disagreement grow (negative: shrink) [1/s].

    Parameters
    ----------
    L : ndarray (Nn, Nn)
        Block Laplacian.
    size : int
        Number N of nodes.
    norm : {1, 2, numpy.inf}
        Norm of V x.
    Theta : ndarray, optional
        Change of coordinates of V x, or weights.
    """
    V = synchronisation_complement(size, len(L) // size)
    return float(matrix_measure(-V @ L @ V.T, norm, Theta))


def disagreement_measure(L: Array, size: int, jacobians: Sequence[Array], norm: float = 2,
                         Theta: Array | None = None) -> float:
    """Largest μ(V(Ā − L)Vᵀ) over all Ā whose blocks are in the hull of the given Jacobians.

    Parameters
    ----------
    L : ndarray (Nn, Nn)
        Block Laplacian.
    size : int
        Number N of nodes.
    jacobians : sequence of ndarray (n, n)
        Matrices whose convex hull contains the Jacobian of one oscillator on the region.
    norm : {1, 2, numpy.inf}
        Norm of V x.
    Theta : ndarray, optional
        Change of coordinates of V x, or weights.

    Returns
    -------
    float
        Negative when the network synchronises on the region; minus it is the rate [1/s].

    Raises
    ------
    ParameterError
        If the number of vertices to the power of the number of nodes is larger than 200,000.
    """
    if len(jacobians) ** size > _MOST_CASES:
        raise ParameterError(f'{len(jacobians)} vertices on {size} nodes are more than '
                             f'{_MOST_CASES} cases; give fewer vertices')
    n = len(L) // size
    V = synchronisation_complement(size, n)
    columns = [V[:, n * i:n * i + n] for i in range(size)]
    # V Ā Vᵀ is a sum of one term per node: combine their terms for every choice of vertices.
    terms = np.array([[column @ A @ column.T for A in jacobians] for column in columns])
    choices = np.array(list(product(range(len(jacobians)), repeat=size)))    # (cases, N)
    cases = sum(terms[i][choices[:, i]] for i in range(size))
    return float(matrix_measure(cases - V @ L @ V.T, norm, Theta).max())


def hopf_jacobian_vertices(rho: float, radius: float, omega: float, directions: int = 8
                           ) -> list[Array]:
    """Matrices whose hull contains the Andronov-Hopf Jacobian for every |x| ≤ radius.

    A = ωS + ρr²I − ρ|x|²(2I + P), with P = 2uuᵀ − I a reflection. The reflections form a circle in
    the symmetric traceless matrices; a regular polygon around it encloses them.

    Parameters
    ----------
    rho, radius, omega : float
        Parameters of the oscillator.
    directions : int
        Corners of the polygon, at least 3.
    """
    S = np.array([[0.0, 1.0], [-1.0, 0.0]])
    at_origin = omega * S + rho * radius**2 * np.eye(2)
    angles = 2.0 * np.pi * np.arange(directions) / directions
    stretch = 1.0 / np.cos(np.pi / directions)
    on_cycle = [at_origin - rho * radius**2 * (2.0 * np.eye(2) + stretch * np.array(
        [[np.cos(a), np.sin(a)], [np.sin(a), -np.cos(a)]])) for a in angles]
    return [at_origin, *on_cycle]
