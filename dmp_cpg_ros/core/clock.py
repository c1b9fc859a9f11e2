# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Time step from one control tick to the next, by the ticks' stamps."""

from __future__ import annotations

LONGEST_GAP_S = 1.0
"""Longest time step [s]: what is longer is a clock that was set, and no time that was lived."""


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
        """Time since the last tick [s]: 0 at the first and where the stamp does not grow, and
        ``LONGEST_GAP_S`` at most.
        """
        last, self.time_ns = self.time_ns, time_ns
        return min((time_ns - last) * 1e-9, LONGEST_GAP_S) if 0 <= last < time_ns else 0.0
