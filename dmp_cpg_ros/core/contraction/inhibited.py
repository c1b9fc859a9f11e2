# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Contraction under sparse inhibition (Proposition strongEnoughLocalContraction and Section 4.2).

f = F + f_inh with F the uncoupled oscillators and f_inh = −L x + α (x_d − x). Under the identity
metric f_inh contracts at λ2 = λ_min(L_K + diag α), which inhibition of a single node makes
positive, and F grows by at most β/2 = ρr². The sum contracts *globally* when λ2 > ρr²; that is
stricter than synchronisation. On the invariant set of a capture the origin is out of reach and
less suffices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import CaptureSet
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.contraction.synchronisation import (
    comparison_laplacian,
    grounded_connectivity,
    slowest_rate,
)
from dmp_cpg_ros.core.maths import Array

GLOBAL, REGIONAL, NONE = 'global', 'regional', 'none'


@dataclass(frozen=True)
class InhibitedContraction:
    """Both sides of the condition for contraction under inhibition.

    Attributes
    ----------
    inhibition_rate : float
        λ2 of f_inh [1/s].
    global_growth : float
        sup λ_max(A_s) = ρr² over the whole plane [1/s].
    regional_growth : float
        Growth that is left on the capture set, as λ2 minus the rate there [1/s].
    reach : str
        ``global``: from everywhere; ``regional``: on the capture set; ``none``.
    """

    inhibition_rate: float
    global_growth: float
    regional_growth: float
    reach: str

    @property
    def growth(self) -> float:
        """Growth on the region that the grade speaks of [1/s]."""
        return self.global_growth if self.reach == GLOBAL else self.regional_growth

    @property
    def rate(self) -> float:
        """λ on that region [1/s]; negative when there is no contraction."""
        return self.inhibition_rate - self.growth


def inhibition_rate(graph: CouplingGraph, gains: Array) -> float:
    """Contraction rate λ2 of f_inh = −L x + α (x_d − x) [1/s].

    It grows with every α_i, and saturates at the grounded Laplacian's smallest eigenvalue.
    """
    return grounded_connectivity(graph, np.asarray(gains, dtype=float))


def inhibited_contraction(system: CanonicalSystem, capture: CaptureSet) -> InhibitedContraction:
    """Contraction of the inhibited network, globally or on the set that capture leads into.

    Parameters
    ----------
    system : CanonicalSystem
        Coupled oscillators.
    capture : CaptureSet
        Invariant set with the gains that act; where it does not hold there is no regional grade.

    Returns
    -------
    InhibitedContraction
    """
    growths = growth(system.rho, system.radius)
    rate = inhibition_rate(system.graph, capture.gains)
    whole = float(growths.max())
    everywhere = rate - whole
    if not everywhere > 0.0 and growths.min() < whole:
        # Unequal oscillators may contract together where the largest growth does not.
        M = comparison_laplacian(system.graph) + np.diag(capture.gains)
        everywhere = slowest_rate(M - np.diag(growths))
        whole = rate - everywhere if everywhere > 0.0 else whole
    if everywhere > 0.0:
        reach = GLOBAL
    else:
        reach = REGIONAL if capture.holds and capture.rate > 0.0 else NONE
    return InhibitedContraction(rate, whole, rate - capture.rate, reach)
