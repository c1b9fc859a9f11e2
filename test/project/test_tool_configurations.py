# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Configurations of the tools of ROS 2 name what there is, and each value is a number."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml
from checkout import ROOT
from entry_names import ENTRY_NAMES

pytest.importorskip('rclpy')

from dmp_cpg_ros.nodes.messages.interfaces import SERVICES, TOPICS
from dmp_cpg_ros.nodes.messages.markers import FEET, FOOTHOLDS, FORCES, PATHS
from dmp_cpg_ros.nodes.messages.robot_state import BASE_FRAME, ODOM_FRAME
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite_table import DRIVER, instances

CONFIG = ROOT / 'config'
RVIZ, FOXGLOVE, PLOTJUGGLER = (CONFIG / tool / f'dmp_cpg_ros.{kind}' for tool, kind in (
    ('rviz', 'rviz'), ('foxglove', 'json'), ('plotjuggler', 'xml')))

TYPES = {f"/{topic.name.strip('/')}": topic for topic in TOPICS if not topic.name.startswith('~')}
DISPLAYED = {'RobotModel': 'std_msgs/msg/String', 'Path': 'nav_msgs/msg/Path',
             'MarkerArray': 'visualization_msgs/msg/MarkerArray',
             'Odometry': 'nav_msgs/msg/Odometry'}


def entries(value: Any, key: str) -> Iterator[Any]:
    """Every value of a key in nested mappings and lists."""
    for name, entry in value.items() if isinstance(value, dict) else enumerate(
            value if isinstance(value, list) else ()):
        if name == key:
            yield entry
        yield from entries(entry, key)


def reach(topic: str, fields: str) -> Any:
    """Value at dotted fields of an empty message; arrays have the suite's entries."""
    value = TYPES[topic].type()
    for word in fields.split('.'):
        name, _, place = word.partition('[')
        value = getattr(value, name)
        if place:
            assert int(place.rstrip(']')) < len(ENTRY_NAMES[topic.strip('/')])
            value = 0.0
    return value


def test_rviz_shows_topics_of_the_right_types_in_frames_that_there_are() -> None:
    manager = yaml.safe_load(RVIZ.read_text('utf-8'))['Visualization Manager']
    shown = {}
    displays = {display['Class'].rpartition('/')[2]: display for display in manager['Displays']}
    nav2_map = displays.pop('Map')['Topic']
    assert (nav2_map['Value'], nav2_map['Durability Policy']) == ('/map', 'Transient Local')
    for display in displays.values():
        kind = display['Class'].rpartition('/')[2]
        for key in ('Topic', 'Description Topic'):
            if key in display:
                topic = TYPES[display[key]['Value']]
                assert topic.type_name == DISPLAYED[kind]
                assert (display[key]['Durability Policy'] == 'Transient Local') == topic.latched
                shown[kind] = display
    assert set(shown) == set(DISPLAYED)
    assert set(shown['MarkerArray']['Namespaces']) == {FEET, FORCES, PATHS, FOOTHOLDS}
    assert manager['Global Options']['Fixed Frame'] == ODOM_FRAME
    assert manager['Views']['Current']['Target Frame'] == BASE_FRAME


def test_rviz_sets_the_pose_and_the_goal_of_nav2() -> None:
    manager = yaml.safe_load(RVIZ.read_text('utf-8'))['Visualization Manager']
    assert {tool['Class'].rpartition('/')[2]: tool['Topic']['Value']
            for tool in manager['Tools'] if 'Topic' in tool} == {
        'SetInitialPose': '/initialpose', 'SetGoal': '/goal_pose'}
    text = (ROOT / 'doc' / 'how_to' / 'nav2.md').read_text('utf-8')
    assert 'ros2 topic pub --once /initialpose ' in text
    assert RVIZ.relative_to(ROOT).as_posix() in text


def test_foxglove_shows_topics_and_fields_that_there_are() -> None:
    layout = json.loads(FOXGLOVE.read_text('utf-8'))
    panels = layout['configById']
    assert set(re.findall(r'"(\w+!\w+)"', json.dumps(layout['layout']))) == set(panels)
    scene = panels['3D!robot']
    named = {*scene['topics'], *(
        topic for key in ('topic', 'jointStatesTopic', 'topicToRender')
        for topic in entries(panels, key))}
    assert named <= set(TYPES)
    assert {'/markers', '/body_path', '/robot_description', '/joint_states'} <= named
    frames = {scene['followTf'], *entries(scene['layers'], 'frameId')}
    assert frames == {BASE_FRAME, ODOM_FRAME}
    paths = [path for name, panel in panels.items() if name.startswith('Plot!')
             for path in entries(panel['paths'], 'value')]
    assert len(paths) == 15
    for path in paths:
        topic, _, fields = path.partition('.')
        assert isinstance(reach(topic, fields), float), path
    topic, _, fields = panels['RawMessages!stop']['topicPath'].partition('.')
    assert hasattr(TYPES[topic].type(), fields.partition('[')[0])
    services = {f'/{service.name}': service.type for service in SERVICES}
    for name, panel in panels.items():
        if name.startswith('CallService!'):
            request = services[panel['serviceName']].Request()
            assert json.loads(panel['requestPayload']).keys() == (
                request.get_fields_and_field_types().keys())
    for button, field in (('upButton', 'linear-x'), ('leftButton', 'angular-z')):
        assert panels['Teleop!drive'][button]['field'] == field


def test_plotjuggler_plots_series_that_there_are() -> None:
    curves = [curve.get('name', '') for curve in ElementTree.parse(PLOTJUGGLER).iter('curve')]
    assert len(curves) > 20
    for name in curves:
        topic = max((known for known in TYPES if name.startswith(f'{known}/')), key=len)
        rest = name[len(topic) + 1:]
        if topic.strip('/') in ENTRY_NAMES:  # JointState: /topic/name/field
            row, _, field = rest.rpartition('/')
            assert row in ENTRY_NAMES[topic.strip('/')] or topic == '/joint_targets', name
            assert hasattr(TYPES[topic].type(), field), name
        else:
            assert isinstance(reach(topic, rest.replace('/', '.')), float), name


@pytest.mark.parametrize('place', ['', 'robot1/'])
def test_every_node_reports_into_one_group(place: str) -> None:
    (parameters,) = load_yaml(CONFIG / 'diagnostics' / 'aggregator.yaml').values()
    groups = {name: group for name, group in parameters['ros__parameters'].items()
              if isinstance(group, dict)}
    assert all(group['path'] == name and group['type'] == 'diagnostic_aggregator/GenericAnalyzer'
               for name, group in groups.items())
    for node in (*(name for _, name, _ in instances()), DRIVER):
        found = [name for name, group in groups.items()
                 if any(word in place + node for word in group['contains'])]
        assert len(found) == 1, node


@pytest.mark.parametrize('path', [RVIZ, FOXGLOVE, PLOTJUGGLER], ids=lambda path: path.name)
def test_the_configuration_is_in_the_documentation(path: Path) -> None:
    text = (ROOT / 'doc' / 'usage.md').read_text('utf-8')
    assert path.relative_to(ROOT).as_posix() in text
