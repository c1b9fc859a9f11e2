# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Arcs of the phase offsets from one gait to another: direction and length for each leg.

Leg i is at the position o_i = rest − lag_i of its cycle when oscillator fl has phase 0. From one
gait to another it moves by the arc a_i ≡ o_i' − o_i (mod 1). Only differences matter: a common arc
is a faster or slower cycle for all. The rule, in this order:

1. the smallest spread max a − min a, so that the legs' frequencies differ least,
2. the fewest legs in swing at once: the least mean square of their number over all phases and all
   blends between the gaits,
3. the least total movement Σ |a_i − middle|,
4. a leg moves forward in its cycle rather than backward, the front legs first.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from dmp_cpg_ros.core.canonical.phase import wrapped
from dmp_cpg_ros.core.maths import Array

ROUNDING = 1e-9
"""Differences of costs below this are ties."""


def arcs_between(places: Array, new_places: Array, duty: float, new_duty: float) -> Array:
    """Arcs of the four legs by the rule above.

    Parameters
    ----------
    places, new_places : ndarray (4,)
        o_i of both gaits, in cycles.
    duty, new_duty : float
        Duty factors of both, for the second criterion.

    Returns
    -------
    ndarray (4,)
        a_i in cycles; the largest and the smallest are equally far from 0, so that the mean
        frequency of the two is that of the gait.
    """
    direct = wrapped(2.0 * np.pi * (new_places - places)) / (2.0 * np.pi)
    best, least = direct, (float('inf'),)
    for turns in product((0.0, 1.0, -1.0), repeat=len(direct) - 1):
        arcs = direct + np.array((0.0, *turns))
        arcs -= 0.5 * (arcs.max() + arcs.min())
        cost = (float(np.ptp(arcs)), crowding(places, arcs, duty, new_duty),
                float(np.abs(arcs).sum()), *(-arcs).tolist())
        if _less(cost, least):
            best, least = arcs, cost
    return best


def crowding(places: Array, arcs: Array, duty: float, new_duty: float, grid: int = 48) -> float:
    """Mean square of the number of legs in swing, over all phases and all blends.

    Parameters
    ----------
    places, arcs : ndarray (4,)
        o_i at the beginning and a_i, in cycles.
    duty, new_duty : float
        Duty factors at the beginning and at the end.
    grid : int
        Number of blends and of phases that the mean is taken over.

    Returns
    -------
    float
    """
    weight = (np.arange(grid) + 0.5) / grid
    phases = np.arange(grid) / grid
    at = phases[:, None, None] + places + weight[:, None] * arcs
    from_mid_swing = np.abs((at + 0.5) % 1.0 - 0.5)
    swing = 0.5 * (1.0 - duty - weight * (new_duty - duty))
    return float(np.mean(np.sum(from_mid_swing < swing[:, None], axis=-1) ** 2.0))


def _less(cost: tuple[float, ...], least: tuple[float, ...]) -> bool:
    """Compare costs in order; a later one decides only where the earlier ones are equal."""
    for one, other in zip(cost, least, strict=False):
        if abs(one - other) > ROUNDING:
            return one < other
    return False
