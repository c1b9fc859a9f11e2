# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``body_mode``: whether the robot stands, lies, moves between the two, or has fallen."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.modes.command import MODES
from dmp_cpg_ros.core.modes.manager import ModeState
from dmp_cpg_ros.nodes.message_values import set_stamp


class BodyModeWriter:
    """Writes ``body_mode``."""

    def __init__(self) -> None:
        """Build the message."""
        self._reason, self._movement = KeyValue(key='reason'), KeyValue(key='movement')
        self._tries = KeyValue(key='tries')
        self._status = DiagnosticStatus(
            name='body_mode', hardware_id='dmp_cpg_ros',
            values=[self._reason, self._movement, self._tries])
        self.message = DiagnosticArray(status=[self._status])

    def fill(self, state: ModeState) -> DiagnosticArray:
        """Refill with a state."""
        fell = state.mode == 'damped'
        self._status.message = state.mode
        self._status.level = DiagnosticStatus.ERROR if fell else DiagnosticStatus.OK
        self._reason.value = state.reason
        self._movement.value = state.movements[0] if state.movements else ''
        self._tries.value = str(state.tries)
        set_stamp(self.message.header.stamp, state.time_ns)
        return self.message


def read_body_mode(message: DiagnosticArray) -> str:
    """Mode in a message; raises DataError when it holds none that is valid."""
    for status in message.status:
        if status.name == 'body_mode':
            if status.message not in MODES:
                raise DataError(
                    f"body mode '{status.message}' must be one of {', '.join(MODES)}")
            return str(status.message)
    raise DataError(
        f"no status named 'body_mode' among {[status.name for status in message.status]}")
