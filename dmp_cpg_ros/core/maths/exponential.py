# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Exponential Runge-Kutta step for ẋ = M x + c + N(x) with a stiff constant M and a mild N.

Third-order method ETD3RK of Cox & Matthews, *Exponential time differencing for stiff systems*, J.
Comput. Phys. 176 (2002), eqs. (23)-(25). The linear part is exact, so the step is stable however
large the coupling and inhibition gains are; an equilibrium of the equation is exactly an
equilibrium of the step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import factorial

import numpy as np

from dmp_cpg_ros.core.maths import Array


def phi_functions(M: Array, highest: int = 3) -> list[Array]:
    """φ₀ … φ_m of a matrix: φ₀ = e^M and φ_k(M) = Σ_j M^j/(j+k)!.

    Read off the exponential of one block matrix (Sidje 1998, Theorem 1): scaling, a Taylor series
    and squaring, which is accurate also where the recursion φ_{k+1} = M⁻¹(φ_k − 1/k!) cancels or M
    is singular.

    Parameters
    ----------
    M : ndarray (n, n)
        Matrix.
    highest : int
        The largest index m.

    Returns
    -------
    list of ndarray (n, n)
        φ₀ … φ_m.
    """
    n = len(M)
    block = np.zeros(((highest + 1) * n, (highest + 1) * n))
    block[:n, :n] = M
    for k in range(highest):
        block.ravel()[k * n * len(block) + (k + 1) * n :: len(block) + 1][:n] = 1.0
    whole = exponential(block)
    return [whole[:n, k * n : (k + 1) * n] for k in range(highest + 1)]


def phi_functions_doubled(phi: Sequence[Array]) -> list[Array]:
    """φ₀ … φ_m of twice a matrix from those of it, ndarray (n, n) each: φ_k(2M) = 2^(−k) (φ₀φ_k +
    Σ_j φ_j/(k − j)!), j from 1 to k.
    """
    return [0.5**k * (phi[0].dot(phi[k]) + sum(
        phi[j] / factorial(k - j) for j in range(1, k + 1))) for k in range(len(phi))]


def exponential(M: Array) -> Array:
    """Matrix exponential by scaling and squaring of a Taylor polynomial (norm below 1/2, 18
    terms).

    Parameters
    ----------
    M : ndarray (..., n, n)
        Matrix, or stack of matrices that are scaled alike.

    Returns
    -------
    ndarray (..., n, n)
    """
    unit, norm = np.eye(M.shape[-1]), float(np.abs(M).sum(axis=-2).max())
    squarings = max(0, int(np.ceil(np.log2(norm / 0.5)))) if norm > 0.0 else 0
    scaled, result = M / 2.0**squarings, unit
    times = np.dot if M.ndim == 2 else np.matmul  # alike, but the first begins sooner
    for k in range(18, 0, -1):
        result = times(scaled, result)
        result /= k
        result += unit
    for _ in range(squarings):
        result = times(result, result)
    return result


class ExponentialStep:
    """One step of fixed length for a fixed linear part; the nonlinear part may change from step
    to step.

    Parameters
    ----------
    M : ndarray (n, n)
        Linear part [1/s].
    c : ndarray (n,)
        Constant part.
    dt : float
        Length of the step [s].
    """

    def __init__(self, M: Array, c: Array, dt: float) -> None:
        """Compute the matrices of the method once."""
        whole, half = phi_functions(M * dt), phi_functions(M * (0.5 * dt))
        p1, p2, p3 = whole[1], whole[2], whole[3]
        self._to_half = np.hstack([half[0], 0.5 * dt * half[1]])  # (n, 2n) on [x, N]
        self._to_end = np.hstack([whole[0], -dt * p1, 2.0 * dt * p1])  # on [x, N_0, N_half]
        self._final = np.hstack(
            [
                whole[0],
                dt * (p1 - 3.0 * p2 + 4.0 * p3),
                dt * (4.0 * p2 - 8.0 * p3),
                dt * (4.0 * p3 - p2),
            ]
        )  # on [x, N_0, N_half, N_end]
        self._c_half, self._c = 0.5 * dt * half[1] @ c, dt * p1 @ c
        self._stages = np.empty(4 * len(c))

    def __call__(self, x: Array, nonlinear: Callable[[Array], Array]) -> Array:
        """Advance by one step.

        Parameters
        ----------
        x : ndarray (...) of n numbers
            State.
        nonlinear : callable
            N: of the shape of x to the same shape.

        Returns
        -------
        ndarray (...)
            State one step later.
        """
        n, stages, shape = x.size, self._stages, x.shape
        stages[:n] = x.ravel()  # below, dot has half the overhead of @ at this size
        stages[n : 2 * n] = nonlinear(x).ravel()
        half = self._to_half.dot(stages[: 2 * n]) + self._c_half
        stages[2 * n : 3 * n] = nonlinear(half.reshape(shape)).ravel()
        end = self._to_end.dot(stages[: 3 * n]) + self._c
        stages[3 * n :] = nonlinear(end.reshape(shape)).ravel()
        return (self._final.dot(stages) + self._c).reshape(shape)
