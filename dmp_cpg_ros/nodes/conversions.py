# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Between the suite's messages and the core's arrays.

Values pass bit for bit. What enters is taken by name and checked;
:class:`~dmp_cpg_ros.core.errors.DataError` is raised for what must not enter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.posture import PostureFeedback
from dmp_cpg_ros.core.robot_state import JOINT_NAMES, JOINTS_OF_LEG, LEGS, JointTargets, RobotState
from dmp_cpg_ros.nodes.joint_state_messages import JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.message_values import Array, checked, checked_numbers, set_stamp, stamp_ns, text

BASE_FRAME, WORLD_FRAME = 'base_link', 'odom'

CANONICAL_NAMES = tuple(f'{leg}_x{i}' for leg in LEGS for i in (1, 2))
FOOT_NAMES = tuple(f'{leg}_foot' for leg in LEGS)
SHIFT_NAMES = tuple(f'{leg}_foot_{axis}' for leg in LEGS for axis in 'xy')
CORRECTION_NAMES = ('base_x', 'base_y', 'base_yaw')
TARGET_FIELDS = ('position', 'velocity', 'effort')


# Robot state ------------------------------------------------------------------------------------------------


class RobotStateWriter:
    """The five messages of a robot's state, refilled at every tick.

    Attributes
    ----------
    clock, imu, odom, foot_contacts, joint_states : messages
        Valid after :meth:`fill`.
    """

    def __init__(self) -> None:
        """Build the messages."""
        self.clock, self.imu, self.odom = Clock(), Imu(), Odometry()
        self.imu.header.frame_id = BASE_FRAME
        self.odom.header.frame_id, self.odom.child_frame_id = WORLD_FRAME, BASE_FRAME
        self._joints = JointStateWriter(JOINT_NAMES, TARGET_FIELDS, BASE_FRAME)
        self._feet = JointStateWriter(FOOT_NAMES, ('effort',), BASE_FRAME)
        self.joint_states, self.foot_contacts = self._joints.message, self._feet.message

    def fill(self, state: RobotState) -> None:
        """Refill all messages from a state; raises DataError when a number is not finite."""
        time_ns = state.time_ns
        self._joints.fill(time_ns, state.joint_position, state.joint_velocity, state.joint_effort)
        self._feet.fill(time_ns, state.foot_force)
        set_stamp(self.clock.clock, time_ns)
        set_stamp(self.imu.header.stamp, time_ns)
        set_stamp(self.odom.header.stamp, time_ns)
        rate = _numbers(state.base_rate_in_base, 'base_rate_in_base')
        quaternion = _numbers(state.base_quaternion, 'base_quaternion')
        _set_vector(self.imu.angular_velocity, rate)
        _set_vector(self.imu.linear_acceleration, _numbers(state.acceleration_in_base, 'acceleration_in_base'))
        _set_quaternion(self.imu.orientation, quaternion)
        _set_vector(self.odom.pose.pose.position,
                    _numbers(state.base_position_in_world, 'base_position_in_world'))
        _set_quaternion(self.odom.pose.pose.orientation, quaternion)
        _set_vector(self.odom.twist.twist.linear, _numbers(state.base_velocity_in_base, 'base_velocity_in_base'))
        _set_vector(self.odom.twist.twist.angular, rate)


class JointsReader:
    """Reads ``joint_states``."""

    def __init__(self) -> None:
        """Prepare the order of the twelve joints; effort may be absent in others' messages."""
        self._full = JointStateReader(JOINT_NAMES, TARGET_FIELDS)
        self._without_effort = JointStateReader(JOINT_NAMES, ('position', 'velocity'))

    def read(self, message: JointState) -> tuple[Array, Array, Array]:
        """Position [rad], velocity [rad/s] and effort [N m], each ndarray (12,); effort 0 where it is absent."""
        if message.effort:
            position, velocity, effort = self._full.read(message)
            return position, velocity, effort
        position, velocity = self._without_effort.read(message)
        return position, velocity, np.zeros(len(JOINT_NAMES))


class FootContactsReader:
    """Reads ``foot_contacts``."""

    def __init__(self) -> None:
        """Prepare the order of the feet."""
        self._reader = JointStateReader(FOOT_NAMES, ('effort',))

    def read(self, message: JointState) -> Array:
        """Normal forces, ndarray (4,) [N]."""
        return self._reader.read(message)[0]


@dataclass(frozen=True)
class BaseMotion:
    """Motion of ``base_link``, as ``odom`` tells it.

    Attributes
    ----------
    position_in_world : ndarray (3,)
        [m]
    quaternion : ndarray (4,)
        x, y, z, w.
    velocity_in_base, rate_in_base : ndarray (3,)
        [m/s], [rad/s]
    """

    position_in_world: Array
    quaternion: Array
    velocity_in_base: Array
    rate_in_base: Array


def read_odom(message: Odometry) -> BaseMotion:
    """Read ``odom``; raises DataError for numbers that are not finite or a quaternion that is no rotation."""
    pose, twist = message.pose.pose, message.twist.twist
    return BaseMotion(_vector(pose.position, 'position'), _quaternion(pose.orientation),
                      _vector(twist.linear, 'linear velocity'), _vector(twist.angular, 'angular velocity'))


def read_imu(message: Imu) -> tuple[Array, Array, Array]:
    """Quaternion (4,), rate (3,) [rad/s] and specific force (3,) [m/s^2] in ``base_link``; raises DataError."""
    return (_quaternion(message.orientation), _vector(message.angular_velocity, 'angular_velocity'),
            _vector(message.linear_acceleration, 'linear_acceleration'))


def robot_state(time_ns: int, joints: tuple[Array, Array, Array], base: BaseMotion, foot_force: Array,
                acceleration_in_base: Array | None = None) -> RobotState:
    """Put a robot state together from what its messages told; the acceleration is zero where none is given."""
    return RobotState(
        time_ns, joints[0], joints[1], joints[2], base.position_in_world, base.quaternion, base.velocity_in_base,
        base.rate_in_base, np.zeros(3) if acceleration_in_base is None else acceleration_in_base, foot_force)


# Velocities -------------------------------------------------------------------------------------------------


def read_twist(message: Twist) -> tuple[float, float, float]:
    """(v_x, v_y, γ) of a velocity command [m/s, m/s, rad/s]; raises DataError when any number is not finite."""
    linear, angular = message.linear, message.angular
    v_x, v_y, gamma = linear.x, linear.y, angular.z
    checked_numbers((v_x, v_y, gamma, linear.z, angular.x, angular.y), 'velocity')
    return v_x, v_y, gamma


class ReferenceWriter:
    """Writes ``reference``."""

    def __init__(self) -> None:
        """Build the message."""
        self.message = TwistStamped()
        self.message.header.frame_id = BASE_FRAME

    def fill(self, time_ns: int, r: Array) -> TwistStamped:
        """Refill with r = (v_x, v_y, γ), ndarray (3,); raises DataError when it is not finite."""
        v_x, v_y, gamma = _numbers(r, 'reference')
        twist = self.message.twist
        twist.linear.x, twist.linear.y, twist.angular.z = v_x, v_y, gamma
        set_stamp(self.message.header.stamp, time_ns)
        return self.message


def read_reference(message: TwistStamped) -> Array:
    """Reference r = (v_x, v_y, γ), ndarray (3,) [m/s, m/s, rad/s]; raises DataError."""
    return np.array(read_twist(message.twist))


# Canonical state, targets, feedback -------------------------------------------------------------------------


class CanonicalStateWriter:
    """Writes ``canonical_state``."""

    def __init__(self) -> None:
        """Build the message."""
        self._writer = JointStateWriter(CANONICAL_NAMES, ('position', 'velocity'))

    def fill(self, time_ns: int, x: Array, x_dot: Array) -> JointState:
        """Refill with states and rates [1/s], ndarrays (4, 2); raises DataError when they are not finite."""
        return self._writer.fill(time_ns, x, x_dot)


class CanonicalStateReader:
    """Reads ``canonical_state``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader = JointStateReader(CANONICAL_NAMES, ('position', 'velocity'))

    def read(self, message: JointState) -> tuple[Array, Array]:
        """States x and rates ẋ [1/s], ndarrays (4, 2); raises DataError."""
        x, x_dot = self._reader.read(message)
        return x.reshape(len(LEGS), 2), x_dot.reshape(len(LEGS), 2)


class JointTargetsWriter:
    """Writes the ``joint_targets`` of one leg."""

    def __init__(self, leg: str) -> None:
        """Build the message of a leg."""
        self._writer = JointStateWriter([f'{leg}_{joint}' for joint in JOINTS_OF_LEG], TARGET_FIELDS)

    def fill(self, time_ns: int, targets: JointTargets) -> JointState:
        """Refill with the targets of the leg's joints; raises DataError when they are not finite."""
        return self._writer.fill(time_ns, targets.position, targets.velocity, targets.effort)


class JointTargetsReader:
    """Reads ``joint_targets`` of whichever leg sent them."""

    def __init__(self) -> None:
        """Prepare the order of the joints of every leg."""
        self._readers = {leg: JointStateReader([f'{leg}_{joint}' for joint in JOINTS_OF_LEG], TARGET_FIELDS)
                         for leg in LEGS}

    def read(self, message: JointState) -> tuple[str, JointTargets]:
        """Name of the leg and its targets; raises DataError when the names are not those of one leg."""
        names = message.name
        leg = names[0].partition('_')[0] if names else ''
        if leg not in self._readers or len(names) != len(JOINTS_OF_LEG):
            raise DataError(f"names {names} must be the {len(JOINTS_OF_LEG)} joints of one leg of "
                            f"{', '.join(LEGS)}, such as {', '.join(JOINT_NAMES[:3])}")
        return leg, JointTargets(*self._readers[leg].read(message))


class PostureFeedbackWriter:
    """Writes ``posture_feedback``: twelve torques, a shift in x and y for each foot, a correction of the velocity."""

    def __init__(self) -> None:
        """Build the message."""
        names = JOINT_NAMES + SHIFT_NAMES + CORRECTION_NAMES
        self._writer = JointStateWriter(names, TARGET_FIELDS, BASE_FRAME)
        self._position, self._velocity, self._effort = (np.zeros(len(names)) for _ in TARGET_FIELDS)

    def fill(self, time_ns: int, feedback: PostureFeedback) -> JointState:
        """Refill with a feedback; raises DataError when it is not finite."""
        self._position[len(JOINT_NAMES):-len(CORRECTION_NAMES)] = feedback.shift_in_base.reshape(-1)
        self._velocity[-len(CORRECTION_NAMES):] = feedback.correction
        self._effort[:len(JOINT_NAMES)] = feedback.torque
        return self._writer.fill(time_ns, self._position, self._velocity, self._effort)


class PostureFeedbackReader:
    """Reads ``posture_feedback``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader = JointStateReader(JOINT_NAMES + SHIFT_NAMES + CORRECTION_NAMES, TARGET_FIELDS)

    def read(self, message: JointState) -> PostureFeedback:
        """Read the feedback; raises DataError."""
        position, velocity, effort = self._reader.read(message)
        shift = position[len(JOINT_NAMES):-len(CORRECTION_NAMES)].reshape(len(LEGS), 2)
        return PostureFeedback(effort[:len(JOINT_NAMES)], shift, velocity[-len(CORRECTION_NAMES):])


# Inhibition state -------------------------------------------------------------------------------------------


class InhibitionStateWriter:
    """Writes ``inhibition_state``; entries that do not change keep their texts."""

    def __init__(self) -> None:
        """Build the message."""
        self._status = DiagnosticStatus(name='inhibition', hardware_id='dmp_cpg_ros')
        self.message = DiagnosticArray(status=[self._status])
        self._values: dict[str, Any] = {}
        self._entries: dict[str, KeyValue] = {}

    def fill(self, time_ns: int, word: str, values: Mapping[str, Any], *, level: bytes = DiagnosticStatus.OK,
             ) -> DiagnosticArray:
        """Refill.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        word : str
            State.
        values : mapping of str to value
            Numbers become decimal text that reads back to the same float. The keys must not change between calls.
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


@dataclass(frozen=True)
class InhibitionMessage:
    """Content of ``inhibition_state``.

    Attributes
    ----------
    word : str
        State.
    values : dict of str to str
        Values by key.
    """

    word: str
    values: dict[str, str]

    def number(self, key: str) -> float:
        """Value of a key as a float; raises DataError when it is absent or not a finite number."""
        try:
            value = float(self.values[key])
        except (KeyError, ValueError):
            raise DataError(f"'{key}' must be a number, not {self.values.get(key)!r}") from None
        if not np.isfinite(value):
            raise DataError(f"'{key}' = {value} must be finite")
        return value

    def flag(self, key: str) -> bool:
        """Value of a key as a bool; raises DataError unless it is ``true`` or ``false``."""
        value = self.values.get(key)
        if value not in ('true', 'false'):
            raise DataError(f"'{key}' must be true or false, not {value!r}")
        return value == 'true'


def read_inhibition_state(message: DiagnosticArray) -> InhibitionMessage:
    """Read ``inhibition_state``; raises DataError when it holds no status named ``inhibition``."""
    for status in message.status:
        if status.name == 'inhibition':
            return InhibitionMessage(status.message, {entry.key: entry.value for entry in status.values})
    raise DataError(f"no status named 'inhibition' among {[status.name for status in message.status]}")


# Inside -----------------------------------------------------------------------------------------------------


def header_ns(message: Any) -> int:
    """Stamp of a message's header [ns]; raises DataError when it is not valid."""
    return stamp_ns(message.header.stamp)


def _numbers(values: Array, what: str) -> list[float]:
    return list(checked(values, what).tolist())


def _vector(vector: Any, what: str) -> Array:
    return checked(np.array((vector.x, vector.y, vector.z)), what)


def _quaternion(q: Any) -> Array:
    quaternion = np.array((q.x, q.y, q.z, q.w))
    if not abs(quaternion.dot(quaternion) - 1.0) < 0.01:
        raise DataError(f'quaternion {quaternion} must have length 1')
    return quaternion


def _set_vector(vector: Any, values: list[float]) -> None:
    vector.x, vector.y, vector.z = values


def _set_quaternion(quaternion: Any, values: list[float]) -> None:
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = values
