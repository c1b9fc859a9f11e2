# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``inhibition_state``: stop and start in words and decimal text, for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.messages.values import status_message

NAME = 'inhibition'


def inhibition_state(time_ns: int, word: str, values: Mapping[str, Any]) -> DiagnosticArray:
    """Message of a state word at a time [ns], with values of the stop."""
    return status_message(NAME, time_ns, word, values)


def read_state_word(message: DiagnosticArray) -> str:
    """State word of ``inhibition_state``, for people; raises DataError where there is none."""
    names = [status.name for status in message.status]
    if NAME not in names:
        raise DataError(f"no status named '{NAME}' among {names}")
    return str(message.status[names.index(NAME)].message)
