# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every executable alone: help, bad parameters, Ctrl-C, and input that is not a number."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy')

import ros_processes
from entry_names import ENTRY_NAMES
from rcl_interfaces.srv import GetParameters
from ros_processes import Processes, Ros
from std_srvs.srv import SetBool

from dmp_cpg_ros import __version__
from dmp_cpg_ros.__main__ import COMMANDS, STUDIES, main
from dmp_cpg_ros.core.suite_parameters import CHANGEABLE, OWNER
from dmp_cpg_ros.nodes.messages.interfaces import INTERFACES, published_by, read_by
from dmp_cpg_ros.suite_table import KINDS

processes, ros, ros_domain = (
    ros_processes.processes,
    ros_processes.ros,
    ros_processes.ros_domain,
)

OUTPUTS = (
    'reference',
    'canonical_state',
    'posture_feedback',
    'joint_targets',
    'joint_states',
    'ground_truth',
)


@pytest.mark.parametrize('name', (*KINDS, *COMMANDS, *STUDIES))
def test_help_names_what_there_is(processes: Processes, name: str) -> None:
    alone = name in (next(iter(KINDS)), COMMANDS[0], STUDIES[0])  # the others are forked
    process = (processes.python('-m', 'dmp_cpg_ros', name, '--help') if alone
               else processes.executable(name, '--help'))
    assert process.wait() == 0, str(process)
    assert name in process.output
    if name in KINDS and name != 'bag_recorder':
        for topic in (*published_by(name), *read_by(name)):
            assert topic.name in process.output
        owned = re.findall(r'^  (\w+): .*\n.*, changeable$', process.output, re.MULTILINE)
        assert set(owned) & set(OWNER) == set(CHANGEABLE.get(name, ()))
    if name in STUDIES:
        assert not re.search('``|:`', process.output), process


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['--version']) == 0
    assert capsys.readouterr().out == f'dmp_cpg_ros {__version__}\n'


@pytest.mark.parametrize('name', KINDS)
def test_a_bad_parameter_is_named_with_what_is_valid(processes: Processes, name: str) -> None:
    bad = {
        'reference_filter': ('alpha_r', -1.0, '0.05'),
        'canonical_oscillators': ('gait', 'gallop', 'amble'),
        'leg_transformation': ('leg', 'middle', 'fl, fr, rl, rr'),
        'inhibition': ('region_radius', math.nan, '0.001'),
        'posture_control': ('robot', 'no_robot.yaml', 'no_robot.yaml'),
        'mujoco_robot': ('control_rate', 333.0, 'whole microseconds'),
        'bag_recorder': ('storage', 'tape', 'mcap'),
        'visualization': ('drawing_rate', 0.0, '0.1'),
        'ros2_control_driver': ('command_interfaces', '[torque]', 'position, velocity, effort'),
    }
    parameter, value, valid = bad[name]
    text = '.nan' if isinstance(value, float) and math.isnan(value) else str(value)
    process = processes.executable(name, '--ros-args', '-p', f'{parameter}:={text}')
    assert process.wait() == 2, str(process)
    assert valid in process.output, process
    assert 'Traceback' not in process.output


@pytest.mark.parametrize('name', KINDS)
def test_not_a_number_neither_ends_a_node_nor_leaves_it(
    processes: Processes, ros: Ros, tmp_path: Path, name: str
) -> None:
    options = {'output': str(tmp_path / 'bag')} if name == 'bag_recorder' else {}
    process = processes.node(name, **options)
    ros.call(GetParameters, f'{name}/get_parameters', GetParameters.Request(names=['autostart']))
    outputs = {
        topic.name: ros.collect(topic.type, topic.name, topic.reader_qos)
        for topic in published_by(name)
        if topic.installed
    }
    publishers = [
        (ros.node.create_publisher(topic.type, topic.name, topic.publisher_qos), topic)
        for topic in read_by(name)
        if topic.installed
        and topic.name not in outputs
        and topic.name != '/diagnostics'
        and name not in topic.sometimes
    ]
    ros.spin_until(lambda: all(publisher.get_subscription_count() for publisher, _ in publishers))
    for round_ in range(3):
        for publisher, topic in publishers:
            publisher.publish(poisoned(topic.type, topic.name, round_))
    request = GetParameters.Request(names=['autostart'])
    answer = ros.call(GetParameters, f'{name}/get_parameters', request)
    assert answer.values[0].bool_value
    if name == 'inhibition':
        assert not ros.call(SetBool, 'inhibit', SetBool.Request(data=True)).success
    for topic, messages in outputs.items():
        for message in messages if topic in OUTPUTS else ():
            assert all(math.isfinite(value) for value in numbers_of(message)), topic
    process.interrupt()
    assert process.wait() == 0, str(process)
    assert 'Traceback' not in process.output, process


def poisoned(kind: type, name: str, round_: int) -> Any:
    """Message of a topic with numbers that are not finite and otherwise right names and stamps."""
    bad = (math.nan, math.inf, -math.inf)[round_]
    message = kind()
    if hasattr(message, 'header'):
        message.header.stamp.sec = round_ + 1
    if name in ENTRY_NAMES:
        message.name = list(ENTRY_NAMES[name])
        for field in ('position', 'velocity', 'effort'):
            setattr(message, field, [bad] * len(message.name))
    elif name in ('reference', 'ground_truth', 'cmd_vel'):
        twist = message
        while hasattr(twist, 'twist'):
            twist = twist.twist
        twist.linear.x = twist.angular.z = bad
    return message


def numbers_of(message: Any) -> list[float]:
    """All floats in a message."""
    if isinstance(message, float):
        return [message]
    if hasattr(message, 'get_fields_and_field_types'):
        fields = message.get_fields_and_field_types()
        return [value for field in fields for value in numbers_of(getattr(message, field))]
    if isinstance(message, (str, bytes, int)):
        return []
    return [value for entry in message for value in numbers_of(entry)]


def test_every_node_of_the_contract_is_here() -> None:
    kinds = {kind for topic in INTERFACES.values() for kind in topic.publishers}
    assert kinds - {'user'} <= set(KINDS)
