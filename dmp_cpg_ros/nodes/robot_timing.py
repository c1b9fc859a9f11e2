# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How well the suite keeps up with the robot: rate, latency from state to last target, missed
deadlines.
"""

from __future__ import annotations

import time
from array import array

import numpy as np

from dmp_cpg_ros.core.robot_model.state import LEGS


class RobotTiming:
    """Measures on the machine's monotonic clock; nothing of it enters the gait."""

    def __init__(self) -> None:
        """Start without any tick."""
        self._published: dict[int, list[float]] = {}
        self._latency = array('d')
        self._first: tuple[float, int] | None = None
        self._last: tuple[float, int] | None = None
        self.ticks = 0
        self.misses = 0
        self.waits = 0

    def published(self, stamp_ns: int) -> None:
        """Note that the state of a tick has been published."""
        now = time.monotonic()
        self._first = self._first or (now, stamp_ns)
        self._last = (now, stamp_ns)
        self.ticks += 1
        self._published[stamp_ns] = [now, 0.0]
        if len(self._published) > 64:
            del self._published[min(self._published)]

    def arrived(self, stamp_ns: int) -> None:
        """Note that a leg's targets of a tick have arrived."""
        entry = self._published.get(stamp_ns)
        if entry is None:
            return
        entry[1] += 1.0
        if entry[1] == len(LEGS):
            self._latency.append(1e3 * (time.monotonic() - entry[0]))

    def deadline(self, stamp_ns: int) -> None:
        """Note that the tick after ``stamp_ns`` begins: its targets should have arrived."""
        entry = self._published.get(stamp_ns)
        if entry is not None and entry[1] < len(LEGS):
            self.misses += 1

    def waited(self) -> None:
        """Note that the simulation let a period of wall time pass."""
        self.waits += 1

    def values(self) -> dict[str, float | int]:
        """Rate [Hz], real-time factor, latency [ms] and misses since the start; NaN without
        ticks.
        """
        values: dict[str, float | int] = {
            'deadline_misses': self.misses,
            'waits': self.waits,
            'timed_ticks': self.ticks,
        }
        wall = robot = float('nan')
        if self._first is not None and self._last is not None and self._last[0] > self._first[0]:
            wall, robot = self._last[0] - self._first[0], (self._last[1] - self._first[1]) * 1e-9
        latency = np.frombuffer(self._latency) if self._latency else np.array([np.nan])
        values.update(
            rate_hz=(self.ticks - 1) / wall,
            real_time_factor=robot / wall,
            latency_ms_p50=float(np.percentile(latency, 50)),
            latency_ms_p99=float(np.percentile(latency, 99)),
        )
        return values
