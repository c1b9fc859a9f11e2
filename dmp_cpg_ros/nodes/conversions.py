# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Between the suite's messages and the core's arrays.

Values pass bit for bit. What enters is taken by name and checked;
:class:`~dmp_cpg_ros.core.errors.DataError` is raised for what must not enter. The robot's state is
in :mod:`~dmp_cpg_ros.nodes.robot_state_messages`, stop and start in
:mod:`~dmp_cpg_ros.nodes.inhibition_messages`.
"""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Twist, TwistStamped, WrenchStamped
from sensor_msgs.msg import JointState

from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, JOINTS_OF_LEG, LEGS, JointTargets
from dmp_cpg_ros.core.scenario.push import FRAMES, PushForce
from dmp_cpg_ros.layouts import CANONICAL_NAMES, CORRECTION_NAMES, SHIFT_NAMES
from dmp_cpg_ros.nodes.joint_state_messages import FIELDS, JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.message_values import (
    Array,
    checked,
    checked_numbers,
    frame_of,
    header_ns,
)
from dmp_cpg_ros.nodes.robot_state_messages import BASE_FRAME
from dmp_cpg_ros.nodes.serialized_messages import SerializedJointState, SerializedTwist
from dmp_cpg_ros.nodes.serialized_writing import RefilledMessage, SerializedDraft

_JOINTS = slice(0, len(JOINT_NAMES))
_FEET = slice(len(JOINT_NAMES), len(JOINT_NAMES) + len(SHIFT_NAMES))
_BASE = slice(len(JOINT_NAMES) + len(SHIFT_NAMES), None)


def read_twist(message: Twist) -> tuple[float, float, float]:
    """(v_x, v_y, γ) of a velocity command [m/s, m/s, rad/s]; raises DataError."""
    linear, angular = message.linear, message.angular
    v_x, v_y, gamma = linear.x, linear.y, angular.z
    checked_numbers((v_x, v_y, gamma, linear.z, angular.x, angular.y), 'velocity')
    return v_x, v_y, gamma


def read_push_force(message: WrenchStamped) -> PushForce:
    """Force of a push with its time and frame; raises DataError."""
    force, torque = message.wrench.force, message.wrench.torque
    numbers = checked_numbers((force.x, force.y, force.z), 'force of the push')
    if (torque.x, torque.y, torque.z) != (0.0, 0.0, 0.0):
        raise DataError('push: only a force can act, the torque must be zero')
    return PushForce(
        header_ns(message), (numbers[0], numbers[1], numbers[2]),
        message.header.frame_id or FRAMES[0])


class ReferenceWriter:
    """Writes ``reference``."""

    def __init__(self) -> None:
        """Lay the message out."""
        draft = SerializedDraft()
        draft.text(BASE_FRAME)
        self._message = RefilledMessage(draft, [draft.doubles(6)])
        self._numbers = np.zeros(6)

    def fill(self, time_ns: int, r: Array) -> SerializedTwist:
        """Refill with r = (v_x, v_y, γ), ndarray (3,); raises DataError when it is not finite."""
        checked(r, 'reference')
        numbers = self._numbers
        numbers[:2], numbers[5] = r[:2], r[2]
        return SerializedTwist(self._message.filled(time_ns, [numbers.tobytes()]))


def read_reference(message: TwistStamped | SerializedTwist) -> Array:
    """Reference r = (v_x, v_y, γ), ndarray (3,) [m/s, m/s, rad/s]; raises DataError."""
    if isinstance(message, SerializedTwist):
        numbers = checked_numbers(message.numbers, 'velocity')
        return np.array((numbers[0], numbers[1], numbers[5]))
    return np.array(read_twist(message.twist))


class CanonicalStateWriter:
    """Writes ``canonical_state``."""

    def __init__(self) -> None:
        """Lay the message out."""
        self._writer = JointStateWriter(CANONICAL_NAMES, ('position', 'velocity'))

    def fill(self, time_ns: int, x: Array, x_dot: Array, gait: str = '',
             ) -> SerializedJointState:
        """Refill with states and rates [1/s], ndarrays (4, 2), and the word of the gait in which
        their phases are to be read; raises DataError.
        """
        return self._writer.fill(time_ns, x, x_dot, frame=gait)


class CanonicalStateReader:
    """Reads ``canonical_state``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader = JointStateReader(CANONICAL_NAMES, ('position', 'velocity'))

    def read(self, message: JointState | SerializedJointState) -> tuple[Array, Array]:
        """States x and rates ẋ [1/s], ndarrays (4, 2); raises DataError."""
        x, x_dot = self._reader.read(message)
        return x.reshape(len(LEGS), 2), x_dot.reshape(len(LEGS), 2)


class JointTargetsWriter:
    """Writes the ``joint_targets`` of one leg."""

    def __init__(self, leg: str) -> None:
        """Lay the message of a leg out."""
        self._writer = JointStateWriter([f'{leg}_{joint}' for joint in JOINTS_OF_LEG], FIELDS)

    def fill(self, time_ns: int, targets: JointTargets) -> SerializedJointState:
        """Refill with the targets of the leg's joints; raises DataError."""
        return self._writer.fill(time_ns, targets.position, targets.velocity, targets.effort)


class JointTargetsReader:
    """Reads ``joint_targets`` of whichever leg sent them."""

    def __init__(self) -> None:
        """Prepare the order of the joints of every leg."""
        self._readers = {
            leg: JointStateReader([f'{leg}_{joint}' for joint in JOINTS_OF_LEG], FIELDS)
            for leg in LEGS}

    def read(self, message: JointState | SerializedJointState) -> tuple[str, JointTargets]:
        """Name of the leg and its targets; raises DataError, also for names of no leg."""
        names = message.name
        leg = names[0].partition('_')[0] if names else ''
        if leg not in self._readers or len(names) != len(JOINTS_OF_LEG):
            raise DataError(f"names {names} must be the {len(JOINTS_OF_LEG)} joints of one leg of "
                            f"{', '.join(LEGS)}, such as {', '.join(JOINT_NAMES[:3])}")
        return leg, JointTargets(*self._readers[leg].read(message))


class PostureFeedbackWriter:
    """Writes ``posture_feedback``: torques and measured angles of the joints, shift, drift and
    measured forces of the feet, a velocity correction.

    The body's mode is in ``frame_id``.
    """

    def __init__(self) -> None:
        """Lay the message out."""
        names = JOINT_NAMES + SHIFT_NAMES + CORRECTION_NAMES
        self._writer = JointStateWriter(names, FIELDS)
        self._position, self._velocity, self._effort = (np.zeros(len(names)) for _ in FIELDS)

    def fill(self, time_ns: int, feedback: PostureFeedback) -> SerializedJointState:
        """Refill with a feedback; raises DataError when it is not finite."""
        self._position[_JOINTS] = feedback.measured
        self._position[_FEET] = feedback.shift_in_base.reshape(-1)
        self._velocity[_FEET].reshape(len(LEGS), 3)[:, :2] = feedback.drift_in_base
        self._velocity[_BASE] = feedback.correction
        self._effort[_JOINTS] = feedback.torque
        self._effort[_FEET].reshape(len(LEGS), 3)[:, 2] = feedback.foot_force
        return self._writer.fill(
            time_ns, self._position, self._velocity, self._effort, frame=feedback.mode)


class PostureFeedbackReader:
    """Reads ``posture_feedback``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader = JointStateReader(JOINT_NAMES + SHIFT_NAMES + CORRECTION_NAMES, FIELDS)

    def read(self, message: JointState | SerializedJointState) -> PostureFeedback:
        """Read the feedback; raises DataError."""
        position, velocity, effort = self._reader.read(message)
        return PostureFeedback(
            effort[_JOINTS], position[_FEET].reshape(len(LEGS), 3),
            velocity[_FEET].reshape(len(LEGS), 3)[:, :2], velocity[_BASE],
            frame_of(message), position[_JOINTS], effort[_FEET].reshape(len(LEGS), 3)[:, 2])
