# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A driver in the place of ``mujoco_robot`` that does what doc/how_to/hardware.md says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import ros_processes
import yaml
from geometry_msgs.msg import Twist
from ros_processes import Processes, Ros
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import SetBool

from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS, JointTargets
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.suite import load_suite
from dmp_cpg_ros.suite_table import ROBOT, WALKING, WALKING_NODES

processes, ros, ros_domain = (
    ros_processes.processes, ros_processes.ros, ros_processes.ros_domain)


class Driver:
    """A robot behind topics, with messages as anybody makes them."""

    def __init__(self, ros: Ros) -> None:
        suite = load_suite()
        self.robot = MujocoRobot(suite.robot_file, suite.tick_ns, sensors=suite.sensors)
        self.state = self.robot.reset()
        node = self.node = ros.node
        self.clock, self.imu, self.feet, self.joints = (
            node.create_publisher(kind, name, 10) for kind, name in (
                (Clock, '/clock'), (Imu, 'imu'), (JointState, 'foot_contacts'),
                (JointState, 'joint_states')))
        self.command = node.create_publisher(Twist, 'cmd_vel', 10)
        self.targets: dict[str, JointState] = {}
        self.speed = 0.0
        node.create_subscription(JointState, 'joint_targets', self.take, 100)

    def publish(self) -> None:
        """One tick: all with one stamp, joint_states last."""
        state, clock = self.state, Clock()
        clock.clock.sec, clock.clock.nanosec = divmod(state.time_ns, 10**9)
        self.clock.publish(clock)
        imu = Imu()
        imu.header.stamp, imu.header.frame_id = clock.clock, 'base_link'
        imu.orientation_covariance[0] = -1.0
        for vector, values in ((imu.angular_velocity, state.measured_rate_in_base),
                               (imu.linear_acceleration, state.acceleration_in_base)):
            vector.x, vector.y, vector.z = map(float, values)
        self.imu.publish(imu)
        feet = JointState(name=[f'{leg}_foot' for leg in LEGS], effort=state.foot_force.tolist())
        joints = JointState(
            name=list(JOINT_NAMES), position=state.joint_position.tolist(),
            velocity=state.joint_velocity.tolist(), effort=state.joint_effort.tolist())
        feet.header.stamp = joints.header.stamp = clock.clock
        self.feet.publish(feet)
        self.joints.publish(joints)
        if state.time_ns % 100_000_000 == 0:
            command = Twist()
            command.linear.x = self.speed
            self.command.publish(command)

    def take(self, message: JointState) -> None:
        """Take the targets of one leg; those of all four at this tick make the next."""
        stamp = message.header.stamp
        if stamp.sec * 10**9 + stamp.nanosec != self.state.time_ns:
            return
        self.targets[message.name[0][:2]] = message
        if len(self.targets) == len(LEGS):
            legs = [self.targets.pop(leg) for leg in LEGS]
            self.state = self.robot.step(JointTargets(*(
                np.concatenate([getattr(leg, what) for leg in legs])
                for what in ('position', 'velocity', 'effort'))))
            self.publish()


def test_a_driver_in_place_of_the_robot_walks_and_stops(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    own: dict[str, Any] = {f'/**/leg_transformation_{leg}': {'ros__parameters': {'leg': leg}}
                           for leg in LEGS}
    expected = [kind.name for kind in WALKING if kind.name != ROBOT]
    file = tmp_path / 'my_suite.yaml'
    file.write_text(yaml.safe_dump({
        '/**': {'ros__parameters': {'expected_nodes': expected}}, **own}), encoding='utf-8')
    processes.executable('composed_suite', *(name for name in WALKING_NODES if name != ROBOT),
                         '--ros-args', '--params-file', str(file))
    driver = Driver(ros)
    ros.spin_until(lambda: driver.joints.get_subscription_count() >= 1
                   and driver.node.count_publishers('joint_targets') == len(LEGS))
    driver.node.create_timer(0.5, lambda: driver.targets or driver.publish())  # until all are met
    ros.spin_until(lambda: driver.state.time_ns > 200_000_000, 120.0)
    driver.speed = 0.4
    ros.spin_until(lambda: driver.state.base_position_in_world[0] > 0.4, 120.0)
    answer = ros.call(SetBool, 'inhibit', SetBool.Request(data=True))
    assert answer.success and 'at rest in' in answer.message
    then = driver.state.time_ns
    ros.spin_until(lambda: driver.state.time_ns > then + 3_500_000_000, 120.0)
    assert np.abs(driver.state.base_velocity_in_base).max() < 0.02
    assert not driver.robot.fallen
