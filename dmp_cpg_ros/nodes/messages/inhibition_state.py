# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``inhibition_state``: stop and start in words and decimal text, for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.messages.values import set_stamp, text


class InhibitionStateWriter:
    """Writes ``inhibition_state``; entries that do not change keep their texts."""

    def __init__(self) -> None:
        """Build the message."""
        self._status = DiagnosticStatus(name='inhibition', hardware_id='dmp_cpg_ros')
        self.message = DiagnosticArray(status=[self._status])
        self._values: dict[str, Any] = {}
        self._entries: dict[str, KeyValue] = {}

    def fill(self, time_ns: int, word: str, values: Mapping[str, Any], *,
             level: bytes = DiagnosticStatus.OK) -> DiagnosticArray:
        """Refill.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        word : str
            State.
        values : mapping of str to value
            Numbers become decimal text that reads back to the same float. The keys must not change
            between calls.
        level : bytes
            Level of :class:`DiagnosticStatus`.
        """
        if values.keys() != self._entries.keys():
            self._entries = {key: KeyValue(key=key) for key in values}
            self._values = {}
            self._status.values = list(self._entries.values())
        for key, value in values.items():
            if key not in self._values or self._values[key] != value:
                self._entries[key].value, self._values[key] = text(value), value
        self._status.message, self._status.level = word, level
        set_stamp(self.message.header.stamp, time_ns)
        return self.message


def read_state_word(message: DiagnosticArray) -> str:
    """State word of ``inhibition_state``, for people; raises DataError where there is none."""
    for status in message.status:
        if status.name == 'inhibition':
            return str(status.message)
    raise DataError(
        f"no status named 'inhibition' among {[status.name for status in message.status]}")
