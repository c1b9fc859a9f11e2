# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Coupled oscillators of unequal frequencies: the bound (r/λ) d̄ on their disagreement (Section 3.4).

With ω_i = ω + δ_i the mismatch d_i = δ_i S x_i is a disturbance of the homogeneous network. In the
norm of Theorem 4, (Σ ξ_i |x_i − x̄|²)^½ =: ε with Σ ξ_i = 1, disagreement obeys ε̇ ≤ −λε + d̄, so
that ε ≤ d̄/λ in the end. Once ε is small the oscillators are near their cycle, where they grow
apart less than at the origin; the bound is applied again with that growth until it settles.

For K_ij = k_ij I the disc |x| ≤ r cannot be left and x̄ feels no coupling. Other gains may drive
states out of the disc, to R with ρ(R² − r²) = Σ_j (‖K_ij‖ − λ_min(K_ij)); and where ξ does not
balance the couplings nothing is known of x̄, so that only ε is bounded.

For k_ij I phases have a sharper bound of their own. With θ_i from their places, |x_i| ∈ [R, r],

    θ̇_i = ω_i + Σ_j k_ij (|x_j|/|x_i|) sin(θ_j − θ_i) = ω_i − (Lθ)_i + p_i,

R² ≥ r² − max_i Σ_j k_ij (1 − cos s_ij)/ρ where |θ_i − θ_j| ≤ s_ij, and |p_i| is what sine and
radii differ from the straight line by. So |θ_i − θ_j| ≤ (δ + max |p|) ∫ |(e_i − e_j)ᵀe^{−Lt}|₁ dt
in the end, for frequencies that vary in time as they like; applied again with what it gives.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import asin, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph
from dmp_cpg_ros.core.contraction.synchronisation import (
    Synchronisation,
    comparison_laplacian,
    invariant_radius,
)
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import phi_functions
from dmp_cpg_ros.core.maths.roots import last_that_holds


@dataclass(frozen=True)
class MismatchBound:
    """What the oscillators' disagreement stays below, after a transient.

    Attributes
    ----------
    disagreement : float
        ε = (Σ ξ_i |x_i − x̄|²)^½.
    distance : float
        Largest |x_i − x_j|; the paper's (r/λ) d̄ with r = (1/ξ_i + 1/ξ_j)^½.
    smallest_radius : float
        Lower bound on every |x_i|; 0 where nothing is known.
    phase_spread : float
        Largest difference of two oscillators' phases from their places [rad]; π without a bound.
    """

    disagreement: float
    distance: float
    smallest_radius: float
    phase_spread: float


def disagreement_bound(rate: float, disturbance: float, weights: Array) -> tuple[float, float]:
    """(r/λ) d̄: bounds on ε and on every |x_i − x_j| under a disturbance.

    Parameters
    ----------
    rate : float
        λ > 0 of :class:`~dmp_cpg_ros.core.contraction.synchronisation.Synchronisation` [1/s].
    disturbance : float
        d̄ ≥ (Σ ξ_i |d_i|²)^½ at all times [1/s].
    weights : ndarray (N,)
        ξ, adding up to 1.

    Returns
    -------
    disagreement, distance : float

    Raises
    ------
    ParameterError
        If the rate is not positive.
    """
    if not rate > 0.0:
        raise ParameterError(f'rate = {rate!r} 1/s must be positive: the network is not certified '
                             'to synchronise')
    found = disturbance / rate
    return found, found * _farthest(weights)[0]


def disagreement(weights: Array, z: NDArray[np.complex128]
                 ) -> tuple[complex, float, float, float]:
    """Mean of locked coordinates and ε = (Σ ξ_i |z_i − z̄|²)^½, with the largest distance of two of
    them and of one from the mean, as multiples of ε.
    """
    pairs: list[tuple[float, complex]] = list(zip(weights.tolist(), z.tolist(), strict=True))
    mean = sum(weight * each for weight, each in pairs)
    return (mean, sqrt(sum(weight * abs(each - mean) ** 2 for weight, each in pairs)),
            *_farthest(weights))


def _farthest(weights: Array) -> tuple[float, float]:
    if len(weights) == 1:
        return 0.0, 0.0
    smallest, second = sorted(weights.tolist())[:2]
    return sqrt(1.0 / smallest + 1.0 / second), sqrt((1.0 - smallest) / smallest)


def phase_spread(distance: float, inner: float) -> float:
    """Largest difference of the phases of two states [rad] at a distance, neither of them nearer
    to the origin than ``inner``.
    """
    half = distance / (2.0 * inner) if inner > 0.0 else 1.0
    return 2.0 * asin(half) if half < 1.0 else pi


def mismatch_bound(found: Synchronisation, rho: float, radius: float,
                   mismatch: float) -> MismatchBound:
    """Bound for frequencies that differ from a common one by at most δ.

    Parameters
    ----------
    found : Synchronisation
        Of the homogeneous network, with weights.
    rho, radius : float
        ρ [1/s] and r of the oscillators.
    mismatch : float
        δ ≥ |ω_i − ω| [rad/s].

    Returns
    -------
    MismatchBound
        With an infinite disagreement when the network is not certified to synchronise or its
        components only follow one another.

    Raises
    ------
    ParameterError
        If the mismatch is negative or not finite.
    """
    if not (np.isfinite(mismatch) and mismatch >= 0.0):
        raise ParameterError(f'mismatch = {mismatch!r} rad/s must be finite and not negative')
    *_, last = _bounds(found, rho, radius, mismatch)
    return last


def _bounds(found: Synchronisation, rho: float, radius: float, mismatch: float
            ) -> Iterator[MismatchBound]:
    """Bounds of which each is nowhere larger than the one before."""
    if not found.synchronises or found.weights is None:
        yield MismatchBound(float('inf'), float('inf'), 0.0, float(np.pi))
        return
    least, (_, one) = 0.0, _farthest(found.weights)
    largest = invariant_radius(radius, found.overshoot, rho)
    for _ in range(20):
        growth = min(found.growth, rho * (radius**2 - least**2))
        epsilon, distance = disagreement_bound(
            found.connectivity - growth, mismatch * largest, found.weights)
        if not found.free_mean:
            yield MismatchBound(epsilon, distance, 0.0, float(np.pi))
            return
        farthest = epsilon * one                                             # bounds |x_i − x̄|
        mean = _mean_radius(rho, radius, mismatch, epsilon, farthest)
        inner = max(0.0, mean - farthest)
        yield MismatchBound(epsilon, distance, inner, phase_spread(distance, inner))
        if abs(inner - least) < 1e-9:
            return
        least = inner


def mismatch_margin(graph: CouplingGraph, found: Synchronisation, rho: float, radius: float,
                    phase_spread: float) -> float:
    """Largest mismatch for which the phases stay together: the margin for unequal leg frequencies.

    Parameters
    ----------
    graph : CouplingGraph
        Couplings.
    found : Synchronisation
        Of the homogeneous network on it.
    rho, radius : float
        Parameters of the oscillators.
    phase_spread : float
        What the phases may differ by [rad].

    Returns
    -------
    float
        δ with |ω_i − ω| ≤ δ [rad/s]; 0 when nothing is certified.
    """
    L = comparison_laplacian(graph)
    gain = None if graph.weights is None else phase_gain(L)

    def within(delta: float) -> bool:
        for bound in _bounds(found, rho, radius, delta):
            if bound.phase_spread <= phase_spread:
                return True
        return gain is not None and _stays_within(phase_spread, bound, L, gain, rho, radius, delta)

    return last_that_holds(within, 0.0, max(found.rate, 0.0), 20)


def phase_gain(L: Array) -> Array | None:
    """∫ |(e_i − e_j)ᵀ e^{−Lt}|₁ dt of each pair: how far it parts under bounded disturbances.

    The rows of e^{−Lt} add up to 1, so that |zᵀe^{−Lt}|₁ never grows and, for z that adds up to 0,
    has shrunk by half the largest norm of the pairs' own rows. A cell h adds the trapezoid of the
    absolute values and at most h³/8 |zᵀL²|₁.

    Parameters
    ----------
    L : ndarray (N, N)
        Scalar Laplacian [1/s].

    Returns
    -------
    ndarray (N, N) or None
        Upper bounds [s], read-only; None where it takes too many cells, or nothing reaches all
        nodes. Kept for the last Laplacians: gaits and parameters change, couplings rarely do.
    """
    return _phase_gain(np.asarray(L, dtype=float).tobytes(), len(L))


@lru_cache(maxsize=64)
def _phase_gain(laplacian: bytes, size: int) -> Array | None:
    L = np.frombuffer(laplacian).reshape(size, size)
    unit, h = np.eye(len(L)), _CELL / max(float(np.diag(L).max()), 1e-300)
    z, decay, gain = unit[:, None] - unit, phi_functions(-h * L, 0)[0], np.zeros_like(L)
    for _ in range(_MOST_CELLS):
        after = z @ decay
        gain += 0.5 * h * np.abs(np.concatenate([z, after], axis=2)).sum(axis=2)
        gain += h**3 / 8.0 * np.abs(z @ L @ L).sum(axis=2)
        z, left = after, 0.5 * float(np.abs(after).sum(axis=2).max())
        if left < 1e-3:
            gain /= 1.0 - left
            gain.setflags(write=False)
            return gain
    return None


_CELL = 0.1  # of the fastest time constant
_MOST_CELLS = 3000


def _stays_within(limit: float, bound: MismatchBound, L: Array, gain: Array, rho: float,
                  radius: float, mismatch: float) -> bool:
    """Whether phases differ by at most a limit [rad] in the end, from a bound that holds then."""
    spread, inner = np.full_like(L, bound.phase_spread), bound.smallest_radius
    K = np.maximum(0.0, -L)
    for _ in range(20):
        if spread.max() <= limit:
            return True
        if not (spread.max() < 1.0 and inner > 0.0):
            break
        slack = float((K * (1.0 - np.cos(spread))).sum(axis=1).max()) / rho
        inner = max(inner, float(np.sqrt(max(0.0, radius**2 - slack))))
        bent = np.maximum(radius / inner - 1.0, 1.0 - np.sinc(spread / np.pi) * inner / radius)
        new = np.minimum(spread, gain * (
            mismatch + float((K * bent * spread).sum(axis=1).max())))
        if np.abs(new - spread).max() < 1e-9:
            break
        spread = new
    return float(spread.max()) <= limit


def _mean_radius(rho: float, radius: float, mismatch: float, epsilon: float,
                 farthest: float) -> float:
    """Lower bound that R = |x̄| comes to, from Ṙ ≥ ρ(r²R − R³ − 3ε²R − ε² max|e|) − δε.

    x̄ = Σ ξ_i x_i feels no coupling; the terms in ε are what the spread e_i = x_i − x̄ does to the
    means of −ρ|x_i|²x_i and of δ_i S x_i. The right side is concave and positive between two
    roots; R passes the lower one from all initial states but those with x̄ near 0. Newton's
    iteration from r falls towards the upper one.
    """
    linear = radius**2 - 3.0 * epsilon**2
    constant = epsilon**2 * farthest + mismatch * epsilon / rho
    R = radius
    for _ in range(50):
        slope = linear - 3.0 * R * R
        if not slope < 0.0:
            return 0.0
        step = (linear * R - R**3 - constant) / slope
        R -= step
        if abs(step) < 1e-13 * radius:
            return max(0.0, R - 1e-9 * radius)
    return 0.0
