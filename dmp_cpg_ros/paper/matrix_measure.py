# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Contraction by matrix measures, at points, on regions (Definitions 1 and 2) and of networks.

Matrix measures (logarithmic norms) under the 1, 2, ∞ and weighted norms (Section 3.1) are

    μ(A) = lim_{h→0+} (‖I + hA‖ − 1)/h

A system is contracting at the rate λ when μ(F) ≤ −λ for its generalized Jacobian F in *some* norm
(Lozinskii 1959, Dahlquist 1959; closed forms: Vidyasagar 2002, Section 2.2).

On regions, the sampled tests evaluate Jacobians at points and say so in their result. The proved
test bounds the matrix measure on boxes by interval arithmetic and splits the boxes that decide.

Synchronisation under other norms (second remark after Theorem 4): the remark prints
max_i μ(A_i) + μ(−V L_K Vᵀ) < 0 for any matrix measure. Subadditivity gives μ(V Ā Vᵀ) + μ(−V L Vᵀ)
with Ā = diag(A_1, …, A_N), and μ(V Ā Vᵀ) ≤ max_i μ(A_i) holds in the 2-norm, where V has
orthonormal rows, but *not* in the 1- and ∞-norm when N ≥ 3 (a test has the counterexample). Here
the whole matrix V(Ā − L)Vᵀ is measured instead, for every Ā whose blocks lie in the hull of given
matrices: a measure is convex, so the worst case is at a vertex.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.contraction.capture_anywhere import Interval
from dmp_cpg_ros.core.contraction.finding import PROVED, SAMPLED
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation_complement
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.jacobians import Array, Field, numerical_jacobian
from dmp_cpg_ros.paper.region import Box, Finding, Region

Matrix = Callable[[Array], Array]
"""Matrix at a state, ndarray (n,) → (n, n)."""

NORMS = (1, 2, np.inf)
"""Norms that have a closed form here."""

_EPS = float(np.finfo(float).eps)
_MOST_CASES = 200_000
_TOLERANCE = 1e-3


def matrix_measure(A: ArrayLike, norm: float = 2, Theta: ArrayLike | None = None) -> Array:
    """Measure μ(Θ A Θ⁻¹) of matrices.

    Parameters
    ----------
    A : array_like (..., n, n)
        Matrices [1/s].
    norm : {1, 2, numpy.inf}
        Norm of the transformed vectors Θ x.
    Theta : array_like (n, n) or (n,), optional
        Change of coordinates, or weights w > 0 for Θ = diag(w); none for the plain norm.

    Returns
    -------
    ndarray (...)
        [1/s]

    Raises
    ------
    ParameterError
        If the norm is another one, the weights are not positive or Θ is singular.
    """
    matrix = np.asarray(A, dtype=float)
    if Theta is not None:
        T = _coordinates(Theta, matrix.shape[-1])
        matrix = T @ matrix @ np.linalg.inv(T)
    if norm == 2:
        symmetric = 0.5 * (matrix + np.swapaxes(matrix, -1, -2))
        return np.asarray(np.linalg.eigvalsh(symmetric)[..., -1], dtype=float)
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
    beside = np.abs(matrix).sum(axis=_summed_axis(norm)) - np.abs(diagonal)
    return np.asarray((diagonal + beside).max(axis=-1), dtype=float)


def stack(rows: list[list[Interval | float]]) -> Interval:
    """Intervals (…,) of equal shape put together as matrices.

    Parameters
    ----------
    rows : list of lists
        Entries of the matrix, intervals or numbers.

    Returns
    -------
    Interval (..., n, m)
    """
    entries = [[Interval.of(entry) for entry in row] for row in rows]
    shape = np.broadcast_shapes(*(entry.lower.shape for row in entries for entry in row))

    def packed(end: str) -> Array:
        return np.stack([np.stack([np.broadcast_to(getattr(entry, end), shape) for entry in row],
                                  axis=-1) for row in entries], axis=-2)

    return Interval(packed('lower'), packed('upper'))


def interval_measure(A: Interval, norm: float = 2) -> Array:
    """Upper bound on the measure of every matrix in interval matrices.

    Parameters
    ----------
    A : Interval (..., n, n)
        Enclosures of Jacobians [1/s].
    norm : {1, 2, numpy.inf}
        Norm.

    Returns
    -------
    ndarray (...)
        Rounded outwards [1/s]. For the 2-norm: μ(middle) + ‖radius‖, exact for points.
    """
    n = A.lower.shape[-1]
    slack = 1.0 + 4.0 * n * _EPS
    if norm == 2:
        middle, radius = A.middle, A.radius
        symmetric = 0.5 * (middle + np.swapaxes(middle, -1, -2))
        spread = 0.5 * (radius + np.swapaxes(radius, -1, -2))
        eigenvalue = np.linalg.eigvalsh(symmetric)[..., -1]
        rounding = 8.0 * n * _EPS * np.abs(symmetric).sum(axis=(-2, -1))
        return eigenvalue + rounding + slack * spread.sum(axis=-1).max(axis=-1)
    off = A.magnitude * (1.0 - np.eye(n))
    total = np.diagonal(A.upper, axis1=-2, axis2=-1) + slack * off.sum(axis=_summed_axis(norm))
    return (total + 2.0 * _EPS * np.abs(total)).max(axis=-1)


def _summed_axis(norm: float) -> int:
    if norm not in (1, np.inf):
        raise ParameterError(f'norm {norm!r} has no closed form here; valid are 1, 2 and inf')
    return -2 if norm == 1 else -1


def _coordinates(Theta: ArrayLike, n: int) -> Array:
    T = np.asarray(Theta, dtype=float)
    if T.ndim == 1:
        if np.any(T <= 0.0):
            raise ParameterError(f'weights {T.tolist()} must all be positive')
        T = np.diag(T)
    if T.shape != (n, n) or np.linalg.matrix_rank(T) < n:
        raise ParameterError(f'Theta must be an invertible {n} x {n} matrix or {n} weights')
    return T


def sampled_contraction(
    jacobian: Matrix, region: Region, norm: float = 2, Theta: ArrayLike | None = None,
    count: int = 1000, seed: int = 0,
) -> Finding:
    """Contraction in a norm under a constant change of coordinates, at sampled points.

    Parameters
    ----------
    jacobian : callable
        A: ndarray (n,) → ndarray (n, n) [1/s]; see
        :func:`~dmp_cpg_ros.paper.jacobians.numerical_jacobian` for a field without one.
    region : Ball, Annulus or Box
        Where to sample; that it is forward invariant is the caller's concern.
    norm : {1, 2, numpy.inf}
        Norm.
    Theta : array_like (n, n) or (n,), optional
        Constant change of coordinates or weights.
    count, seed : int
        Number of points and seed of the generator.

    Returns
    -------
    Finding
        Grade ``sampled``; rate = −max μ over the points.
    """
    points = region.sample(count, seed)
    measures = matrix_measure(np.stack([jacobian(x) for x in points]), norm, Theta)
    worst = int(np.argmax(measures))
    rate = -float(measures[worst])
    return Finding(rate, SAMPLED, count, (
        f'at {count} sampled points the matrix measure is at most {-rate:.6g} 1/s '
        f'(at x = {np.round(points[worst], 6).tolist()}); nothing is known between them'))


def sampled_transverse_contraction(field: Field, region: Region, metric: Matrix | None = None,
                                   jacobian: Matrix | None = None, count: int = 1000,
                                   seed: int = 0) -> Finding:
    """Transverse contraction (eq. trans_condition) under a metric M(x), at sampled points.

    Parameters
    ----------
    field : callable
        f: ndarray (n,) → ndarray (n,) [1/s].
    region : Ball, Annulus or Box
        Where to sample.
    metric : callable, optional
        M: ndarray (n,) → ndarray (n, n), symmetric and positive definite; the identity without.
    jacobian : callable, optional
        A; found numerically without.
    count, seed : int
        Number of points and seed of the generator.

    Returns
    -------
    Finding
        Grade ``sampled``; rate = the smallest λ over displacements with fᵀMδ = 0.

    Raises
    ------
    ParameterError
        If a sampled point is an equilibrium, where nothing is transverse.
    """
    rates = []
    for x in region.sample(count, seed):
        f = field(x)
        if not np.linalg.norm(f) > 0.0:
            raise ParameterError(f'x = {x.tolist()} is an equilibrium: nothing is transverse')
        A = numerical_jacobian(field, x) if jacobian is None else jacobian(x)
        rates.append(_transverse_rate(x, f, A, metric or (lambda x: np.eye(x.size))))
    rate = min(rates)
    return Finding(rate, SAMPLED, count, f'at {count} sampled points transverse displacements '
                   f'shrink at {rate:.6g} 1/s or more; nothing is known between them')


def proved_contraction(jacobian: Callable[[Interval], Interval], box: Box, norm: float = 2,
                       weights: ArrayLike | None = None, budget: int = 20000) -> Finding:
    """Contraction at every point of a box, by interval bounds and bisection.

    Parameters
    ----------
    jacobian : callable
        Encloses A on boxes: Interval (k, n) → Interval (k, n, n) [1/s].
    box : Box
        Region.
    norm : {1, 2, numpy.inf}
        Norm.
    weights : array_like (n,), optional
        Positive weights w of the norm |diag(w) x|.
    budget : int
        Largest number of boxes that are looked at.

    Returns
    -------
    Finding
        Grade ``proved``: the rate is a true lower bound, within 0.1 % of the best of this norm
        when the budget sufficed.
    """
    boxes = box.as_interval()
    n = boxes.lower.shape[1]
    w = np.diag(_coordinates(np.ones(n) if weights is None else weights, n))
    ratios = Interval.of(w[:, None]) / Interval.of(w[None, :])
    bound, attained, evaluations = -np.inf, -np.inf, 0
    while True:
        evaluations += len(boxes.lower)
        upper = interval_measure(jacobian(boxes) * ratios, norm)
        at_points = interval_measure(jacobian(Interval.of(boxes.middle)) * ratios, norm)
        attained = max(attained, float(at_points.max()))
        undecided = upper > attained + _TOLERANCE * max(1.0, abs(attained))
        if evaluations + 2 * np.count_nonzero(undecided) > budget:
            undecided[:] = False
        bound = max(bound, float(upper[~undecided].max(initial=-np.inf)))
        if not np.any(undecided):
            break
        boxes = _split(boxes[undecided])
    return Finding(-bound, PROVED, evaluations, 'on the whole box the matrix measure is at most '
                   f'{bound:.6g} 1/s, by interval bounds on {evaluations} boxes')


def _split(boxes: Interval) -> Interval:
    """Halve every box along its longest side."""
    widths = boxes.upper - boxes.lower
    rows, axis = np.arange(len(widths)), widths.argmax(axis=1)
    lower, upper, middle = boxes.lower.copy(), boxes.upper.copy(), boxes.middle
    upper[rows, axis] = middle[rows, axis]
    lower[rows, axis] = middle[rows, axis]
    return Interval(np.concatenate([boxes.lower, lower]), np.concatenate([upper, boxes.upper]))


def _transverse_rate(x: Array, f: Array, A: Array, metric: Matrix) -> float:
    """Smallest λ with δᵀ(Ṁ + AᵀM + MA + 2λM)δ ≤ 0 for all δ with fᵀMδ = 0."""
    step = 1e-5 * max(1.0, float(np.linalg.norm(x))) / float(np.linalg.norm(f))
    M, M_dot = metric(x), (metric(x + step * f) - metric(x - step * f)) / (2.0 * step)
    transverse = np.linalg.svd((M @ f)[None])[2][1:].T                       # (n, n-1)
    W = transverse.T @ (M_dot + A.T @ M + M @ A) @ transverse
    half = np.linalg.inv(np.linalg.cholesky(transverse.T @ M @ transverse))
    return -0.5 * float(np.linalg.eigvalsh(half @ W @ half.T)[-1])


def coupling_measure(L: Array, size: int) -> float:
    """μ₂(−V L Vᵀ), how fast the coupling alone makes disagreement grow (negative: shrink) [1/s].

    Parameters
    ----------
    L : ndarray (Nn, Nn)
        Block Laplacian.
    size : int
        Number N of nodes.
    """
    V = synchronisation_complement(size, len(L) // size)
    return float(matrix_measure(-V @ L @ V.T))


def disagreement_measure(L: Array, size: int, jacobians: Sequence[Array], norm: float = 2
                         ) -> float:
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
        raise ParameterError(f'more than {_MOST_CASES} cases; give fewer vertices')
    n = len(L) // size
    V = synchronisation_complement(size, n)
    columns = [V[:, n * i:n * i + n] for i in range(size)]
    # V Ā Vᵀ is a sum of one term per node: combine their terms for every choice of vertices.
    terms = np.array([[column @ A @ column.T for A in jacobians] for column in columns])
    choices = np.array(list(product(range(len(jacobians)), repeat=size)))    # (cases, N)
    cases = sum(terms[i][choices[:, i]] for i in range(size))
    return float(matrix_measure(cases - V @ L @ V.T, norm).max())
