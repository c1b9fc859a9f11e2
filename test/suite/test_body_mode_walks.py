# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Standing up and lying down through the services of real nodes, and a shut-down that drops
nobody.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy')

import ros_processes
from plain_run import plain_run
from ros_processes import RUN_S, Processes

from dmp_cpg_ros.analysis.loading import load_recording

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain

UP_AND_DOWN = """\
name: up_and_down
duration: 4.2
parameters: {start_mode: lying, start_pose: lying, control_rate: 50.0}
events:
  - {at: 0.1, stand_up: true}
  - {at: 2.0, inhibit: false}
  - {at: 2.0, command: {v_x: 0.3}}
  - {at: 2.1, lie_down: true}
"""

TOO_EARLY = """\
name: too_early
duration: 1.0
parameters: {start_mode: lying, start_pose: lying, control_rate: 50.0}
events:
  - {at: 0.1, inhibit: false}
"""

WALKING = """\
name: stroll
duration: 300.0
parameters: {control_rate: 50.0}
events:
  - {at: 0.1, inhibit: false}
  - {at: 0.1, command: {v_x: 0.3}}
"""

def test_services_act_at_their_ticks_and_nodes_agree_with_the_plain_loop_bit_for_bit(
    processes: Processes, tmp_path: Path
) -> None:
    process = processes.walk(
        UP_AND_DOWN, tmp_path / 'run', '--lock-step', '--processes', 'blocks')
    assert process.wait(RUN_S) == 0, str(process)
    assert 'lie_down: lying' in process.output
    recording = load_recording(tmp_path / 'run' / 'bag')
    states, ticks = plain_run(tmp_path / 'run.yaml')
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
    process = processes.walk(TOO_EARLY, tmp_path / 'run', '--lock-step', '--composed')
    assert process.wait(RUN_S) == 1
    assert 'the gait cannot start: the robot is lying, not standing; call stand_up' in (
        process.output)


def test_ctrl_c_lays_a_live_robot_down_after_the_recording(
    processes: Processes, tmp_path: Path
) -> None:
    process = processes.walk(WALKING, tmp_path / 'run', '--composed')
    process.wait_for_output('walking', RUN_S)
    process.interrupt()
    assert process.wait(RUN_S) == 130, str(process)
    assert 'it is lying' in process.output
    modes = [event.message for event in load_recording(tmp_path / 'run' / 'bag').modes]
    assert modes == ['standing']
