# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The suite moves a robot through ros2_control's topics: a low-level interface at 500 Hz behind
``ros2_control_driver``, as doc/how_to/hardware.md says. Time is the robot's: it waits for answers.
"""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import ros_processes
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from ros_processes import SHARED_HZ, Processes, Ros
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from dmp_cpg_ros.commands.low_level_robot import LowLevelTopics
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.nodes.messages.interfaces import COMMAND_INTERFACES, interface
from dmp_cpg_ros.robot.low_level import TIMEOUT_NS, LowLevelRobot
from dmp_cpg_ros.suite_table import DRIVER, ROBOT, WALKING, WALKING_NODES

processes, ros, ros_domain = (
    ros_processes.processes, ros_processes.ros, ros_processes.ros_domain)

TICK_NS = round(1e9 / SHARED_HZ)

ORDER = (*reversed(JOINT_NAMES), 'gripper')
"""Joints in the order of somebody else, with one that is not ours."""


class Session:
    """Suite, driver and robot, and what the test hears of them."""

    def __init__(self, processes: Processes, ros: Ros, folder: Path,
                 interfaces: tuple[str, ...]) -> None:
        own: dict[str, Any] = {f'/**/leg_transformation_{leg}': {'ros__parameters': {'leg': leg}}
                               for leg in LEGS}
        expected = [kind.name for kind in WALKING if kind.name != ROBOT]
        file = folder / 'my_suite.yaml'
        file.write_text(yaml.safe_dump({'/**': {'ros__parameters': {
            'expected_nodes': expected, 'start_mode': 'lying', 'gait': 'amble',
            'control_rate': SHARED_HZ}}, **own}),
            encoding='utf-8')
        self.suite = processes.executable(
            'composed_suite', *(name for name in WALKING_NODES if name != ROBOT),
            '--ros-args', '--params-file', str(file))
        self.driver = processes.node(DRIVER, command_interfaces=list(interfaces),
                                     control_rate=SHARED_HZ)
        self.ros, self.robot = ros, LowLevelRobot(interfaces=interfaces)
        self.topics = LowLevelTopics(ros.node, self.robot, interfaces, ORDER)
        self.answered = {leg: -1 for leg in LEGS}
        self.heard: dict[str, str] = {}
        self.stop: dict[str, str] = {}
        node = ros.node
        node.create_subscription(JointState, 'joint_targets', self._on_targets, 100)
        for name in ('body_mode', 'drive_mode'):
            node.create_subscription(String, name, self._hearing(name),
                                     interface(name).reader_qos)
        node.create_subscription(DiagnosticArray, 'inhibition_state', self._on_stop,
                                 interface('inhibition_state').reader_qos)
        self._command, self.speed = node.create_publisher(Twist, 'cmd_vel', 10), 0.0
        self.commanded = self.silent = False
        self._wanted_ns = -1
        ros.spin_until(lambda: self.topics.matched
                       and node.count_publishers('joint_targets') == len(LEGS), 90.0)
        going_on = node.create_timer(0.5, self._go_on)           # until all have met
        ros.spin_until(lambda: min(self.answered.values()) >= 0, 90.0, what=lambda: str(self))
        node.destroy_timer(going_on)

    def __repr__(self) -> str:
        return f'answers {self.answered} to {self.robot.state.time_ns} of\n{self.driver!r}'

    def _go_on(self) -> None:
        """Let the robot's time go on by a tick: nobody answers the same stamp again."""
        end = self.robot.state.time_ns + TICK_NS
        self.topics.publish()
        while self.robot.state.time_ns < end:
            self.robot.step()

    def _hearing(self, name: str) -> Any:
        return lambda message: self.heard.update({name: message.data})

    def _on_targets(self, message: JointState) -> None:
        stamp = message.header.stamp
        self.answered[message.name[0][:2]] = stamp.sec * 10**9 + stamp.nanosec

    def _on_stop(self, message: DiagnosticArray) -> None:
        status = message.status[0]
        self.stop = {'state': status.message, **{entry.key: entry.value
                                                 for entry in status.values}}

    def run(self, seconds: float) -> None:
        """Let the robot's time go on."""
        robot, end = self.robot, self.robot.state.time_ns + round(seconds * 1e9)
        while robot.state.time_ns < end:
            robot.step()
            now, taken = robot.state.time_ns, self.topics.taken
            if now % 100_000_000 == 0:
                command = Twist()
                command.linear.x = self.speed
                self._command.publish(command)
            self.topics.publish()
            if not self.silent:
                tick = now - now % TICK_NS
                self.ros.spin_until(lambda tick=tick: min(self.answered.values()) >= tick, 60.0)
            if self.commanded:
                self.ros.spin_until(lambda taken=taken: self.topics.taken > taken, 60.0)

    def run_until(self, condition: Any, seconds: float) -> None:
        """Let the robot's time go on until something holds; fails after so long."""
        end = self.robot.state.time_ns + round(seconds * 1e9)
        while not condition():
            assert self.robot.state.time_ns < end, f'{self.heard} {self.stop}'
            self.run(0.02)

    def comes_to_rest(self, seconds: float) -> None:
        """Fail unless the robot comes to stand within so long, for a quarter of a second."""
        moved_ns = self.robot.state.time_ns

        def rested() -> bool:
            nonlocal moved_ns
            now = self.robot.state.time_ns
            moved_ns = moved_ns if self.at_rest else now
            return now - moved_ns > 250_000_000

        self.run_until(rested, seconds)
        assert not self.robot.robot.fallen

    @property
    def at_rest(self) -> bool:
        state = self.robot.state
        return bool(np.abs(state.base_velocity_in_base).max() < 0.02
                    and np.abs(state.base_rate_in_base).max() < 0.05)


def test_a_low_level_interface_walks_stops_and_is_left_alone_safely(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    session = Session(processes, ros, tmp_path, COMMAND_INTERFACES)
    robot = session.robot
    session.run(0.1)
    assert session.topics.taken == 0 and robot.damped   # the dead man's switch is off
    answer = ros.call(SetBool, f'{DRIVER}/enable', SetBool.Request(data=True))
    assert answer.success, answer.message
    session.commanded = True
    before = robot.state.joint_position
    session.run(0.02)
    assert np.abs(robot.state.joint_position - before).max() < 0.2   # no jump
    session.run_until(lambda: session.heard.get('drive_mode') == 'following', 6.0)
    answer = ros.call(Trigger, 'stand_up', Trigger.Request())
    assert answer.success, answer.message
    session.run_until(lambda: session.heard.get('body_mode') == 'standing', 8.0)
    height = robot.robot.height_over_ground

    session.speed = 0.4
    start = robot.state.base_position_in_world[0]
    session.run_until(lambda: robot.state.base_position_in_world[0] > start + 0.25, 6.0)
    answer = ros.call(SetBool, 'inhibit', SetBool.Request(data=True))
    assert answer.success and 'at rest in' in answer.message
    session.run_until(lambda: isfinite(float(session.stop.get('measured_s', 'nan'))), 4.0)
    predicted, bound, measured = (
        float(session.stop[name]) for name in ('predicted_s', 'bound_s', 'measured_s'))
    assert abs(measured - predicted) < 0.05 and measured <= bound
    session.comes_to_rest(1.5)

    assert ros.call(SetBool, 'inhibit', SetBool.Request(data=False)).success
    session.run(0.5)
    assert not session.at_rest
    assert ros.call(SetBool, f'{DRIVER}/enable', SetBool.Request(data=False)).success
    session.run_until(lambda: session.heard['drive_mode'] == 'stand', 1.0)
    session.comes_to_rest(3.0)

    assert ros.call(SetBool, f'{DRIVER}/enable', SetBool.Request(data=True)).success
    session.run_until(lambda: session.heard['drive_mode'] == 'following', 6.0)
    session.run(0.5)
    assert not session.at_rest
    session.suite.kill()
    session.silent = True
    session.run_until(lambda: session.heard['drive_mode'] == 'stand', 1.0)
    session.comes_to_rest(3.0)
    session.driver.kill()
    session.commanded = False
    assert not robot.damped
    session.run(TIMEOUT_NS * 1e-9 + 0.01)
    assert robot.damped and robot.timeouts == 1                  # nobody repeats the last command
    session.run_until(lambda: robot.robot.height_over_ground < 0.5 * height, 3.0)
    assert session.topics.refused == 0
