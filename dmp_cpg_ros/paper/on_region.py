# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Contraction and transverse contraction on a region (Definitions 1 and 2): sampled, and proved.

The sampled tests evaluate Jacobians at points and say so in their result. The proved test bounds
the matrix measure on boxes by interval arithmetic and splits the boxes that decide.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.contraction.capture_anywhere import Interval
from dmp_cpg_ros.core.contraction.finding import PROVED, SAMPLED, Finding
from dmp_cpg_ros.core.contraction.region import Box, Region
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.jacobians import Array, Field, numerical_jacobian
from dmp_cpg_ros.paper.matrix_measure import interval_measure, matrix_measure

Matrix = Callable[[Array], Array]

_TOLERANCE = 1e-3


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
            raise ParameterError(f'x = {x.tolist()} is an equilibrium; a region of transverse '
                                 'contraction to an orbit must leave equilibria out')
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
    enclosure = jacobian
    if weights is not None:
        w = np.asarray(weights, dtype=float)
        if np.any(w <= 0.0):
            raise ParameterError(f'weights {w.tolist()} must all be positive')
        ratios = Interval.of(w[:, None]) / Interval.of(w[None, :])

        def enclosure(boxes: Interval) -> Interval:
            return jacobian(boxes) * ratios

    boxes = box.as_interval()
    bound, attained, evaluations = -np.inf, -np.inf, 0
    while True:
        evaluations += len(boxes.lower)
        upper = interval_measure(enclosure(boxes), norm)
        at_points = interval_measure(enclosure(Interval.of(boxes.middle)), norm)
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
