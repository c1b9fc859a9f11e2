# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bounds on one step of :class:`~dmp_cpg_ros.core.maths.exponential.ExponentialStep`.

For ẏ = −M y + N(y) with N(y) = q y + Q(y), q a complex number that is the same for all entries of
y, the step is

    a  = A y + A_y Q(y)
    b  = B y + B_y Q(y) + B_a Q(a)
    y⁺ = T y + C_y Q(y) + C_a Q(a) + C_b Q(b)

and each of these matrices a polynomial of degree 3 at most in q, whose coefficients are functions
of M. With q = −κ − iω the moduli of their entries, or their 2-norms, are bounded for every |ω| up
to a largest one: what the rotation ω does to the size of y cancels in them, as it does in the
step. Where bounds of |Q| are known, nonnegative inequalities follow for |y⁺|, and where Q is
Lipschitz, for the difference of two states.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import phi_functions

_POWERS = 4  # 1, q, q², q³

_BERNSTEIN = np.array([
    [comb(k, m) / comb(_POWERS - 1, m) for m in range(_POWERS)] for k in range(_POWERS)])
_ORDERS = np.array([[[1j**m * (-1j)**k * (m + k == order) for k in range(_POWERS)]
                     for m in range(_POWERS)] for order in range(2 * _POWERS - 1)])
"""What dᵀ_m d_k adds to each order of ω in PᴴP, P = Σ_k d_k (−iω)^k."""


class StepBounds(NamedTuple):
    """Moduli of the matrices of a step, ndarray (n, n) each, or their norms as (1, 1).

    Attributes
    ----------
    T, C_y, C_a, C_b : ndarray
        Of the step.
    C : ndarray
        C_y + C_a + C_b: what a constant part of N does.
    A, A_y : ndarray
        Of its stage in the middle.
    A_moved : ndarray
        A − 1.
    B, B_y, B_a : ndarray
        Of its stage at the end.
    B_c : ndarray
        B_y + B_a.
    D : ndarray
        b − y is D v + B_a (Q(a) − Q(y)), v the rate of y; a − y is A_y v.
    G : ndarray
        y⁺ − y is G v + C_a (Q(a) − Q(y)) + C_b (Q(b) − Q(y)).
    P, S, S_a, S_b : ndarray
        v⁺ is P (y⁺ − y) + Q(y⁺) − Q(y) − S v − S_a (Q(a) − Q(y)) − S_b (Q(b) − Q(y)).
    """

    T: Array
    C_y: Array
    C_a: Array
    C_b: Array
    C: Array
    A: Array
    A_y: Array
    A_moved: Array
    B: Array
    B_y: Array
    B_a: Array
    B_c: Array
    D: Array
    G: Array
    P: Array
    S: Array
    S_a: Array
    S_b: Array

    def difference(self, start: Array, middle: Array, end: Array) -> Array:
        """Matrix Z with |y⁺ − z⁺| ≤ Z |y − z|, where Q has given Lipschitz constants at y, a and
        b, ndarray (n,) each.
        """
        half = self.A + self.A_y * start
        last = self.B + self.B_y * start + (self.B_a * middle) @ half
        return self.T + self.C_y * start + (self.C_a * middle) @ half + (self.C_b * end) @ last

    def forced(self, middle: Array, end: Array) -> Array:
        """Matrix Y with Y η a bound of what parts of N up to η, others at each stage, do to y⁺."""
        half = self.A_y
        last = self.B_y + self.B_a + (self.B_a * middle) @ half
        return (self.C_y + self.C_a + self.C_b + (self.C_a * middle) @ half
                + (self.C_b * end) @ last)

    def moved(self, lipschitz: Array) -> Array:
        """Matrix that bounds |y⁺ − y| by the rates |v| of y, where Q has given Lipschitz constants
        on all that lies between y, a, b and y⁺, ndarray (n,).
        """
        middle, end = self._changes(lipschitz)
        return self.G + self.C_a @ middle + self.C_b @ end

    def rates(self, lipschitz: Array) -> tuple[Array, Array]:
        """Matrices that bound the rates |v⁺| by the sum of what they make of |y⁺ − y| and of |v|,
        likewise.
        """
        middle, end = self._changes(lipschitz)
        return self.P + np.diag(lipschitz), self.S + self.S_a @ middle + self.S_b @ end

    def _changes(self, lipschitz: Array) -> tuple[Array, Array]:
        """Bounds of |Q(a) − Q(y)| and |Q(b) − Q(y)| over |v|."""
        each = np.asarray(lipschitz)[:, None]
        middle = each * self.A_y
        return middle, np.asarray(each * (self.D + self.B_a @ middle))


class StepComparison:
    """Matrices of a step as polynomials in q.

    Parameters
    ----------
    M : ndarray (n, n)
        Linear part [1/s], real.
    dt : float
        Length of the step [s].
    """

    def __init__(self, M: Array, dt: float) -> None:
        """Compute the coefficients once."""
        n, unit = len(M), np.eye(len(M))
        whole, p_1, p_2, p_3 = phi_functions(-dt * M)
        half, p_half = phi_functions(-0.5 * dt * M, 1)

        def constant(matrix: Array) -> Array:
            return np.concatenate([matrix[None], np.zeros((_POWERS - 1, n, n))])

        def times_q(polynomial: Array) -> Array:
            return np.concatenate([np.zeros((1, n, n)), polynomial[:-1]])

        b_1, b_2, b_3 = (dt * (p_1 - 3.0 * p_2 + 4.0 * p_3), dt * (4.0 * p_2 - 8.0 * p_3),
                         dt * (4.0 * p_3 - p_2))
        full = dt * p_1
        A_y, B_a, C_b = constant(0.5 * dt * p_half), constant(2.0 * full), constant(b_3)
        A = constant(half) + times_q(A_y)
        B = constant(whole) - times_q(constant(full)) + times_q(2.0 * full @ A)
        B_y = -constant(full) + times_q(2.0 * full @ A_y)
        C_y = constant(b_1) + times_q(b_2 @ A_y) + times_q(b_3 @ B_y)
        C_a = constant(b_2) + times_q(b_3 @ B_a)
        D = constant(full) + times_q(2.0 * full @ A_y)
        inverse = np.linalg.inv(full)
        self._polynomials = np.stack([
            constant(whole) + times_q(constant(b_1)) + times_q(b_2 @ A) + times_q(b_3 @ B),
            C_y, C_a, C_b, C_y + C_a + C_b, A, A_y, A - constant(unit), B, B_y, B_a, B_y + B_a,
            D, constant(full) + times_q(b_2 @ A_y) + times_q(b_3 @ D),
            constant(whole @ inverse) + times_q(constant(unit)),
            times_q(inverse @ (b_2 @ A_y + b_3 @ D)), inverse @ C_a, inverse @ C_b])

    def _about(self, kappa: float) -> Array:
        """Coefficients of powers of q + κ, ndarray (4, 18, n, n)."""
        shift = [[comb(m, k) * (-kappa) ** (m - k) if m >= k else 0.0 for m in range(_POWERS)]
                 for k in range(_POWERS)]
        return np.tensordot(shift, self._polynomials, (1, 1))

    def moduli(self, kappa: float, omega: float) -> StepBounds:
        """Bound the moduli of all entries for q = −κ − iω, at every |ω| up to a largest one."""
        d_0, d_1, d_2, d_3 = self._about(kappa)
        squared = d_0**2 + omega**2 * (
            np.maximum(d_1**2 - 2.0 * d_0 * d_2, 0.0) + omega**2 * (
                np.maximum(d_2**2 - 2.0 * d_1 * d_3, 0.0) + (omega * d_3) ** 2))
        return StepBounds(*np.sqrt(squared))

    def norms(self, kappa: float, omega: float) -> StepBounds:
        """Bound the 2-norms likewise, as arrays (1, 1): PᴴP is a polynomial in ω with Hermitian
        coefficients.
        """
        d = self._about(kappa)
        products = np.swapaxes(d, -1, -2)[:, None] @ d                            # dᵀ_m d_k
        orders = np.tensordot(_ORDERS, products, 2)
        orders = 0.5 * (orders + np.swapaxes(orders, -1, -2).conj())
        # a polynomial in ω² lies among Bernstein's coefficients
        turned = _BERNSTEIN * omega ** (2 * np.arange(_POWERS))
        even = np.linalg.eigvalsh(np.tensordot(turned, orders[::2], 1))[..., -1].max(axis=0)
        odd = np.maximum(np.linalg.eigvalsh(orders[1::2])[..., -1], 0.0)            # (3, 18)
        squared = even + np.abs(omega) ** np.arange(1, 2 * _POWERS - 1, 2) @ odd
        return StepBounds(*np.sqrt(np.maximum(squared, 0.0))[:, None, None])


def step_comparison(M: Array, dt: float) -> StepComparison:
    """:class:`StepComparison` of M (n, n) [1/s] and dt [s], kept: of a change of parameters most
    steps have the same.
    """
    return _kept(len(M), np.asarray(M, dtype=float).tobytes(), dt)


@lru_cache(maxsize=16)
def _kept(n: int, M: bytes, dt: float) -> StepComparison:
    return StepComparison(np.frombuffer(M).reshape(n, n), dt)
