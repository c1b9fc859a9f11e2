# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Standing up and lying down through the services of real nodes, and a shut-down that drops
nobody.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')

import ros_processes
from ros_processes import NodeProcess, Processes

from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.commands.walk import load_scenario
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.scenario.scenario import play
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.suite import load_suite

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain

UP_AND_DOWN = """\
name: up_and_down
duration: 4.2
parameters: {start_mode: lying, start_pose: lying, control_rate: 100.0}
events:
  - {at: 0.1, stand_up: true}
  - {at: 2.0, inhibit: false}
  - {at: 2.0, command: {v_x: 0.3}}
  - {at: 2.1, lie_down: true}
"""

TOO_EARLY = """\
name: too_early
duration: 1.0
parameters: {start_mode: lying, start_pose: lying}
events:
  - {at: 0.1, inhibit: false}
"""

WALKING = """\
name: stroll
duration: 300.0
parameters: {control_rate: 100.0}
events:
  - {at: 0.1, inhibit: false}
  - {at: 0.1, command: {v_x: 0.3}}
"""

RUN_S = 240.0
"""How long a run may take on a loaded machine before the test gives up [s]."""


def start(processes: Processes, text: str, folder: Path, *options: str) -> NodeProcess:
    scenario = folder / 'scenario.yaml'
    scenario.write_text(text, encoding='utf-8')
    return processes.executable('walk', str(scenario), '--no-report',
                                '--out', str(folder / 'run'), *options)


def plain_run(scenario_file: Path) -> tuple[list[RobotState], list[Any]]:
    """Run the scenario on the plain loop; states and ticks."""
    scenario = load_scenario(scenario_file)
    suite = load_suite(None, scenario.parameters)
    robot = MujocoRobot(suite.robot_file, suite.tick_ns, sensors=suite.sensors,
                        start_pose=suite.robot.start_pose)
    loop = WalkingLoop(robot.description, suite.gait, suite.parameters)
    states, ticks = [robot.reset()], []

    def step() -> None:
        ticks.append(loop.tick(states[-1]))
        states.append(robot.step(ticks[-1].targets))

    play(scenario, suite.tick_ns, step, {**loop.takers, **robot.takers})
    return states, ticks


def test_services_act_at_their_ticks_and_nodes_agree_with_the_plain_loop_bit_for_bit(
    processes: Processes, tmp_path: Path
) -> None:
    process = start(processes, UP_AND_DOWN, tmp_path, '--lock-step', '--processes', 'blocks')
    assert process.wait(RUN_S) == 0, str(process)
    assert 'lie_down: lying' in process.output
    recording = load_recording(tmp_path / 'run' / 'bag')
    states, ticks = plain_run(tmp_path / 'scenario.yaml')
    np.testing.assert_array_equal(
        recording.joints.position, [state.joint_position for state in states[:-1]])
    np.testing.assert_array_equal(
        recording.targets.effort, [tick.targets.effort for tick in ticks])
    np.testing.assert_array_equal(recording.canonical.x, [tick.x for tick in ticks])
    changes = [(tick.time_ns, tick.mode.mode) for before, tick in zip(
        [None, *ticks], ticks, strict=False) if before is None
        or before.mode.mode != tick.mode.mode]
    told = [(round(event.time * 1e9), event.message) for event in recording.modes]
    assert told == changes
    assert [mode for _, mode in told] == ['lying', 'rising', 'standing', 'stopping', 'lowering']


def test_the_gait_does_not_start_while_the_robot_lies_and_the_reason_is_said(
    processes: Processes, tmp_path: Path
) -> None:
    process = start(processes, TOO_EARLY, tmp_path, '--lock-step', '--composed')
    assert process.wait(RUN_S) == 1
    assert 'the gait cannot start: the robot is lying, not standing; call stand_up' in (
        process.output)


def test_ctrl_c_lays_a_live_robot_down_after_the_recording(
    processes: Processes, tmp_path: Path
) -> None:
    process = start(processes, WALKING, tmp_path, '--composed')
    process.wait_for_output('walking', RUN_S)
    process.interrupt()
    assert process.wait(RUN_S) == 130, str(process)
    assert 'it is lying' in process.output
    modes = [event.message for event in load_recording(tmp_path / 'run' / 'bag').modes]
    assert modes == ['standing']
