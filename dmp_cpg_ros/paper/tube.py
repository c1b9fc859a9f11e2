# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
The tube (R/λ) w̄ in which a disturbed transverse contracting system stays (appendix, last part).

inf_τ |x_d(t) − x(τ)| ≤ (R/λ) w̄ for every t > 0, where R bounds the condition number of Θ, M =
ΘᵀΘ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.contraction.hopf_bounds import transverse_contraction
from dmp_cpg_ros.core.contraction.region import Annulus
from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]


def metric_condition(metrics: ArrayLike) -> float:
    """R = sup ‖Θ‖ / inf σ_min(Θ) over metrics M = ΘᵀΘ, array_like (..., n, n)."""
    eigenvalues = np.linalg.eigvalsh(np.asarray(metrics, dtype=float))
    if not eigenvalues.min() > 0.0:
        raise ParameterError('a metric must be positive definite everywhere')
    return float(np.sqrt(eigenvalues.max() / eigenvalues.min()))


def tube_radius(rate: float, condition: float, disturbance: float) -> float:
    """(R/λ) w̄.

    Parameters
    ----------
    rate : float
        Transverse contraction rate λ > 0 [1/s].
    condition : float
        R ≥ 1 of the metric.
    disturbance : float
        w̄ ≥ |w(t)| [1/s].

    Returns
    -------
    float
        Radius of the tube around the undisturbed trajectory.

    Raises
    ------
    ParameterError
        If the rate is not positive.
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
        w̄ [1/s].

    Returns
    -------
    radius : float
        Of the tube around the trajectory.
    annulus : Annulus
        The smallest annulus around the cycle that the disturbed state cannot leave; None for both
        when the disturbance can push the state through the origin.
    """
    rho, r = float(oscillator.rho), float(oscillator.radius)
    # ρ(r² − s²)s = w̄ between its maximum at r/√3 and r; −ρ(r² − s²)s = w̄ beyond r.
    roots = np.sort(np.roots([1.0, 0.0, -r * r, disturbance / rho]).real)
    if disturbance >= rho * 2.0 * r**3 / (3.0 * 3.0**0.5):
        return None
    outer = float(np.roots([1.0, 0.0, -r * r, -disturbance / rho]).real.max())
    annulus = Annulus(float(roots[-1]), max(outer, float(roots[-1])))
    rate = transverse_contraction(oscillator, omega, annulus).rate
    return tube_radius(rate, annulus.outer / annulus.inner, disturbance), annulus
