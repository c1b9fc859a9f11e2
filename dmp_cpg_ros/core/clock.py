# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Time by the stamps of ticks: from one to the next, ages, and a clock that was set back."""

from __future__ import annotations

LONGEST_GAP_S = 1.0
"""Longest time step [s]: what is longer is a clock that was set, and no time that was lived."""

RESET_NS = 100_000_000
"""A stamp that lies this far behind another one is of a clock that was set back, or false [ns]."""


def time_step(last_ns: int, time_ns: int) -> float:
    """Time from a stamp to the next one [s]: 0 after none (−1) and where the stamp does not grow,
    and ``LONGEST_GAP_S`` at most.
    """
    return min((time_ns - last_ns) * 1e-9, LONGEST_GAP_S) if 0 <= last_ns < time_ns else 0.0


def fresh(told_ns: int, now_ns: int, limit_ns: int) -> bool:
    """Whether what bears a stamp is at most so old [ns]. What lies ahead by ``RESET_NS`` is older:
    it was told before the clock was set back.
    """
    return -RESET_NS < now_ns - told_ns <= limit_ns


def carried(stamp_ns: int, last_ns: int, now_ns: int) -> int:
    """A stamp [ns] on a clock that was set back from ``last_ns`` to ``now_ns``: as long ago as
    before, and 0 at least. One of −1, which is none, and those of a clock that runs on stay.
    """
    return stamp_ns if stamp_ns < 0 or last_ns <= now_ns else max(0, stamp_ns + now_ns - last_ns)


class TickClock:
    """The one rule for the time step, in the nodes and in the plain loop.

    Attributes
    ----------
    time_ns : int
        Stamp of the last tick [ns]; −1 before the first.
    """

    def __init__(self) -> None:
        """Wait for the first tick."""
        self.time_ns = -1

    def step(self, time_ns: int) -> float:
        """Time since the last tick, by :func:`time_step` [s]."""
        last, self.time_ns = self.time_ns, time_ns
        return time_step(last, time_ns)
