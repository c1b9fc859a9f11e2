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

from dmp_cpg_ros.core.body_estimate import BodyEstimate
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_state import JOINT_NAMES, LEGS, RobotState
from dmp_cpg_ros.nodes.joint_state_messages import FIELDS, JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.message_values import Array, checked, finite_list, set_stamp
from dmp_cpg_ros.nodes.serialized_messages import SerializedImu

BASE_FRAME, WORLD_FRAME = 'base_link', 'odom'

FOOT_NAMES = tuple(f'{leg}_foot' for leg in LEGS)


class RobotStateWriter:
    """The five messages of a robot's state, refilled at every tick.

    ``imu`` holds what a gyroscope and an accelerometer measure and no orientation: fusing them
    is the reader's task, and yaw is nothing that such a sensor knows. ``odom`` is the truth.

    Attributes
    ----------
    clock, imu, odom, foot_contacts, joint_states : messages
        Valid after :meth:`fill`.
    """

    def __init__(self) -> None:
        """Build the messages."""
        self.clock, self.imu, self.odom = Clock(), Imu(), Odometry()
        self.imu.header.frame_id = BASE_FRAME
        self.imu.orientation_covariance[0] = -1.0  # says that there is no orientation
        self.odom.header.frame_id, self.odom.child_frame_id = WORLD_FRAME, BASE_FRAME
        self._joints = JointStateWriter(JOINT_NAMES, FIELDS, BASE_FRAME)
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
        rate = finite_list(state.base_rate_in_base, 'base_rate_in_base')
        quaternion = finite_list(state.base_quaternion, 'base_quaternion')
        _set_vector(self.imu.angular_velocity,
                    finite_list(state.measured_rate_in_base, 'measured_rate_in_base'))
        _set_vector(self.imu.linear_acceleration,
                    finite_list(state.acceleration_in_base, 'acceleration_in_base'))
        _set_vector(self.odom.pose.pose.position,
                    finite_list(state.base_position_in_world, 'base_position_in_world'))
        _set_quaternion(self.odom.pose.pose.orientation, quaternion)
        _set_vector(self.odom.twist.twist.linear,
                    finite_list(state.base_velocity_in_base, 'base_velocity_in_base'))
        _set_vector(self.odom.twist.twist.angular, rate)


class JointsReader:
    """Reads ``joint_states``."""

    def __init__(self) -> None:
        """Prepare the order of the twelve joints; effort may be absent in others' messages."""
        self._full = JointStateReader(JOINT_NAMES, FIELDS)
        self._without_effort = JointStateReader(JOINT_NAMES, ('position', 'velocity'))

    def read(self, message: JointState) -> tuple[Array, Array, Array]:
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
        Whether forces that are not finite are refused; else the caller judges them.
    """

    def __init__(self, *, strict: bool = True) -> None:
        """Prepare the order of the feet."""
        self._reader = JointStateReader(FOOT_NAMES, ('effort',), strict=strict)

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
    """Read ``odom``; raises DataError, also for a quaternion that is no rotation."""
    pose, twist = message.pose.pose, message.twist.twist
    return BaseMotion(_vector(pose.position, 'position'), _quaternion(pose.orientation),
                      _vector(twist.linear, 'linear velocity'),
                      _vector(twist.angular, 'angular velocity'))


def read_imu(message: Imu | SerializedImu) -> tuple[Array, Array]:
    """Turn rate (3,) [rad/s] and specific force (3,) [m/s^2], as they are.

    Numbers that are not finite pass: the estimator judges them together with silent sensors.
    """
    if isinstance(message, SerializedImu):
        return np.array(message.rate), np.array(message.force)
    rate, force = message.angular_velocity, message.linear_acceleration
    return np.array((rate.x, rate.y, rate.z)), np.array((force.x, force.y, force.z))


class EstimatedOdometryWriter:
    """Writes ``estimated_odom``."""

    def __init__(self) -> None:
        """Build the message."""
        self.message = Odometry()
        self.message.header.frame_id, self.message.child_frame_id = WORLD_FRAME, BASE_FRAME

    def fill(self, estimate: BodyEstimate) -> Odometry:
        """Refill with an estimate; of the covariances only the velocity's variances are known."""
        message = self.message
        set_stamp(message.header.stamp, estimate.time_ns)
        pose, twist = message.pose.pose, message.twist.twist
        _set_vector(pose.position, finite_list(estimate.position_in_world, 'position'))
        _set_quaternion(pose.orientation, finite_list(estimate.quaternion, 'quaternion'))
        _set_vector(twist.linear, finite_list(estimate.velocity_in_base, 'velocity'))
        _set_vector(twist.angular, finite_list(estimate.rate_in_base, 'rate'))
        message.twist.covariance[:15:7] = estimate.velocity_variance
        return message


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


def _set_vector(vector: Any, values: list[float]) -> None:
    vector.x, vector.y, vector.z = values


def _set_quaternion(quaternion: Any, values: list[float]) -> None:
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = values
