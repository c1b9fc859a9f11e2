# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of a robot's state and the arrays in them."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import NamedTuple

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.estimation.body_estimate import BodyEstimate
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS, RobotState
from dmp_cpg_ros.layouts import work_rows
from dmp_cpg_ros.nodes.messages import cdr
from dmp_cpg_ros.nodes.messages.joint_states import AnyJoints, JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.messages.values import LARGEST, Array, checked, sensed, set_stamp

BASE_FRAME, ODOM_FRAME, WORLD_FRAME = 'base_link', 'odom', 'world'
"""Frames: the base, where it believes that it was switched on (REP-105), and the simulator's."""

WORK_EVERY = 10
"""``joint_work`` comes with every so many states: it is a sum, of which nothing is lost."""

FOOT_NAMES = tuple(f'{leg}_foot' for leg in LEGS)


class RobotStateWriter:
    """The five messages of a robot's state, refilled at every tick.

    ``imu`` holds what a gyroscope and an accelerometer measure and no orientation: fusing them
    is the reader's task, and yaw is nothing that such a sensor knows.

    Parameters
    ----------
    joint_names : sequence of str
        Of the twelve joints.

    Attributes
    ----------
    clock, imu, ground_truth, foot_contacts, joint_states : messages
        Valid after :meth:`fill`.
    joint_work : message or None
        Only of every tenth state, and of a robot that knows its work.
    """

    def __init__(self, joint_names: Sequence[str] = JOINT_NAMES) -> None:
        """Lay the messages out."""
        self.clock, self._truth, self._imu = (
            Clock(), OdometryWriter(WORLD_FRAME), cdr.RefilledMessage(BASE_FRAME))
        self._imu.constant(*[0.0] * 4, -1.0, *[0.0] * 8)  # no orientation: its covariance says so
        self._imu.refilled(measured_rate_in_base=3)
        self._imu.constant(*[0.0] * 9)
        self._imu.refilled(acceleration_in_base=3)
        self._imu.constant(*[0.0] * 9)
        self._joints = JointStateWriter(joint_names, frame=BASE_FRAME)
        self._feet = JointStateWriter(FOOT_NAMES, ('effort',), BASE_FRAME)
        self._work = JointStateWriter(
            work_rows(joint_names), ('position', 'effort'), BASE_FRAME)
        self._peak, self._fills = np.zeros(len(JOINT_NAMES)), 0

    def fill(self, state: RobotState) -> None:
        """Refill all messages from a state; raises DataError when a number is not finite."""
        time_ns = state.time_ns
        self.joint_states = self._joints.fill(
            time_ns, state.joint_position, state.joint_velocity, state.joint_effort)
        self.foot_contacts = self._feet.fill(time_ns, state.foot_force)
        set_stamp(self.clock.clock, time_ns)
        self.imu = cdr.SerializedImu(self._imu.filled(
            time_ns, state.measured_rate_in_base, state.acceleration_in_base))
        self.ground_truth = self._truth.fill(
            time_ns, state.base_position_in_world, state.base_quaternion,
            state.base_velocity_in_base, state.base_rate_in_base)
        self.joint_work = self._filled_work(state)

    def fill_failing(self, state: RobotState) -> None:
        """Refill what sensors tell with the readings of failing ones, whatever numbers they are;
        the truth stays as it is.
        """
        stamp = state.time_ns
        self.joint_states = self._joints.fill(
            stamp, state.joint_position, state.joint_velocity, state.joint_effort, sound=False)
        self.foot_contacts = self._feet.fill(stamp, state.foot_force, sound=False)
        set_stamp(self.clock.clock, stamp)
        self.imu = cdr.SerializedImu(self._imu.filled(
            stamp, state.measured_rate_in_base, state.acceleration_in_base, sound=False))

    def _filled_work(self, state: RobotState) -> cdr.SerializedJointState | None:
        work, loss = state.joint_work, state.joint_loss
        if work is None or loss is None or state.joint_peak_effort is None:
            return None
        self._peak = np.maximum(self._peak, state.joint_peak_effort)
        due, self._fills = self._fills % WORK_EVERY == 0, self._fills + 1
        if not due:
            return None
        peak, self._peak = self._peak, np.zeros(len(JOINT_NAMES))
        return self._work.fill(
            state.time_ns, np.concatenate((work, loss)), np.append(peak, np.zeros(len(loss))))


class OdometryWriter:
    """Writes an ``Odometry`` of ``base_link`` in a frame, by default ``odom``."""

    def __init__(self, frame: str = ODOM_FRAME) -> None:
        """Lay the message out."""
        self._message = cdr.RefilledMessage(frame, BASE_FRAME)
        self._message.refilled(position=3, quaternion=4, pose_covariance=36)
        self._message.refilled(velocity=3, rate=3, twist_covariance=36)
        self._pose, self._twist = np.zeros(36), np.zeros(36)

    def fill(self, time_ns: int, position: Array, quaternion: Array, velocity: Array,
             rate: Array) -> cdr.SerializedOdometry:
        """Refill with position [m], quaternion x, y, z, w, velocity [m/s] and turn rate [rad/s] in
        the base's frame.
        """
        return cdr.SerializedOdometry(self._message.filled(
            time_ns, position, quaternion, self._pose, velocity, rate, self._twist))

    def fill_estimate(self, estimate: BodyEstimate) -> cdr.SerializedOdometry:
        """Refill with an estimate and its variances, or what a message holds at most: nothing may
        be known for long.
        """
        for diagonal, variances in (
                (self._pose[::7], (estimate.position_variance, estimate.attitude_variance)),
                (self._twist[::7], (estimate.velocity_variance, estimate.rate_variance))):
            np.minimum(np.concatenate(variances), LARGEST, out=diagonal)
        return self.fill(
            estimate.time_ns, estimate.position_in_world, estimate.quaternion,
            estimate.velocity_in_base, estimate.rate_in_base)


class JointsReader:
    """Reads ``joint_states``."""

    def __init__(self, joint_names: Sequence[str] = JOINT_NAMES, *, strict: bool = True) -> None:
        """Prepare the order of the twelve joints; effort may be absent in others' messages, and
        numbers that cannot be are NaN unless it is strict.
        """
        self._full = JointStateReader(joint_names, strict=strict)
        self._without_effort = JointStateReader(
            joint_names, ('position', 'velocity'), strict=strict)

    def read(self, message: AnyJoints) -> list[Array]:
        """Position [rad], velocity [rad/s] and effort [N m] (0 where absent), each (12,)."""
        if len(message.effort):
            return self._full.read(message)
        return [*self._without_effort.read(message), np.zeros(len(JOINT_NAMES))]


class FootContactsReader:
    """Reads ``foot_contacts``; numbers that cannot be are NaN, and the caller judges them."""

    def __init__(self) -> None:
        """Prepare the order of the feet."""
        self._reader = JointStateReader(FOOT_NAMES, ('effort',), strict=False)

    def read(self, message: AnyJoints) -> Array:
        """Normal forces, ndarray (4,) [N]."""
        return self._reader.read(message)[0]


class BaseMotion(NamedTuple):
    """Motion of ``base_link``, as an ``Odometry`` tells it; in the order of :class:`RobotState`.

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


def read_odom(message: Odometry | cdr.SerializedOdometry) -> BaseMotion:
    """Read an ``Odometry``, also as a writer of the same process hands it over; raises DataError,
    also for a quaternion that is no rotation.
    """
    if isinstance(message, cdr.SerializedOdometry):
        message = deserialize_message(message.serialized, Odometry)
    pose, twist = message.pose.pose, message.twist.twist
    q = pose.orientation
    quaternion = _rotation((q.x, q.y, q.z, q.w))
    position, velocity, rate = (
        checked(np.array((vector.x, vector.y, vector.z)), what) for vector, what in (
            (pose.position, 'position'), (twist.linear, 'linear velocity'),
            (twist.angular, 'angular velocity')))
    return BaseMotion(position, quaternion, velocity, rate)


def read_imu(message: Imu | cdr.SerializedImu) -> tuple[Array, Array]:
    """Turn rate (3,) [rad/s] and specific force (3,) [m/s^2].

    Numbers that cannot be are NaN: the estimator judges them together with silent sensors.
    """
    if isinstance(message, cdr.SerializedImu):
        rate, force = message.rate, message.force
    else:
        of_rate, of_force = message.angular_velocity, message.linear_acceleration
        rate, force = (of_rate.x, of_rate.y, of_rate.z), (of_force.x, of_force.y, of_force.z)
    return sensed(np.array(rate)), sensed(np.array(force))


def read_orientation(message: Imu | cdr.SerializedImu) -> Array | None:
    """Quaternion x, y, z, w of an IMU, or None of one that knows none; raises DataError."""
    if isinstance(message, cdr.SerializedImu):
        *quaternion, unknown = message.orientation
    else:
        q, unknown = message.orientation, message.orientation_covariance[0]
        quaternion = [q.x, q.y, q.z, q.w]
    return None if unknown == -1.0 else _rotation(quaternion)


def _rotation(quaternion: Sequence[float]) -> Array:
    """Quaternion x, y, z, w, checked to be a rotation."""
    norm = hypot(*quaternion)
    if not abs(norm * norm - 1.0) < 0.01:
        raise DataError(f'quaternion {list(quaternion)} must have length 1')
    return np.array(quaternion)
