# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Examples of the how-to pages name what there is, here and in the packages of others."""

from __future__ import annotations

import re

import pytest
from checkout import ROOT

from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.strict_yaml import parse_yaml
from dmp_cpg_ros.suite_table import KINDS, namespace_rules

CONTROLLERS = {
    'joint_state_broadcaster/JointStateBroadcaster': {
        'use_local_topics', 'joints', 'extra_joints', 'interfaces', 'map_interface_to_joint_state',
        'use_urdf_to_filter'},
    'imu_sensor_broadcaster/IMUSensorBroadcaster': {
        'sensor_name', 'frame_id', 'static_covariance_orientation',
        'static_covariance_angular_velocity', 'static_covariance_linear_acceleration'},
    'force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster': {
        'sensor_name', 'frame_id', 'interface_names'},
    'forward_command_controller/ForwardCommandController': {'joints', 'interface_name'},
}
"""Parameters of the controllers of ros2_controllers for Jazzy that the page uses, as their files
``*_parameters.yaml`` declare them."""


def example(page: str, first: str) -> str:
    """The block of YAML of a page that begins with a name."""
    text = (ROOT / 'doc' / 'how_to' / page).read_text(encoding='utf-8')
    (block,) = (block for block in re.findall(r'```yaml\n(.*?)```', text, re.DOTALL)
                if block.startswith(first))
    return str(block)


def test_the_controllers_of_the_hardware_page_are_those_that_the_driver_speaks_with() -> None:
    pytest.importorskip('rclpy')
    from dmp_cpg_ros.nodes.messages.interfaces import COMMAND_INTERFACES, commands_of, foot_wrench

    content = parse_yaml(example('hardware.md', 'controller_manager'), 'hardware.md')
    manager = content.pop('controller_manager')['ros__parameters']
    assert manager.pop('update_rate') == 500
    assert manager.keys() == content.keys()
    for name, section in content.items():
        given = section['ros__parameters']
        assert given.keys() <= CONTROLLERS[manager[name]['type']], name
        if 'joints' in given:
            assert given['joints'] == list(JOINT_NAMES)
            assert name == commands_of(given['interface_name']).partition('/')[0]
    forwarded = {commands_of(name).partition('/')[0] for name in COMMAND_INTERFACES}
    feet = {foot_wrench(leg).partition('/')[0] for leg in LEGS}
    assert set(content) == {
        'joint_state_broadcaster', 'imu_sensor_broadcaster', *forwarded, *feet}
    assert content['joint_state_broadcaster']['ros__parameters'] == {'use_local_topics': True}


def test_the_nodes_that_expect_one_another_beside_a_driver_are_those_that_are_started() -> None:
    pytest.importorskip('rclpy')
    from dmp_cpg_ros.commands.reference import tables_of_parameters
    from dmp_cpg_ros.nodes.framework.parameters import NodeParameters

    given = parse_yaml(example('hardware.md', '/**'), 'hardware.md')['/**']['ros__parameters']
    expected = NodeParameters(expected_nodes=tuple(given['expected_nodes'])).expected_nodes
    text = (ROOT / 'doc' / 'how_to' / 'hardware.md').read_text(encoding='utf-8')
    (started,) = set(re.findall(r'composed_suite (.*?) --ros-args', text))
    assert [name for kind in expected for name in KINDS[kind].instances] == started.split()
    assert given.keys() <= {
        name for table in tables_of_parameters().values() for name in table.fields}


def test_the_rules_for_nodes_in_a_namespace_are_those_of_a_suite() -> None:
    pytest.importorskip('rclpy')
    from dmp_cpg_ros.nodes.messages.interfaces import SERVICES, TOPICS

    text = (ROOT / 'doc' / 'how_to' / 'several_robots.md').read_text(encoding='utf-8')
    (rules,) = re.findall(r'`--ros-args (-r __ns:=[^`]+)`', text)
    told = [tuple(rule.split(':=')) for rule in rules.removeprefix('-r ').split(' -r ')]
    assert told == namespace_rules('/robot1')
    absolute = {topic.name for topic in (*TOPICS, *SERVICES) if topic.name.startswith('/')}
    assert absolute == {name for name, _ in told[1:]}  # those that ROS has; no others


@pytest.mark.parametrize(('gait', 'column'), [('amble', 3), ('walk', 4), ('trot', 5)])
def test_the_table_of_the_nav2_page_is_what_the_command_prints(gait: str, column: int) -> None:
    pytest.importorskip('mujoco')
    from dmp_cpg_ros.commands.nav2_limits import axis_limits
    from dmp_cpg_ros.suite import load_suite

    text = (ROOT / 'doc' / 'how_to' / 'nav2.md').read_text(encoding='utf-8')
    rows = [line.split('|') for line in text.splitlines() if line.startswith('| `max_')]
    told = [[float(value) for value in row[column].split(',')] for row in rows]
    assert told == list(axis_limits(load_suite(None, {'gait': gait})))
