# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Jacobians of a user's own field, and the generalized Jacobian of a metric (Section 3.1).

What this package ships has analytic Jacobians. For any other field the complex step (Squire &
Trapp, SIAM Review 40, 1998) is exact to rounding where the field is analytic code; where it is not
(an absolute value, an arctangent of two arguments) central differences take over.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.maths import Array

Field = Callable[[Array], Array]

_COMPLEX_STEP = 1e-30
_DIFFERENCE_STEP = 6e-4  # about the fifth root of the machine's precision
_AGREEMENT = 1e-5


def complex_step_jacobian(field: Field, x: ArrayLike) -> Array:
    """∂f/∂x (m, n) by the complex step, for fields that are made of analytic operations.

    Raises
    ------
    ParameterError
        If the field returns real numbers for complex ones; what it does then cannot be
        differentiated so.
    """
    x = np.asarray(x, dtype=float)
    columns = [field(x + 1j * _COMPLEX_STEP * direction) for direction in np.eye(x.size)]
    if not all(map(np.iscomplexobj, columns)):
        raise ParameterError('the function drops imaginary parts; take differences')
    return np.stack(columns, axis=-1).imag / _COMPLEX_STEP


def difference_jacobian(field: Field, x: ArrayLike) -> Array:
    """∂f/∂x (m, n) by five-point central differences, with a relative error of about 1e-11."""
    x = np.asarray(x, dtype=float)
    columns = []
    for k, direction in enumerate(np.eye(x.size)):
        h = _DIFFERENCE_STEP * max(1.0, abs(float(x[k])))
        near, far = (np.asarray(field(x + d * direction)) - np.asarray(field(x - d * direction))
                     for d in (h, 2.0 * h))
        with np.errstate(invalid='ignore'):  # a field that is not finite has no derivatives
            columns.append((8.0 * near - far) / (12.0 * h))
    return np.stack(columns, axis=-1)


def numerical_jacobian(field: Field, x: ArrayLike) -> Array:
    """∂f/∂x of any smooth field: the complex step where it agrees with differences.

    Parameters
    ----------
    field : callable
        f: ndarray (n,) → ndarray (m,).
    x : array_like (n,)
        State.

    Returns
    -------
    ndarray (m, n)

    Raises
    ------
    DataError
        If the field is not finite around the state.
    """
    differences = difference_jacobian(field, x)
    if not np.all(np.isfinite(differences)):
        raise DataError(f'the field is not finite around x = {np.asarray(x).tolist()}')
    try:
        exact = complex_step_jacobian(field, x)
    except (TypeError, ParameterError):  # the field takes, or returns, real numbers only
        return differences
    scale = 1.0 + np.abs(differences).max(initial=0.0)
    return exact if np.abs(exact - differences).max(initial=0.0) < _AGREEMENT * scale \
        else differences


def generalized_jacobian(A: Array, Theta: Array, Theta_dot: Array | None = None) -> Array:
    """F = (Θ A + Θ̇) Θ⁻¹, the Jacobian in the differential coordinates δz = Θ δx.

    Parameters
    ----------
    A : ndarray (..., n, n)
        Jacobian [1/s].
    Theta : ndarray (..., n, n)
        Change of coordinates, a factor of the metric M = ΘᵀΘ.
    Theta_dot : ndarray (..., n, n), optional
        Its rate along the flow [1/s]; zero without.

    Returns
    -------
    ndarray (..., n, n)
    """
    turned = Theta @ A if Theta_dot is None else Theta @ A + Theta_dot
    return turned @ np.linalg.inv(Theta)
