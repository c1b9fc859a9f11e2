# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an intruder does: forges, repeats and floods topics, and calls services."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterEvent, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_parameter_events
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool

from dmp_cpg_ros.core import suite_parameters as core
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.layouts import GAIN_ROWS
from dmp_cpg_ros.nodes.messages.interfaces import TOPICS
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.studies.intruder_node import NAME, Intruder
from dmp_cpg_ros.studies.walk_process import WITHIN_S
from dmp_cpg_ros.suite_table import POSTURE, ROBOT, WALKING_NODES

ATTACK_S = 2.0
"""Length of an attack [s]."""

LAST_S = 36_000
"""Length of the walk, which nobody waits for [s]."""

NOTHING = 'nothing'
"""Attack that is none, for comparison."""

OWN = tuple(topic for topic in TOPICS if topic.publishers != ('user',) and topic.recorded
            and topic.name not in ('/clock', '/diagnostics', 'joint_work', 'odom', '/tf'))
"""Topics that only nodes of the suite may write."""

TICKED = ('joint_states', 'imu', 'foot_contacts', 'reference', 'canonical_state',
          'posture_feedback', 'joint_targets')
"""Topics with a message at every tick."""


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
    """Flood a topic; half way a user asks for a stop from the same process."""
    def attack(node: Intruder) -> None:
        data = make(node)
        node.repeat(ATTACK_S, 1e9, lambda: node.publish(name, data))
        node.stop = node.ask(True)
        node.repeat(ATTACK_S, 1e9, lambda: node.publish(name, data))

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


def _progress(node: Intruder) -> None:
    """What a scenario goes by: the robot's clock, what it does, and how far the stop is."""
    late = Clock()
    set_stamp(late.clock, LAST_S * 10**9)
    words = DiagnosticArray(status=[DiagnosticStatus(name=core.INHIBITION, message='at_rest')])

    def forge() -> None:
        node.publish('/clock', late)
        node.publish('drive_mode', String(data='damp'))
        node.publish('inhibition_state', words)

    node.repeat(ATTACK_S, 50.0, forge)


def _events(node: Intruder) -> None:
    publisher = node.create_publisher(
        ParameterEvent, '/parameter_events', qos_profile_parameter_events)
    node.spin(0.3)
    lies = [('gait', ParameterValue(type=4, string_value='nope')),
            ('gait', ParameterValue(type=4, string_value='trot')),
            ('gait', ParameterValue(type=77)),
            ('alpha_r', ParameterValue(type=3, double_value=5.0)),
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


def _questions(node: Intruder) -> None:
    for name in WALKING_NODES:
        node.call(GetParameters, f'{name}/get_parameters',
                  [GetParameters.Request(names=['gait'] * 100_000)], 50.0)


def _second_servers(node: Intruder) -> None:
    """Answer in the name of the suite: another gait, and that what was not done is."""
    def gait(request: Any, response: Any) -> Any:
        response.values = [ParameterValue(type=4, string_value='trot')] * len(request.names)
        return response

    def done(_: Any, response: Any) -> Any:
        response.success = True
        return response

    services = [node.create_service(GetParameters, f'{owner}/get_parameters', gait)
                for owner in core.CHANGEABLE] + [
        node.create_service(SetBool, 'inhibit', done)]
    node.sent += len(services)
    node.spin(3.0 * ATTACK_S)  # followers ask every 5 s
    for service in services:
        node.destroy_service(service)


def _second_robot(node: Intruder) -> None:
    robot = subprocess.Popen([sys.executable, '-m', 'dmp_cpg_ros', ROBOT, '--ros-args', '-r',
                              f'__node:={NAME}'], stderr=subprocess.DEVNULL)
    end = time.monotonic() + WITHIN_S
    while node.count_publishers('joint_states') < 2 and time.monotonic() < end:
        node.spin(0.02)
    node.begin = time.monotonic()  # so far it has only started
    node.spin(5.0)
    robot.send_signal(signal.SIGINT)
    robot.wait(10.0)


ATTACKS: dict[str, Callable[[Intruder], None]] = {
    NOTHING: lambda node: node.spin(ATTACK_S),
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
    'clock, drive_mode and inhibition_state': _progress,
    '10 MB': _huge,
    **{f'flood of old {name}': _flood(name, partial(_newest, name)) for name in TICKED},
    **{f'flood of garbage on {name}': _flood(name, _garbage) for name in TICKED},
    'parameter events': _events,
    'transitions': _transitions,
    '1,000 rho a second': _parameters(core.CANONICAL, 'rho'),
    '1,000 friction a second': _parameters(POSTURE, 'friction'),
    'questions of 100,000 names': _questions,
    'second servers': _second_servers,
    'second robot': _second_robot,
}
"""What the intruder does, by name."""
