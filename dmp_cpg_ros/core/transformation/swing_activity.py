# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much a leg swings: a filtered measure of its phase speed.

When inhibition stops a phase inside the swing, the foot must come down; when the phase moves again
it must lift. The clearance of the swing is therefore scaled by an activity that follows the phase
speed (notes on the paper: for duty factors below 3/4 no phase has all four feet down), through a
first-order filter as the paper uses for amplitudes.
"""

from __future__ import annotations

from math import exp

import numpy as np
from numpy.typing import NDArray


def activity_step(
    activity: float, phase_rate: float, omega: float, rate: float, dt: float
) -> float:
    """Advance ȧ = rate · (sat(φ̇/ω) − a) exactly for a held phase rate.

    Parameters
    ----------
    activity : float
        a in [0, 1].
    phase_rate : float
        φ̇ [rad/s].
    omega : float
        Free-running ω > 0 [rad/s].
    rate : float
        Rate of the filter [1/s].
    dt : float
        [s]

    Returns
    -------
    float
    """
    wanted = min(max(phase_rate / omega, 0.0), 1.0)
    return wanted + (activity - wanted) * exp(-rate * dt)


def activities_step(
    activities: NDArray[np.float64],
    phase_rates: list[float],
    omegas: list[float],
    rate: float,
    dt: float,
) -> NDArray[np.float64]:
    """As :func:`activity_step` for a few legs, (n,), without arithmetic on arrays."""
    kept, after = exp(-rate * dt), []
    for activity, phase_rate, omega in zip(
        activities.tolist(), phase_rates, omegas, strict=True
    ):
        wanted = min(max(phase_rate / omega, 0.0), 1.0)
        after.append(wanted + (activity - wanted) * kept)
    return np.array(after)
