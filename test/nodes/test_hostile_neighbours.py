# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What strangers in a ROS network, the user's Ctrl-C among them, must not do to a node."""

from __future__ import annotations

import contextlib
import math
import os
import random
import signal
import time
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sensor_msgs.msg import JointState

from dmp_cpg_ros.layouts import GAIN_ROWS
from dmp_cpg_ros.nodes.messages.inhibition import InhibitionGainsReader

pytest.importorskip('rclpy')

import ros_processes
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from entry_names import ENTRY_NAMES
from geometry_msgs.msg import Twist, WrenchStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterEvent, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
)
from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_parameter_events
from rclpy.serialization import serialize_message
from ros_processes import DEADLINE_S, SHARED_HZ, NodeProcess, Processes, Ros
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu
from std_srvs.srv import SetBool, Trigger

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets
from dmp_cpg_ros.core.scenario.push import LARGEST_FORCE
from dmp_cpg_ros.nodes.framework import parameter_follower
from dmp_cpg_ros.nodes.framework.gaits import follow_gait, known_gaits
from dmp_cpg_ros.nodes.framework.writer_watch import SILENT_NS
from dmp_cpg_ros.nodes.leg_transformation import LegTransformation
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader
from dmp_cpg_ros.nodes.messages.commands import read_push_force
from dmp_cpg_ros.nodes.messages.interfaces import Interface, interface, published_by, read_by
from dmp_cpg_ros.nodes.messages.robot_state import read_imu
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.nodes.mujoco_robot import MujocoRobotNode
from dmp_cpg_ros.nodes.reference_filter import ReferenceFilter
from dmp_cpg_ros.suite_table import DRIVER, KINDS

processes, ros, ros_domain = (
    ros_processes.processes,
    ros_processes.ros,
    ros_processes.ros_domain,
)

RCLError = rclpy_implementation.RCLError

CONTROLLERS = tuple(name for name in KINDS if name != 'bag_recorder')
FOLLOWERS = ('reference_filter', 'canonical_oscillators', 'inhibition')
GARBAGE = (
    b'\x00\x00\x00\x00\x01\x02\x03',  # big-endian, cut short
    b'\x00\x01\x00\x00\x01\x02\x03',  # little-endian, cut short
    b'\xff\x42' + random.Random(7).randbytes(200),
    b'\x00\x01\x00\x00' + 16 * b'\xff',
    b'\x00\x01\x00\x00' + bytes(200_000),
)
TRANSITIONS = {getattr(Transition, name) for name in dir(Transition)
               if name.startswith('TRANSITION_')} | {9, 255}
STAMPS_NS = (4_000_000, 0, 2_147_483_000_000_000_000, 10_000_000_000, 8_000_000)


def started(processes: Processes, tmp_path: Path, kind: str, **parameters: Any) -> NodeProcess:
    """Start a node; it says when it is active."""
    if kind == 'bag_recorder':
        parameters['output'] = str(tmp_path / 'bag')
    return processes.node(kind, **parameters)


def ended(process: NodeProcess) -> None:
    """It ends as it should, and nothing went wrong before."""
    process.interrupt()
    assert process.wait() == 0, str(process)
    assert 'Traceback' not in process.output, process
    assert 'FATAL' not in process.output, process


def raw_publishers(ros: Ros, kind: str) -> dict[Any, Interface]:
    """Publishers on all that a node reads with its default parameters, matched."""
    own = {topic.name for topic in published_by(kind)}
    publishers = {
        ros.node.create_publisher(topic.type, topic.name, topic.publisher_qos): topic
        for topic in read_by(kind)
        if topic.name not in own and kind not in topic.sometimes
    }
    ros.spin_until(lambda: all(publisher.get_subscription_count() for publisher in publishers))
    return publishers


@pytest.mark.parametrize('kind', CONTROLLERS)
def test_bytes_that_are_no_message_are_dropped_and_told_and_false_stamps_end_nothing(
    processes: Processes, ros: Ros, tmp_path: Path, kind: str
) -> None:
    """Stamps of zero, of the far future, and back, on messages that are right otherwise."""
    process = started(processes, tmp_path, kind)
    process.wait_for_output('active')
    reports = ros.collect(DiagnosticArray, '/diagnostics', 100)
    publishers = raw_publishers(ros, kind)
    told: dict[str, str] = {}

    def all_told() -> bool:
        for data in GARBAGE:
            for publisher in publishers:
                with contextlib.suppress(RCLError):  # what does not fit into a type of fixed size
                    publisher.publish(data)
        for report in reports:
            status = report.status[0]
            if status.level == DiagnosticStatus.WARN:
                told.update({entry.key: entry.value for entry in status.values})
        return all(f'rejected.{topic.name}' in told for topic in publishers.values())

    ros.spin_until(all_told, what=lambda: f'{told}; {process}')
    for topic in publishers.values():
        assert int(told[f'rejected.{topic.name}']) >= 1
    for stamp in STAMPS_NS:
        for publisher, topic in publishers.items():
            publisher.publish(still(topic, stamp))
        state = ros.call(GetState, f'{kind}/get_state', GetState.Request())
        assert state.current_state.label == 'active', process
    ended(process)


def still(topic: Interface, stamp_ns: int) -> Any:
    """Message of a robot that stands, with a stamp."""
    message = topic.type()
    if topic.name in ENTRY_NAMES:
        message.name = list(ENTRY_NAMES[topic.name])
        for field in ('position', 'velocity', 'effort'):
            setattr(message, field, [0.0] * len(message.name))
    if hasattr(message, 'header'):
        set_stamp(message.header.stamp, stamp_ns)
    return message


@pytest.mark.parametrize('kind', FOLLOWERS)
def test_false_news_of_parameters_are_refused(
    processes: Processes, ros: Ros, tmp_path: Path, kind: str
) -> None:
    process = started(processes, tmp_path, kind)
    process.wait_for_output('active')
    publisher = ros.node.create_publisher(
        ParameterEvent, '/parameter_events', qos_profile_parameter_events)
    reports = ros.collect(DiagnosticArray, '/diagnostics', 100)
    ros.spin_until(lambda: publisher.get_subscription_count() > 0)
    owner, name = ('inhibition', 'region_radius') if kind == 'canonical_oscillators' else (
        'canonical_oscillators', 'gait')
    value = ParameterValue(type=4, string_value='gallop') if name == 'gait' else ParameterValue(
        type=3, double_value=1e300)
    counts: set[str] = set()

    def told() -> bool:
        # Again and again: a reader that the publisher knows may not know the publisher yet.
        for false in (ParameterValue(type=77), value):
            publisher.publish(ParameterEvent(
                node=f'/{owner}', changed_parameters=[ParameterMessage(name=name, value=false)]))
        publisher.publish(GARBAGE[0])
        counts.update(entry.value for report in reports for entry in report.status[0].values
                      if entry.key == 'rejected./parameter_events')
        return bool(counts)

    ros.spin_until(told, what=lambda: str(process))
    answer = ros.call(GetParameters, f'{kind}/get_parameters', GetParameters.Request(names=[name]))
    kept = answer.values[0]
    assert kept.string_value == 'amble' if name == 'gait' else 0.0 < kept.double_value < 2.0
    ended(process)


def test_every_false_news_of_parameters_is_counted(ros: Ros, follower: Any) -> None:
    publisher = ros.node.create_publisher(
        ParameterEvent, '/parameter_events', qos_profile_parameter_events)
    ros.spin_until(lambda: publisher.get_subscription_count() > 0)
    counted = follower.health.rejected
    for number, false in enumerate(
            (ParameterValue(type=77), ParameterValue(type=4, string_value='gallop')), 1):
        publisher.publish(ParameterEvent(node='/canonical_oscillators', changed_parameters=[
            ParameterMessage(name='gait', value=false)]))
        ros.spin_until(lambda number=number: counted.get('/parameter_events') == number,
                       what=lambda: str(counted))
    assert follower.get_parameter('gait').value == 'amble'


def test_a_node_tells_of_all_its_parameters_at_once(
        ros: Ros, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else one that is restarted would wake all that follow it a hundred times."""
    told, publish = list[Any](), Publisher.publish
    monkeypatch.setattr(Publisher, 'publish', lambda self, message: (
        told.append(message), publish(self, message)))
    node = ReferenceFilter('teller', context=ros.context)
    try:
        events = [message for message in told if isinstance(message, ParameterEvent)]
        *_, own = events
        assert {entry.name for entry in own.new_parameters} == set(node.parameter_table().fields)
        assert sum(len(event.new_parameters) > 1 for event in events) == 1
    finally:
        node.destroy_node()


@pytest.fixture
def follower(ros: Ros) -> Any:
    """A reference filter in this process."""
    node = ReferenceFilter('follower', context=ros.context)
    node.start()
    ros.executor.add_node(node)
    yield node
    node.close()
    ros.executor.remove_node(node)
    node.destroy_node()


def bare_node(ros: Ros, name: str) -> Node:
    """Return a node of a name, without the services that a node usually has."""
    node = Node(name, context=ros.context, start_parameter_services=False)
    ros.nodes.append(node)
    ros.executor.add_node(node)
    return node


def test_news_that_the_owner_has_not_told_change_nothing(ros: Ros, follower: Any) -> None:
    """The follower asks the owner, which has another gait than the news say."""
    gait = 'amble'

    def answer(request: Any, response: Any) -> Any:
        response.values = [
            ParameterValue(type=4, string_value=gait) if name == 'gait'
            else follower.get_parameter(name).get_parameter_value() for name in request.names]
        return response

    owner = bare_node(ros, 'canonical_oscillators')
    owner.create_service(GetParameters, 'canonical_oscillators/get_parameters', answer)
    publisher = ros.node.create_publisher(
        ParameterEvent, '/parameter_events', qos_profile_parameter_events)
    ros.spin_until(lambda: publisher.get_subscription_count() > 0)
    news = ParameterEvent(node='/canonical_oscillators', changed_parameters=[
        ParameterMessage(name='gait', value=ParameterValue(type=4, string_value='trot'))])

    def told() -> bool:
        publisher.publish(news)
        return bool(follower.health.rejected.get('/parameter_events', 0) > 1)

    ros.spin_until(told)
    assert follower.get_parameter('gait').value == 'amble'
    gait = 'trot'  # now they are true

    def followed() -> bool:
        publisher.publish(news)
        return bool(follower.get_parameter('gait').value == 'trot')

    ros.spin_until(followed)


def test_parameter_requests_without_end_are_not_all_looked_at(ros: Ros, follower: Any) -> None:
    looked_at: list[Any] = []
    follower.check_parameters = looked_at.append
    name = 'follower/set_parameters'
    client = ros.node.create_client(SetParameters, name)
    ros.spin_until(client.service_is_ready)
    reasons: list[str] = []
    for k in range(100):
        answer = ros.call(SetParameters, name, SetParameters.Request(parameters=[
            Parameter('allow_uncertified', value=bool(k % 2)).to_parameter_msg()]))
        reasons += [result.reason for result in answer.results if not result.successful]
    assert len(looked_at) + len(reasons) >= 100
    assert 'too many' in reasons[-1] and len(looked_at) >= 20
    many = SetParameters.Request(parameters=[
        Parameter('max_speed', value=1.0).to_parameter_msg()] * 1000)
    answer = ros.call(SetParameters, name, many)
    assert 'too many' in answer.results[0].reason and len(answer.results) < 1000
    assert follower.health.rejected['set_parameters'] > len(reasons)


def test_no_more_parameters_are_told_than_ticks_can_bear(ros: Ros, follower: Any) -> None:
    name, known = 'follower/get_parameters', list(follower._parameters)
    every = ros.call(GetParameters, name, GetParameters.Request(names=known))
    assert len(every.values) == len(known)
    assert not ros.call(GetParameters, name, GetParameters.Request(
        names=['max_speed'] * 100_000)).values
    assert follower.health.rejected['get_parameters'] >= 1
    said = follower.health.status('', {}, periodic=True).status[0].message
    assert 'at most 200 at once' in said and f'asked by /{ros.node.get_name()}' in said
    for kind, service, what in ((DescribeParameters, 'describe_parameters', 'names'),
                                (GetParameterTypes, 'get_parameter_types', 'names'),
                                (ListParameters, 'list_parameters', 'prefixes')):
        before = follower.health.rejected['get_parameters']
        ros.call(kind, f'follower/{service}', kind.Request(**{what: ['a'] * 1000}))
        assert follower.health.rejected['get_parameters'] > before
    before, asked = follower.health.rejected['get_parameters'], 0
    while follower.health.rejected['get_parameters'] == before:
        ros.call(GetParameters, name, GetParameters.Request(names=['max_speed'] * 200))
        asked += 200
        assert asked < 1_000_000
    assert asked >= 2000


def test_a_second_server_of_a_service_is_named_and_its_answers_are_not_believed(
        ros: Ros, follower: Any) -> None:
    owner, stranger = bare_node(ros, 'canonical_oscillators'), bare_node(ros, 'stranger')
    told: list[str] = []

    def answering(gait: str) -> Any:
        def answer(request: Any, response: Any) -> Any:
            told.append(gait)
            response.values = [
                ParameterValue(type=4, string_value=gait) if name == 'gait' else
                follower.get_parameter(name).get_parameter_value() for name in request.names]
            return response

        return answer

    service = 'canonical_oscillators/get_parameters'
    forged = stranger.create_service(GetParameters, service, answering('trot'))
    stranger.create_service(Trigger, 'follower/ready', lambda _, response: response)
    ros.spin_until(lambda: service in follower.health.rejected)
    assert told and follower.get_parameter('gait').value == 'amble'
    assert 'served by /stranger' in follower.health.status('', {}, periodic=True).status[0].message

    def named() -> bool:
        follower.health.stamp_ns += 1_000_000_000
        follower.end_tick()
        return any('ready is not only of this node; served by /stranger' in text
                   for _, text in follower.health._problems.values())

    ros.spin_until(named)
    stranger.destroy_service(forged)
    owner.create_service(GetParameters, service, answering('pace'))
    ros.spin_until(lambda: follower.get_parameter('gait').value == 'pace')


def test_who_may_have_sent_what_names_no_sender_is_told(ros: Ros, follower: Any) -> None:
    """Of requests and events, by the graph; the suite's own nodes are no suspects."""
    own = Node('inhibition', context=ros.context)
    own.create_client(SetParameters, 'follower/set_parameters')
    own.create_publisher(ParameterEvent, '/parameter_events', qos_profile_parameter_events)

    def told(what: str) -> str:
        message: str = follower.health.status('', {}, periodic=True).status[0].message
        assert what in message
        return message

    stranger = f'/{ros.node.get_name()}'
    ros.call(SetParameters, 'follower/set_parameters', SetParameters.Request(
        parameters=[Parameter('max_speed', value=1.0).to_parameter_msg()] * 1000))
    assert told('too many changes').endswith(f'; asked by {stranger}')
    ros.call(ChangeState, 'follower/change_state',
             ChangeState.Request(transition=Transition(id=99)))
    assert told('transition 99').endswith(f'; asked by {stranger}')
    publisher = ros.node.create_publisher(
        ParameterEvent, '/parameter_events', qos_profile_parameter_events)
    ros.spin_until(lambda: publisher.get_subscription_count() > 0)
    publisher.publish(ParameterEvent(node='/canonical_oscillators', changed_parameters=[
        ParameterMessage(name='gait', value=ParameterValue(type=77))]))
    ros.spin_until(lambda: '/parameter_events' in follower.health.rejected)
    said = told('cannot be read')
    assert f'may come from {stranger}' in said and '/inhibition' not in said
    own.destroy_node()


def test_huge_messages_leave_no_memory_behind(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    """Of each message its reader would keep the room otherwise."""
    process = started(processes, tmp_path, 'reference_filter')
    process.wait_for_output('active')
    huge = b'\x00\x01\x00\x00' + bytes(10_000_000)
    publisher = ros.node.create_publisher(
        JointState, 'joint_states', QoSProfile(depth=50, reliability=ReliabilityPolicy.RELIABLE))
    ros.spin_until(lambda: publisher.get_subscription_count() > 0)

    def resident_mb() -> float:
        pages = int(Path(f'/proc/{process.pid}/statm').read_text().split()[1])
        return 1e-6 * pages * os.sysconf('SC_PAGE_SIZE')

    before = resident_mb()
    for _ in range(15):
        for data in (*[huge[:300]] * 20, huge, *[huge[:300]] * 20):
            publisher.publish(data)
        assert publisher.wait_for_all_acked(Duration(seconds=DEADLINE_S))
    process.wait_for_output('joint_states')  # dropped, or of whom
    ros.spin_until(lambda: resident_mb() < before + 80.0, what=lambda: str(resident_mb()))
    ended(process)


def test_a_topic_has_one_writer(ros: Ros, follower: Any) -> None:
    """The robot is heard, a second writer is refused and named, and a new robot takes over."""
    topic = interface('joint_states')
    ticks: list[int] = []
    follower.on_tick = lambda stamp_ns, values: ticks.append(stamp_ns // 4_000_000)
    nodes = {name: Node(name, context=ros.context) for name in ('mujoco_robot', 'intruder')}
    writers = {name: node.create_publisher(topic.type, topic.name, topic.publisher_qos)
               for name, node in nodes.items() if name == 'mujoco_robot'}
    sent = dict.fromkeys(nodes, 0)

    def send(name: str, tick: int) -> None:
        writers[name].publish(still(topic, 4_000_000 * tick))
        sent[name] += 1

    def heard(count: int) -> None:
        ros.spin_until(lambda: len(ticks) + follower.health.rejected.get('joint_states', 0)
                       >= count, what=lambda: f'{ticks} {follower.health.rejected}')

    ros.spin_until(lambda: writers['mujoco_robot'].get_subscription_count() > 0)
    for tick in range(100, 200):
        send('mujoco_robot', tick)
        heard(sent['mujoco_robot'])
    writers['intruder'] = nodes['intruder'].create_publisher(
        topic.type, topic.name, topic.publisher_qos)
    ros.spin_until(lambda: writers['intruder'].get_subscription_count() > 0)
    for tick in range(200, 220):
        send('intruder', tick)
        heard(sum(sent.values()))
        send('mujoco_robot', tick)
        heard(sum(sent.values()))
    assert ticks == list(range(100, 220))
    assert follower.health.rejected['joint_states'] == 20
    problem = follower.health.status('', {}, periodic=False).status[0].message
    assert 'joint_states is published by /intruder too' in problem
    # The robot is gone: the intruder does not take over, and when it is gone a new robot does.
    nodes['mujoco_robot'].destroy_node()
    silent_ns = time.time_ns() + 2 * SILENT_NS
    ros.spin_until(lambda: time.time_ns() > silent_ns)
    for tick in range(220, 230):
        send('intruder', tick)
        heard(sum(sent.values()))
    assert ticks[-1] == 219
    nodes['intruder'].destroy_node()
    nodes['mujoco_robot'] = robot = Node('mujoco_robot', context=ros.context)
    writers['mujoco_robot'] = robot.create_publisher(topic.type, topic.name, topic.publisher_qos)
    ros.spin_until(lambda: writers['mujoco_robot'].get_subscription_count() > 0)
    tick = 0

    def taken_over() -> bool:
        nonlocal tick
        tick += 1
        send('mujoco_robot', tick)
        heard(sum(sent.values()))
        return 219 not in ticks[-1:]

    ros.spin_until(taken_over)
    assert ticks[-1] == tick
    robot.destroy_node()


@pytest.mark.parametrize('set_by_s', [-3600, 3600])
def test_a_time_of_day_that_is_set_makes_nobody_a_stranger(
        follower: Any, monkeypatch: pytest.MonkeyPatch, set_by_s: int) -> None:
    """The writer is heard on, and after its death whoever takes its place."""
    now_ns, set_ns, taken = 10**12, 10**18, list[Any]()
    monkeypatch.setattr(time, 'monotonic_ns', lambda: now_ns)
    monkeypatch.setattr(time, 'time_ns', lambda: set_ns + now_ns)
    topic = interface('joint_states')
    receive = follower.writers.only(topic, taken.append, serialized_reader(topic.type))

    def told(number: int, tick: int) -> None:
        nonlocal now_ns
        now_ns += 4_000_000
        receive(serialize_message(still(topic, 4_000_000 * tick)),
                {'publication_sequence_number': number, 'received_timestamp': time.time_ns()})

    for tick in range(1, 101):
        told(tick, tick)
    set_ns += set_by_s * 10**9
    for tick in range(101, 201):
        told(tick, tick)
    now_ns += 2 * SILENT_NS
    for number in range(1, 21):
        told(number, 500 + number)
    assert len(taken) == 220
    assert 'joint_states' not in follower.health.rejected


def test_several_who_command_are_told(ros: Ros, follower: Any) -> None:
    topic = interface('cmd_vel')
    nodes = [Node(name, context=ros.context) for name in ('teleop', 'joystick')]
    writers = [node.create_publisher(topic.type, topic.name, topic.publisher_qos)
               for node in nodes]
    ros.spin_until(lambda: all(writer.get_subscription_count() for writer in writers))

    def told(by: Sequence[Any]) -> bool:
        for writer in by:
            writer.publish(Twist())
        return bool(follower.health.has_problem('writers of cmd_vel'))

    for _ in range(50):
        assert not told(writers[:1])
    ros.spin_until(lambda: told(writers))
    problem = follower.health.status('', {}, periodic=False).status[0].message
    assert 'several publish cmd_vel (joystick, teleop): the newest acts' in problem
    ros.spin_until(lambda: not told(writers[:1]))
    for node in nodes:
        node.destroy_node()


def test_a_stranger_on_a_topic_that_nobody_reads_is_told(ros: Ros, follower: Any) -> None:
    """Its writer tells, as in a process whose nodes do not listen to the world outside."""
    topic, node = interface('reference'), Node('intruder', context=ros.context)
    node.create_publisher(topic.type, topic.name, topic.publisher_qos)
    own = Node('reference_filter', context=ros.context)
    own.create_publisher(topic.type, topic.name, topic.publisher_qos)
    ros.spin_until(lambda: follower.health.has_problem('writer of reference'))
    problem = follower.health.status('', {}, periodic=False).status[0].message
    assert 'reference is published by /' in problem and '/intruder' in problem
    node.destroy_node()
    own.destroy_node()
    ros.spin_until(lambda: not follower.health.has_problem('writer of reference'))


def test_a_false_answer_about_parameters_is_refused(
        ros: Ros, monkeypatch: pytest.MonkeyPatch) -> None:
    def answer(request: Any, response: Any) -> Any:
        response.values = [ParameterValue(type=77) for _ in request.names]
        return response

    monkeypatch.setattr(parameter_follower, 'ASK_EVERY_S', 0.05)
    ros.node.create_service(GetParameters, 'canonical_oscillators/get_parameters', answer)
    node = ReferenceFilter('follower', context=ros.context)
    node.start()
    ros.executor.add_node(node)
    ros.spin_until(lambda: node.health.rejected.get('canonical_oscillators/get_parameters', 0) > 1)
    node.close()
    ros.executor.remove_node(node)
    node.destroy_node()


@pytest.mark.parametrize('kind', KINDS)
def test_transitions_that_are_not_possible_are_refused(
    processes: Processes, ros: Ros, tmp_path: Path, kind: str
) -> None:
    """Every number that means one somewhere, in every state, of one kind of node, whose base all
    share, every number at all; then the legal sequence still works.
    """
    numbers = set(range(256)) if kind == 'leg_transformation' else TRANSITIONS
    process = started(processes, tmp_path, kind, autostart=False)
    change = ros.node.create_client(ChangeState, f'{kind}/change_state')
    ros.spin_until(change.service_is_ready)
    sequence = [
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
        Transition.TRANSITION_DEACTIVATE,
        Transition.TRANSITION_ACTIVATE,
        Transition.TRANSITION_ACTIVE_SHUTDOWN,
        None,
    ]
    for following in sequence:
        state = ros.call(GetState, f'{kind}/get_state', GetState.Request()).current_state.id
        possible = ros.call(GetAvailableTransitions, f'{kind}/get_available_transitions',
                            GetAvailableTransitions.Request())
        legal = {entry.transition.id for entry in possible.available_transitions}
        for number in sorted(numbers - legal):
            future = change.call_async(ChangeState.Request(transition=Transition(id=number)))
            ros.spin_until(future.done, what=lambda: str(process))
            assert not future.result().success, number
        now = ros.call(GetState, f'{kind}/get_state', GetState.Request()).current_state.id
        assert now == state
        if following is not None:
            request = ChangeState.Request(transition=Transition(id=following))
            assert ros.call(ChangeState, f'{kind}/change_state', request).success, process
    ended(process)


@pytest.mark.parametrize(('kind', 'numbers'), [*zip(KINDS, cycle((
    (signal.SIGINT, signal.SIGTERM, signal.SIGINT),
    (signal.SIGTERM, signal.SIGINT, signal.SIGTERM))), strict=False)], ids=lambda given: (
        given if isinstance(given, str) else given[0].name))
def test_an_interrupt_ends_a_lone_node_without_complaint(
    processes: Processes, ros: Ros, tmp_path: Path, kind: str, numbers: tuple[int, ...]
) -> None:
    """When its node is in the graph, when it is active, and while it publishes; every kind and
    every moment has both signals.
    """
    outputs = [topic for topic in published_by(kind) if topic.name in ('/diagnostics', '/clock')]
    for moment, number in enumerate(numbers):
        process = started(processes, tmp_path / str(moment), kind)
        if moment == 0:
            ros.spin_until(lambda: kind in ros.node.get_node_names())
        elif moment == 1:
            process.wait_for_output('active')
        else:
            process.wait_for_output('active')
            seen = [ros.collect(topic.type, topic.name, 100) for topic in outputs]
            if kind == 'mujoco_robot':
                ros.spin_until(lambda seen=seen: all(seen))
        process.signal(number)
        assert process.wait() == 0, str(process)
        assert 'Traceback' not in process.output, process
        assert 'FATAL' not in process.output, process


@pytest.mark.parametrize(('row', 'value'), [
    ('fl', -1e6), ('fl', 1e300), ('rr', math.nan), ('region_radius', 1e300),
    ('region_radius', -1.0), ('requested', 0.5), ('at_rest', -1.0), ('opposite', 2.0),
    ('share', 0.0), ('share', 1.5), ('share', math.nan),
    ('quickness', 0.9), ('quickness', 99.0), ('quickness', math.nan),
    ('lead', -0.004), ('lead', 0.3), ('lead', math.nan),
])
def test_an_inhibition_that_no_parameters_allow_is_refused(row: str, value: float) -> None:
    message = JointState(name=list(GAIN_ROWS),
                         position=[400.0] * 4 + [0.3, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.024])
    read = InhibitionGainsReader().read(message)
    assert read.gains.tolist() == [400.0] * 4 and read.requested and not read.at_rest
    message.position[GAIN_ROWS.index(row)] = value
    with pytest.raises(DataError):
        InhibitionGainsReader().read(message)


def test_a_turn_rate_that_cannot_be_is_none() -> None:
    """Its square would overflow in whatever filters it."""
    message = Imu()
    message.angular_velocity.x, message.linear_acceleration.z = 1e160, 9.81
    for read in (message, serialized_reader(Imu)(serialize_message(message))):
        rate, force = read_imu(read)
        assert np.isnan(rate).tolist() == [True, False, False]
        assert force.tolist() == [0.0, 0.0, 9.81]


def test_a_push_that_no_simulation_bears_is_refused() -> None:
    message = WrenchStamped()
    message.wrench.force.y = -LARGEST_FORCE
    assert read_push_force(message).force[1] == -LARGEST_FORCE
    message.wrench.force.y = -1.01 * LARGEST_FORCE
    with pytest.raises(DataError, match='15000 N'):
        read_push_force(message)


@pytest.fixture
def robot(ros: Ros) -> Any:
    """A robot in this process whose gate is closed: the test makes its ticks."""
    node = MujocoRobotNode(context=ros.context, parameter_overrides=[
        Parameter('gated', value=True)])
    node.start()
    yield node
    node.close()
    node.destroy_node()


def test_a_robot_whose_simulation_diverges_is_put_back(robot: MujocoRobotNode, ros: Ros) -> None:
    home = robot._state.joint_position.copy()
    for _ in range(3):
        robot._step()
    before = robot._state.time_ns
    robot._robot.data.qvel[:] = 1e40  # type: ignore[attr-defined]
    robot._step()
    robot._publish_state()
    assert robot._state.time_ns == before + robot._tick_ns
    np.testing.assert_allclose(robot._state.joint_position, home)
    status = robot.health.status('active', {}, periodic=False).status[0]
    assert status.level == DiagnosticStatus.ERROR
    assert 'unstable' in status.message
    assert 'start pose' in status.message
    robot._step()
    assert robot._state.time_ns == before + 2 * robot._tick_ns


def test_silence_that_flickers_is_told_once(
    robot: MujocoRobotNode, capfd: pytest.CaptureFixture[str]
) -> None:
    """Legs that are heard now and then for two seconds, and then at every tick."""
    home = robot._state.joint_position.reshape(len(LEGS), 3)
    legs = {leg: JointTargets(angles, np.zeros(3), np.zeros(3))
            for leg, angles in zip(LEGS, home, strict=True)}
    every = round(2 * robot._options.target_timeout * 1e9) // robot._tick_ns

    def hear() -> None:
        for leg, targets in legs.items():
            robot._guard.accept(leg, robot._state.time_ns, targets)

    for k in range(1, 501):
        if k % every == 0:
            hear()
        robot._step()
    assert capfd.readouterr().err.count('no targets from') == 1
    for _ in range(300):
        hear()
        robot._step()
    assert not robot.health.has_problem('silent')


def test_targets_from_the_future_do_not_hold_the_robot(robot: MujocoRobotNode) -> None:
    message = still(interface('joint_targets'), 1_000_000_000_000)
    with pytest.raises(DataError, match='ahead of the clock'):
        robot._on_targets(message)
    assert robot._guard.stamps == [None] * 4


def test_a_leg_tells_the_gait_that_it_follows(ros: Ros) -> None:
    """The parameter is what is in force, and who asks for another one is sent to its owner."""
    node = LegTransformation('leg', namespace='/robot1', context=ros.context)
    node.start()
    follow_gait(node, known_gaits(node).gaits['trot'].scaled(1.25))
    assert node.get_parameter('gait').value == 'trot'
    result = node.set_parameters([Parameter('gait', value='amble')])[0]
    assert not result.successful
    assert 'belongs to canonical_oscillators' in result.reason
    assert 'param set /robot1/canonical_oscillators gait' in result.reason
    assert node.get_parameter('gait').value == 'trot'
    node.close()
    node.destroy_node()


def test_the_suite_walks_on_among_garbage(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    """All nodes in real time, and garbage on every topic ten times a second."""
    kinds = [name for name in CONTROLLERS if name not in ('leg_transformation', DRIVER)]
    gated, light = {'mujoco_robot': {'gated': True}}, tmp_path / 'light.yaml'
    light.write_text(  # a rate which a loaded machine can keep
        f'/**: {{ros__parameters: {{control_rate: {SHARED_HZ}}}}}\n', encoding='utf-8')
    given = ('--params-file', str(light))
    nodes = [processes.node(kind, *given, **gated.get(kind, {})) for kind in kinds]
    nodes += [processes.node('leg_transformation', *given, leg=leg) for leg in LEGS]
    for node in nodes:
        node.wait_for_output('active')
    places: list[Any] = ros.collect(Odometry, 'ground_truth', interface('ground_truth').reader_qos)
    reports = ros.collect(DiagnosticArray, '/diagnostics', 1000)
    topics = {topic.name: topic for kind in kinds for topic in read_by(kind)
              if kind not in topic.sometimes and topic.name != '/clock'}
    publishers = {name: ros.node.create_publisher(topic.type, name, topic.publisher_qos)
                  for name, topic in topics.items()}
    for node in (*kinds, *(f'leg_transformation_{leg}' for leg in LEGS)):
        ros.spin_until(
            lambda node=node: ros.call(Trigger, f'{node}/ready', Trigger.Request()).success)
    gate = interface('mujoco_robot/advance_until')
    opener = ros.node.create_publisher(gate.type, gate.name, gate.publisher_qos)
    ros.spin_until(lambda: opener.get_subscription_count() > 0)
    opener.publish(Clock(clock=Time(sec=10_000)))
    # Where targets come late at first the robot looks after itself, which stops the gait.
    ros.spin_until(lambda: len(places) > SHARED_HZ)
    # The service needs a tick of the oscillators and of the reference, which may come later.
    ros.spin_until(lambda: ros.call(SetBool, 'inhibit', SetBool.Request(data=False)).success)
    command, rounds = Twist(), 0
    command.linear.x = 0.4

    def walked() -> bool:
        nonlocal rounds
        if len(places) // (SHARED_HZ / 10) > rounds:
            rounds = int(len(places) // (SHARED_HZ / 10))
            for publisher in publishers.values():
                publisher.publish(GARBAGE[rounds % 2])
            publishers['cmd_vel'].publish(command)
        assert all(node.running for node in nodes), nodes
        return bool(places[-1].pose.pose.position.x > 0.5)

    ros.spin_until(walked, deadline_s=4 * ros_processes.DEADLINE_S,
                   what=lambda: f'half a metre, after {len(places)} ticks at {places[-1].pose} '
                                f'of {nodes}')
    assert places[-1].pose.pose.position.z > 0.2
    trot = Parameter('gait', value='trot').to_parameter_msg()
    answer = ros.call(SetParameters, 'canonical_oscillators/set_parameters',
                      SetParameters.Request(parameters=[trot]))
    assert answer.results[0].successful, answer.results[0].reason
    for node in ('posture_control', 'leg_transformation_rr'):
        ros.spin_until(lambda node=node: walked() and ros.call(
            GetParameters, f'{node}/get_parameters', GetParameters.Request(names=['gait'])
        ).values[0].string_value == 'trot')
    counted = {entry.key for report in reports for entry in report.status[0].values}
    assert {f'rejected.{name}' for name in publishers} <= counted
    for node in nodes:
        ended(node)
