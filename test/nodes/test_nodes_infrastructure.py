# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What all nodes stand on: interfaces, parameters, lifecycle, diagnostics, executors."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy.experimental
import ros_processes
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSCompatibility, ReliabilityPolicy, qos_check_compatible
from rclpy.task import Future
from ros_processes import NodeProcess, Processes, Ros
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from dmp_cpg_ros.configuration import find_config, node_parameters
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES
from dmp_cpg_ros.nodes.framework import middleware
from dmp_cpg_ros.nodes.framework.execution import make_executor, spin, spin_in_slices
from dmp_cpg_ros.nodes.framework.health import LOG_EVERY_S, NodeHealth
from dmp_cpg_ros.nodes.framework.local_delivery import LocalDelivery
from dmp_cpg_ros.nodes.framework.parameters import (
    LockStepParameters,
    NodeParameters,
    ParameterTable,
    help_text,
)
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages.commands import read_twist
from dmp_cpg_ros.nodes.messages.interfaces import (
    INTERFACES,
    TOPICS,
    expected_count,
    interface,
    published_by,
    read_by,
    served_by,
)
from dmp_cpg_ros.nodes.messages.reference import ReferenceWriter
from dmp_cpg_ros.nodes.messages.values import header_ns, set_stamp
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite_table import KINDS

processes, ros, ros_domain = ros_processes.processes, ros_processes.ros, ros_processes.ros_domain

TICK = 4_000_000
MIDDLE = 1_500_000_000


@dataclass(frozen=True)
class OtherParameters(Parameters):
    """Parameters of the test's node."""

    count: int = parameter(3, 'a whole number', minimum=1, maximum=9)
    words: tuple[str, ...] = parameter(('a', 'b'), 'some words', choices=('a', 'b', 'c'))
    gains: tuple[float, ...] = parameter((1.0, 2.0), 'some numbers', unit='1/s', minimum=0.0)
    upper: float = parameter(5.0, 'a number not below count', minimum=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.upper < self.count:
            raise ParameterError(f'upper = {self.upper} must not be below count = {self.count}')


class Relay(SuiteNode):
    """Publishes the newest command at every tick.

    And more that --help does not say.
    """

    KIND = 'reference_filter'
    PARAMETER_SETS = (LockStepParameters, ReferenceParameters, OtherParameters)
    CHANGEABLE = ('alpha_r', 'count', 'upper', 'gains')
    fails_with: Exception | None = None

    def configure(self) -> None:
        if self.fails_with:
            raise self.fails_with
        self.command = (0.0, 0.0, 0.0)
        self.changes: list[tuple[int, float, int]] = []
        self.out, self.writer = self.publisher('reference'), ReferenceWriter()
        self.match('joint_states', {'joint_states': lambda message: None})
        self.listen('cmd_vel', self.on_command, command=True)

    def on_command(self, message: Any) -> None:
        self.command = read_twist(message)

    def on_parameters(self) -> None:
        self.changes.append((self.health.ticks, self.parameters_of(ReferenceParameters).alpha_r,
                             self.parameters_of(OtherParameters).count))

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        self.out.publish(self.writer.fill(stamp_ns, np.array(self.command)))

    def check_parameters(self, sets: Any) -> None:
        if sets[ReferenceParameters].alpha_r == 5.5:
            raise ParameterError('alpha_r = 5.5 would lose the certificate')

    def diagnostic_values(self) -> dict[str, Any]:
        return {'v_x': self.command[0]}


def overrides(**values: Any) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]


def relay(ros: Ros, **values: Any) -> Relay:
    node = Relay('relay', context=ros.context, parameter_overrides=overrides(**values))
    ros.nodes.append(node)
    return node


@pytest.fixture
def started(ros: Ros) -> Iterator[Relay]:
    """An active relay whose callbacks run when the test's do."""
    node = relay(ros)
    node.start()
    ros.executor.add_node(node)
    yield node
    node.close()
    ros.executor.remove_node(node)
    node.destroy_node()


class Robot:
    """The other end of the relay."""

    def __init__(self, ros: Ros) -> None:
        self.ros = ros
        self.joints = self._publisher('joint_states')
        self.commands = self._publisher('cmd_vel')
        self.references: list[TwistStamped] = ros.collect(
            TwistStamped, 'reference', interface('reference').reader_qos)
        self.reports: list[DiagnosticArray] = ros.collect(DiagnosticArray, '/diagnostics', 100)
        self.k = 0
        ros.spin_until(lambda: self.joints.get_subscription_count()
                       and self.commands.get_subscription_count())

    def _publisher(self, name: str) -> Any:
        topic = interface(name)
        return self.ros.node.create_publisher(topic.type, topic.name, topic.publisher_qos)

    def tick(self) -> TwistStamped:
        """Publish a tick and return the reference that it leads to."""
        self.publish_tick()
        stamps = [self.k * TICK]
        self.ros.spin_until(lambda: [header_ns(m) for m in self.references[-1:]] == stamps)
        return self.references[-1]

    def publish_tick(self) -> None:
        """Publish the next tick."""
        self.k += 1
        message = JointState(name=list(JOINT_NAMES), position=[0.0] * 12, velocity=[0.0] * 12)
        set_stamp(message.header.stamp, self.k * TICK)
        self.joints.publish(message)

    def send(self, v_x: float) -> None:
        """Send a command; it is in the reader's queue when this returns."""
        message = interface('cmd_vel').type()
        message.linear.x = v_x
        self.commands.publish(message)
        assert self.commands.wait_for_all_acked()

    def status(self) -> tuple[int, str, dict[str, str]]:
        """Level, message and values of the last report of the relay."""
        found = [r.status[0] for r in self.reports if r.status[0].name == 'relay']
        return found[-1].level, found[-1].message, {v.key: v.value for v in found[-1].values}


# Interfaces ------------------------------------------------------------------------------------


def test_every_topic_is_lossless_and_the_latched_ones_are_latched() -> None:
    for topic in TOPICS:
        offered = topic.publisher_qos
        assert offered.reliability == ReliabilityPolicy.RELIABLE
        assert (offered.durability == DurabilityPolicy.TRANSIENT_LOCAL) == topic.latched
        assert (offered.depth == 1) == topic.latched
        for reader in (topic.reader_qos, topic.recorder_qos):
            assert qos_check_compatible(offered, reader)[0] != QoSCompatibility.ERROR
            assert topic.latched or reader.depth >= 2 * expected_count(topic.publishers)
    assert interface('inhibition_state').latched


def test_every_node_has_its_place_in_the_table() -> None:
    for kind in tuple(KINDS):
        assert {'/diagnostics'} <= {topic.name for topic in published_by(kind)}
        assert {'~/ready'} <= {service.name for service in served_by(kind)}
        assert read_by(kind)
    for entry in INTERFACES.values():
        known = {*tuple(KINDS), 'user'}
        assert set(entry.publishers) | set(entry.subscribers) <= known
        assert set(entry.sometimes) <= set(entry.publishers) | set(entry.subscribers)
        assert entry.type_name.split('/')[1] == ('srv' if entry.service else 'msg')
    with pytest.raises(ParameterError, match='joint_states'):
        interface('joint_stats')


# Parameters ------------------------------------------------------------------------------------


@pytest.mark.parametrize(('values', 'problem'), [
    ({'alpha_r': 'fast'}, "alpha_r.*must be a number, not 'fast'"),
    ({'alpha_r': math.nan}, 'alpha_r.*nan.*0.05, 6'),
    ({'alpha_r': 6.1}, 'alpha_r.*6.1.*0.05, 6'),
    ({'alpha_R': 3.0}, "no parameter 'alpha_R'.*alpha_r"),
    ({'count': 1.5}, 'count.*whole number'),
    ({'count': True}, 'count.*whole number'),
    ({'lock_step': 1}, 'lock_step.*true or false'),
    ({'words': ['a', 'd']}, "words.*one of a, b, c, not 'd'"),
    ({'gains': [1.0, -1.0]}, 'gains'),
    ({'gains': 1.0}, 'gains.*list'),
    ({'words': []}, 'words.*empty'),
    ({'executor': 'fastest'}, 'executor.*events, single'),
    ({'count': 7}, 'upper = 5.0.*count = 7'),
])
def test_a_bad_override_is_named(ros: Ros, values: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        relay(ros, **values)


def test_overrides_take_effect_and_whole_numbers_are_numbers(ros: Ros) -> None:
    node = relay(ros, alpha_r=4, count=2, words=['c'], gains=[3, 4], use_sim_time=True)
    assert node.parameters_of(ReferenceParameters) == ReferenceParameters(alpha_r=4.0)
    assert node.parameters_of(OtherParameters) == OtherParameters(
        count=2, words=('c',), gains=(3.0, 4.0))
    assert node.get_parameter('alpha_r').value == 4.0
    node.destroy_node()


def test_values_for_all_nodes_may_be_foreign_but_not_ones_for_this_node(
        processes: Processes, tmp_path: Path) -> None:
    shared = tmp_path / 'shared.yaml'
    shared.write_text('/**:\n  ros__parameters:\n    of_another: 1.0\n    alpha_r: 2.0\n')
    own = tmp_path / 'own.yaml'
    own.write_text('reference_filter:\n  ros__parameters:\n    alpha_q: 1.0\n')
    good = processes.node('reference_filter', '--params-file', str(shared), autostart=False)
    bad = processes.node('reference_filter', '--params-file', str(own))
    assert bad.wait() == 2
    assert 'alpha_q' in bad.output and 'alpha_r' in bad.output
    session = Ros(processes.domain)
    try:
        state = session.call(GetState, 'reference_filter/get_state', GetState.Request())
        assert state.current_state.label == 'unconfigured'
    finally:
        session.end()
    assert good.running, good


def test_a_section_whose_name_is_misspelt_is_told_by_the_node_that_was_meant(
        processes: Processes, tmp_path: Path) -> None:
    """ROS passes it over without a word; one for another node of the suite is none."""
    file = tmp_path / 'misspelt.yaml'
    values = 'ros__parameters: {alpha_r: 2.0}'
    file.write_text(f'refrence_filter: {{{values}}}\ninhibition: {{{values}}}\n')
    process = processes.node('reference_filter', '--params-file', str(file))
    process.wait_for_output('active')
    assert ("has a section '/refrence_filter', which means no node; did you mean reference_filter?"
            in process.output), process
    assert process.output.count('has a section') == 1, process


def test_descriptors_tell_unit_range_and_what_may_change(ros: Ros, started: Relay) -> None:
    names = ['alpha_r', 'count', 'executor', 'words', 'max_speed']
    answer = ros.call(DescribeParameters, 'relay/describe_parameters',
                      DescribeParameters.Request(names=names))
    alpha_r, count, executor, words, max_speed = answer.descriptors
    assert '[1/s]' in alpha_r.description and not alpha_r.read_only
    limits = alpha_r.floating_point_range[0]
    assert (limits.from_value, limits.to_value) == (0.05, 6.0)
    assert (count.integer_range[0].from_value, count.integer_range[0].to_value) == (1, 9)
    assert executor.read_only and 'events, single' in executor.additional_constraints
    assert 'a, b, c' in words.additional_constraints
    assert max_speed.read_only


def change(ros: Ros, **values: Any) -> tuple[bool, str]:
    messages: Sequence[ParameterMessage] = [p.to_parameter_msg() for p in overrides(**values)]
    result = ros.call(SetParametersAtomically, 'relay/set_parameters_atomically',
                      SetParametersAtomically.Request(parameters=messages)).result
    return result.successful, result.reason


def test_changes_act_together_at_the_next_tick(ros: Ros, started: Relay) -> None:
    robot = Robot(ros)
    robot.tick()
    assert change(ros, alpha_r=6.0, count=4) == (True, '')
    assert started.parameters_of(ReferenceParameters).alpha_r == 3.0
    assert change(ros, count=5)[0]
    robot.tick()
    robot.tick()
    assert started.changes == [(2, 6.0, 5)]


def test_a_change_that_cannot_be_is_refused_with_the_reason(ros: Ros, started: Relay) -> None:
    robot = Robot(ros)
    for values, reason in (({'alpha_r': 'x'}, 'type'), ({'alpha_r': 1e9}, 'alpha_r'),
                           ({'alpha_r': math.nan}, 'alpha_r'), ({'count': 6}, 'upper = 5.0'),
                           ({'alpha_r': 5.5}, 'certificate'), ({'gains': [math.nan]}, 'gains'),
                           ({'max_speed': 0.5}, 'what may change is alpha_r, count')):
        accepted, said = change(ros, **values)
        assert not accepted and reason in said, (values, said)
    assert change(ros, count=6, upper=6.0)[0]  # together they fit
    robot.tick()
    assert started.changes == [(1, 3.0, 6)]
    assert started.parameters_of(OtherParameters).upper == 6.0


@pytest.mark.parametrize('service', [SetParameters, SetParametersAtomically])
def test_what_is_no_parameter_or_no_value_is_refused_with_what_is_valid(
        ros: Ros, started: Relay, service: Any) -> None:
    unknown, nameless, odd, good = (
        ParameterMessage(name=name, value=value) for name, value in (
            ('alpha_q', Parameter('', value=1.0).to_parameter_msg().value),
            ('', Parameter('', value=1.0).to_parameter_msg().value),
            ('alpha_r', ParameterValue(type=77)),
            ('alpha_r', Parameter('', value=6.0).to_parameter_msg().value)))
    name = 'relay/set_parameters' + '_atomically' * (service is SetParametersAtomically)
    for wrong, reason in ((unknown, "no parameter 'alpha_q'; did you mean alpha_r"),
                          (nameless, "no parameter ''; valid are"),
                          (odd, "'alpha_r' has the type 77; valid are 0 to 9")):
        answer = ros.call(service, name, service.Request(parameters=[wrong, good]))
        results = answer.results if service is SetParameters else [answer.result]
        assert not results[0].successful and reason in results[0].reason
        assert [result.successful for result in results[1:]] == [True] * (len(results) - 1)
    assert not started.has_parameter('')


def test_a_changeable_name_must_be_a_parameter() -> None:
    with pytest.raises(ParameterError, match='nothing'):
        ParameterTable((NodeParameters,), ('nothing',))


def test_help_tells_everything_without_starting_ros() -> None:
    text = help_text(Relay)
    assert 'Publishes the newest command' in text and 'And more' not in text
    for topic in (*read_by(Relay.KIND), *published_by(Relay.KIND), *served_by(Relay.KIND)):
        assert f'{topic.name} ({topic.type_name}' in text
    table = Relay.parameter_table()
    for name, field in table.fields.items():
        assert f'{name}: {field.metadata["description"]}' in text
    for part in ('[1/s]', 'default 3.0, from 0.05 to 6, changeable', 'default [a, b]',
                 'from 0 to inf'):
        assert part in text, part


# Lifecycle -------------------------------------------------------------------------------------


def test_a_node_that_is_destroyed_leaves_the_graph_though_python_still_knows_it(ros: Ros) -> None:
    # No relay: those that other tests could not make are in the graph until they are collected.
    node = Relay('leaving', context=ros.context, parameter_overrides=overrides(autostart=False))
    other = Node('other', context=ros.context)
    name = node.get_name()
    ros.spin_until(lambda: name in other.get_node_names())
    node.start()
    node.destroy_node()
    node.destroy_node()
    ros.spin_until(lambda: name not in other.get_node_names())
    other.destroy_node()


def test_the_lifecycle_makes_and_destroys_the_topics(ros: Ros) -> None:
    node = relay(ros, autostart=False)
    ros.executor.add_node(node)
    reports: list[DiagnosticArray] = ros.collect(DiagnosticArray, '/diagnostics', 100)
    ros.spin_until(lambda: node._diagnostics.get_subscription_count() > 0)
    node.start()
    topics = ('/reference', '/joint_states', '/cmd_vel')

    def entities() -> list[int]:
        names = [entity.topic_name for entity in (*node.publishers, *node.subscriptions)]
        return [names.count(topic) for topic in topics]

    def go(transition: str) -> None:
        request = ChangeState.Request()
        request.transition.label = transition
        assert ros.call(ChangeState, 'relay/change_state', request).success, transition

    expected = {'configure': ('inactive', [1, 1, 1]), 'activate': ('active', [1, 1, 1]),
                'deactivate': ('inactive', [1, 1, 1]), 'cleanup': ('unconfigured', [0, 0, 0])}
    assert entities() == [0, 0, 0]
    for transition in (*expected, *expected, 'configure', 'activate'):
        go(transition)
        label, counts = expected[transition]
        assert entities() == counts
        assert node.state_label == label == node._state_machine.current_state[1]
        ros.spin_until(lambda label=label: bool(reports) and {
            v.key: v.value for v in reports[-1].status[0].values}['state'] == label)
    go('shutdown')
    assert node.state_label == 'finalized' and entities() == [0, 0, 0]
    ros.executor.remove_node(node)
    node.destroy_node()


@pytest.mark.parametrize('failure', [ParameterError('no such gait'), RuntimeError('a bug')])
def test_a_failed_configuration_says_why_and_can_be_repeated(ros: Ros, failure: Exception) -> None:
    node = relay(ros)
    node.fails_with = failure
    with pytest.raises(type(failure), match=str(failure)):
        node.start()
    assert node.state_label == 'unconfigured' == node._state_machine.current_state[1]
    node.fails_with = None
    node.start()
    assert node.active
    node.destroy_node()


def test_nothing_enters_an_inactive_node_but_what_is_latched(ros: Ros, started: Relay) -> None:
    robot, seen = Robot(ros), []
    latched = started.listen('inhibition_state', seen.append)
    started.trigger_deactivate()
    robot.send(1.0)
    state = interface('inhibition_state')
    sender = ros.node.create_publisher(state.type, state.name, state.publisher_qos)
    sender.publish(DiagnosticArray())
    ros.spin_until(lambda: bool(seen))
    assert latched in started.subscriptions
    assert started.command == (0.0, 0.0, 0.0)
    started.trigger_activate()
    robot.send(0.25)
    assert robot.tick().twist.linear.x == 0.25


class Matching(Relay):
    """Ticks with foot contacts and joints, of which the latter come last."""

    def configure(self) -> None:
        self.command, self.stamps = (0.0, 0.0, 0.0), []
        self.match('joint_states', dict.fromkeys(('foot_contacts', 'joint_states'), header_ns))

    def on_tick(self, stamp_ns: int, values: dict[str, int]) -> None:
        self.stamps.append(values)


def test_only_the_last_message_of_a_tick_wakes_and_the_others_are_taken_without_it(
        ros: Ros) -> None:
    node = Matching('matching', context=ros.context)
    ros.nodes.append(node)
    node.start()
    ros.executor.add_node(node)
    names = ('foot_contacts', 'joint_states')
    assert [name for name in names if any(
        entry.topic_name == f'/{name}' for entry in node.subscriptions)] == ['joint_states']
    senders = [ros.node.create_publisher(JointState, name, interface(name).publisher_qos)
               for name in names]
    ros.spin_until(lambda: all(sender.get_subscription_count() for sender in senders))
    message = JointState()
    for k in range(1, 20):
        set_stamp(message.header.stamp, k * TICK)
        for sender in senders:
            sender.publish(message)
            assert sender.wait_for_all_acked()
        # Of ticks that wait a slow machine looks first for what does not wake.
        ros.spin_until(lambda k=k: len(node.stamps) == k)
    assert node.stamps == [dict.fromkeys(names, k * TICK) for k in range(1, 20)]
    set_stamp(message.header.stamp, 20 * TICK)
    senders[0].publish(message)
    ros.spin_until(lambda: node.inputs.reached('foot_contacts', 20 * TICK))
    ros.executor.remove_node(node)
    node.close()


# Messages and diagnostics ----------------------------------------------------------------------


@pytest.mark.parametrize('bad', [math.nan, math.inf])
def test_a_bad_message_is_dropped_and_told(ros: Ros, started: Relay, bad: float) -> None:
    robot = Robot(ros)
    robot.send(0.5)
    assert robot.tick().twist.linear.x == 0.5
    for _ in range(3):
        robot.send(bad)
    assert robot.tick().twist.linear.x == 0.5
    ros.spin_until(lambda: robot.status()[0] == DiagnosticStatus.WARN)
    assert 'cmd_vel' in robot.status()[1] and 'finite' in robot.status()[1]
    robot.k += 250  # a second later all is well, but not forgotten
    robot.tick()
    robot.k += 250
    robot.tick()
    ros.spin_until(lambda: robot.status()[0] == DiagnosticStatus.OK)
    values = robot.status()[2]
    assert values['rejected.cmd_vel'] == '3'
    assert values['state'] == 'active' and values['ticks'] == str(started.health.ticks)
    assert values['last_stamp_ns'] == str(robot.k * TICK) and values['v_x'] == '0.5'


def test_diagnostics_come_once_in_a_second_of_the_robots_clock() -> None:
    for name in ('one', 'another'):
        health, due = NodeHealth(name), []
        for k in range(1000):
            health.stamp_ns = MIDDLE + k * TICK
            due += [health.stamp_ns] if health.due() else []
        assert len(due) == 5  # the first, then one for each of four seconds
        assert set(np.diff(due[1:])) == {1_000_000_000}


def test_reports_of_two_robots_are_told_apart() -> None:
    reports = [NodeHealth('node', robot=space).status('active', {}, periodic=False).status[0]
               for space in ('/', '/robot1', '/lab/robot2')]
    assert [report.name for report in reports] == ['node', 'robot1/node', 'lab/robot2/node']
    assert [report.hardware_id for report in reports] == ['dmp_cpg_ros', 'robot1', 'lab/robot2']


def test_of_many_bad_messages_few_are_logged() -> None:
    now = 0.0
    health = NodeHealth('node', clock=lambda: now)
    logged = []
    for k in range(1000):
        now = k * 0.05 * LOG_EVERY_S
        if health.reject('imu', 'NaN'):
            logged.append(k)
    assert logged == list(range(0, 1000, 20))
    assert health.rejected == {'imu': 1000}


def test_problems_stay_until_they_are_cleared() -> None:
    health = NodeHealth('node')
    assert health.set_problem('fell', 'the robot fell', error=True)
    assert not health.set_problem('fell', 'the robot fell', error=True)
    for _ in range(2):
        status = health.status('active', {'x': 0.1}, periodic=True).status[0]
        assert (status.level, status.message) == (DiagnosticStatus.ERROR, 'the robot fell')
    assert health.clear_problem('fell') and not health.clear_problem('fell')
    status = health.status('active', {'x': 0.1}, periodic=True).status[0]
    assert (status.level, status.message) == (DiagnosticStatus.OK, 'active')


def test_an_unexpected_error_is_told_with_its_traceback_and_ends_nothing(
        ros: Ros, started: Relay, capfd: pytest.CaptureFixture[str]) -> None:
    robot, on_tick = Robot(ros), started.on_tick
    started.on_tick = None  # type: ignore[assignment, method-assign]
    for k in (1, 2, 3):
        robot.publish_tick()
        ros.spin_until(lambda k=k: started.health.rejected.get('joint_states') == k)
    ros.spin_until(lambda: bool(robot.reports) and robot.status()[0] == DiagnosticStatus.ERROR)
    _, text, values = robot.status()
    assert 'joint_states: TypeError' in text
    assert values['rejected.joint_states'] == '1'
    assert capfd.readouterr().err.count('Traceback') == 1
    started.on_tick = on_tick  # type: ignore[method-assign]
    robot.tick()


def test_a_request_that_fails_is_answered(ros: Ros, started: Relay) -> None:
    def fail() -> list[str]:
        raise KeyError('a bug')

    started.missing = fail  # type: ignore[method-assign]
    answer = ros.call(Trigger, 'relay/ready', Trigger.Request())
    assert not answer.success
    assert 'a bug' in answer.message
    assert started.health.rejected['~/ready'] >= 1


def test_a_timer_that_fails_goes_on_and_is_counted(ros: Ros, started: Relay) -> None:
    def look() -> None:
        raise KeyError('a bug')

    started.create_steady_timer(0.01, look)
    ros.spin_until(lambda: started.health.rejected.get('timer look', 0) > 1)
    assert "KeyError: 'a bug'" in started.health.status('active', {}, periodic=False
                                                        ).status[0].message


def test_a_message_from_the_same_process_is_refused_like_any_other(ros: Ros) -> None:
    node = relay(ros)
    node.local = LocalDelivery(('mujoco_robot',))
    node.start()
    message = JointState()
    message.header.stamp.sec = -1
    node.local.publish('joint_states', message)
    assert node.health.rejected == {'joint_states': 1}
    node.close()
    node.destroy_node()


def test_commands_of_a_wrong_type_are_told(
        ros: Ros, ros_domain: int, started: Relay) -> None:
    """What nobody receives: only the graph knows it."""
    robot, stranger = Robot(ros), Ros(ros_domain)
    stranger.node.create_publisher(TwistStamped, 'cmd_vel', 10)

    def problem() -> str:
        robot.k += 40  # on to another second of the robot's clock, no faster than a robot may
        robot.tick()
        return robot.status()[1] if robot.reports else ''

    ros.spin_until(lambda: 'stamped_cmd_vel:=true' in problem())
    assert robot.status()[0] == DiagnosticStatus.WARN
    stranger.end()
    ros.spin_until(lambda: problem() == 'active')


def test_a_node_takes_back_the_parameters_that_it_tells(ros: Ros, started: Relay) -> None:
    """What ``ros2 param dump`` and ``load`` do, for read-only parameters too."""
    names = ros.call(ListParameters, 'relay/list_parameters', ListParameters.Request())
    names = names.result.names
    values = ros.call(GetParameters, 'relay/get_parameters', GetParameters.Request(names=names))
    entries = [ParameterMessage(name=name, value=value)
               for name, value in zip(names, values.values, strict=True)]
    answer = ros.call(SetParameters, 'relay/set_parameters',
                      SetParameters.Request(parameters=entries))
    assert [result.reason for result in answer.results if not result.successful] == []
    executor = next(entry for entry in entries if entry.name == 'executor')
    executor.value.string_value = 'single' if executor.value.string_value == 'events' else 'events'
    answer = ros.call(SetParameters, 'relay/set_parameters',
                      SetParameters.Request(parameters=[executor]))
    assert not answer.results[0].successful

SECTIONS = ('/**', 'node', '/**/node', '/robot1/node', '/*/node', '/robot1/**', '/other')


@pytest.mark.parametrize('namespace', ['', '/robot1', '/a/b'])
def test_sections_apply_and_override_as_in_ros(
        namespace: str, ros_domain: int, tmp_path: Path) -> None:
    for turn in range(len(SECTIONS)):
        order = SECTIONS[turn:] + SECTIONS[:turn]
        path = tmp_path / 'sections.yaml'
        path.write_text('\n'.join(
            f'{name}: {{ros__parameters: {{a: {number}, own_{number}: 1}}}}'
            for number, name in enumerate(order)), encoding='utf-8')
        context = rclpy.context.Context()
        rclpy.init(context=context, args=['--ros-args', '--params-file', str(path)])
        node = rclpy.node.Node('node', context=context, namespace=namespace)
        overrides = {name: value.value for name, value in node._parameter_overrides.items()}
        context.try_shutdown()
        assert node_parameters(load_yaml(path), f'{namespace}/node', path) == overrides, order


# Readiness -------------------------------------------------------------------------------------


def test_ready_lists_who_is_missing(ros: Ros) -> None:
    node = relay(ros, expected_nodes=['reference_filter', 'mujoco_robot', 'canonical_oscillators',
                                      'leg_transformation'])
    ros.executor.add_node(node)

    def ready() -> tuple[bool, str]:
        answer = ros.call(Trigger, 'relay/ready', Trigger.Request())
        return answer.success, answer.message

    assert ready() == (False, 'relay is unconfigured')
    node.start()
    success, said = ready()
    assert not success
    for part in ('joint_states is not published by mujoco_robot',
                 'reference is not read by canonical_oscillators',
                 'reference is not read by leg_transformation_fl'):
        assert part in said
    assert 'posture_control' not in said and 'bag_recorder' not in said
    names = ('mujoco_robot', 'canonical_oscillators', *KINDS['leg_transformation'].instances)
    others = [rclpy.node.Node(name, context=ros.context) for name in names]
    joints, reference = interface('joint_states'), interface('reference')
    others[0].create_publisher(joints.type, joints.name, joints.publisher_qos)
    for other in others[1:-1]:
        other.create_subscription(reference.type, reference.name, lambda m: None,
                                  reference.reader_qos)
    almost = 'reference is not read by leg_transformation_rr'
    ros.spin_until(lambda: ready() == (False, almost), what=lambda: ready()[1])
    others[-1].create_subscription(reference.type, reference.name, lambda m: None,
                                   reference.reader_qos)
    ros.spin_until(lambda: ready() == (True, 'ready'), what=lambda: ready()[1])
    for other in (node, *others):
        other.destroy_node()


# Executors and processes -----------------------------------------------------------------------


@pytest.mark.parametrize('kind', ['events', 'single'])
def test_nodes_share_an_executor_until_a_future_is_done(ros: Ros, kind: str) -> None:
    done, sender = Future(), ros.node.create_publisher(JointState, 'joint_states', 10)
    node = Relay('relay', context=ros.context)
    node.start()
    node.on_tick = lambda stamp_ns, values: done.set_result(stamp_ns)  # type: ignore
    message = JointState()
    set_stamp(message.header.stamp, 5 * TICK)
    timer = ros.node.create_timer(0.01, lambda: sender.publish(message))
    ros.executor.remove_node(ros.node)
    spin([ros.node, node], kind, until=done)
    assert done.result() == 5 * TICK
    ros.node.destroy_timer(timer)
    node.destroy_node()


def test_without_events_executor_the_single_threaded_one_serves(
        ros: Ros, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(context: Any) -> Any:
        raise RuntimeError('not in this build')

    monkeypatch.setattr(rclpy.experimental, 'EventsExecutor', broken)
    assert isinstance(make_executor('events', ros.context), SingleThreadedExecutor)
    monkeypatch.delattr(rclpy.experimental, 'EventsExecutor')
    assert isinstance(make_executor('events', ros.context), SingleThreadedExecutor)


@pytest.mark.parametrize('kind', ['events', 'single'])
def test_who_waits_for_long_gathers_nothing(ros: Ros, kind: str) -> None:
    class Counted(Future):
        callbacks = 0

        def add_done_callback(self, callback: Any) -> None:
            self.callbacks += 1
            super().add_done_callback(callback)

    executor, awaited, slices = make_executor(kind, ros.context), Counted(), 0
    for slices, _ in enumerate(spin_in_slices(executor, awaited, 0.001, 60.0), start=1):
        if slices == 50:  # within the slice after this one
            executor.create_task(awaited.set_result, True)
    assert slices == 51 and awaited.callbacks == 1
    assert list(spin_in_slices(executor, Future(), 0.001, 0.0)) == []


@pytest.mark.parametrize(('executor', 'number'), [
    ('events', signal.SIGINT), ('events', signal.SIGTERM), ('single', signal.SIGINT)])
def test_a_lone_node_serves_and_ends_cleanly(processes: Processes, ros: Ros, executor: str,
                                             number: int) -> None:
    """A real process: alone, fed with NaN, interrupted while it works."""
    process = processes.node('reference_filter', executor=executor)
    robot = Robot(ros)
    state = ros.call(GetState, 'reference_filter/get_state', GetState.Request())
    assert state.current_state.label == 'active'
    robot.tick()
    for bad in (math.nan, math.inf, 1e300):
        robot.send(bad)
    assert np.isfinite(robot.tick().twist.linear.x), process
    ros.spin_until(lambda: 'dropped' in process.output)
    process.signal(number)
    assert process.wait() == 0, str(process)
    assert 'Traceback' not in process.output, process


def ended(process: NodeProcess, status: int, *words: str) -> None:
    assert process.wait() == status, str(process)
    assert 'Traceback' not in process.output, process
    for word in words:
        assert word in process.output, process


def test_bad_arguments_end_a_process_with_status_two(processes: Processes, tmp_path: Path
                                                     ) -> None:
    file = tmp_path / 'robot.yaml'
    file.write_text('model: [', encoding='utf-8')
    started = [
        (processes.node('reference_filter', robot=file), 2, (str(file), 'line 1')),
        (processes.node('reference_filter', alpha_r='.nan'), 2, ('alpha_r', 'nan', '[0.05, 6]')),
        (processes.node('reference_filter', alpha_r='fast'), 2, ('alpha_r', 'fast', 'number')),
        (processes.node('reference_filter', alpha='3.0'), 2, ("'alpha'", 'alpha_r')),
        (processes.node('reference_filter', '-p'), 2, ('-p',)),
        (processes.node('composed_suite', stamped_cmd_vel=True), 2,
         ("composed_suite: canonical_oscillators: there is no parameter 'stamped_cmd_vel'",)),
        (processes.python('-m', 'dmp_cpg_ros', 'reference_filter', '--fast'), 2, ('--fast',)),
        (processes.python('-m', 'dmp_cpg_ros', 'reference_filter', '--help'), 0,
         ('alpha_r', 'cmd_vel', 'geometry_msgs/msg/Twist')),
    ]
    for process, status, words in started:
        ended(process, status, *words)


@pytest.mark.parametrize('command', [
    ('reference_filter',), ('walk', '--no-report'), ('robot_client', 'nodes'),
    ('live_view',)])
@pytest.mark.parametrize(('variable', 'value', 'valid'), [
    ('ROS_DOMAIN_ID', 'mine', '0 to 232'),
    ('ROS_DOMAIN_ID', '233', '[0, 232]'),
    ('ROS_LOG_DIR', '/dev/null/log', 'set ROS_LOG_DIR to a folder')])
def test_an_environment_that_ros_refuses_is_named_in_a_line(
        processes: Processes, tmp_path: Path, command: tuple[str, ...], variable: str, value: str,
        valid: str) -> None:
    out = ('--out', str(tmp_path / 'run')) if command[0] == 'walk' else ()
    process = processes.start(*command, *out, forked=True, **{variable: value})
    ended(process, 2, f'{command[0]}: ', valid)


def test_a_namespace_that_ros_refuses_is_named_in_a_line(processes: Processes) -> None:
    ended(processes.node('reference_filter', '-r', '__ns:=/robot1/'), 2, 'invalid node namespace')


def test_without_a_folder_for_claims_it_is_said_which_is_needed(
        processes: Processes, tmp_path: Path) -> None:
    (tmp_path / f'dmp_cpg_ros_claims_{os.getuid()}').touch()
    process = processes.python('-m', 'dmp_cpg_ros', 'reference_filter', TMPDIR=str(tmp_path))
    ended(process, 2, 'set TMPDIR to a folder')


# Middleware ------------------------------------------------------------------------------------


def test_the_middleware_profile_is_named_unless_the_user_has_one(
        monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    names = (*middleware.VARIABLES, middleware.RANGE, middleware.LOCALHOST_ONLY)

    def prepared(**given: str) -> list[str | None]:
        for name in names:
            monkeypatch.setenv(name, given.get(name, ''))
        middleware.prepare_middleware()
        first = [os.environ.get(name) for name in names]
        middleware.prepare_middleware()  # as a process that was started by this one
        assert [os.environ.get(name) for name in names] == first
        return first

    subnet, local = (str(find_config(name)) for name in middleware.PROFILES)
    assert prepared() == [subnet, subnet, '', '']
    assert prepared(**{middleware.RANGE: 'OFF'}) == [subnet, subnet, 'OFF', '']
    assert prepared(**{middleware.RANGE: 'LOCALHOST'}) == [local, local, 'SUBNET', None]
    assert prepared(**{middleware.LOCALHOST_ONLY: '1'}) == [local, local, 'SUBNET', None]
    assert prepared(**{middleware.VARIABLES[0]: 'mine.xml', middleware.RANGE: 'LOCALHOST'}) == [
        'mine.xml', '', 'LOCALHOST', '']
    (tmp_path / 'DEFAULT_FASTRTPS_PROFILES.xml').touch()
    assert prepared(**{middleware.RANGE: 'LOCALHOST'}) == ['', '', 'LOCALHOST', '']


def test_the_profiles_differ_in_the_interface_only() -> None:
    subnet, local = (ElementTree.parse(find_config(name)).getroot()
                     for name in middleware.PROFILES)
    descriptor = local.find('.//{*}transport_descriptor')
    assert descriptor is not None
    interfaces = descriptor.find('{*}interfaceWhiteList')
    assert interfaces is not None and [part.text for part in interfaces] == ['127.0.0.1']
    descriptor.remove(interfaces)
    assert ([(part.tag, (part.text or '').strip()) for part in subnet.iter()]
            == [(part.tag, (part.text or '').strip()) for part in local.iter()])
    period = subnet.find('.//{*}heartbeatPeriod')
    assert period is not None
    assert int(period[0].text or '') == 0 and 0 < int(period[1].text or '') < 100_000_000


def test_nodes_have_no_shared_memory(processes: Processes) -> None:
    node = processes.executable('reference_filter')
    node.wait_for_output('active')
    links = [os.readlink(path) for path in Path(f'/proc/{node.pid}/fd').iterdir()]
    maps = Path(f'/proc/{node.pid}/maps').read_text(encoding='utf-8')
    assert not [link for link in (*links, *maps.split()) if link.startswith('/dev/shm/fast')]


def test_every_thread_of_a_process_is_scheduled_in_batches() -> None:
    if not hasattr(os, 'SCHED_BATCH'):
        pytest.skip('this system has no such policy')
    told = subprocess.run(
        [sys.executable, '-c', 'import os, threading\n'
         'from dmp_cpg_ros.nodes.framework.execution import schedule\n'
         'event = threading.Event()\n'
         'threading.Thread(target=event.wait).start()\n'
         'print(schedule("normal"), schedule("batch"), schedule("batch"))\n'
         'print({os.sched_getscheduler(int(t)) for t in os.listdir("/proc/self/task")}'
         ' == {os.SCHED_BATCH})\n'
         'event.set()'], capture_output=True, text=True, check=True, preexec_fn=_normal_policy)
    normal, batch, again, all_are = told.stdout.split()
    assert (normal, again, all_are) == ('0', '0', 'True')
    assert int(batch) >= 2  # those of the numerical libraries, too


def _normal_policy() -> None:
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
