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
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

ActivityT = TypeVar('ActivityT', float, NDArray[np.float64])


def activity_step(
    activity: ActivityT,
    phase_rate: ActivityT,
    omega: float | NDArray[np.float64],
    rate: float,
    dt: float,
) -> ActivityT:
    """Advance ȧ = rate · (sat(φ̇/ω) − a) exactly for a held phase rate.

    Parameters
    ----------
    activity : float or ndarray (...)
        a in [0, 1].
    phase_rate : float or ndarray (...)
        φ̇ [rad/s].
    omega : float or ndarray (...)
        Free-running ω > 0 [rad/s], of all or of each.
    rate : float
        Rate of the filter [1/s].
    dt : float
        [s]

    Returns
    -------
    float or ndarray (...)
    """
    wanted: Any = (
        min(max(phase_rate / omega, 0.0), 1.0)
        if isinstance(phase_rate, float)
        else np.minimum(np.maximum(phase_rate / omega, 0.0), 1.0)
    )
    return wanted + (activity - wanted) * exp(-rate * dt)
