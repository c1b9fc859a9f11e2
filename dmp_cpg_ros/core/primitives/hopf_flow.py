# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Solution of one Andronov-Hopf oscillator whose radius follows a reference.

In polar coordinates the angle turns at ω and the squared radius obeys a logistic equation
(Bernoulli), which is linear in 1/R². So the flow of
:class:`~dmp_cpg_ros.core.canonical.hopf.AndronovHopf`
is exact for a constant radius and has no stability limit, however large ρr² is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.phase import phase_generator
from dmp_cpg_ros.core.primitives.time_scaling import StepGrid

Array = NDArray[np.float64]


def hopf_flow(x: Array, omega: float, rho: float, radii: Array, grid: StepGrid) -> Array:
    """States at the start, middle and end of a step.

    Exact in the angle; exact in the radius for constant r, else of fourth order in the length of
    the step.

    Parameters
    ----------
    x : ndarray (2,)
        State at the start.
    omega, rho : float
        ω [rad/s] and ρ [1/s].
    radii : ndarray (5,)
        r at the nodes.
    grid : StepGrid
        With five nodes.

    Returns
    -------
    ndarray (3, 2)
    """
    squared = float(x @ x)
    growth = np.ones(3)
    if squared > 0.0:
        density, half = grid.density, 0.5 * grid.length
        middle = _squared_radius(squared, rho, radii[:3], density[:3], half)
        end = _squared_radius(middle, rho, radii[2:], density[2:], half)
        growth[1:] = np.sqrt(np.array([middle, end]) / squared)
    angle = omega * grid.scaled[::2]
    turned = x @ phase_generator().T
    return growth[:, None] * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * turned)


def _squared_radius(squared: float, rho: float, radii: Array, density: Array, length: float
                    ) -> float:
    """Squared radius after a step: 1/R² = e^{−P}/R₀² + ∫ e^{p − P}/r² dp, p = 2ρ ∫ r² ds.

    P is p at the end. 1/r² is replaced by the quadratic in p through three nodes, and the integral
    is then taken exactly.
    """
    rate = 2.0 * rho * radii**2 * density  # dp/du at the nodes
    p_middle = length * float(rate @ (5.0, 8.0, -1.0)) / 24.0
    p_end = length * float(rate @ (1.0, 4.0, 1.0)) / 6.0
    values = 1.0 / radii**2
    # Newton's divided differences
    slope = (values[1] - values[0]) / p_middle
    bend = ((values[2] - values[1]) / (p_end - p_middle) - slope) / p_end
    one = -np.expm1(-p_end)  # ∫ e^{p − P} dp
    first = p_end - one  # ∫ e^{p − P} p dp
    second = p_end**2 - 2.0 * first  # ∫ e^{p − P} p² dp
    integral = values[0] * one + slope * first + bend * (second - p_middle * first)
    return float(1.0 / (np.exp(-p_end) / squared + integral))
