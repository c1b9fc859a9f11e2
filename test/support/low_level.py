# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stand-in for a robot with a low-level interface as Unitree's robots have it, at 500 Hz.

Every motor takes q, dq, kp, kd and tau, as ``LowCmd`` of unitree_go has them, and turns them into
τ = tau + kp (q_d − q) + kd (dq_d − dq). That package is not among the wheels: here each of the
five comes on the topic of a forward_command_controller, and the state goes out as the broadcasters
of ros2_control publish it. MuJoCo is the robot.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import WrenchStamped
from ros_processes import Ros
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray

from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS, JointTargets
from dmp_cpg_ros.nodes.messages.interfaces import COMMAND_INTERFACES, commands_of, foot_wrench
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.robot_file import own_robot_file

PERIOD_NS, MOTOR_NS = 2_000_000, 1_000_000
"""Period of states and commands; of the motors' own loops [ns]."""

ORDER = (*reversed(JOINT_NAMES), 'gripper')
"""Joints in the order of somebody else, with one that is not ours."""


class LowLevel:
    """The robot behind its topics; its time goes on when it is told.

    Parameters
    ----------
    ros : Ros
        Node of the test.
    interfaces : sequence of str
        Command interfaces that have a controller.
    """

    def __init__(self, ros: Ros, interfaces: tuple[str, ...] = COMMAND_INTERFACES) -> None:
        self.robot = MujocoRobot(own_robot_file().without_gains(), MOTOR_NS, start_pose='lying')
        self.state = self.robot.reset()
        self.ros, node = ros, ros.node
        self.command = {name: np.zeros(12) for name in COMMAND_INTERFACES}
        self.taken = 0
        self._last = interfaces[-1]
        for name in interfaces:
            node.create_subscription(Float64MultiArray, commands_of(name), self._taker(name), 100)
        self._imu = node.create_publisher(Imu, 'imu_sensor_broadcaster/imu', 10)
        self._feet = [node.create_publisher(WrenchStamped, foot_wrench(leg), 10) for leg in LEGS]
        self._joints = node.create_publisher(
            JointState, 'joint_state_broadcaster/joint_states', 10)

    @property
    def matched(self) -> bool:
        """Whether somebody reads what it measures."""
        return all(publisher.get_subscription_count()
                   for publisher in (self._imu, self._joints, *self._feet))

    def _taker(self, name: str) -> Callable[[Any], None]:
        def take(message: Float64MultiArray) -> None:
            self.command[name] = np.array(message.data)
            assert np.isfinite(self.command[name]).all()
            self.taken += name == self._last

        return take

    def publish(self) -> None:
        """Tell what is measured, the joints last."""
        state, imu = self.state, Imu()
        q, rate, force = imu.orientation, imu.angular_velocity, imu.linear_acceleration
        q.x, q.y, q.z, q.w = state.base_quaternion.tolist()
        rate.x, rate.y, rate.z = state.base_rate_in_base.tolist()
        force.x, force.y, force.z = state.acceleration_in_base.tolist()
        set_stamp(imu.header.stamp, state.time_ns)
        self._imu.publish(imu)
        for publisher, size in zip(self._feet, state.foot_force.tolist(), strict=True):
            wrench = WrenchStamped()
            wrench.header.stamp = imu.header.stamp
            wrench.wrench.force.z = size
            publisher.publish(wrench)
        joints = JointState(name=list(ORDER), position=[*state.joint_position[::-1], 0.0],
                            velocity=[*state.joint_velocity[::-1], 0.0], effort=[np.nan] * 13)
        joints.header.stamp = imu.header.stamp
        self._joints.publish(joints)

    def step(self) -> None:
        """Go on by a period."""
        c = self.command
        for _ in range(PERIOD_NS // MOTOR_NS):
            state = self.state
            tau = (c['effort'] + c['kp'] * (c['position'] - state.joint_position)
                   + c['kd'] * (c['velocity'] - state.joint_velocity))
            self.state = self.robot.step(JointTargets(np.zeros(12), np.zeros(12), tau))
