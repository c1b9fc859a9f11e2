# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which share of a leg's targets does not come: what a link loses, and what it lets be overtaken.

A robot bears some of it, as targets are carried on, but the controllers lose as much of what it
says to them, and at 30 % a trot falls within seconds. So it stops before.
"""

from __future__ import annotations

from collections import deque

WINDOW_NS = 1_000_000_000
"""Time over which targets are counted, by their stamps [ns]."""

BORNE, LITTLE = 0.15, 0.1
"""Share that may be lost, and share at which a robot that has stopped for it follows again."""


class TargetLoss:
    """Counts the targets of one leg.

    Parameters
    ----------
    tick_ns : int
        Time between two of them [ns]; 0: nothing is counted.
    gap_ns : int
        Time without any after which counting begins anew [ns]: that was no loss, but silence.
    """

    def __init__(self, tick_ns: int, gap_ns: int) -> None:
        """Begin without targets."""
        self._tick_ns, self._gap_ns = tick_ns, gap_ns
        self._stamps: deque[int] = deque()
        self._begin_ns = 0

    def accept(self, stamp_ns: int) -> None:
        """Count targets, whose stamps grow."""
        if not self._tick_ns:
            return
        stamps = self._stamps
        if not stamps or stamp_ns - stamps[-1] > self._gap_ns:
            stamps.clear()
            self._begin_ns = stamp_ns
        stamps.append(stamp_ns)
        while stamps[0] <= stamp_ns - WINDOW_NS:
            stamps.popleft()

    @property
    def share(self) -> float:
        """Share of the last second's targets that have not come; 0 within the first second."""
        stamps = self._stamps
        if not stamps or stamps[-1] - self._begin_ns < WINDOW_NS:
            return 0.0
        return max(0.0, 1.0 - len(stamps) * self._tick_ns / WINDOW_NS)
