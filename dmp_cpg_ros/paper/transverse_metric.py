# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
The appendix: Theorem 1's metric along an orbit, and the tube in which a disturbed system stays.

The paper builds M in coordinates (δz1, δz2) with δz1 = pᵀδx, p = f/|f|², along the flow and δz2
across it. Written with covectors the construction needs no frame: along the orbit, backwards in
time, where they are stable, one integrates

    Ṁ_s + AᵀM_s + M_sA + Q  = 0     Q the projector across f          (singular metric, rank n − 1)
    ṁ + Aᵀm + c             = 0     c = ṗ + Aᵀp = A12 in covectors    (eq. desContrIdentity)
    Ṗ + AᵀP + PA + 2rP + mcᵀ + cmᵀ + κM_s = 0                         (eq. desContrIdentity2)

until they are periodic; all three vanish along f. M = ppᵀ + pmᵀ + mpᵀ + P then has
Ṁ + AᵀM + MA = −(κM_s + 2rP): F_s is negative semidefinite of rank n − 1.

In the tube inf_τ |x_d(t) − x(τ)| ≤ (R/λ) w̄ for every t > 0, where R bounds the condition number
of Θ, M = ΘᵀΘ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.contraction.hopf_bounds import transverse_rate
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.paper.jacobians import Array, Field
from dmp_cpg_ros.paper.region import Annulus

_MOST_PERIODS = 200
_MOST_STEPS = 100_000
_SETTLED = 1e-7
_PIECES = 50  # of a period, in each of which displacements shrink by less than rounding
_NEUTRAL = 1e-6  # decay per period that the integration cannot tell from none


@dataclass(frozen=True)
class Orbit:
    """States of one period, equally spaced in time; the last is one step before the first.

    Attributes
    ----------
    states : ndarray (m, n)
        States.
    period : float
        T [s].
    """

    states: Array
    period: float

    def spline(self, values: Array) -> CubicSpline:
        """Periodic function of time of values at the states, ndarray (m, ...)."""
        times = np.linspace(0.0, self.period, len(values) + 1)
        return CubicSpline(times, np.append(values, values[:1], axis=0), bc_type='periodic')


def find_orbit(field: Field, start: ArrayLike, transient: float, step: float,
               count: int = 800) -> Orbit:
    """Follow the flow onto an attracting orbit and once around it.

    Parameters
    ----------
    field : callable
        f: ndarray (n,) → ndarray (n,) [1/s].
    start : array_like (n,)
        State in the orbit's basin.
    transient : float
        Time after which the state is taken to be on the orbit [s].
    step : float
        Step while following; a small part of the period [s].
    count : int
        Number of states that are returned.

    Returns
    -------
    Orbit

    Raises
    ------
    DataError
        If the state does not come back within 100,000 steps or the orbit does not close.
    """
    x = _flow(field, start, transient, step).y[:, -1]
    normal, farthest = field(x), 0.0

    def height(_: float, at: Array) -> float:
        """Height over the plane through x across the flow; below it where x is far away."""
        nonlocal farthest
        distance = float(np.linalg.norm(at - x))
        farthest = max(farthest, distance)
        return float((at - x) @ normal) if distance < 0.1 * farthest else -1.0

    height.direction, height.terminal = 1.0, True  # type: ignore[attr-defined]
    returned = _flow(field, x, _MOST_STEPS * step, step, events=height).t_events[0]
    if not returned.size:
        raise DataError('the state did not come back to where it was within '
                        f'{_MOST_STEPS:,} steps')
    period = float(returned[0])
    states = _flow(field, x, period, step, np.linspace(0.0, period, count + 1)).y.T
    gap = float(np.linalg.norm(states[-1] - x))
    if not gap <= 1e-4 * float(np.ptp(states, axis=0).max()):
        raise DataError(f'the orbit leaves a gap of {gap:.3g}; give a longer transient')
    return Orbit(states[:-1].copy(), period)


def _flow(field: Field, start: ArrayLike, duration: float, step: float,
          times: Array | None = None, events: Callable[[float, Array], float] | None = None
          ) -> Any:
    return solve_ivp(lambda _, x: field(x), (0.0, duration), np.asarray(start, dtype=float),
                     'DOP853', times, events=events, rtol=1e-11, atol=1e-12, max_step=step)


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


def transverse_metric(field: Field, jacobian: Callable[[Array], Array], orbit: Orbit,
                      share: float = 0.5) -> TransverseMetric:
    """Construct Theorem 1's metric along an orbit.

    Parameters
    ----------
    field, jacobian : callable
        f: ndarray (n,) → ndarray (n,) and its Jacobian → ndarray (n, n) [1/s].
    orbit : Orbit
        A closed orbit.
    share : float
        r as a share of the Floquet rate, in (0, 1).

    Returns
    -------
    TransverseMetric
        At every state of the orbit.

    Raises
    ------
    DataError
        If displacements across the orbit do not decay.
    """
    floquet = floquet_rate(jacobian, orbit)
    if not floquet * orbit.period > _NEUTRAL:
        raise DataError(f'displacements across the orbit do not decay (rate {floquet:.4g} 1/s)')
    r = share * floquet
    f, A = (np.array([of(x) for x in orbit.states]) for of in (field, jacobian))
    p = f / np.sum(f * f, axis=1, keepdims=True)
    Af = np.einsum('tij,tj->ti', A, f)
    p_dot = Af / np.sum(f * f, axis=1, keepdims=True) - 2.0 * p * np.sum(
        p * Af, axis=1, keepdims=True)
    c = p_dot + np.einsum('tji,tj->ti', A, p)
    across = np.eye(f.shape[1]) - f[:, :, None] * p[:, None, :]
    m, Ms, P0, P1 = _periodic_solutions(orbit, A, across, c, r)
    kappa = 1.0 + 2.0 * max(0.0, *map(_needed_scale, across, m, P0, P1))
    P = P0 + kappa * P1
    pm = p[:, :, None] * m[:, None, :]
    M = p[:, :, None] * p[:, None, :] + pm + np.swapaxes(pm, 1, 2) + P
    half = np.linalg.inv(np.linalg.cholesky(M))
    Fs = -0.5 * half @ (kappa * Ms + 2.0 * r * P) @ np.swapaxes(half, 1, 2)
    eigenvalues = np.asarray(np.linalg.eigvalsh(Fs)[:, ::-1], dtype=float)
    return TransverseMetric(orbit.states, M, eigenvalues, floquet)


def floquet_rate(jacobian: Callable[[Array], Array], orbit: Orbit) -> float:
    """Slowest decay rate across an orbit: −log|largest multiplier across the flow| / T [1/s].

    The variational equation is projected across the flow piece by piece, and its size is kept
    apart: beside the flow's own multiplier 1, one of a fast decay would be lost in rounding.
    """
    n, A = orbit.states.shape[1], orbit.spline(np.array([jacobian(x) for x in orbit.states]))
    times = np.linspace(0.0, orbit.period, _PIECES + 1)
    across, size = np.eye(n), 0.0
    for begin, end, flow in zip(times, times[1:], orbit.spline(orbit.states)(times[1:], 1),
                                strict=False):
        Phi = solve_ivp(lambda t, y: (A(t) @ y.reshape(n, n)).ravel(), (begin, end),
                        np.eye(n).ravel(), 'DOP853', rtol=1e-10, atol=1e-12).y[:, -1]
        across = Phi.reshape(n, n) @ across
        across -= np.outer(flow, flow @ across) / (flow @ flow)
        largest = max(float(np.abs(across).max()), 1e-300)
        across, size = across / largest, size + float(np.log(largest))
    multiplier = max(float(np.abs(np.linalg.eigvals(across)).max()), 1e-300)
    return -(size + float(np.log(multiplier))) / orbit.period


def _periodic_solutions(orbit: Orbit, A: Array, across: Array, c: Array, r: float
                        ) -> tuple[Array, ...]:
    """m, M_s and P = P0 + κP1 at the states, by integrating backwards until they are periodic."""
    count, n = c.shape
    local = orbit.spline(np.concatenate([A, across, c[:, :, None]], axis=2))

    def projected(y: Array, E: Array) -> tuple[Array, Array]:
        """Parts m (n,) and M_s, P0, P1 (3, n, n), without what rounding adds along f."""
        return E @ y[:n], E @ y[n:].reshape(3, n, n) @ E

    def slope(back: float, y: Array) -> Array:
        at = local(-back)
        A, E, c = at[:, :n], at[:, n:-1], at[:, -1]
        m, S = projected(y, E)
        mc = np.outer(m, c)
        source = np.stack([E, 2.0 * r * S[1] + mc + mc.T, 2.0 * r * S[2] + S[0]])
        return np.append(A.T @ m + c, A.T @ S + S @ A + source)

    times, y = np.linspace(0.0, orbit.period, count + 1), np.zeros(n + 3 * n * n)
    for _ in range(_MOST_PERIODS):
        run = solve_ivp(slope, (0.0, orbit.period), y, 'DOP853', times, rtol=1e-9, atol=1e-11).y
        former, y = y, np.append(*projected(run[:, -1], across[0]))
        if np.allclose(y, former, _SETTLED, _SETTLED):
            break
    # backwards in time the last row is of state 0, the one before of state 1, …
    m, S = zip(*map(projected, run[:, :0:-1].T, across), strict=True)
    return np.array(m), *np.stack(S, axis=1)


def _needed_scale(across: Array, m: Array, P0: Array, P1: Array) -> float:
    """Smallest κ with P0 + κP1 ≥ mmᵀ across the flow (the remark after the appendix's M22)."""
    basis = np.linalg.eigh(across)[1][:, 1:]                                 # (n, n-1)
    half = np.linalg.inv(np.linalg.cholesky(basis.T @ P1 @ basis))
    lacking = basis.T @ (np.outer(m, m) - P0) @ basis
    return float(np.linalg.eigvalsh(half @ lacking @ half.T)[-1])


def metric_condition(metrics: ArrayLike) -> float:
    """R = sup ‖Θ‖ / inf σ_min(Θ) over metrics M = ΘᵀΘ, array_like (..., n, n)."""
    eigenvalues = np.linalg.eigvalsh(np.asarray(metrics, dtype=float))
    if not eigenvalues.min() > 0.0:
        raise ParameterError('a metric must be positive definite everywhere')
    return float(np.sqrt(eigenvalues.max() / eigenvalues.min()))


def tube_radius(rate: float, condition: float, disturbance: float) -> float:
    """(R/λ) w̄, the radius of the tube around the undisturbed trajectory.

    Parameters
    ----------
    rate : float
        Transverse contraction rate λ > 0 [1/s]; ParameterError if it is not.
    condition : float
        R ≥ 1 of the metric.
    disturbance : float
        w̄ ≥ |w(t)| [1/s].
    """
    if not rate > 0.0:
        raise ParameterError(f'rate = {rate!r} 1/s must be positive for a tube to exist')
    return condition / rate * disturbance


def hopf_tube(oscillator: AndronovHopf, omega: float, disturbance: float
              ) -> tuple[float, Annulus] | None:
    """Tube of one Andronov-Hopf oscillator, with the annulus K that it is valid in.

    Parameters
    ----------
    oscillator : AndronovHopf
        Oscillator.
    omega : float
        Angular frequency > 0 [rad/s].
    disturbance : float
        w̄ ≥ 0 [1/s]; ParameterError if it is not.

    Returns
    -------
    radius : float
        Of the tube around the trajectory.
    annulus : Annulus
        The smallest annulus around the cycle that the disturbed state cannot leave; None for both
        when the disturbance can push the state through the origin.
    """
    rho, r = float(oscillator.rho), float(oscillator.radius)
    if not disturbance >= 0.0:
        raise ParameterError(f'disturbance = {disturbance!r} 1/s must not be negative')
    if disturbance >= rho * 2.0 * r**3 / (3.0 * 3.0**0.5):
        return None
    # ρ(r² − s²)s = w̄ between its maximum at r/√3 and r; −ρ(r² − s²)s = w̄ beyond r.
    inner, outer = (float(np.roots([1.0, 0.0, -r * r, w / rho]).real.max())
                    for w in (disturbance, -disturbance))
    annulus = Annulus(inner, max(outer, inner))
    rate = transverse_rate(rho, r, omega, annulus.inner, annulus.outer)
    return tube_radius(rate, annulus.outer / annulus.inner, disturbance), annulus
