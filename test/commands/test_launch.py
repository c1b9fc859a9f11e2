# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The launch file starts the suite: its nodes, read by stand-ins for ROS 2's launch system and
started with the command lines that the real one makes of them, become ready.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

pytest.importorskip('rclpy')

import ros_processes
import yaml
from launch_files import read_launch_file, with_arguments
from ros_processes import NodeProcess, Processes, Ros, wait_until
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.robot.urdf import urdf
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite_table import (
    ABSOLUTE_TOPICS,
    KINDS,
    RECORDER,
    RETURN_S,
    ROBOT,
    VISUALIZATION,
    WALKING_NODES,
)

processes, ros, ros_domain = ros_processes.processes, ros_processes.ros, ros_processes.ros_domain

ARGUMENTS = {'parameters': '', 'robot': '', 'lock_step': '', 'namespace': '', 'record': 'false',
             'processes': 'each', 'bag': 'bag', 'respawn': 'false', 'return_time': '',
             'robot_state_publisher': 'auto', 'visualization': 'false'}

UP_S = 90.0
"""How long nine processes may take to start and to find each other on a loaded machine [s]."""


Described = Callable[[Mapping[str, str]], list[Any]]


@pytest.fixture
def launch_file(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    return read_launch_file('suite', monkeypatch)


@pytest.fixture
def described(launch_file: ModuleType) -> Described:
    """Nodes that the launch file makes of its arguments."""
    return lambda arguments: launch_file.nodes(with_arguments(arguments))


def start(processes: Processes, node: Any, folder: Path) -> NodeProcess:
    """Start a node with the command line that launch_ros makes of its description."""
    named = getattr(node, 'name', None)
    rules = [*([('__node', named)] if named else []),
             *([('__ns', node.namespace)] if node.namespace else []), *node.remappings]
    words = [word for name, to in rules for word in ('-r', f'{name}:={to}')]
    words += getattr(node, 'ros_arguments', [])
    for number, given in enumerate(node.parameters):
        if isinstance(given, dict):
            path = folder / f'{named or "_".join(node.arguments)}_{number}.yaml'
            values = {key: tuple(value) if isinstance(value, list) else value
                      for key, value in given.items()}
            content = {f'{node.namespace or ""}/{named or "**"}': {'ros__parameters': values}}
            path.write_text(yaml.dump(content), encoding='utf-8')
            given = path
        words += ['--params-file', str(given)]
    return processes.executable(node.executable, *getattr(node, 'arguments', ()), '--ros-args',
                                *words)


def test_launched_nodes_are_those_of_the_table(described: Described) -> None:
    assert sorted(node.name for node in described(ARGUMENTS)) == sorted(WALKING_NODES)
    recording = described({**ARGUMENTS, 'record': 'true'})
    assert {node.name for node in recording} == {*WALKING_NODES, RECORDER}
    drawn = described({**ARGUMENTS, 'visualization': 'true'})
    assert {node.name for node in drawn} == {*WALKING_NODES, VISUALIZATION}
    for node in recording:
        assert node.name in KINDS[node.executable].instances
    assert recording[-1].name == ROBOT and recording[-1].on_exit is not None
    sections = {name.rpartition('/')[2] for name in load_yaml(find_config('suite.yaml'))}
    assert sections - {'**'} <= {*WALKING_NODES, RECORDER}


def test_all_but_the_robot_come_back_where_that_is_asked_for(described: Described) -> None:
    for respawn in ('true', 'false'):
        for shared in ('each', 'blocks'):
            given = {**ARGUMENTS, 'respawn': respawn, 'processes': shared, 'record': 'true'}
            *others, robot = described(given)
            assert {node.respawn for node in others} == {respawn == 'true'}
            assert robot.on_exit is not None and not robot.respawn


def return_times(described: list[Any]) -> dict[str, float]:
    """What of the launch file's own values overrides the file's ``return_time``, by node."""
    told: dict[str, float] = {}
    for node in described:
        names = getattr(node, 'arguments', [getattr(node, 'name', '')])
        own = node.parameters[1] if len(node.parameters) > 1 else {}
        told.update(dict.fromkeys(names, own['return_time']) if 'return_time' in own else {})
        told.update((word.partition(':')[0], float(word.rpartition(':=')[2]))
                    for word in getattr(node, 'ros_arguments', []) if ':return_time:=' in word)
    return told


@pytest.mark.parametrize('shared', ['each', 'blocks', 'composed'])
def test_the_return_time_is_the_files_unless_the_argument_is_given(
        described: Described, tmp_path: Path, shared: str) -> None:
    given = {**ARGUMENTS, 'processes': shared}
    assert return_times(described(given)) == {}
    given['respawn'] = 'true'
    assert return_times(described(given)) == dict.fromkeys(WALKING_NODES, RETURN_S)
    file = tmp_path / 'mine.yaml'
    of_one = {'/**': {'ros__parameters': {'gait': 'trot'}},
              f'/**/{ROBOT}': {'ros__parameters': {'return_time': 0.25}}}
    file.write_text(yaml.dump(of_one), encoding='utf-8')
    given['parameters'] = str(file)
    assert return_times(described(given)) == {
        **dict.fromkeys(WALKING_NODES, RETURN_S), ROBOT: 0.25}
    file.write_text(yaml.dump({'/**': {'ros__parameters': {'return_time': 0.4}}}),
                    encoding='utf-8')
    assert return_times(described(given)) == dict.fromkeys(WALKING_NODES, 0.4)
    for respawn in ('true', 'false'):
        asked = {**given, 'return_time': '0.6', 'respawn': respawn}
        assert return_times(described(asked)) == dict.fromkeys(WALKING_NODES, 0.6)


@pytest.mark.parametrize(('lock_step', 'namespace', 'shared'), [
    ('', '', 'each'), ('true', 'robot1', 'blocks')])
def test_what_is_launched_becomes_ready_and_ticks(
        described: Described, processes: Processes, ros: Ros, tmp_path: Path,
        lock_step: str, namespace: str, shared: str) -> None:
    given = {**ARGUMENTS, 'lock_step': lock_step, 'namespace': namespace, 'record': 'true',
             'processes': shared, 'bag': str(tmp_path / 'bag')}
    space = f'/{namespace}' if namespace else ''
    ticks = ros.collect(Clock, f'{space}/clock')
    for node in described(given):
        start(processes, node, tmp_path)
    for name in (*WALKING_NODES, RECORDER):
        answers: list[Any] = []

        def ready(name: str = name, answers: list[Any] = answers) -> bool:
            answers.append(ros.call(Trigger, f'{space}/{name}/ready', Trigger.Request(), UP_S))
            return bool(answers[-1].success)

        ros.spin_until(ready, UP_S, what=lambda answers=answers: answers[-1].message)
    ros.spin_until(lambda: len(ticks) > 2 and ticks[-1] != ticks[0], UP_S)
    running = {name for name, place in ros.node.get_node_names_and_namespaces()
               if place == (space or '/')}
    assert running - {'test'} == {*WALKING_NODES, RECORDER}


def test_a_lock_step_robot_says_what_it_waits_for(processes: Processes) -> None:
    robot = processes.node(ROBOT, lock_step=True)
    robot.wait_for_output('waiting for .*joint_targets is not published by leg_transformation_fl')


def test_a_lock_step_robot_that_is_recorded_waits_for_the_recorder(
        described: Described, processes: Processes, tmp_path: Path) -> None:
    given = {**ARGUMENTS, 'lock_step': 'true', 'record': 'true', 'bag': str(tmp_path / 'bag')}
    robot, = (node for node in described(given) if node.name == ROBOT)
    start(processes, robot, tmp_path).wait_for_output(f'waiting for .*{RECORDER}')


def test_arguments_left_empty_override_nothing_and_given_ones_reach_the_nodes(
        described: Described) -> None:
    quiet = {node.name: node.parameters[1:] for node in described(ARGUMENTS)}
    assert quiet['mujoco_robot'] == quiet['reference_filter'] == quiet['inhibition'] == []
    given = {node.name: node.parameters[1] for node in described(
        {**ARGUMENTS, 'robot': 'robots/mini_quadruped.yaml', 'lock_step': 'true'})}
    file = str(find_config('robots/mini_quadruped.yaml'))
    assert given['mujoco_robot'] == {'lock_step': True, 'robot': file}
    assert given['leg_transformation_rr'] == {'lock_step': True, 'robot': file, 'leg': 'rr'}


@pytest.mark.parametrize('namespace', ['', 'robot1'])
def test_the_frames_of_the_links_come_from_the_robots_description_where_that_is_installed(
        described: Described, launch_file: ModuleType,
        monkeypatch: pytest.MonkeyPatch, namespace: str) -> None:
    given = {**ARGUMENTS, 'namespace': namespace, 'robot': 'robots/mini_quadruped.yaml'}
    frames = 'robot_state_publisher'
    monkeypatch.setattr(launch_file, 'get_packages_with_prefixes', dict)
    without = described(given)
    assert sorted(node.name for node in without) == sorted(WALKING_NODES)
    monkeypatch.setattr(launch_file, 'get_packages_with_prefixes', lambda: {frames: '/opt/ros'})
    node, *others = described(given)
    assert [other.name for other in others] == [other.name for other in without]
    assert (node.package, node.executable, node.name) == (frames, frames, frames)
    assert node.namespace == (f'/{namespace}' if namespace else None)
    (parameters,), remappings = node.parameters, dict(node.remappings)
    text = parameters['robot_description']
    assert text.positional == (urdf(find_config(given['robot'])),) and text.value_type is str
    assert parameters['use_sim_time'] is True and node.output == 'screen'
    assert remappings.pop('robot_description') == f'{frames}/robot_description'
    assert remappings == ({name: name[1:] for name in ABSOLUTE_TOPICS} if namespace else {})
    assert len(described({**given, frames: 'false'})) == len(without)


@pytest.mark.parametrize('name', ['parameters', 'robot'])
def test_a_file_that_is_not_there_is_one_error_before_any_node(
        described: Described, name: str) -> None:
    with pytest.raises(DmpCpgError, match=r'nosuch\.yaml'):
        described({**ARGUMENTS, name: 'nosuch.yaml'})


def test_a_bag_that_exists_is_an_error_before_any_node(
        described: Described, tmp_path: Path) -> None:
    with pytest.raises(FileExistsError, match='bag:=FOLDER'):
        described({**ARGUMENTS, 'record': 'true', 'bag': str(tmp_path)})


def test_the_bag_is_where_its_argument_says(
        described: Described, processes: Processes, tmp_path: Path) -> None:
    bag = tmp_path / 'outing'
    recorder, = (node for node in described({**ARGUMENTS, 'record': 'true', 'bag': str(bag)})
                 if node.name == RECORDER)
    start(processes, recorder, tmp_path)
    wait_until(bag.is_dir)


def test_the_arguments_are_declared(launch_file: ModuleType) -> None:
    description = launch_file.generate_launch_description()
    declared = [entity.positional[0] for entity in description.positional[0]
                if type(entity).__name__ == 'DeclareLaunchArgument']
    assert set(declared) == set(ARGUMENTS)
