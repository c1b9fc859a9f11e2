# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``ros2_control_driver``: ticks out of any stream; commands within limits, once enabled."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import ros_processes
from rclpy.parameter import Parameter
from ros_processes import Ros
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import SetBool

from dmp_cpg_ros.commands.low_level_robot import LowLevelTopics
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.modes.motion_library import lying_posture
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, JOINTS_OF_LEG, LEGS
from dmp_cpg_ros.nodes.messages.interfaces import COMMAND_INTERFACES, POWER
from dmp_cpg_ros.nodes.messages.values import header_ns, set_stamp
from dmp_cpg_ros.nodes.ros2_control_driver import DriverParameters, Ros2ControlDriver
from dmp_cpg_ros.robot.low_level import LowLevelRobot
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite_table import DRIVER

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain

ORDER = (*reversed(JOINT_NAMES), 'gripper')
"""Joints in the order of somebody else, with one that is not ours."""


class Bench:
    """The driver and a robot for it; the test sends what the legs would."""

    def __init__(self, ros: Ros, interfaces: tuple[str, ...]) -> None:
        self.ros, self.robot = ros, LowLevelRobot(interfaces=interfaces)
        self.topics = LowLevelTopics(ros.node, self.robot, interfaces, ORDER, False)
        self.driver = Ros2ControlDriver(context=ros.context, parameter_overrides=[
            Parameter('command_interfaces', value=list(interfaces))])
        self.driver.start()
        self.driver._timer.cancel()  # states come when the test tells them
        ros.nodes.append(self.driver)
        ros.executor.add_node(self.driver)
        self.legs = ros.node.create_publisher(JointState, 'joint_targets', 100)
        self.ticks: list[Any] = ros.collect(JointState, 'joint_states', 100)
        self.imus: list[Any] = ros.collect(Imu, 'imu', 100)
        ros.spin_until(lambda: self.topics.matched and self.legs.get_subscription_count() > 0
                       and ros.node.count_publishers('joint_states') > 0)

    def told(self) -> None:
        """Tell the driver what the robot measures now."""
        self.topics.publish()
        now = self.robot.state.time_ns
        self.ros.spin_until(lambda: self.driver._state.time_ns == now)

    def enable(self, on: bool = True) -> Any:
        return self.ros.call(SetBool, f'{DRIVER}/enable', SetBool.Request(data=on))

    def run(self, steps: int) -> None:
        """Let a commanded robot go on."""
        for _ in range(steps):
            self.robot.step()
            before = self.topics.taken
            self.told()
            self.ros.spin_until(lambda before=before: self.topics.taken > before)

    def send(self, leg: int, place: Any, torque: float = 0.0, **changes: Any) -> None:
        """Send targets of a leg at the newest tick."""
        names = JOINT_NAMES[3 * leg:3 * leg + 3]
        message = JointState(name=list(names), position=list(map(float, place)),
                             velocity=[0.0] * 3, effort=[torque] * 3)
        set_stamp(message.header.stamp, changes.pop('stamp_ns', self.driver.health.stamp_ns))
        for name, value in changes.items():
            setattr(message, name, value)
        self.legs.publish(message)


@contextmanager
def bench(ros: Ros, *interfaces: str) -> Iterator[Bench]:
    made = Bench(ros, interfaces)
    yield made
    ros.executor.remove_node(made.driver)
    made.driver.close()


def test_nothing_is_commanded_before_it_is_enabled_and_enabling_needs_an_imu(ros: Ros) -> None:
    with bench(ros, 'position') as made:
        answer = made.enable()
        assert not answer.success and 'IMU' in answer.message
        made.robot.state = made.robot.robot.reset()
        made.told()
        made.robot.step()
        made.told()
        assert made.topics.taken == 0
        assert made.enable().success
        ros.spin_until(lambda: made.topics.taken == 1)
        held = made.robot.command['position']
        assert np.allclose(held, made.robot.state.joint_position, atol=1e-3)
        assert 'belly' in made.enable().message


def test_joint_states_that_have_fallen_silent_do_not_enable(ros: Ros) -> None:
    with bench(ros, 'position') as made:
        made.told()
        for _ in range(2):
            made.driver._look_for_states()
        answer = made.enable()
        assert not answer.success and 'joint states' in answer.message
        made.robot.step()
        made.told()
        assert made.enable().success


@pytest.mark.parametrize('given', [
    'position', 'effort', 'velocity effort', 'position velocity', 'position kp kd',
    'kd position velocity effort kp', 'effort power'])
def test_interfaces_that_close_a_loop_are_taken(given: str) -> None:
    assert DriverParameters(command_interfaces=tuple(given.split())).command_interfaces


@pytest.mark.parametrize('given', [
    '', 'velocity', 'power', 'velocity power', 'kp kd', 'velocity kp kd', 'effort kp kd',
    'velocity effort kd', 'position position', 'effort velocity effort'])
def test_interfaces_that_close_no_loop_or_come_twice_are_refused(ros: Ros, given: str) -> None:
    with pytest.raises(ParameterError, match='each once, position or effort'):
        Ros2ControlDriver(context=ros.context, parameter_overrides=[
            Parameter('command_interfaces', Parameter.Type.STRING_ARRAY, given.split())]).start()


def test_torques_alone_bring_the_robot_to_its_belly_and_keep_their_limits(ros: Ros) -> None:
    with bench(ros, 'effort') as made:
        made.told()
        assert made.enable().success
        made.run(300)
        description = made.robot.robot.description
        away = made.robot.state.joint_position - lying_posture(description)
        assert np.abs(away).max() < 0.15
        limit = np.concatenate([leg.torque_limit for leg in description.legs])
        assert (np.abs(made.robot.command['effort']) <= limit).all()


def test_drives_of_a_lame_leg_lose_their_power_where_they_have_an_interface_for_it(
        ros: Ros) -> None:
    """As long as the leg is lame: the others go on, and it gives no torque whatever it is told."""
    with bench(ros, *COMMAND_INTERFACES, POWER) as made:
        made.told()
        assert made.enable().success
        made.run(10)
        drives, front_right = made.driver._guard.drives, slice(3, 6)
        assert drives.cuts and made.robot.command[POWER].all()
        assert np.abs(made.robot.state.joint_effort[front_right]).max() > 0.0
        drives.lame = ('fr',)
        drives._lame_ns = np.where(np.array(LEGS) == 'fr', made.robot.state.time_ns, -10**10)
        made.run(5)
        power = made.robot.command[POWER].reshape(4, 3)
        assert not power[1].any() and power[[0, 2, 3]].all()
        assert not made.robot.state.joint_effort[front_right].any()
        assert np.abs(made.robot.state.joint_effort[6:]).max() > 0.0
        drives.lame = ()
        made.run(5)
        assert made.robot.command[POWER].all()
    with bench(ros, *COMMAND_INTERFACES) as made:
        assert not made.driver._guard.drives.cuts  # a wild leg is not lain down with


def test_the_legs_are_followed_within_limits_when_they_rest_where_the_joints_are(ros: Ros) -> None:
    with bench(ros, 'position', 'effort', 'kp', 'kd') as made:
        description = made.robot.robot.description
        made.told()
        assert made.enable().success
        rest = lying_posture(description)
        made.run(2)
        for _ in range(350):
            for i in range(len(LEGS)):
                made.send(i, rest[3 * i:3 * i + 3], torque=1e4)
            stamp = made.driver.health.stamp_ns
            ros.spin_until(lambda stamp=stamp: made.driver._guard.stamps == [stamp] * 4)
            made.run(2)
            if made.driver._drive_mode == 'following':
                break
        made.run(2)
        assert made.driver._drive_mode == 'following'
        limit = np.concatenate([leg.torque_limit for leg in description.legs])
        assert np.array_equal(made.robot.command['effort'], limit)
        assert np.array_equal(made.robot.command['kp'], np.tile(load_description(None).kp, 4))
        rejected = made.driver.health.rejected
        for count, changes in enumerate((
                {'position': [float('nan')] * 3}, {'name': list(JOINTS_OF_LEG)},
                {'stamp_ns': made.robot.state.time_ns + 1}, {'effort': []}), 1):
            made.send(0, rest[:3], **changes)
            ros.spin_until(lambda count=count: rejected.get('joint_targets', 0) == count)


def test_a_reading_of_before_the_clock_was_set_back_tells_nothing(ros: Ros) -> None:
    with bench(ros, 'position') as made:
        made.told()
        driver, now = made.driver, made.robot.state.time_ns
        ros.spin_until(lambda: driver._imu[0] == now)
        _, *told = driver._imu
        for ahead_ns, known in ((1_000_000_000, False), (2_000_000, True)):
            driver._imu, driver._feet[0] = (now + ahead_ns, *told), (now + ahead_ns, 1.0)
            state = driver._state_at(now, np.zeros((3, 12)))
            assert bool(np.isfinite(state.acceleration_in_base).all()) == known
            assert bool(np.isfinite(state.foot_force[0])) == known
            assert driver._take_request(SetBool.Request(data=True))[0] == known
            driver.health.set_problem('late', 'told then')
            driver._silent_ns['late'] = now + ahead_ns
            driver._tell_silence('late', now, False, str)
            assert driver.health.has_problem('late') == known


@pytest.mark.parametrize('period_ns', [2_000_000, 3_100_000, 4_000_000, 9_000_000])
def test_ticks_are_whole_at_any_rate_and_a_silent_imu_tells_nothing(
        ros: Ros, period_ns: int) -> None:
    with bench(ros, 'position') as made:
        start = 1_700_000_000_001_300_000
        made.told()
        imu = made.topics._imu
        joints = made.topics._states
        told = Imu()
        told.orientation_covariance[0] = -1.0
        set_stamp(told.header.stamp, start)
        imu.publish(told)
        ros.spin_until(lambda: made.driver._imu[0] == start)
        message = JointState(name=list(JOINT_NAMES), position=[0.1] * 12, velocity=[0.0] * 12)
        stamps = [start + i * period_ns for i in range(round(0.15e9 / period_ns))]
        for stamp in stamps:
            set_stamp(message.header.stamp, stamp)
            joints.publish(message)
            ros.spin_until(lambda stamp=stamp: made.driver._state.time_ns == stamp)
        expected = sorted({stamp - stamp % 4_000_000 for stamp in stamps})
        ros.spin_until(lambda: len(made.ticks) == len(made.imus) == 1 + len(expected))
        assert [header_ns(tick) for tick in made.ticks[1:]] == expected
        assert [header_ns(tick) for tick in made.imus[1:]] == expected
        known = [np.isfinite(tick.linear_acceleration.z) for tick in made.imus[1:]]
        assert known[0] and not known[-1] and sorted(known, reverse=True) == known
        joints.publish(message)                                  # a stamp that is not newer
        ros.spin_until(lambda: any('joint_states' in name
                                   for name in made.driver.health.rejected))
