# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where something ceases to hold, by bisection."""

from __future__ import annotations

from collections.abc import Callable


def last_that_holds(holds: Callable[[float], bool], low: float, high: float, rounds: int) -> float:
    """Largest value between one that holds and one that does not, to (high − low)/2^rounds.

    Parameters
    ----------
    holds : callable (float) → bool
        Holds below some value and not above it.
    low, high : float
        A value that holds, and one that need not.
    rounds : int
        How often the interval is halved.

    Returns
    -------
    float
        It holds, or is ``low``.
    """
    for _ in range(rounds):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low
