# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nav2's parameters and launch file: limits that the suite keeps, names that Nav2 has.

Nav2 is not installed here: its names are those of its sources, branch ``jazzy``.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from checkout import ROOT
from launch_files import read_launch_file, with_arguments
from numpy.typing import NDArray

from dmp_cpg_ros.commands.nav2_limits import SMOOTHING_S, axis_limits, main, nav2_limits
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceSystem
from dmp_cpg_ros.core.reference.governor import Governor
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.strict_yaml import load_yaml, parse_yaml
from dmp_cpg_ros.suite import Suite, load_suite

TICK_S = 0.004

COSTMAP = {
    'global_frame', 'robot_base_frame', 'rolling_window', 'width', 'height', 'resolution',
    'robot_radius', 'plugins', 'inflation_layer.plugin', 'inflation_layer.inflation_radius',
    'static_layer.plugin', 'static_layer.map_subscribe_transient_local'}

DECLARED = {
    'bt_navigator': {'global_frame', 'robot_base_frame', 'odom_topic'},
    'controller_server': {
        'controller_frequency', 'odom_topic', 'progress_checker_plugins', 'goal_checker_plugins',
        'controller_plugins', 'progress_checker.plugin',
        'progress_checker.required_movement_radius', 'progress_checker.movement_time_allowance',
        'goal_checker.plugin', 'goal_checker.xy_goal_tolerance', 'goal_checker.yaw_goal_tolerance',
        'goal_checker.stateful', *(f'FollowPath.{name}' for name in (
            'plugin', 'desired_linear_vel', 'lookahead_dist', 'rotate_to_heading_angular_vel',
            'min_approach_linear_velocity', 'approach_velocity_scaling_dist',
            'use_rotate_to_heading', 'max_angular_accel', 'use_collision_detection'))},
    'local_costmap': COSTMAP, 'global_costmap': COSTMAP,
    'planner_server': {'planner_plugins', 'GridBased.plugin', 'GridBased.tolerance'},
    'behavior_server': {
        'behavior_plugins', 'spin.plugin', 'backup.plugin', 'wait.plugin', 'local_frame',
        'global_frame', 'robot_base_frame', 'max_rotational_vel', 'rotational_acc_lim'},
    'velocity_smoother': {
        'smoothing_frequency', 'feedback', 'odom_topic', 'velocity_timeout', 'max_velocity',
        'min_velocity', 'max_accel', 'max_decel'},
    'map_server': {'yaml_filename'},
    'lifecycle_manager': {'autostart', 'node_names'},
    'loopback_simulator': {'base_frame_id', 'odom_frame_id', 'map_frame_id', 'scan_frame_id'},
}
"""Those of the parameters that Nav2's nodes declare which are used here."""

PLUGINS = {
    'nav2_controller::SimpleProgressChecker', 'nav2_controller::SimpleGoalChecker',
    'nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController',
    'nav2_costmap_2d::InflationLayer', 'nav2_costmap_2d::StaticLayer',
    'nav2_navfn_planner::NavfnPlanner', 'nav2_behaviors::Spin', 'nav2_behaviors::BackUp',
    'nav2_behaviors::Wait'}


def smoothed(command: float, wanted: float, most: float) -> float:
    """What Nav2's smoother makes of a command in a step, with equal limits both ways."""
    return command + float(np.clip(wanted - command, -most * SMOOTHING_S, most * SMOOTHING_S))


def flat(values: dict[str, Any], prefix: str = '') -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in values.items():
        found |= flat(value, f'{prefix}{name}.') if isinstance(value, dict) else {
            prefix + name: value}
    return found


@pytest.fixture(params=[('amble', {}), ('walk', {}), ('trot', {'max_speed': 0.7})],
                ids=lambda given: given[0])
def suite(request: pytest.FixtureRequest) -> Suite:
    gait, overrides = request.param
    return load_suite(None, {'gait': gait, **overrides})


def test_what_the_smoother_lets_pass_the_reference_follows_unlimited(suite: Suite) -> None:
    p = suite.parameters
    scale = body_scale(load_description(suite.robot_file))
    gate = CommandGate(p.reference, scale, (suite.gait,))
    speeds, accelerations = axis_limits(suite)
    for axis in range(3):
        system = ReferenceSystem(
            p.reference, scale.hip_radius, Governor((suite.gait,), scale))
        r, command, now = np.zeros(3), np.zeros(3), 0
        for wanted in (speeds[axis], -speeds[axis], 0.0):
            for _ in range(60):
                command[axis] = smoothed(command[axis], wanted, accelerations[axis])
                gate.accept(*command)
                for _ in range(round(SMOOTHING_S / TICK_S)):
                    now += round(TICK_S * 1e9)
                    r = system.step(r, np.array(gate.at(now)), TICK_S)
                    assert not gate.limited_by and not system.limited
            assert r[axis] == pytest.approx(wanted, abs=0.02)
        gate.accept(*(1.01 * speeds[axis] * np.eye(3)[axis]))
        gate.at(now)
        assert gate.limited_by, axis                             # and no more than that


def test_more_acceleration_would_be_cut_somewhere(suite: Suite) -> None:
    speeds, accelerations = axis_limits(suite)
    scale = body_scale(load_description(suite.robot_file))
    p = suite.parameters.reference
    governor, stairs = Governor((suite.gait,), scale), 1.0 + p.alpha_r * SMOOTHING_S

    def least(axis: int, factor: float) -> float:
        unit: NDArray[np.float64] = np.eye(3)[axis]
        change = factor * stairs * accelerations[axis] * TICK_S * unit[:2]
        return min(governor.share(v * unit, change, TICK_S, p.max_acceleration)
                   for v in np.linspace(0.0, speeds[axis], 137))

    for axis in range(2):
        assert least(axis, 0.995) == 1.0 and least(axis, 1.02) < 1.0


def test_the_command_prints_a_parameter_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['--ros-args', '-p', 'max_speed:=0.5']) == 0
    printed = parse_yaml(capsys.readouterr().out, 'printed')
    assert printed['velocity_smoother']['ros__parameters']['max_velocity'][0] == 0.5
    assert {node: section['ros__parameters'] for node, section in printed.items()} == nav2_limits(
        load_suite(None, {'max_speed': 0.5}))
    assert main(['--ros-args', '-p', 'auto_gait:=true']) == 2


@pytest.fixture
def launch_file(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    return read_launch_file('nav2', monkeypatch)


def test_the_launch_file_starts_what_is_managed_with_the_limits_of_the_suite(
        launch_file: ModuleType, tmp_path: Path) -> None:
    *declared, _ = launch_file.generate_launch_description().positional[0]
    defaults = {entry.positional[0]: entry.default_value for entry in declared}
    *nodes, suite = launch_file.nodes(with_arguments(defaults))
    assert Path(suite.positional[0].positional[0]) == ROOT / 'launch' / 'suite.launch.py'
    assert dict(suite.launch_arguments).keys() <= {'parameters', 'robot'}
    by_name = {node.executable: node for node in nodes}
    (manager,) = (node for node in nodes if node.executable == 'lifecycle_manager')
    assert {*manager.parameters[1]['node_names'], 'lifecycle_manager',
            'static_transform_publisher'} == set(by_name)
    limits = nav2_limits(load_suite())
    for name, node in by_name.items():
        values = dict(node.parameters[-1])
        assert values.pop('use_sim_time') is True
        assert {key: values[key] for key in limits.get(name, {})} == limits.get(name, {})
        assert set(flat(values)) <= DECLARED.get(name, set()), name
    for name in ('controller_server', 'behavior_server'):
        assert by_name[name].remappings == (('cmd_vel', 'cmd_vel_nav'),)
    assert dict(by_name['velocity_smoother'].remappings) == {
        'cmd_vel': 'cmd_vel_nav', 'cmd_vel_smoothed': 'cmd_vel'}

    own = tmp_path / 'own.yaml'
    own.write_text('/**: {ros__parameters: {max_speed: 0.5}}', encoding='utf-8')
    alone = launch_file.nodes(with_arguments(
        {**defaults, 'parameters': str(own), 'loopback': 'true'}))
    assert [node.executable for node in alone][-1] == 'loopback_simulator'
    (smoother,) = (node for node in alone if node.executable == 'velocity_smoother')
    assert smoother.parameters[1]['max_velocity'][0] == 0.5


def test_the_parameters_of_nav2_are_names_of_nav2_and_no_limit_is_typed() -> None:
    content = load_yaml(find_config('nav2.yaml'))
    limits = nav2_limits(load_suite())
    frequency = content['velocity_smoother']['ros__parameters']['smoothing_frequency']
    assert frequency == 1.0 / SMOOTHING_S
    for node, section in content.items():
        values = flat(section.get(node, section)['ros__parameters'])
        assert set(values) <= DECLARED[node], node
        assert not set(values) & set(flat(limits.get(node, {}))), node
        for name, value in values.items():
            if name.endswith('.plugin'):
                assert value in PLUGINS, name
            if name.endswith('plugins'):
                assert {f'{each}.plugin' for each in value} <= set(values)
    for node, values in limits.items():
        assert set(flat(values)) <= DECLARED[node]
    cruise = limits['controller_server']['FollowPath']
    assert cruise['approach_velocity_scaling_dist'] < content['local_costmap']['local_costmap'][
        'ros__parameters']['width'] / 2


def test_the_map_is_a_free_field() -> None:
    path = find_config('maps/free_field.yaml')
    described = load_yaml(path)
    kind, size, *rows = (path.parent / described['image']).read_text(encoding='ascii').split('\n')
    width, height = map(int, size.split())
    assert kind == 'P1' and ''.join(rows) == '0' * (width * height)
    assert described['origin'] == [
        -0.5 * described['resolution'] * width, -0.5 * described['resolution'] * height, 0.0]


def test_a_reached_goal_is_a_certified_stop() -> None:
    """As Nav2 ends a path: slower from a distance on, then zero; the suite stops by itself."""
    pytest.importorskip('mujoco')
    from dmp_cpg_ros.commands.certify import running_setting
    from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

    suite = load_suite(None, {'max_speed': 0.8})
    follow = nav2_limits(suite)['controller_server']['FollowPath']
    tolerance = load_yaml(find_config('nav2.yaml'))['controller_server']['ros__parameters'][
        'goal_checker']['xy_goal_tolerance']
    (most, *_), goal, reached, command = axis_limits(suite)[1], 1.2, False, 0.0
    robot = MujocoRobot(suite.robot_file, suite.tick_ns)
    loop, state = WalkingLoop(robot.description, suite.gait, suite.parameters), robot.reset()
    for tick in range(round(9.0 / TICK_S)):
        left = goal - state.base_position_in_world[0]
        if tick * TICK_S % SMOOTHING_S < TICK_S:
            reached = reached or left < tolerance
            wanted = 0.0 if reached else follow['desired_linear_vel'] * min(
                1.0, max(left / follow['approach_velocity_scaling_dist'], 0.2))
            command = smoothed(command, wanted, most)
            loop.command(command)
        state = robot.step(loop.tick(state).targets)
        if reached and loop.stop.state == 'at_rest' and loop.stop.automatic:
            break
    assert reached and loop.stop.state == 'at_rest' and loop.stop.automatic
    certificate = certify(running_setting(suite))
    assert certificate.holds and loop.stop.measured_s <= certificate.time_to_rest
    assert abs(goal - state.base_position_in_world[0]) < tolerance
