# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Forward invariance of C while the other nodes are anywhere on their bound.

On ∂C the inward part of ẋ_1 must be positive for *every* |x_j| ≤ R, not only for states that can
be together. It needs no synchronisation beforehand, and gains several times those of
:mod:`~dmp_cpg_ros.core.contraction.capture`, where the followers' places are taken into account.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.connectivity import comparison_laplacian
from dmp_cpg_ros.core.contraction.interval import Interval

Array = NDArray[np.float64]

_BOXES = 512
_ROUNDS = 40
_TOLERANCE = 1e-4


def needed_gain_anywhere(system: CanonicalSystem, omega: float, node: int,
                         region_radius: float) -> float:
    """Gain above which one inhibited node keeps C whatever the others do, proved by intervals.

    Parameters
    ----------
    system : CanonicalSystem
        Coupled oscillators.
    omega : float
        Upper bound on the node's angular frequency [rad/s].
    node : int
        The inhibited node i.
    region_radius : float
        r0 of C_i.

    Returns
    -------
    float
        max over n of (n·f_i(x_d + r0 n) + Σ_j (‖K_ij‖ R − λ_min(K_ij) n·x_i)) / r0, rounded up
        [1/s], with R = max(r_i, |x_d|), the radius of the invariant disc.
    """
    reach = float(np.linalg.norm(system.target[node]))
    largest = max(float(system.radius.max()), reach)
    L = comparison_laplacian(system.graph)[node]
    held, pulled = float(L[node]), float(-L[np.arange(len(L)) != node].sum())
    rho, r = float(system.rho[node]), float(system.radius[node])

    def outward(cosine: Interval) -> Interval:
        """n·ẋ_i without inhibition at x_i = x_d + r0 n, with n·x_d = |x_d| cos."""
        sine = (1.0 - cosine.square()).sqrt()
        along = cosine * reach + region_radius                               # n·x_i
        squared = (cosine * (2.0 * reach * region_radius)
                   + (Interval.of(reach).square() + Interval.of(region_radius).square()))
        radial = rho * ((Interval.of(r).square() - squared) * along)
        return sine * (abs(omega) * reach) + radial + pulled * largest - held * along

    return _maximum(outward) / region_radius


def _maximum(function: Callable[[Interval], Interval]) -> float:
    """Upper bound on a function over [−1, 1], by bisection of the intervals that decide."""
    edges = np.linspace(-1.0, 1.0, _BOXES + 1)
    boxes = Interval(edges[:-1], edges[1:])
    settled = -np.inf
    for _ in range(_ROUNDS):
        upper = function(boxes).upper
        attained = float(function(Interval.of(boxes.middle)).lower.max())
        keep = upper > attained + _TOLERANCE * max(1.0, abs(attained))
        if np.any(~keep):
            settled = max(settled, float(upper[~keep].max()))
        if not np.any(keep):
            return settled
        boxes = boxes[keep]
        middle = boxes.middle
        boxes = Interval(np.concatenate([boxes.lower, middle]),
                         np.concatenate([middle, boxes.upper]))
    return max(settled, float(function(boxes).upper.max()))
