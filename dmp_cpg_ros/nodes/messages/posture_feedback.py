# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``posture_feedback``: corrections of the legs, and what the body does; ``body_mode``."""

from __future__ import annotations

import numpy as np
from std_msgs.msg import String

from dmp_cpg_ros import layouts
from dmp_cpg_ros.core.balance.body_command import MODES, BodyCommand
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.maths.vec3 import triple
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.nodes.messages import cdr
from dmp_cpg_ros.nodes.messages.joint_states import AnyJoints, JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.messages.values import Array

_JOINTS = slice(0, len(JOINT_NAMES))
_FEET = slice(_JOINTS.stop, _JOINTS.stop + len(layouts.SHIFT_ROWS))
_BASE = slice(_FEET.stop, _FEET.stop + len(layouts.CORRECTION_ROWS))
_MARGINS = slice(_BASE.stop, _BASE.stop + len(layouts.MARGIN_ROWS))
_PROGRESS = slice(_MARGINS.stop, _MARGINS.stop + len(layouts.PROGRESS_ROWS))
_FELT = slice(_PROGRESS.stop, _PROGRESS.stop + len(layouts.FELT_ROWS))
_GROUND = slice(_FELT.stop, _FELT.stop + len(layouts.GROUND_ROWS))
_COMMAND = slice(_GROUND.stop, None)


class PostureFeedbackWriter:
    """Writes ``posture_feedback``: torques and measured angles of the joints, shift, drift and
    measured forces of the feet, a velocity correction, the body's mode and its movement.
    """

    def __init__(self) -> None:
        """Lay the message out."""
        self._writer = JointStateWriter(layouts.POSTURE_ROWS)
        self._position, self._velocity, self._effort = np.zeros((3, len(layouts.POSTURE_ROWS)))

    def fill(self, time_ns: int, feedback: PostureFeedback) -> cdr.SerializedJointState:
        """Refill with a feedback; raises DataError when it is not finite."""
        self._position[_JOINTS] = feedback.measured
        self._position[_FEET].reshape(len(LEGS), 3)[:] = feedback.shift_in_base
        self._velocity[_FEET].reshape(len(LEGS), 3)[:, :2] = feedback.drift_in_base
        self._velocity[_BASE] = feedback.correction
        self._position[_MARGINS] = feedback.margins
        velocity, *rest = feedback.progress or Progress()
        self._position[_PROGRESS] = (*velocity, *rest)
        self._position[_FELT] = feedback.felt
        self._position[_GROUND] = feedback.level
        self._effort[_JOINTS] = feedback.torque
        self._effort[_FEET].reshape(len(LEGS), 3)[:, 2] = feedback.foot_force
        self._position[_COMMAND], self._velocity[_COMMAND] = layouts.command_rows(feedback.command)
        return self._writer.fill(time_ns, self._position, self._velocity, self._effort)


class PostureFeedbackReader:
    """Reads ``posture_feedback``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader, self._command = JointStateReader(layouts.POSTURE_ROWS), CommandReader()

    def read(self, message: AnyJoints) -> PostureFeedback:
        """Read the feedback; raises DataError."""
        position, velocity, effort = self._reader.read(message)
        shift, drift, force = (of[_FEET].reshape(len(LEGS), 3).tolist()
                               for of in (position, velocity, effort))
        return PostureFeedback(
            effort[_JOINTS].tolist(), [triple(of_foot) for of_foot in shift],
            [(x, y) for x, y, _ in drift], triple(velocity[_BASE].tolist()),
            self._command.of(position[_COMMAND], velocity[_COMMAND]), position[_JOINTS].tolist(),
            [normal for _, _, normal in force], tuple(position[_MARGINS].tolist()),
            _progress(position[_PROGRESS]), tuple(
                felt > 0.0 for felt in position[_FELT].tolist()),
            tuple(position[_GROUND].tolist()))


def _progress(row: Array) -> Progress:
    x, y, *rest = row.tolist()
    return Progress((x, y), *rest)


class CommandReader:
    """Reads what the body does out of ``posture_feedback``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader = JointStateReader(layouts.POSTURE_ROWS[_COMMAND], cdr.FIELDS[:2])
        self._last: tuple[bytes, BodyCommand] | None = None

    def read(self, message: AnyJoints) -> BodyCommand:
        """Read the command only; raises DataError."""
        return self.of(*self._reader.read(message))

    def of(self, position: Array, velocity: Array) -> BodyCommand:
        """Command of its rows, the same object while they stay; raises DataError."""
        content = position.tobytes() + velocity.tobytes()
        if self._last is None or content != self._last[0]:
            self._last = content, layouts.read_command_rows(position.tolist(), velocity.tolist())
        return self._last[1]


class BodyReader:
    """Reads what the inhibition needs of ``posture_feedback``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._command = CommandReader()
        self._rows = JointStateReader(
            (*layouts.MARGIN_ROWS, *layouts.PROGRESS_ROWS), cdr.FIELDS[:1])

    def read(self, message: AnyJoints) -> tuple[str, tuple[float, ...], Progress]:
        """Mode of the body, margins of the capture point [m], and progress; raises DataError."""
        (rows,) = self._rows.read(message)
        count = len(layouts.MARGIN_ROWS)
        return (self._command.read(message).mode, tuple(rows[:count].tolist()),
                _progress(rows[count:]))


def read_body_mode(message: String) -> str:
    """Mode in ``body_mode``; raises DataError when it is none."""
    if message.data not in MODES:
        raise DataError(f"body mode '{message.data[:40]}' must be one of {', '.join(MODES)}")
    return str(message.data)
