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
from dmp_cpg_ros.core.maths.exponential import phi_functions, phi_functions_doubled

_POWERS = 4  # 1, q, q², q³

_BERNSTEIN = np.array([
    [comb(k, m) / comb(_POWERS - 1, m) for m in range(_POWERS)] for k in range(_POWERS)])
_CHOOSE = np.array([[float(comb(m, k)) for m in range(_POWERS)] for k in range(_POWERS)])
_RAISED = np.array([[max(m - k, 0) for m in range(_POWERS)] for k in range(_POWERS)])
"""Of (q + κ)^k in q^m = Σ_k C(m, k) (−κ)^(m − k) (q + κ)^k."""

_ORDERS = np.array([[[1j**m * (-1j)**k * (m + k == order) for k in range(_POWERS)]
                     for m in range(_POWERS)] for order in range(2 * _POWERS - 1)])
"""What dᵀ_m d_k adds to each order of ω in PᴴP, P = Σ_k d_k (−iω)^k: real for even orders,
imaginary for odd ones.
"""

_EVEN, _ODD = (order.reshape(-1, _POWERS**2).copy()
               for order in (_ORDERS.real[::2], _ORDERS.imag[1::2]))


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
        last = self.B + self.B_y * start + (self.B_a * middle).dot(half)
        return (self.T + self.C_y * start + (self.C_a * middle).dot(half)
                + (self.C_b * end).dot(last))

    def forced(self, middle: Array, end: Array) -> Array:
        """Matrix Y with Y η a bound of what parts of N up to η, others at each stage, do to y⁺."""
        half = self.A_y
        last = self.B_y + self.B_a + (self.B_a * middle).dot(half)
        return (self.C_y + self.C_a + self.C_b + (self.C_a * middle).dot(half)
                + (self.C_b * end).dot(last))

    def moved(self, lipschitz: Array) -> Array:
        """Matrix that bounds |y⁺ − y| by the rates |v| of y, where Q has given Lipschitz constants
        on all that lies between y, a, b and y⁺, ndarray (n,).
        """
        middle, end = self._changes(lipschitz)
        return self.G + self.C_a.dot(middle) + self.C_b.dot(end)

    def rates(self, lipschitz: Array) -> tuple[Array, Array]:
        """Matrices that bound the rates |v⁺| by the sum of what they make of |y⁺ − y| and of |v|,
        likewise.
        """
        middle, end = self._changes(lipschitz)
        return self.P + np.diag(lipschitz), self.S + self.S_a.dot(middle) + self.S_b.dot(end)

    def _changes(self, lipschitz: Array) -> tuple[Array, Array]:
        """Bounds of |Q(a) − Q(y)| and |Q(b) − Q(y)| over |v|."""
        each = np.asarray(lipschitz)[:, None]
        middle = each * self.A_y
        return middle, np.asarray(each * (self.D + self.B_a.dot(middle)))


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
        half, p_half, *_ = at_half = phi_functions(-0.5 * dt * M)
        whole, p_1, p_2, p_3 = phi_functions_doubled(at_half)
        b_1, b_2, b_3 = (dt * (p_1 - 3.0 * p_2 + 4.0 * p_3), dt * (4.0 * p_2 - 8.0 * p_3),
                         dt * (4.0 * p_3 - p_2))
        full = dt * p_1
        twice, inverse = 2.0 * full, np.linalg.inv(full)
        polynomials = np.zeros((_POWERS, len(StepBounds._fields), n, n))
        T, C_y, C_a, C_b, C, A, A_y, A_moved, B, B_y, B_a, B_c, D, G, P, S, S_a, S_b = (
            polynomials.swapaxes(0, 1))                          # of each the powers of q
        A_y[0], B_a[0], C_b[0] = 0.5 * dt * p_half, twice, b_3
        A[0], A[1] = half, A_y[0]
        B[0], B[1], B[2] = whole, twice.dot(half) - full, twice.dot(A[1])
        B_y[0], B_y[1] = -full, twice.dot(A_y[0])
        C_y[0], C_y[1], C_y[2] = b_1, b_2.dot(A_y[0]) + b_3.dot(B_y[0]), b_3.dot(B_y[1])
        C_a[0], C_a[1] = b_2, b_3.dot(twice)
        D[0], D[1] = full, B_y[1]
        T[0], T[1], T[2], T[3] = (whole, b_1 + b_2.dot(half) + b_3.dot(whole),
                                  b_2.dot(A[1]) + b_3.dot(B[1]), b_3.dot(B[2]))
        C[:], A_moved[:], B_c[:] = C_y + C_a + C_b, A, B_y + B_a
        A_moved[0] -= unit
        G[0], G[1], G[2] = full, b_2.dot(A_y[0]) + b_3.dot(full), b_3.dot(D[1])
        P[0], P[1] = whole.dot(inverse), unit
        S[1], S[2] = inverse.dot(G[1]), inverse.dot(G[2])
        S_a[0], S_a[1], S_b[0] = inverse.dot(b_2), inverse.dot(C_a[1]), inverse.dot(b_3)
        self._polynomials = polynomials

    def _about(self, kappa: float) -> Array:
        """Coefficients of powers of q + κ, ndarray (4, 18, n, n)."""
        shift = _CHOOSE * np.array([(-kappa) ** power for power in range(_POWERS)])[_RAISED]
        return shift.dot(self._polynomials.reshape(_POWERS, -1)).reshape(self._polynomials.shape)

    def moduli(self, kappa: float, omega: float) -> StepBounds:
        """Bound the moduli of all entries for q = −κ − iω, at every |ω| up to a largest one."""
        d_0, d_1, d_2, d_3 = self._about(kappa)
        squared = d_0**2 + omega**2 * (
            np.maximum(d_1**2 - 2.0 * d_0 * d_2, 0.0) + omega**2 * (
                np.maximum(d_2**2 - 2.0 * d_1 * d_3, 0.0) + (omega * d_3) ** 2))
        return StepBounds(*np.sqrt(squared))

    def norms(self, kappa: float, omega: float) -> StepBounds:
        """Bound the 2-norms likewise, as arrays (1, 1), of what :meth:`StepBounds.difference`
        takes, others NaN: PᴴP is a polynomial in ω with Hermitian coefficients.
        """
        d = self._about(kappa)[:, _DIFFERENT]
        products = d.swapaxes(-1, -2)[:, None] @ d                                # dᵀ_m d_k
        even, odd = (signs.dot(products.reshape(_POWERS**2, -1)).reshape(-1, *d.shape[1:])
                     for signs in (_EVEN, _ODD))
        # a polynomial in ω² lies among Bernstein's coefficients
        turned = (_BERNSTEIN * omega ** (2 * np.arange(_POWERS))).dot(
            even.reshape(_POWERS, -1)).reshape(even.shape)
        turned, odd = turned + turned.swapaxes(-1, -2), odd - odd.swapaxes(-1, -2)
        # i times a skew matrix K has the eigenvalues ±σ, σ² those of KᵀK
        largest = np.linalg.eigvalsh(
            np.concatenate([0.5 * turned, 0.25 * odd.swapaxes(-1, -2) @ odd]))[..., -1]
        squared = largest[:_POWERS].max(axis=0) + np.abs(omega) ** np.arange(
            1, 2 * _POWERS - 1, 2) @ np.sqrt(np.maximum(largest[_POWERS:], 0.0))
        found = np.full((len(StepBounds._fields), 1, 1), np.nan)
        found[_DIFFERENT, 0, 0] = np.sqrt(np.maximum(squared, 0.0))
        return StepBounds(*found)


_DIFFERENT = [StepBounds._fields.index(name) for name in (
    'T', 'C_y', 'C_a', 'C_b', 'A', 'A_y', 'B', 'B_y', 'B_a')]


def step_comparison(M: Array, dt: float) -> StepComparison:
    """:class:`StepComparison` of M (n, n) [1/s] and dt [s], kept: of a change of parameters most
    steps have the same.
    """
    return _kept(len(M), np.asarray(M, dtype=float).tobytes(), dt)


@lru_cache(maxsize=16)
def _kept(n: int, M: bytes, dt: float) -> StepComparison:
    return StepComparison(np.frombuffer(M).reshape(n, n), dt)
