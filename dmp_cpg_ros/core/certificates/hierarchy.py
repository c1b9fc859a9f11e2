# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reference and transformation systems contract, and with the oscillators the whole hierarchy."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.contraction.finding import PROVED
from dmp_cpg_ros.core.contraction.hierarchy import (
    CONTRACTING,
    TRANSVERSE,
    Part,
    coupled_primitives,
)
from dmp_cpg_ros.core.contraction.hopf_bounds import transverse_contraction
from dmp_cpg_ros.core.contraction.region import Annulus
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters

Array = NDArray[np.float64]

_CRITICAL = 1e-3  # share of the rate that is given away where no metric attains it
_INNER = 0.9  # inner radius of the annulus around the cycle, as a share of r


def spring_damper_contraction(stiffness: float, damping: float) -> tuple[float, Array]:
    """Contraction rate of θ̈ = k(g − θ) + b(ġ − θ̇) with the coordinates that show it.

    In (s θ, θ̇ + (b/2) θ) the Jacobian is [[−b/2, s], [(b²/4 − k)/s, −b/2]], whose matrix measure
    is −b/2 + |s + (b²/4 − k)/s|/2. With s² = |k − b²/4| it is the slowest eigenvalue's real part;
    critical damping has none that attains it, and s = 2ε(b/2) comes within ε.

    Parameters
    ----------
    stiffness, damping : float
        k > 0 [1/s^2] and b > 0 [1/s].

    Returns
    -------
    rate : float
        λ [1/s].
    Theta : ndarray (2, 2)
        Change of coordinates of (θ, θ̇).
    """
    half = 0.5 * damping
    s = max(math.sqrt(abs(stiffness - half**2)), 2.0 * _CRITICAL * half)
    rate = half - 0.5 * abs(s + (half**2 - stiffness) / s)
    return rate, np.array([[s, 0.0], [half, 1.0]])


def hierarchy_inequalities(reference: ReferenceParameters, leg: LegParameters,
                           posture: PostureParameters, found: Synchronisation, rho: float,
                           radius: float, omega: float) -> list[Inequality]:
    """Inequalities (e): rates of the driving and the driven systems, and Theorem 4 for the whole.

    Parameters
    ----------
    reference, leg, posture : ReferenceParameters, LegParameters, PostureParameters
        Parameters of the systems.
    found : Synchronisation
        Of the oscillators.
    rho, radius, omega : float
        Parameters of the oscillators, the smallest ω.

    Returns
    -------
    list of Inequality
    """
    spring, _ = spring_damper_contraction(leg.stiffness, leg.damping)
    filters = min(leg.activity_rate, leg.placement_rate, posture.activity_rate)
    oscillator = transverse_contraction(AndronovHopf(rho, radius), omega,
                                        Annulus(_INNER * radius, radius))
    whole = coupled_primitives(
        Part('reference', CONTRACTING, reference.alpha_r),
        Part('oscillator', TRANSVERSE, oscillator.rate), found,
        [Part('swing filters', CONTRACTING, filters), Part('joints', CONTRACTING, spring)])
    return [
        Inequality('reference', 0.0, reference.alpha_r, '1/s', 'zero', 'alpha_r', PROVED,
                   'the reference forgets how it was commanded before, but while its acceleration '
                   'is limited'),
        Inequality('transformation', 0.0, spring, '1/s', 'zero', 'rate of the joints', PROVED,
                   'the joints converge to what the oscillators and the reference ask for'),
        Inequality('hierarchy', 0.0, whole.rate, '1/s', 'zero', 'smallest rate of all', PROVED,
                   f'for a held command the whole suite is {whole.kind} (Theorem 4)')]
