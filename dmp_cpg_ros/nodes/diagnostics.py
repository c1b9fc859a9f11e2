# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Status of a node for ``/diagnostics``."""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable, Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from dmp_cpg_ros.nodes.message_values import set_stamp, text

PERIOD_NS = 1_000_000_000
"""Time between reports on the robot's clock [ns]."""

LOG_EVERY_S = 5.0
"""Time after which a topic's next dropped message is logged again [s]."""


class NodeHealth:
    """Ticks, rejected messages and problems of one node.

    Parameters
    ----------
    name : str
        Name of the node.
    clock : callable () → float
        Steady time [s]: what is dropped may come while the robot's clock stands still.

    Attributes
    ----------
    ticks : int
        Ticks since the node was made.
    stamp_ns : int
        Stamp of the last tick [ns].
    rejected : dict of str to int
        Messages that were dropped, per topic; requests, per service.
    """

    def __init__(self, name: str, clock: Callable[[], float] = time.monotonic) -> None:
        """Start healthy; nodes report at different moments, so that no tick bears all reports."""
        self.name, self._clock = name, clock
        self.ticks = 0
        self.stamp_ns = 0
        self.rejected: dict[str, int] = {}
        self._recent: dict[str, tuple[bytes, str]] = {}
        self._logged: dict[str, float] = {}
        self._problems: dict[str, tuple[bytes, str]] = {}
        self._offset_ns = zlib.crc32(name.encode()) % PERIOD_NS
        self._period = -1

    def due(self) -> bool:
        """Whether a second of the robot's clock has begun since the last time this was true."""
        period = (self.stamp_ns + self._offset_ns) // PERIOD_NS
        if period == self._period:
            return False
        self._period = period
        return True

    def reject(self, topic: str, problem: str, *, error: bool = False) -> bool:
        """Count a dropped message; returns whether to log it: not again within ``LOG_EVERY_S``."""
        self.rejected[topic] = self.rejected.get(topic, 0) + 1
        self._recent[topic] = (_level(error), f'{topic}: {problem}')
        now, logged = self._clock(), self._logged.get(topic)
        if logged is not None and now < logged + LOG_EVERY_S:
            return False
        self._logged[topic] = now
        return True

    def set_problem(self, key: str, message: str, *, error: bool = False) -> bool:
        """Raise a warning (or error) that stays until it is cleared; returns whether it is new."""
        problem = (_level(error), message)
        new = self._problems.get(key) != problem
        self._problems[key] = problem
        return new

    def has_problem(self, key: str) -> bool:
        """Whether a warning is raised."""
        return key in self._problems

    def clear_problem(self, key: str) -> bool:
        """Withdraw a warning; returns whether there was one."""
        return self._problems.pop(key, None) is not None

    def status(self, state: str, values: Mapping[str, Any], *, periodic: bool) -> DiagnosticArray:
        """Build the report.

        Parameters
        ----------
        state : str
            Lifecycle state.
        values : mapping of str to value
            What the node adds.
        periodic : bool
            Whether this report closes the second in which messages were rejected; later reports
            are healthy again.
        """
        problems = dict(self._problems)
        for topic, problem in self._recent.items():
            problems.setdefault(topic, problem)
        if periodic:
            self._recent = {}
        entries: dict[str, Any] = {
            'state': state, 'ticks': self.ticks, 'last_stamp_ns': self.stamp_ns}
        entries.update((f'rejected.{topic}', count) for topic, count in self.rejected.items())
        entries.update(values)
        status = DiagnosticStatus(
            name=self.name, hardware_id='dmp_cpg_ros',
            level=max((level for level, _ in problems.values()), default=DiagnosticStatus.OK),
            message='; '.join(message for _, message in problems.values()) or state,
            values=[KeyValue(key=key, value=text(value)) for key, value in entries.items()])
        message = DiagnosticArray(status=[status])
        set_stamp(message.header.stamp, self.stamp_ns)
        return message


def _level(error: bool) -> bytes:
    return bytes(DiagnosticStatus.ERROR if error else DiagnosticStatus.WARN)
