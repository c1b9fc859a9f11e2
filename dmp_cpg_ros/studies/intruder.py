# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An intruder in the robot's ROS domain: whether it can topple, stop, start or steer the robot.

``python -m dmp_cpg_ros.studies.intruder --duration S --seed N`` walks the robot at 0.5 m/s, in
real time unless ``--lock-step`` is given, and publishes forged messages, replays, garbage and
floods on every topic of the suite, parameter events and requests, and transitions that are not
possible. After each attack it looks whether the robot is on its feet and at its speed, and how
soon the intruder was named on ``/diagnostics``. Exit status 1 when an attack succeeded.

The documented services and ``cmd_vel`` are open to everybody and are not attacked; neither are
requests that are valid, such as deactivating a node, which only DDS Security can refuse.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from math import atan2, cos, nan, remainder, sin, tau
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterEvent, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_parameter_events
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from dmp_cpg_ros.core import suite_parameters as core
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.layouts import GAIN_ROWS
from dmp_cpg_ros.nodes.framework.execution import prepare_middleware
from dmp_cpg_ros.nodes.messages.interfaces import TOPICS, interface
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.studies.output import markdown_table
from dmp_cpg_ros.suite_table import POSTURE, ROBOT, WALKING_NODES

NAME = 'intruder'
"""Its node; what ``/diagnostics`` must name."""

SPEED = 0.5
"""Commanded speed of the walk [m/s]."""

STEADY_S = 4.0
"""Time of the robot from which it walks steadily [s]."""

HEAR_S = 2.0
"""Time after which a topic has nothing to say [s]."""

RECOVERY_S, LATEST_S = 3.0, 8.0
"""Times of the robot after an attack from and until which it is looked whether it walks as before
[s]: whoever took up a stand by himself at its end has to come to rest and to start.
"""

ATTACK_S = 2.0
"""Length of an attack [s]."""

PATIENCE_S = 120.0
"""Time of this machine in which the suite walks, and recovers [s]."""

SLOWEST, FASTEST, LOWEST, MOST_TURNED = 0.35, 0.65, 0.15, 0.5
"""Speeds [m/s], height of the base [m] and turn by an attack [rad] of a robot that walks on."""

OWN = tuple(topic for topic in TOPICS if topic.publishers != ('user',) and topic.recorded
            and topic.name not in ('/clock', '/diagnostics', 'joint_work', 'odom', '/tf'))
"""Topics that only nodes of the suite may write."""

TICKED = ('joint_states', 'imu', 'foot_contacts', 'reference', 'canonical_state',
          'posture_feedback', 'joint_targets')
"""Topics with a message at every tick."""


class Pose(NamedTuple):
    """Place of the base in the world [m] and its heading [rad] at a time of the robot [s]."""

    time_s: float
    x: float
    y: float
    z: float
    yaw: float


class Intruder(Node):  # type: ignore[misc]
    """A node that listens to the suite and publishes what it should not.

    It hears where the robot is, and a topic of the suite while it attacks with what it says there:
    reading everything takes as much of a core as four legs, from which a suite in as many
    processes as it has nodes falls behind on two cores without any attack.

    Attributes
    ----------
    begin, named : float
        When the attack began, and when a report of the suite first named it since [s]; NaN before.
    fell : bool
        Whether the robot has told a fall.
    sent : int
        Messages and requests so far.
    """

    def __init__(self, seed: int) -> None:
        """Listen to where the robot is, and to reports."""
        super().__init__(NAME)
        self.executor_ = SingleThreadedExecutor()
        self.executor_.add_node(self)
        self.draw = random.Random(seed)
        self.last: dict[str, bytes] = {}
        self.poses: list[Pose] = []
        self.begin, self.named, self.fell, self.sent = nan, nan, False, 0
        self._writers: dict[str, Any] = {}
        self._readers: dict[str, Any] = {}
        place = interface('ground_truth')
        self.create_subscription(place.type, place.name, self._on_place, 10, raw=True)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_report, 100)

    def hear(self, name: str) -> bool:
        """Listen to a topic until :meth:`leave`; whether it has said something."""
        if name not in self._readers:
            self.last.pop(name, None)
            self._readers[name] = self.create_subscription(
                interface(name).type, name, partial(self.last.__setitem__, name), 10, raw=True)
            end = time.monotonic() + HEAR_S
            while name not in self.last and time.monotonic() < end:
                self.spin(0.02)
        return name in self.last

    def _on_place(self, data: bytes) -> None:
        with suppress(rclpy_implementation.RMWError):  # its own garbage comes back
            odom = deserialize_message(data, Odometry)
            place, stamp, q = (odom.pose.pose.position, odom.header.stamp,
                               odom.pose.pose.orientation)
            if place.x == 0.0 == place.z:
                return
            yaw = 2.0 * atan2(q.z, q.w)  # of a body that is hardly tilted
            self.poses.append(Pose(stamp.sec + 1e-9 * stamp.nanosec, place.x, place.y, place.z,
                                   yaw))
            if len(self.poses) > 1000:
                del self.poses[:500]

    def _on_report(self, report: DiagnosticArray) -> None:
        for status in report.status:
            if NAME in status.message and self.named != self.named:
                self.named = time.monotonic()
            self.fell |= status.name == ROBOT and any(entry.key == 'fell' and entry.value == 'true'
                             for entry in status.values)

    def spin(self, seconds: float) -> None:
        """Listen for some time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor_.spin_once(timeout_sec=max(0.0, end - time.monotonic()))

    def speed(self, seconds: float = 1.5) -> float:
        """Mean speed ahead over the last seconds of the robot's clock [m/s]."""
        if not self.poses:
            return nan
        end = self.poses[-1]
        begin = next(pose for pose in self.poses if pose.time_s >= end.time_s - seconds)
        passed_s = end.time_s - begin.time_s
        heading = begin.yaw + 0.5 * remainder(end.yaw - begin.yaw, tau)
        ahead = cos(heading) * (end.x - begin.x) + sin(heading) * (end.y - begin.y)
        return ahead / passed_s if passed_s > 0.0 else nan

    def publish(self, name: str, message: Any) -> None:
        """Publish a message, or its bytes, with the suite's own quality of service."""
        if name not in self._writers:
            topic = interface(name)
            self._writers[name] = self.create_publisher(
                topic.type, topic.name, topic.publisher_qos)
            self.spin(0.3)
        with suppress(rclpy_implementation.RCLError):  # bytes that this middleware does not send
            self._writers[name].publish(message)
            self.sent += 1

    def leave(self) -> None:
        """Destroy all publishers, and the readers of what was attacked."""
        for publisher in self._writers.values():
            self.destroy_publisher(publisher)
        for reader in self._readers.values():
            self.destroy_subscription(reader)
        self._writers, self._readers = {}, {}

    def repeat(self, seconds: float, rate: float, act: Callable[[], object]) -> None:
        """Do something at a rate [Hz], and listen in between."""
        begin, count = time.monotonic(), 0
        while time.monotonic() < begin + seconds:
            act()
            count += 1
            ahead = begin + count / rate - time.monotonic()
            if ahead > 0.0:
                self.spin(ahead)
            elif count % 20 == 0:
                self.executor_.spin_once(timeout_sec=0.0)

    def message(self, name: str) -> Any:
        """The last message of a topic."""
        return deserialize_message(self.last[name], interface(name).type)

    def changed(self, name: str, change: Callable[[Any], None]) -> None:
        """Publish the last message of a topic, changed."""
        if self.hear(name):
            with suppress(rclpy_implementation.RMWError):  # what it has heard last is its own
                message = self.message(name)
                change(message)
                self.publish(name, message)

    def stamp_ns(self) -> int:
        """Stamp of the last pose [ns]."""
        return round(self.poses[-1].time_s * 1e9) if self.poses else 0

    def stamped(self, name: str, stamp_ns: int) -> None:
        """Publish the last message of a topic with another stamp."""
        self.changed(name, lambda message: set_stamp(message.header.stamp, stamp_ns))

    def call(self, kind: Any, name: str, requests: Sequence[Any], rate: float) -> None:
        """Send requests to a service at a rate and do not wait for the answers."""
        client = self.create_client(kind, name)
        client.wait_for_service(timeout_sec=2.0)
        left = list(requests)
        self.sent += len(left)
        self.repeat(len(left) / rate, rate, lambda: left and client.call_async(left.pop()))
        self.spin(0.2)
        self.destroy_client(client)


def _filled(field: str, value: float) -> Callable[[Any], None]:
    return lambda message: setattr(message, field, [value] * len(getattr(message, field)))


def _scaled(field: str, factor: float) -> Callable[[Any], None]:
    return lambda message: setattr(
        message, field, (factor * np.array(getattr(message, field))).tolist())


def _upside_down(message: Any) -> None:
    message.linear_acceleration.z = -9.81


def _too_fast(message: Any) -> None:
    message.twist.linear.x = 9e5


def _forger(name: str, change: Callable[[Any], None]) -> Callable[[Intruder], None]:
    return lambda node: node.repeat(ATTACK_S, 250.0, lambda: node.changed(name, change))


def _old(name: str) -> Callable[[Intruder], None]:
    def attack(node: Intruder) -> None:
        data = _newest(name, node)
        node.repeat(ATTACK_S, 250.0, lambda: node.publish(name, data))

    return attack


def _flood(name: str, make: Callable[[Intruder], bytes]) -> Callable[[Intruder], None]:
    def attack(node: Intruder) -> None:
        data = make(node)
        node.repeat(2.0 * ATTACK_S, 1e9, lambda: node.publish(name, data))

    return attack


def _newest(name: str, node: Intruder) -> bytes:
    return node.last[name] if node.hear(name) else b''


def _garbage(node: Intruder) -> bytes:
    return b'\x00\x01\x00\x00' + node.draw.randbytes(300)


def _stamps(name: str) -> Callable[[Intruder], None]:
    def attack(node: Intruder) -> None:
        for stamp_ns in (10**12, 0, 2_147_483_000 * 10**9, 10**10):
            node.stamped(name, stamp_ns)
            node.spin(0.3)

    return attack


def _bytes_on_all(node: Intruder) -> None:
    for topic in OWN:
        for data in (b'\x00\x00\x00\x00\x01\x02\x03', b'\x00\x01\x00\x00\x01\x02\x03',
                     _garbage(node), b'\xff\x42' + node.draw.randbytes(200)):
            node.publish(topic.name, data)
    node.spin(ATTACK_S)


def _mutants(node: Intruder) -> None:
    heard = [name for name in TICKED if node.hear(name)]

    def mutant() -> None:
        name = node.draw.choice(heard)
        data = bytearray(node.last[name])
        for _ in range(node.draw.randrange(1, 6)):
            data[node.draw.randrange(len(data))] = node.draw.randrange(256)
        node.publish(name, bytes(data[:node.draw.randrange(4, len(data) + 1)]
                                 if node.draw.random() < 0.3 else data))

    if heard:
        node.repeat(2.0 * ATTACK_S, 500.0, mutant)


def _huge(node: Intruder) -> None:
    long = JointState(name=[f'{k:09}' for k in range(600_000)])
    data = serialize_message(long)
    for _ in range(4):
        node.publish('canonical_state', data)
        node.spin(0.3)


def _gains(node: Intruder) -> None:
    for gain, requested, at_rest in ((-1e6, 1.0, 0.0), (1e300, 1.0, 0.0), (400.0, 1.0, 1.0),
                                     (0.0, 0.0, 0.0)):
        values = {**dict.fromkeys(GAIN_ROWS, 0.0), **dict.fromkeys(LEGS, gain),
                  'region_radius': 0.3, 'requested': requested, 'at_rest': at_rest}
        for stamp_ns in (0, node.stamp_ns()):
            message = JointState(name=list(values), position=list(values.values()))
            set_stamp(message.header.stamp, stamp_ns)
            node.publish('inhibition_gains', message)
            node.spin(0.2)


def _modes(node: Intruder) -> None:
    for mode in ('damped', 'lying', 'nonsense', ''):
        node.publish('body_mode', String(data=mode))
        node.spin(0.3)

    def forge(message: Any) -> None:
        message.position[-1] = message.velocity[-1] = 3.0

    node.repeat(0.5, 250.0, lambda: node.changed('posture_feedback', forge))


def _events(node: Intruder) -> None:
    publisher = node.create_publisher(
        ParameterEvent, '/parameter_events', qos_profile_parameter_events)
    node.spin(0.3)
    lies = [('gait', ParameterValue(type=4, string_value='nope')),
            ('gait', ParameterValue(type=4, string_value='trot')),
            ('gait', ParameterValue(type=77)),
            ('alpha_r', ParameterValue(type=3, double_value=9.0)),
            ('rho', ParameterValue(type=3, double_value=1e300)),
            ('region_radius', ParameterValue(type=3, double_value=1.9))]
    for owner in (core.CANONICAL, core.REFERENCE, core.INHIBITION):
        for name, value in lies:
            node.sent += 1
            publisher.publish(ParameterEvent(node=f'/{owner}', changed_parameters=[
                ParameterMessage(name=name, value=value)]))
            node.spin(0.02)
    node.spin(1.0)
    node.destroy_publisher(publisher)


def _transitions(node: Intruder) -> None:
    valid = (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVE_SHUTDOWN)
    for name in WALKING_NODES:
        requests = [ChangeState.Request(transition=Transition(id=number))
                    for number in (99, 1, 2, 3, 0, 255) if number not in valid]
        node.call(ChangeState, f'{name}/change_state', requests, 50.0)


def _parameters(owner: str, name: str) -> Callable[[Intruder], None]:
    def attack(node: Intruder) -> None:
        node.call(SetParameters, f'{owner}/set_parameters', [
            SetParameters.Request(parameters=[
                Parameter(name, value=node.draw.uniform(0.5, 0.9)).to_parameter_msg()])
            for _ in range(2000)], 1000.0)

    return attack


def _second_robot(node: Intruder) -> None:
    robot = subprocess.Popen([sys.executable, '-m', 'dmp_cpg_ros', ROBOT, '--ros-args', '-r',
                              f'__node:={NAME}'], stderr=subprocess.DEVNULL)
    end = time.monotonic() + PATIENCE_S
    while node.count_publishers('joint_states') < 2 and time.monotonic() < end:
        node.spin(0.02)
    node.begin = time.monotonic()  # so far it has only started
    node.spin(5.0)
    robot.send_signal(signal.SIGINT)
    robot.wait(10.0)


ATTACKS: dict[str, Callable[[Intruder], None]] = {
    'nothing': lambda node: node.spin(ATTACK_S),
    'bytes that are no message, on all topics': _bytes_on_all,
    'mutated messages': _mutants,
    **{f'stamps of {name}': _stamps(name) for name in TICKED},
    **{f'{name} of long ago': _old(name) for name in TICKED},
    'joint_targets times 3': _forger('joint_targets', _scaled('position', 3.0)),
    'canonical_state 1e6': _forger('canonical_state', _filled('position', 9e5)),
    'canonical_state zero': _forger('canonical_state', _filled('position', 0.0)),
    'canonical_state backwards': _forger('canonical_state', _scaled('position', -1.0)),
    'posture_feedback 1e6': _forger('posture_feedback', _filled('effort', 9e5)),
    'imu upside down': _forger('imu', _upside_down),
    'reference 9e5 m/s': _forger('reference', _too_fast),
    'foot_contacts zero': _forger('foot_contacts', _filled('effort', 0.0)),
    'joint_states zero': _forger('joint_states', _filled('position', 0.0)),
    'inhibition_gains': _gains,
    'body_mode': _modes,
    '10 MB': _huge,
    **{f'flood of old {name}': _flood(name, partial(_newest, name))
       for name in ('canonical_state', 'joint_targets', 'joint_states')},
    **{f'flood of garbage on {name}': _flood(name, _garbage)
       for name in ('canonical_state', 'joint_targets', 'joint_states')},
    'parameter events': _events,
    'transitions': _transitions,
    '1,000 rho a second': _parameters(core.CANONICAL, 'rho'),
    '1,000 friction a second': _parameters(POSTURE, 'friction'),
    'second robot': _second_robot,
}
"""What the intruder does, by name."""


@dataclass
class Outcome:
    """What came of an attack; it failed when the robot walked on."""

    attack: str
    messages: int
    fell: bool
    speed: float
    turned: float
    named_s: float

    @property
    def walked_on(self) -> bool:
        """Whether the robot walked on as commanded."""
        return (not self.fell and SLOWEST <= self.speed <= FASTEST
                and abs(self.turned) <= MOST_TURNED)


class Suite:
    """A walk at ``SPEED`` with more options of ``walk``; started again after a fall."""

    def __init__(self, folder: Path, options: Sequence[str]) -> None:
        """Write the scenario."""
        self._folder, self._options, self._runs = folder, options, 0
        self._process: subprocess.Popen[bytes] | None = None
        self.begin_mb = 0.0
        (folder / 'walk.yaml').write_text(yaml.safe_dump({
            'name': 'intruder', 'duration': 36000.0,
            'events': [{'at': 0.5, 'inhibit': False}, {'at': 1.0, 'command': {'v_x': SPEED}}]}),
            encoding='utf-8')

    def start(self, node: Intruder) -> None:
        """Walk until the speed is steady; raises DmpCpgError when it does not come up."""
        self.end()
        node.spin(1.0)  # what the last run has left in queues
        node.fell, self._runs = False, self._runs + 1
        node.poses.clear()
        out = self._folder / f'run{self._runs}'
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'dmp_cpg_ros', 'walk', str(self._folder / 'walk.yaml'),
             '--no-report', '--out', str(out), *self._options],
            stdout=(self._folder / f'walk{self._runs}.log').open('wb'), stderr=subprocess.STDOUT)
        end = time.monotonic() + PATIENCE_S
        while not (node.poses and node.poses[-1].time_s > STEADY_S):
            node.spin(0.2)
            if time.monotonic() > end or self._process.poll() is not None:
                said = (self._folder / f'walk{self._runs}.log').read_text(encoding='utf-8')
                raise DmpCpgError(f'the suite does not walk: {said}')
        self.begin_mb = self.memory_mb()

    def memory_mb(self) -> float:
        """Resident memory of its processes [MB]; 0 where it does not run."""
        if self._process is None or self._process.poll() is not None:
            return 0.0
        tasks = Path(f'/proc/{self._process.pid}/task')
        children = (tasks / str(self._process.pid) / 'children').read_text().split()
        pages = [int(Path(f'/proc/{child}/statm').read_text().split()[1]) for child in children]
        return sum(pages) * os.sysconf('SC_PAGE_SIZE') / 1e6

    def running(self) -> bool:
        """Whether no node has died."""
        return self._process is not None and self._process.poll() is None

    def end(self) -> None:
        """End it."""
        if self._process is not None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(90.0)
            except subprocess.TimeoutExpired:
                self._process.kill()


def attacked(node: Intruder, suite: Suite, name: str) -> Outcome:
    """Attack and look what comes of it."""
    node.named, node.begin, sent = nan, time.monotonic(), node.sent
    heading = node.poses[-1].yaw
    ATTACKS[name](node)
    named = node.named
    node.leave()
    ended_s, deadline = node.poses[-1].time_s, time.monotonic() + PATIENCE_S
    while suite.running() and time.monotonic() < deadline:
        passed_s = node.poses[-1].time_s - ended_s
        if passed_s >= LATEST_S or (
                passed_s >= RECOVERY_S and SLOWEST <= node.speed() <= FASTEST):
            break
        node.spin(0.1)
    fell = node.fell or not suite.running() or node.poses[-1].z < LOWEST
    return Outcome(name, node.sent - sent, fell, node.speed(),
                   remainder(node.poses[-1].yaw - heading, tau), max(named - node.begin, 0.0))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = argparse.ArgumentParser(prog='intruder', description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--duration', type=float, default=60.0, metavar='S',
                        help='time of attacks [s]; each is tried once before any is tried again')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--composed', action='append_const', dest='walk', const='--composed',
                        default=[], help='all nodes in one process')
    parser.add_argument('--lock-step', action='append_const', dest='walk', const='--lock-step',
                        help='not in real time: the outcome does not depend on the machine')
    parser.add_argument('--rate', type=float, metavar='HZ', help='control rate of the suite')
    parser.add_argument('--out', type=Path, metavar='DIR', help='keep the runs in an old folder')
    parser.add_argument('--attacks', nargs='+', metavar='NAME', default=list(ATTACKS),
                        help=f'those whose names hold these words, of {"; ".join(ATTACKS)}')
    options = parser.parse_args(arguments)
    names = [name for name in ATTACKS if any(word in name for word in options.attacks)]
    if not names:
        parser.error(f'no attack is named so; valid are {"; ".join(ATTACKS)}')
    prepare_middleware()
    rclpy.init()
    node, outcomes = Intruder(options.seed), list[Outcome]()
    with tempfile.TemporaryDirectory(prefix='intruder') as folder:
        rate = [] if options.rate is None else ['--rate', str(options.rate)]
        suite = Suite(options.out or Path(folder), [*options.walk, *rate])
        try:
            suite.start(node)
            end, left = time.monotonic() + options.duration, list[str]()
            while time.monotonic() < end:
                left = left or node.draw.sample(names, len(names))
                outcomes.append(attacked(node, suite, left.pop()))
                print(outcomes[-1], flush=True)
                if not outcomes[-1].walked_on:
                    suite.start(node)
        finally:
            memory = suite.memory_mb()
            suite.end()
            rclpy.try_shutdown()
    print(table(outcomes))
    print(f'{node.sent:,} messages and requests, seed {options.seed}; memory of the suite at the '
          f'begin {suite.begin_mb:.0f} MB, at the end {memory:.0f} MB')
    return int(not all(outcome.walked_on for outcome in outcomes))


def table(outcomes: Sequence[Outcome]) -> str:
    """Markdown table by attack."""
    rows = []
    for name in ATTACKS:
        of = [outcome for outcome in outcomes if outcome.attack == name]
        if of:
            late = max(outcome.named_s for outcome in of)
            rows.append((name, str(len(of)), f'{sum(outcome.messages for outcome in of):,}',
                         str(sum(outcome.fell for outcome in of)),
                         str(sum(not outcome.walked_on for outcome in of)),
                         f'{max(abs(outcome.turned) for outcome in of):.2f} rad',
                         '-' if late != late else f'{late:.1f} s'))
    return markdown_table(('attack', 'times', 'messages', 'falls', 'did not walk on', 'turned',
                           'named within'), rows)


if __name__ == '__main__':
    sys.exit(main())
