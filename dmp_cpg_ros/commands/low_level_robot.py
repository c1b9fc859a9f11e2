# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``low_level_robot``: a robot with a Unitree-like low-level interface, to rehearse its driver.

At 500 Hz it publishes what the broadcasters of ros2_control would measure and takes what
forward_command_controllers would be told, in real time, with MuJoCo as its body. It says at its
end whether the rate was held.
"""

from __future__ import annotations

import argparse
import sys
import time
from array import array
from collections.abc import Callable, Sequence
from contextlib import suppress
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray

from dmp_cpg_ros.analysis.strict_json import write_json
from dmp_cpg_ros.commands.ros_arguments import positive, within
from dmp_cpg_ros.commands.suite_client import prepared
from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core.errors import DataError, DmpCpgError, ParameterError
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS
from dmp_cpg_ros.nodes.framework.claims import claim
from dmp_cpg_ros.nodes.framework.execution import BAD_INPUT, FAILED, OK, first_signal, spin
from dmp_cpg_ros.nodes.framework.health import Durations
from dmp_cpg_ros.nodes.framework.middleware import start_ros
from dmp_cpg_ros.nodes.messages.interfaces import (
    COMMAND_INTERFACES,
    IMU_BROADCASTER,
    JOINT_BROADCASTER,
    POWER,
    commands_of,
    foot_wrench,
    interface,
)
from dmp_cpg_ros.nodes.messages.values import header_ns, set_stamp
from dmp_cpg_ros.robot.low_level import PERIOD_NS, TIMEOUT_NS, LowLevelRobot
from dmp_cpg_ros.robot.port import RobotError

NAME = 'low_level_robot'

PERIOD_S = PERIOD_NS * 1e-9

TIMEOUTS_S, LAGS_S = (0.004, 10.0), (0.0, 10.0)
"""Least and largest times that may be asked for [s]."""

BEHIND_NS = 20_000_000
"""Age of targets for which a robot waits that waits [ns]: five ticks of 250 Hz."""

AT_ONCE = 5
"""Periods that are made up for at once when this process was late; time beyond them is lost."""


class LowLevelTopics:
    """A low-level robot behind the topics of ros2_control.

    Parameters
    ----------
    node : Node
        Its node.
    robot : LowLevelRobot
        The robot.
    interfaces : sequence of str
        Command interfaces that have a controller.
    order : sequence of str, optional
        Joints as they are published; by default the robot file's. Others than the robot's rest
        at 0.
    reports_effort : bool
        Whether the motors measure their torques; without, they are NaN.

    Attributes
    ----------
    taken : int
        Whole commands so far: all interfaces once.
    refused : int
        Commands that were none.
    on_command : callable ()
        Is called after each whole command.
    targets_ns : list of int
        Stamps of the legs' newest targets, where they are heeded; −1 before the first [ns].
    """

    def __init__(self, node: Node, robot: LowLevelRobot,
                 interfaces: Sequence[str] = COMMAND_INTERFACES,
                 order: Sequence[str] | None = None, reports_effort: bool = True) -> None:
        """Create the topics."""
        self.robot, self.taken, self.refused = robot, 0, 0
        self._felt = 1.0 if reports_effort else np.nan
        self.on_command: Callable[[], None] = lambda: None
        self.targets_ns = [-1] * len(LEGS)
        self._node, self._last = node, interfaces[-1]
        names = list(robot.joint_names if order is None else order)
        known = [name for name in names if name in robot.joint_names]
        self._places = [names.index(name) for name in known]
        self._joints = [robot.joint_names.index(name) for name in known]
        self._messages = Imu(), WrenchStamped(), JointState(name=names)
        for name in interfaces:
            node.create_subscription(Float64MultiArray, commands_of(name), self._taker(name), 100)
        self._imu = node.create_publisher(Imu, f'{IMU_BROADCASTER}/imu', 10)
        self._feet = [node.create_publisher(WrenchStamped, foot_wrench(leg), 10) for leg in LEGS]
        self._states = node.create_publisher(JointState, f'{JOINT_BROADCASTER}/joint_states', 10)

    @property
    def matched(self) -> bool:
        """Whether somebody reads what it measures."""
        return all(publisher.get_subscription_count()
                   for publisher in (self._imu, self._states, *self._feet))

    def heed_targets(self) -> None:
        """Note how far the suite has come; no robot hears of that."""
        topic = interface('joint_targets')
        self._node.create_subscription(topic.type, topic.name, self._note, topic.reader_qos)

    def _note(self, message: JointState) -> None:
        with suppress(DataError, IndexError, ValueError):        # what the driver refuses, too
            joint = self.robot.joint_names.index(message.name[0])
            self.targets_ns[joint // len(JOINTS_OF_LEG)] = header_ns(message)

    def _taker(self, name: str) -> Callable[[Any], None]:
        def take(message: Float64MultiArray) -> None:
            try:
                self.robot.take(name, message.data)
            except DataError as error:
                self.refused += 1
                self._node.get_logger().warning(
                    f'{commands_of(name)} was refused: {error}', throttle_duration_sec=1.0)
                return
            if name == self._last:
                self.taken += 1
                self.on_command()

        return take

    def publish(self) -> None:
        """Tell what is measured, the joints last."""
        state, imu, wrench, joints = self.robot.state, *self._messages
        q, rate, force = imu.orientation, imu.angular_velocity, imu.linear_acceleration
        q.x, q.y, q.z, q.w = state.base_quaternion.tolist()
        rate.x, rate.y, rate.z = state.base_rate_in_base.tolist()
        force.x, force.y, force.z = state.acceleration_in_base.tolist()
        for message in self._messages:
            set_stamp(message.header.stamp, state.time_ns)
        self._imu.publish(imu)
        for publisher, size in zip(self._feet, state.foot_force.tolist(), strict=True):
            wrench.wrench.force.z = size
            publisher.publish(wrench)
        told = np.zeros((3, len(joints.name)))
        told[:, self._places] = np.array(
            (state.joint_position, state.joint_velocity, self._felt * state.joint_effort)
        )[:, self._joints]
        # Arrays of their type are taken as they are; of a list, every entry is looked at.
        joints.position, joints.velocity, joints.effort = (
            array('d', row.tobytes()) for row in told)
        self._states.publish(joints)


class Pace:
    """Lets the robot's time go on with the machine's, and measures how well from the first
    command on.

    Parameters
    ----------
    topics : LowLevelTopics
        The robot.
    longest_lag_s : float
        How long a period waits for the commands of the one before, once they come, and for
        targets that are not older than ``BEHIND_NS`` [s].
    """

    def __init__(self, topics: LowLevelTopics, longest_lag_s: float = 0.0) -> None:
        """Begin now."""
        self._topics, self._lag_s = topics, longest_lag_s
        self._due = self._published = time.monotonic()
        self._answered, self._waited = 0, False
        self._begun = self._commanded = -1.0
        self.states, self.gaps, self.answers = Durations(), Durations(), Durations()
        self.longest_state_s = self.longest_gap_s = self.lost_s = 0.0
        self.periods = self.commands = self.unanswered = 0
        self._from = topics.robot.state.base_position_in_world
        topics.on_command = self._note_command

    def go_on(self) -> None:
        """Make the periods that are due."""
        for _ in range(AT_ONCE):
            now = time.monotonic()
            if now < self._due or self._waits(now):
                return
            self._due += PERIOD_S
            self._topics.robot.step()
            self._topics.publish()
            self._note_state()
        late_s = time.monotonic() - self._due
        if late_s > PERIOD_S:
            self.lost_s += late_s * (self._begun >= 0.0)
            self._due += late_s

    def _waits(self, now: float) -> bool:
        """Whether the robot's time waits for an answer; who has not answered for so long is not
        waited for until the next one.
        """
        oldest_ns = min(self._topics.targets_ns)
        if self._topics.taken > self._answered and (
                oldest_ns < 0 or self._topics.robot.state.time_ns - oldest_ns <= BEHIND_NS):
            self._waited = False
        elif not self._waited and self._begun >= 0.0:
            self._waited = now >= self._published + self._lag_s
            if not self._waited:
                self._due = now
                return True
        return False

    def _note_state(self) -> None:
        now, last = time.monotonic(), self._published
        self._published = now
        if self._begun < 0.0:
            return
        self.periods += 1
        self.states.note(now - last)
        self.longest_state_s = max(self.longest_state_s, now - last)
        self.unanswered += self._topics.taken <= self._answered
        self._answered = self._topics.taken

    def _note_command(self) -> None:
        now = time.monotonic()
        if self._begun < 0.0:
            self._begun = now
        else:
            self.commands += 1
            self.gaps.note(now - self._commanded)
            self.longest_gap_s = max(self.longest_gap_s, now - self._commanded)
            self.answers.note(now - self._published)
        self._commanded = now

    def results(self) -> dict[str, Any]:
        """What was measured since the first command, for JSON; empty without any."""
        seconds = self._published - self._begun
        place = self._topics.robot.state.base_position_in_world
        if self._begun < 0.0 or not self.commands or seconds <= 0.0:
            return {}
        return {
            'seconds': seconds, 'states_hz': self.periods / seconds,
            'real_time_factor': self.periods * PERIOD_S / seconds, 'lost_s': self.lost_s,
            'state_period_ms_p99': 1e3 * self.states.percentile(99.0),
            'state_period_ms_max': 1e3 * self.longest_state_s,
            'commands_hz': self.commands / seconds,
            'command_gap_ms_p99': 1e3 * self.gaps.percentile(99.0),
            'command_gap_ms_max': 1e3 * self.longest_gap_s,
            'answer_ms_p50': 1e3 * self.answers.percentile(50.0),
            'unanswered_share': self.unanswered / max(1, self.periods),
            'timeouts': self._topics.robot.timeouts, 'refused': self._topics.refused,
            'moved_m': float(np.hypot(*(place - self._from)[:2]))}


def told(results: dict[str, Any]) -> str:
    """What was measured, in words."""
    if not results:
        return 'it was not commanded'
    of = {name: f'{value:.3g}' for name, value in results.items()}
    return (
        f'{results["states_hz"]:.1f} states and {results["commands_hz"]:.1f} commands per second '
        f'over {of["seconds"]} s, real-time factor {results["real_time_factor"]:.3f}\n'
        f'period of the states: 99 % {of["state_period_ms_p99"]} ms, longest '
        f'{of["state_period_ms_max"]} ms; between commands: 99 % {of["command_gap_ms_p99"]} ms, '
        f'longest {of["command_gap_ms_max"]} ms\n'
        f'a command comes {of["answer_ms_p50"]} ms after the newest state (median); none came '
        f'within the period in {100.0 * results["unanswered_share"]:.2f} %\n'
        f'damped {results["timeouts"]} times for want of commands, {results["refused"]} commands '
        f'refused; it is {of["moved_m"]} m from where it began')


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the robot; returns the exit status."""
    options, words = prepared(_parser(), arguments)
    try:
        return _run(options, words)
    except (DmpCpgError, OSError) as error:
        print(f'{NAME}: {error}', file=sys.stderr)
        return FAILED if isinstance(error, RobotError) else BAD_INPUT
    finally:
        rclpy.try_shutdown()


def _run(options: argparse.Namespace, words: Sequence[str]) -> int:
    robot = options.robot and find_config(options.robot, ROBOTS)
    topics_of = tuple(options.interfaces.split(',')) if options.interfaces else COMMAND_INTERFACES
    valid = (*COMMAND_INTERFACES, POWER)
    if unknown := set(topics_of) - set(valid):
        raise ParameterError(f"there is no interface '{min(unknown)}'; valid are "
                             f'{", ".join(valid)}')
    low_level = LowLevelRobot(robot, topics_of, round(options.timeout * 1e9), options.start)
    start_ros([NAME, *words])
    node = Node(NAME, enable_rosout=False, start_parameter_services=False)
    claimed = claim(node.get_fully_qualified_name(), node.context.get_domain_id())
    until = first_signal()
    topics = LowLevelTopics(node, low_level, topics_of, reports_effort=not options.no_effort)
    if options.longest_lag:
        topics.heed_targets()
    pace, failed = Pace(topics, options.longest_lag), list[DmpCpgError]()

    def go_on() -> None:
        try:
            pace.go_on()
        except DmpCpgError as error:
            failed.append(error)
        if (failed or low_level.state.time_ns >= options.seconds * 1e9) and not until.done():
            until.set_result(None)

    node.create_timer(PERIOD_S, go_on, clock=Clock(clock_type=ClockType.STEADY_TIME))
    print(f'{NAME}: {options.start}; states at {1.0 / PERIOD_S:g} Hz, commands of '
          f'{", ".join(topics_of)}', flush=True)
    spin([node], 'events', until)
    node.destroy_node()
    claimed.close()
    if failed:
        raise failed[0]
    results = pace.results()
    print(told(results))
    if options.json:
        write_json(options.json, results)
    return OK


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME, description='A robot with a Unitree-like low-level interface at 500 Hz behind '
        'the topics of ros2_control, to rehearse ros2_control_driver without a robot; Ctrl-C ends '
        'it. --ros-args are taken as by every node.')
    add = parser.add_argument
    add('--robot', metavar='FILE', help='robot file (default: mini_quadruped.yaml)')
    add('--interfaces', metavar='A,B', help='command interfaces that have a controller, '
        f'{POWER} among them if there is one (default: {",".join(COMMAND_INTERFACES)})')
    add('--start', choices=('lying', 'standing', 'fallen'), default='lying',
        help='default: lying')
    add('--no-effort', action='store_true', help='motors that do not measure their torques')
    add('--timeout', metavar='S', type=within(*TIMEOUTS_S), default=TIMEOUT_NS * 1e-9,
        help='silence of a controller after which all motors are damped [s], {:g} to {:g} '
        '(default: %(default)g)'.format(*TIMEOUTS_S))
    add('--longest-lag', metavar='S', type=within(*LAGS_S), default=0.0,
        help="how long the robot's time waits for the answer to a state, and for a suite that is "
        'behind [s], for a machine that is too slow; that of a real robot does not (default: 0)')
    add('--seconds', metavar='S', type=positive, default=inf,
        help="end when the robot's time is this [s] (default: at Ctrl-C)")
    add('--namespace', metavar='NAME', help="the suite's namespace")
    add('--json', metavar='FILE', type=Path, help='write what was measured')
    return parser


if __name__ == '__main__':
    sys.exit(main())
