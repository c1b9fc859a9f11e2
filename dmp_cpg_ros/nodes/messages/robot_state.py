# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of a robot's state and the arrays in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.estimation.estimate import BodyEstimate
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS, RobotState
from dmp_cpg_ros.nodes.messages.cdr import (
    RefilledMessage,
    SerializedDraft,
    SerializedImu,
    SerializedJointState,
    SerializedOdometry,
)
from dmp_cpg_ros.nodes.messages.joint_states import FIELDS, JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.messages.values import Array, checked, sensed, set_stamp

BASE_FRAME, WORLD_FRAME = 'base_link', 'odom'

WORK_EVERY = 10
"""``joint_work`` comes with every so many states: it is a sum, of which nothing is lost."""

FOOT_NAMES = tuple(f'{leg}_foot' for leg in LEGS)


class RobotStateWriter:
    """The five messages of a robot's state, refilled at every tick.

    ``imu`` holds what a gyroscope and an accelerometer measure and no orientation: fusing them
    is the reader's task, and yaw is nothing that such a sensor knows. ``odom`` is the truth.

    Attributes
    ----------
    clock, imu, odom, foot_contacts, joint_states : messages
        Valid after :meth:`fill`.
    joint_work : message or None
        Only of every tenth state, and of a robot that knows its work.
    """

    imu: SerializedImu
    odom: SerializedOdometry
    foot_contacts: SerializedJointState
    joint_states: SerializedJointState
    joint_work: SerializedJointState | None

    def __init__(self) -> None:
        """Lay the messages out."""
        self.clock = Clock()
        self._imu, self._odom = _imu_message(), OdometryMessage()
        self._joints = JointStateWriter(JOINT_NAMES, FIELDS, BASE_FRAME)
        self._feet = JointStateWriter(FOOT_NAMES, ('effort',), BASE_FRAME)
        self._work = JointStateWriter(JOINT_NAMES, ('position', 'effort'), BASE_FRAME)
        self._peak, self._fills = np.zeros(len(JOINT_NAMES)), 0

    def fill(self, state: RobotState) -> None:
        """Refill all messages from a state; raises DataError when a number is not finite."""
        time_ns = state.time_ns
        self.joint_states = self._joints.fill(
            time_ns, state.joint_position, state.joint_velocity, state.joint_effort)
        self.foot_contacts = self._feet.fill(time_ns, state.foot_force)
        set_stamp(self.clock.clock, time_ns)
        self.imu = SerializedImu(self._imu.filled(time_ns, (
            checked(state.measured_rate_in_base, 'measured_rate_in_base').tobytes(),
            checked(state.acceleration_in_base, 'acceleration_in_base').tobytes())))
        self.odom = self._odom.fill(
            time_ns,
            checked(state.base_position_in_world, 'base_position_in_world'),
            checked(state.base_quaternion, 'base_quaternion'),
            checked(state.base_velocity_in_base, 'base_velocity_in_base'),
            checked(state.base_rate_in_base, 'base_rate_in_base'))
        self.joint_work = self._filled_work(state)

    def _filled_work(self, state: RobotState) -> SerializedJointState | None:
        if state.joint_work is None or state.joint_peak_effort is None:
            return None
        self._peak = np.maximum(self._peak, state.joint_peak_effort)
        due, self._fills = self._fills % WORK_EVERY == 0, self._fills + 1
        if not due:
            return None
        peak, self._peak = self._peak, np.zeros(len(JOINT_NAMES))
        return self._work.fill(state.time_ns, state.joint_work, peak)


def _imu_message() -> RefilledMessage:
    """Lay an ``Imu`` out whose orientation is marked as unknown."""
    draft = SerializedDraft()
    draft.text(BASE_FRAME)
    draft.doubles(4)
    covariance = draft.doubles(9)
    draft.data[covariance] = np.array((-1.0, *[0.0] * 8)).tobytes()
    rate = draft.doubles(3)
    draft.doubles(9)
    force = draft.doubles(3)
    draft.doubles(9)
    return RefilledMessage(draft, [rate, force])


class OdometryMessage:
    """An ``Odometry`` of ``base_link`` in ``odom`` that is refilled."""

    def __init__(self) -> None:
        """Lay the message out."""
        draft = SerializedDraft()
        draft.text(WORLD_FRAME)
        draft.text(BASE_FRAME)
        position, quaternion, _ = draft.doubles(3), draft.doubles(4), draft.doubles(36)
        velocity, rate, self._covariance = draft.doubles(3), draft.doubles(3), draft.doubles(36)
        self._message = RefilledMessage(
            draft, [position, quaternion, velocity, rate, self._covariance])
        self._no_covariance = bytes(8 * 36)

    def fill(self, time_ns: int, position: Array, quaternion: Array, velocity: Array,
             rate: Array, velocity_variance: Array | None = None) -> SerializedOdometry:
        """Refill with position [m], quaternion x, y, z, w, velocity [m/s] and turn rate [rad/s] in
        the base's frame, ndarrays of float64, and with the variances of the velocity [m²/s²].
        """
        covariance = self._no_covariance
        if velocity_variance is not None:
            diagonal = np.zeros(36)
            diagonal[:15:7] = velocity_variance
            covariance = diagonal.tobytes()
        return SerializedOdometry(self._message.filled(time_ns, (
            position.tobytes(), quaternion.tobytes(), velocity.tobytes(), rate.tobytes(),
            covariance)))


class JointsReader:
    """Reads ``joint_states``."""

    def __init__(self) -> None:
        """Prepare the order of the twelve joints; effort may be absent in others' messages."""
        self._full = JointStateReader(JOINT_NAMES, FIELDS)
        self._without_effort = JointStateReader(JOINT_NAMES, ('position', 'velocity'))

    def read(self, message: JointState | SerializedJointState) -> tuple[Array, Array, Array]:
        """Position [rad], velocity [rad/s] and effort [N m] (0 where absent), each (12,)."""
        if len(message.effort):
            position, velocity, effort = self._full.read(message)
            return position, velocity, effort
        position, velocity = self._without_effort.read(message)
        return position, velocity, np.zeros(len(JOINT_NAMES))


class FootContactsReader:
    """Reads ``foot_contacts``.

    Parameters
    ----------
    strict : bool
        Whether forces that cannot be are refused; else they are NaN, and the caller judges them.
    """

    def __init__(self, *, strict: bool = True) -> None:
        """Prepare the order of the feet."""
        self._reader = JointStateReader(FOOT_NAMES, ('effort',), strict=strict)

    def read(self, message: JointState | SerializedJointState) -> Array:
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
    """Read ``odom``; raises DataError, also for a quaternion that is no rotation."""
    pose, twist = message.pose.pose, message.twist.twist
    return BaseMotion(_vector(pose.position, 'position'), _quaternion(pose.orientation),
                      _vector(twist.linear, 'linear velocity'),
                      _vector(twist.angular, 'angular velocity'))


def read_imu(message: Imu | SerializedImu) -> tuple[Array, Array]:
    """Turn rate (3,) [rad/s] and specific force (3,) [m/s^2].

    Numbers that cannot be are NaN: the estimator judges them together with silent sensors.
    """
    if isinstance(message, SerializedImu):
        rate, force = message.rate, message.force
    else:
        of_rate, of_force = message.angular_velocity, message.linear_acceleration
        rate, force = (of_rate.x, of_rate.y, of_rate.z), (of_force.x, of_force.y, of_force.z)
    return sensed(np.array(rate)), sensed(np.array(force))


class EstimatedOdometryWriter:
    """Writes ``estimated_odom``."""

    def __init__(self) -> None:
        """Lay the message out."""
        self._message = OdometryMessage()

    def fill(self, estimate: BodyEstimate) -> SerializedOdometry:
        """Refill with an estimate; of the covariances only the velocity's variances are known."""
        return self._message.fill(
            estimate.time_ns,
            checked(estimate.position_in_world, 'position'),
            checked(estimate.quaternion, 'quaternion'),
            checked(estimate.velocity_in_base, 'velocity'),
            checked(estimate.rate_in_base, 'rate'),
            estimate.velocity_variance)


def robot_state(time_ns: int, joints: tuple[Array, Array, Array], base: BaseMotion,
                foot_force: Array, acceleration_in_base: Array | None = None,
                gyro_in_base: Array | None = None) -> RobotState:
    """Put a state together from what its messages told; acceleration zero where not given."""
    return RobotState(
        time_ns, joints[0], joints[1], joints[2], base.position_in_world,
        base.quaternion, base.velocity_in_base, base.rate_in_base,
        np.zeros(3) if acceleration_in_base is None else acceleration_in_base, foot_force,
        gyro_in_base)


def _vector(vector: Any, what: str) -> Array:
    return checked(np.array((vector.x, vector.y, vector.z)), what)


def _quaternion(q: Any) -> Array:
    quaternion = np.array((q.x, q.y, q.z, q.w))
    if not abs(quaternion.dot(quaternion) - 1.0) < 0.01:
        raise DataError(f'quaternion {quaternion} must have length 1')
    return quaternion
