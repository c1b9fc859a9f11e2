# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What follows from the lags of a gait alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dmp_cpg_ros.core.maths import Array

SIDES, ENDS = ((0, 2), (1, 3)), ((0, 1), (2, 3))
"""Legs of the two sides, and of the front and the hind end."""


def stance_groups(lag: Array) -> int:
    """Number of groups of legs that stand in turn, evenly over the cycle; 0 where it is uneven.

    Parameters
    ----------
    lag : ndarray (n,)
        Fractions of a cycle by which the legs follow the first.

    Returns
    -------
    int
        1 for a pronk, 2 for a trot, a pace and a bound.
    """
    places = np.unique(np.round(lag % 1.0, 9))
    gaps = np.diff(np.append(places, places[0] + 1.0))
    return len(places) if np.ptp(gaps) < 1e-6 else 0


def rest_phase(lag: Array) -> float:
    """Cycle position of fl at which the leg nearest to its mid-swing is as far from it as
    possible.

    Of several such positions the one at which fl itself is farthest from mid-swing, and of two the
    earlier one.
    """
    mid_swings = np.unique(np.round(lag % 1.0, 9))  # cycle positions of fl
    gaps = np.diff(np.append(mid_swings, mid_swings[0] + 1.0))
    middles = (mid_swings + 0.5 * gaps)[gaps > gaps.max() - 1e-6] % 1.0
    own = np.abs((middles + 0.5) % 1.0 - 0.5)
    return float(min(middles[own > own.max() - 1e-6]))


def stand_together(lag: Array, duty: float, parts: Sequence[Sequence[int]], grid: int = 400
                   ) -> float:
    """Share of the stance of some foot in which feet of both parts of the legs stand.

    Parameters
    ----------
    lag : ndarray (4,)
        Fractions of a cycle by which fl, fr, rl, rr follow the first.
    duty : float
        Duty factor β.
    parts : pair of sequences of int
        ``SIDES`` or ``ENDS``.
    grid : int
        Number of phases that are looked at.

    Returns
    -------
    float
        In [0, 1]; 0 where no foot stands.
    """
    at = (np.arange(grid)[:, None] / grid - lag + 0.5) % 1.0 - 0.5
    one, other = (np.any((np.abs(at) > 0.5 * (1.0 - duty))[:, list(legs)], axis=1)
                  for legs in parts)
    return float(np.sum(one & other) / max(1, np.sum(one | other)))
