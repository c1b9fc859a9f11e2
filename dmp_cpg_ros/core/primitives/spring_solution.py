# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Closed-form motion of a spring and damper under a drive that is quadratic in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def quadratic_drive_step(
    k: float | Array,
    b: float | Array,
    propagator: Array,
    y: Array,
    z: Array,
    drives: Array,
    length: float | Array,
) -> tuple[Array, Array]:
    """Exact solution of y' = z, z' = u(s) − k y − b z for a quadratic u; all arguments broadcast.

    Parameters
    ----------
    k, b : float or ndarray (...)
        Stiffness and damping.
    propagator : ndarray (2, 2, ...)
        :func:`spring_exponential` of the same k, b and length.
    y, z : ndarray (...)
        State at s = 0.
    drives : ndarray (3, ...)
        u at 0, length/2 and length.
    length : float or ndarray (...)
        Length of the step [s].

    Returns
    -------
    y, z : ndarray (...)
    """
    first, middle, last = drives
    u2 = 2.0 * (first - 2.0 * middle + last) / length**2
    u1 = (4.0 * middle - 3.0 * first - last) / length
    a2 = u2 / k  # particular solution a0 + a1 s + a2 s²
    a1 = (u1 - 2.0 * b * a2) / k
    a0 = (first - b * a1 - 2.0 * a2) / k
    y, z = y - a0, z - a1
    return (
        propagator[0, 0] * y + propagator[0, 1] * z + a0 + length * (a1 + length * a2),
        propagator[1, 0] * y + propagator[1, 1] * z + a1 + 2.0 * length * a2,
    )


def spring_exponential(k: ArrayLike, b: ArrayLike, length: ArrayLike) -> Array:
    """Exponential of A s, A = [[0, 1], [−k, −b]], as e^{−μs}(C I + S (A + μ I)) with μ = b/2.

    Parameters
    ----------
    k, b, length : array_like (...)
        Stiffness, damping and s; they broadcast.

    Returns
    -------
    ndarray (2, 2, ...)
    """
    k, length = np.asarray(k, dtype=float), np.asarray(length, dtype=float)
    mu = 0.5 * np.asarray(b, dtype=float)
    root = np.sqrt((mu * mu - k).astype(complex)) * length  # imaginary: oscillating
    grow, fall = np.exp(root - mu * length), np.exp(-root - mu * length)
    C = (0.5 * (grow + fall)).real
    small = np.abs(root) < 1e-3
    series = np.exp(-mu * length) * (1.0 + (root * root).real / 6.0)
    S = length * np.where(small, series, (0.5 * (grow - fall) / np.where(small, 1.0, root)).real)
    return np.array([[C + mu * S, S], [-k * S, C - mu * S]])
