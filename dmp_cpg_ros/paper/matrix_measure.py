# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Matrix measures (logarithmic norms) under the 1, 2, ∞ and weighted norms (Section 3.1).

    μ(A) = lim_{h→0+} (‖I + hA‖ − 1)/h

A system is contracting at the rate λ when μ(F) ≤ −λ for its generalized Jacobian F in *some* norm
(Lozinskii 1959, Dahlquist 1959; closed forms: Vidyasagar 2002, Section 2.2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.contraction.capture_anywhere import Interval
from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]

NORMS = (1, 2, np.inf)
"""Norms that have a closed form here."""

_EPS = float(np.finfo(float).eps)


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
    matrix: Array = np.asarray(A, dtype=float)
    if Theta is not None:
        T = _coordinates(Theta, matrix.shape[-1])
        matrix = T @ matrix @ np.linalg.inv(T)
    if norm == 2:
        symmetric: Array = 0.5 * (matrix + np.swapaxes(matrix, -1, -2))
        return np.asarray(np.linalg.eigvalsh(symmetric)[..., -1], dtype=float)
    diagonal: Array = np.diagonal(matrix, axis1=-2, axis2=-1)
    beside = np.abs(matrix).sum(axis=_summed_axis(norm)) - np.abs(diagonal)
    return np.asarray((diagonal + beside).max(axis=-1), dtype=float)


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
    diagonal = np.diagonal(A.upper, axis1=-2, axis2=-1)
    off = A.magnitude * (1.0 - np.eye(n))
    beside = slack * off.sum(axis=_summed_axis(norm))
    total = diagonal + beside
    return (total + 2.0 * _EPS * np.abs(total)).max(axis=-1)


def _summed_axis(norm: float) -> int:
    if norm == 1:
        return -2
    if norm == np.inf:
        return -1
    raise ParameterError(f'norm {norm!r} has no closed form here; valid are 1, 2 and inf')


def _coordinates(Theta: ArrayLike, n: int) -> Array:
    T = np.asarray(Theta, dtype=float)
    if T.ndim == 1:
        if np.any(T <= 0.0):
            raise ParameterError(f'weights {T.tolist()} must all be positive')
        T = np.diag(T)
    if T.shape != (n, n) or np.linalg.matrix_rank(T) < n:
        raise ParameterError(f'a change of coordinates must be an invertible {n} x {n} matrix or '
                             f'{n} positive weights')
    return T
