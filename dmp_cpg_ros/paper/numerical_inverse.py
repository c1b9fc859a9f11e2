# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numerical Jacobians of a map and its inverse by Newton's method."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]
Map = Callable[[Any], Any]
"""A function of ndarray (n,)."""

_COMPLEX_STEP = 1e-30
# about eps^(1/5)
_DIFFERENCE_STEP = 6e-4
_NEWTON_STEPS = 30
_SMALLEST_PIECE = 2.0**-20


def complex_step_jacobian(function: Callable[[Array], Array], y: Array) -> Array:
    """Jacobian of an analytic function by the complex step (Squire & Trapp 1998); no cancellation.

    Raises
    ------
    ParameterError
        If the function returns real numbers for complex ones; what it does then cannot be
        differentiated so.
    """
    columns = []
    for direction in np.eye(len(y)):
        value = np.asarray(function(y + 1j * _COMPLEX_STEP * direction))
        if not np.iscomplexobj(value):
            raise ParameterError(
                "the function drops imaginary parts; use derivative = 'difference'"
            )
        columns.append(value.imag / _COMPLEX_STEP)
    return np.stack(columns, axis=1)


def difference_jacobian(function: Callable[[Array], Array], y: Array) -> Array:
    """Jacobian by five-point central differences, error O(h⁴).

    Parameters
    ----------
    function : callable
        ndarray (n,) → ndarray (m,).
    y : ndarray (n,)

    Returns
    -------
    ndarray (m, n)
    """
    columns = []
    for direction in np.eye(len(y)):
        h = _DIFFERENCE_STEP * max(1.0, abs(float(direction @ y)))
        near = np.asarray(function(y + h * direction)) - np.asarray(function(y - h * direction))
        far = np.asarray(function(y + 2.0 * h * direction)) - np.asarray(
            function(y - 2.0 * h * direction)
        )
        columns.append((8.0 * near - far) / (12.0 * h))
    return np.stack(columns, axis=1)


def newton_inverse(forward: Map, jacobian: Map, y_prime: Array, guess: Array) -> Array:
    """Solve T(y) = y' by Newton's method along the segment from T(guess) to y'.

    A full step is tried first; where Newton's method fails, the segment is halved. For a
    diffeomorphism of ℝⁿ the segment has a unique pre-image, so small enough pieces always succeed.

    Parameters
    ----------
    forward, jacobian : callable
        T and J.
    y_prime : ndarray (n,)
    guess : ndarray (n,)
        Where the search starts.

    Returns
    -------
    ndarray (n,)

    Raises
    ------
    ParameterError
        If no solution is found: the map is singular on the way, or y' is not in its image.
    """
    y = np.array(guess, dtype=float)
    begin, done, piece = forward(y), 0.0, 1.0
    tolerance = 1e-13 * (1.0 + float(np.abs(y_prime).max()) + float(np.abs(begin).max()))
    while done < 1.0:
        target = begin + min(done + piece, 1.0) * (y_prime - begin)
        found = _newton(forward, jacobian, target, y, tolerance)
        if found is None:
            piece *= 0.5
            if piece < _SMALLEST_PIECE:
                raise ParameterError(
                    f"T(y) = y' has no solution that Newton's method finds for y' = "
                    f'{y_prime.tolist()}; give the inverse or a guess that is nearer'
                )
        else:
            y, done, piece = found, done + piece, 2.0 * piece
    return y


def _newton(
    forward: Map, jacobian: Map, target: Array, y: Array, tolerance: float
) -> Array | None:
    """Newton's method with monotone residual; None where it does not converge."""
    residual = target - forward(y)
    size = float(np.abs(residual).max())
    for _ in range(_NEWTON_STEPS):
        if size <= tolerance:
            return y
        try:
            trial = y + np.linalg.solve(jacobian(y), residual)
        except np.linalg.LinAlgError:
            return None
        rest = target - forward(trial)
        new = float(np.abs(rest).max())
        if not new < size:
            return y if size <= 1e3 * tolerance else None
        y, residual, size = trial, rest, new
    return None
