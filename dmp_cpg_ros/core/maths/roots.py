# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where something ceases to hold, or changes its sign."""

from __future__ import annotations

from collections.abc import Callable
from math import exp, inf

_BEYOND, _JUST, _STEEPEST = 1.2, 0.4, 700.0
_MOST_IN_A_ROW = 9  # below 0, that a line goes through


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


def sign_change(value: Callable[[float], float], low: float, high: float, precision: float,
                ends: tuple[float, float] = (-inf, inf), *, slope: float = 1.0,
                trials: float = inf, jumps: bool = False) -> tuple[float, float]:
    """Positive numbers between which something becomes positive, or 0, from one that is below 0.

    Goes where a straight line through the ends is 0 (Illinois), over the logarithm, or somewhat
    beyond where one of a known slope through the only end that has a value is. At every third
    trial, and where values are infinite or jump, it halves the way, or goes to just beyond where
    the straight line through two in a row that are below 0 is 0.

    Parameters
    ----------
    value : callable
        Of a number; it need not be continuous.
    low, high : float
        Positive. It is not computed there, but between them.
    precision : float
        Share by which the ends differ at most.
    ends : (float, float)
        Values at low and high, where they are known.
    slope : float
        About how the value rises with the logarithm; 0 where it is not known.
    trials : float
        How often it is computed at most.
    jumps : bool
        Whether the value mostly jumps where it becomes positive, so that lines through numbers
        below that alone are of use.

    Returns
    -------
    low, high : float
        Either the ends that were given, or numbers at which the value is below 0, and not.
    """
    (below, above), least, trial, smooth = ends, 1.0 + 0.5 * precision, 0, True
    before, in_a_row, beyond = (low, below), 0, 0.0
    while high > low * (1.0 + precision) and trial < trials:
        trial, most, one = trial + 1, max(-below, above), min(-below, above)
        straight = smooth and trial % 3 > 0
        line = straight and most < inf
        middle = low * (high / low) ** (below / (below - above) if line else 0.5)
        if straight and one < inf == most and slope > 0.0:
            way = exp(min(_BEYOND * one / slope, _STEEPEST))
            middle = low * way if above == inf else high / way
        if low < beyond < high:
            line, middle = False, beyond
        here = value(at := min(max(middle, low * least), high / least))
        if line:
            smooth = abs(here) <= 0.5 * most and (at == middle or (at < middle) == (here < 0.0))
        in_a_row, beyond = in_a_row + 1 if here < 0.0 else 0, 0.0
        if here < 0.0:
            if jumps and 1 < in_a_row < _MOST_IN_A_ROW and -inf < before[1] < here:
                beyond = at + (at - before[0]) * here / (before[1] - here)
                beyond *= 1.0 + _JUST * precision
            before = at, here
            low, below, above = at, here, 0.5 * above if line else above
        else:
            high, above, below = at, here, 0.5 * below if line else below
    return low, high
