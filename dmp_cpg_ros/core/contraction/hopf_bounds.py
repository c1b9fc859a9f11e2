# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Closed forms for the Andronov-Hopf oscillator: growth and transverse rate.

A_s has the eigenvalues ρ(r² − |x|²) and ρ(r² − 3|x|²), so that growth is largest at the origin,
ρr². In polar differentials δz = (δr, r δθ)/r the oscillator is ṙ/r = ρ(r₀² − r²), θ̇ = ω: its
phase is neutral and its radius contracts at 2ρr², which is Theorem 1's change of coordinates in
closed form.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.maths import Array


def growth(rho: ArrayLike, radius: ArrayLike, smallest_radius: ArrayLike = 0.0) -> Array:
    """Supremum of λ_max(A_s) over |x| ≥ smallest_radius: ρ(r² − smallest_radius²).

    Parameters
    ----------
    rho, radius : array_like (...)
        ρ [1/s] and r of the oscillators.
    smallest_radius : array_like (...)
        Lower bound on |x|; 0 gives the bound ρr² of the whole plane.

    Returns
    -------
    ndarray (...)
        [1/s]
    """
    return np.asarray(rho) * (np.asarray(radius) ** 2 - np.asarray(smallest_radius) ** 2)


def mild_rate(rho: float, radius: float, omega: float) -> float:
    """ℓ = sup ‖∂N/∂x‖ over |x| ≤ r of the part that the step does not integrate exactly.

    With z = x₁ + i x₂, N = (ρr² − iω − ρ|z|²) z has ‖∂N/∂x‖ = |ρr² − iω − 2ρ|z|²| + ρ|z|², a
    convex function of |z|², largest at |z| = r.

    Parameters
    ----------
    rho, radius, omega : float
        Parameters of the oscillators [1/s], [-], [rad/s].

    Returns
    -------
    float
        [1/s]
    """
    return math.hypot(omega, rho * radius**2) + rho * radius**2


def largest_radial(rho: float, radius: float, farthest: float) -> float:
    """Largest |ρ(r² − |y|²) y| over |y| ≤ farthest: at r/√3, or at the end beyond r."""
    return max(2.0 / math.sqrt(27.0) * rho * radius**3,
               rho * (farthest**2 - radius**2) * farthest)


def largest_shifted(rho: float, radius: float, distance: Array, farthest: float) -> Array:
    """Largest |κ(y − x_d) + ρ(r² − |y|²) y|, κ = 2ρr², over |y − x_d| ≤ distance, |y| ≤ farthest.

    With |x_d| = r = 1, u = |y − x_d| and d = |y|² − 1 its square over ρ² is 4u² − 2u²d − d² + d³,
    for d ≤ 1 rising with u, and largest at d = (1 − (1 + 6u²)^½)/3, or at −1.

    Parameters
    ----------
    rho, radius : float
        Parameters of the oscillator.
    distance : ndarray (...)
        Largest distance from x_d.
    farthest : float
        Not beyond √2 r.

    Returns
    -------
    ndarray (...)
    """
    u = distance / radius
    squared = u * u
    d = np.minimum(np.maximum((1.0 - np.sqrt(1.0 + 6.0 * squared)) / 3.0, -1.0),
                   (farthest / radius) ** 2 - 1.0)
    return np.asarray(rho * radius**3 * np.sqrt(
        4.0 * squared - 2.0 * squared * d - d * d + d * d * d))


def transverse_rate(rho: float, radius: float, omega: float, inner: float, outer: float) -> float:
    """Rate of transverse contraction on an annulus under the polar metric M = I/|x|².

    In these coordinates F_s = diag(−2ρ|x|², 0) along radius and phase and the flow is
    (ρ(r² − |x|²), ω); the displacement across it shrinks at 2ρ|x|² ω²/(ω² + ρ²(r² − |x|²)²).

    Parameters
    ----------
    rho, radius, omega : float
        Parameters of the oscillator, ω > 0 [1/s], [-], [rad/s].
    inner, outer : float
        Radii of the annulus K; strictly forward invariant when it contains the limit cycle in its
        inside.

    Returns
    -------
    float
        The rate rises with |x|² up to √(r⁴ + ω²/ρ²) and falls beyond, so that its minimum lies at
        an end [1/s].
    """
    def rate(s: float) -> float:
        slip = rho * (radius**2 - s)
        return 2.0 * rho * s * omega**2 / (omega**2 + slip**2)

    return min(rate(inner**2), rate(outer**2))
