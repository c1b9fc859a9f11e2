# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
The metric of Theorem 1, constructed numerically along an orbit (appendix, first part).

The paper builds M in coordinates (δz1, δz2) with δz1 = pᵀδx, p = f/|f|², along the flow and δz2
across it. Written with covectors the construction needs no frame: along the orbit, backwards in
time, where they are stable, one integrates

    Ṁ_s + AᵀM_s + M_sA + Q  = 0     Q the projector across f          (singular metric, rank n − 1)
    ṁ + Aᵀm + c             = 0     c = ṗ + Aᵀp = A12 in covectors    (eq. desContrIdentity)
    Ṗ + AᵀP + PA + 2rP + mcᵀ + cmᵀ + κM_s = 0                         (eq. desContrIdentity2)

until they are periodic; all three vanish along f. M = ppᵀ + pmᵀ + mpᵀ + P then has
Ṁ + AᵀM + MA = −(κM_s + 2rP): F_s is negative semidefinite of rank n − 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.paper.jacobians import Field
from dmp_cpg_ros.paper.orbit import Orbit

Array = NDArray[np.float64]

_MOST_PERIODS = 200
_SETTLED = 1e-10
_NEUTRAL = 1e-6  # decay per period that the integration cannot tell from none


@dataclass(frozen=True)
class TransverseMetric:
    """The metric at points of an orbit.

    Attributes
    ----------
    points : ndarray (m, n)
        States along one period, equally spaced in time.
    metric : ndarray (m, n, n)
        M(x) at the points.
    eigenvalues : ndarray (m, n)
        Of F_s, falling; the first is 0 [1/s].
    floquet_rate : float
        Slowest decay across the orbit, from the Floquet multipliers [1/s].
    """

    points: Array
    metric: Array
    eigenvalues: Array
    floquet_rate: float

    @property
    def rate(self) -> float:
        """−sup λ2(F_s) over the points [1/s]."""
        return -float(self.eigenvalues[:, 1].max())


@dataclass(frozen=True)
class _Local:
    """What the equations need at one instant: A, the projector across f, p and c."""

    A: Array
    across: Array
    p: Array
    c: Array


def transverse_metric(field: Field, jacobian: Callable[[Array], Array], orbit: Orbit,
                      share: float = 0.5) -> TransverseMetric:
    """Construct Theorem 1's metric along an orbit.

    Parameters
    ----------
    field, jacobian : callable
        f: ndarray (n,) → ndarray (n,) and its Jacobian → ndarray (n, n) [1/s].
    orbit : Orbit
        A closed orbit with an even number of states.
    share : float
        r as a share of the Floquet rate, in (0, 1).

    Returns
    -------
    TransverseMetric
        At every second state of the orbit.

    Raises
    ------
    DataError
        If displacements across the orbit do not decay.
    """
    local = [_local(field(x), jacobian(x)) for x in orbit.states]
    floquet = floquet_rate(jacobian, orbit)
    if not floquet * orbit.period > _NEUTRAL:
        raise DataError(f'displacements across the orbit do not decay (rate {floquet:.4g} 1/s)')
    r = share * floquet
    Ms, m, P0, P1 = _periodic_solutions(local, orbit, r)
    kappa = 1.0 + 2.0 * max(0.0, max(
        _needed_scale(at.across, m_k, P0_k, P1_k)
        for at, m_k, P0_k, P1_k in zip(local[::2], m, P0, P1, strict=True)))
    P = P0 + kappa * P1
    p = np.stack([at.p for at in local[::2]])
    pm = p[:, :, None] * m[:, None, :]
    M = p[:, :, None] * p[:, None, :] + pm + np.swapaxes(pm, 1, 2) + P
    half = np.linalg.inv(np.linalg.cholesky(M))
    Fs = -0.5 * half @ (kappa * Ms + 2.0 * r * P) @ np.swapaxes(half, 1, 2)
    eigenvalues = np.asarray(np.linalg.eigvalsh(Fs)[:, ::-1], dtype=float)
    return TransverseMetric(orbit.states[::2].copy(), M, eigenvalues, floquet)


def floquet_rate(jacobian: Callable[[Array], Array], orbit: Orbit) -> float:
    """Slowest decay rate across an orbit: −log|second largest multiplier| / T [1/s]."""
    h = 2.0 * orbit.period / len(orbit.states)
    A = [jacobian(x) for x in orbit.states]
    Phi = np.eye(orbit.states.shape[1])
    for k in range(0, len(A), 2):
        first, middle, last = A[k], A[k + 1], A[(k + 2) % len(A)]
        k1 = first @ Phi
        k2 = middle @ (Phi + 0.5 * h * k1)
        k3 = middle @ (Phi + 0.5 * h * k2)
        Phi = Phi + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + last @ (Phi + h * k3))
    multipliers = np.linalg.eigvals(Phi)
    along = int(np.argmin(np.abs(multipliers - 1.0)))
    others = np.abs(np.delete(multipliers, along))
    return -float(np.log(max(others.max(), 1e-300))) / orbit.period


def _local(f: Array, A: Array) -> _Local:
    squared = float(f @ f)
    p = f / squared
    p_dot = A @ f / squared - 2.0 * f * float(f @ A @ f) / squared**2
    return _Local(A, np.eye(len(f)) - np.outer(f, f) / squared, p, p_dot + A.T @ p)


def _periodic_solutions(local: list[_Local], orbit: Orbit, r: float
                        ) -> tuple[Array, Array, Array, Array]:
    """M_s, m and P = P0 + κP1 at every second state, by integrating backwards until periodic."""
    count, n = len(local), orbit.states.shape[1]
    h = 2.0 * orbit.period / count
    y = (np.zeros((n, n)), np.zeros(n), np.zeros((n, n)), np.zeros((n, n)))
    history: list[tuple[Array, ...]] = []
    for _ in range(_MOST_PERIODS):
        former, history = history, []
        for k in range(count, 0, -2):
            y = _step_back(y, local[k % count], local[k - 1], local[k - 2], h, r)
            history.append(y)
        if former and all(_settled(new, old) for new, old in zip(
                history[-1], former[-1], strict=True)):
            break
    history.reverse()                                       # now at the states 0, 2, 4, …
    Ms, m, P0, P1 = (np.stack([entry[i] for entry in history]) for i in range(4))
    return Ms, m, P0, P1


def _step_back(y: tuple[Array, ...], last: _Local, middle: _Local, first: _Local, h: float,
               r: float) -> tuple[Array, Array, Array, Array]:
    """One classical Runge-Kutta step from the end of an interval to its beginning."""
    def slope(at: _Local, y: tuple[Array, ...]) -> tuple[Array, ...]:
        Ms, m, P0, P1 = y
        mc = np.outer(m, at.c)
        return (at.A.T @ Ms + Ms @ at.A + at.across, at.A.T @ m + at.c,
                at.A.T @ P0 + P0 @ at.A + 2.0 * r * P0 + mc + mc.T,
                at.A.T @ P1 + P1 @ at.A + 2.0 * r * P1 + Ms)

    def moved(by: float, slopes: tuple[Array, ...]) -> tuple[Array, ...]:
        return tuple(value + by * change for value, change in zip(y, slopes, strict=True))

    k1 = slope(last, y)
    k2 = slope(middle, moved(0.5 * h, k1))
    k3 = slope(middle, moved(0.5 * h, k2))
    k4 = slope(first, moved(h, k3))
    Ms, m, P0, P1 = (value + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
                     for value, a, b, c, d in zip(y, k1, k2, k3, k4, strict=True))
    # Exactly, all four vanish along f; rounding would grow there.
    E = first.across
    return E @ Ms @ E, E @ m, E @ P0 @ E, E @ P1 @ E


def _settled(new: Array, old: Array) -> bool:
    return float(np.abs(new - old).max()) <= _SETTLED * (1.0 + float(np.abs(new).max()))


def _needed_scale(across: Array, m: Array, P0: Array, P1: Array) -> float:
    """Smallest κ with P0 + κP1 ≥ mmᵀ across the flow (the remark after the appendix's M22)."""
    basis = np.linalg.eigh(across)[1][:, 1:]                                 # (n, n-1)
    half = np.linalg.inv(np.linalg.cholesky(basis.T @ P1 @ basis))
    lacking = basis.T @ (np.outer(m, m) - P0) @ basis
    return float(np.linalg.eigvalsh(half @ lacking @ half.T)[-1])
