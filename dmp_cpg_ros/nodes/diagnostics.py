# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says about itself on ``/diagnostics``."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from dmp_cpg_ros.nodes.message_values import set_stamp, text

PERIOD_NS = 1_000_000_000
"""Time between reports on the robot's clock [ns]."""

LOG_EVERY = 100
"""Of repeated problems the first and then every so many are logged."""


class NodeHealth:
    """Ticks, rejected messages and problems of one node.

    Attributes
    ----------
    ticks : int
        Ticks since the node was made.
    stamp_ns : int
        Stamp of the last tick [ns].
    rejected : dict of str to int
        Messages that were dropped, per topic.
    """

    def __init__(self, name: str) -> None:
        """Start healthy; nodes report at different moments, so that no tick bears all reports."""
        self.name = name
        self.ticks = 0
        self.stamp_ns = 0
        self.rejected: dict[str, int] = {}
        self._recent: dict[str, str] = {}
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

    def reject(self, topic: str, problem: str) -> bool:
        """Count a dropped message; returns whether to log it: the first and every hundredth."""
        count = self.rejected[topic] = self.rejected.get(topic, 0) + 1
        self._recent[topic] = problem
        return count % LOG_EVERY == 1

    def set_problem(self, key: str, message: str, *, error: bool = False) -> bool:
        """Raise a warning (or error) that stays until it is cleared; returns whether it is new."""
        problem = (DiagnosticStatus.ERROR if error else DiagnosticStatus.WARN, message)
        new = self._problems.get(key) != problem
        self._problems[key] = problem
        return new

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
            problems.setdefault(topic, (DiagnosticStatus.WARN, f'{topic}: {problem}'))
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
