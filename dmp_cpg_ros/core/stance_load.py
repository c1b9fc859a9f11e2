# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much load each foot is planned to carry, over the cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def planned_load(cycle_position: Array, duty: float, activity: Array, transfer: float) -> Array:
    """Share of the load that each foot may take: a trapezoid over the planned stance.

    Parameters
    ----------
    cycle_position : ndarray (n,)
        0 at mid-swing, in [−1/2, 1/2).
    duty : float
        Duty factor β.
    activity : ndarray (n,)
        Swing activity; a leg that does not swing carries.
    transfer : float
        Fraction of the cycle over which a foot takes and gives load.

    Returns
    -------
    ndarray (n,)
        In [0, 1].
    """
    into_stance = np.abs(cycle_position) - 0.5 * (1.0 - duty)
    return np.maximum(np.clip(into_stance / transfer, 0.0, 1.0), 1.0 - activity)
