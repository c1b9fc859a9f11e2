# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much load each foot is planned to carry, over the cycle."""

from __future__ import annotations

from collections.abc import Sequence


def planned_load(
    cycle_position: Sequence[float], duty: float, activity: Sequence[float], transfer: float
) -> list[float]:
    """Share of the load that each foot may take: a trapezoid over the planned stance.

    Parameters
    ----------
    cycle_position : sequence of n floats
        0 at mid-swing, in [−1/2, 1/2).
    duty : float
        Duty factor β.
    activity : sequence of n floats
        Swing activity; a leg that does not swing carries.
    transfer : float
        Fraction of the cycle over which a foot takes and gives load.

    Returns
    -------
    list of n floats
        In [0, 1].
    """
    lift_off = 0.5 * (1.0 - duty)
    return [
        max(min(max((abs(position) - lift_off) / transfer, 0.0), 1.0), 1.0 - swings)
        for position, swings in zip(cycle_position, activity, strict=True)
    ]
