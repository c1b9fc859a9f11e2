# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`walk`, `learn --motion` on its recording, `walk --motion`: nodes over DDS, in lock-step."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy')

import ros_processes
from played_scenario import loop_takers, play, robot_takers
from ros_processes import RUN_S, SHARED_HZ, Processes
from walked_feet import Walk

from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.commands.walk import load_scenario
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.primitive_files import motion_overrides

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain

SCENARIO = """\
name: straight
duration: 7.0
events:
  - {at: 0.2, inhibit: false}
  - {at: 0.2, command: {v_x: 0.5}}
  - {at: 5.0, inhibit: true}
"""


def test_a_walk_is_learned_from_its_recording_and_walked_again(
    processes: Processes, tmp_path: Path
) -> None:
    scenario, file = tmp_path / 'straight.yaml', tmp_path / 'motion.yaml'
    scenario.write_text(SCENARIO, encoding='utf-8')

    def walk(name: str, *options: str) -> int:
        return processes.walk(scenario, tmp_path / name, '--lock-step', '--rate', str(SHARED_HZ),
                              '--composed', *options).wait(RUN_S)

    assert walk('shown') == 0
    learned = processes.executable('learn', str(tmp_path / 'shown'), '--motion', str(file))
    assert learned.wait(RUN_S) == 0, str(learned)
    assert walk('played', '--motion', str(file)) == 0
    shown, played = (json.loads((tmp_path / name / 'metrics.json').read_text(encoding='utf-8'))
                     for name in ('shown', 'played'))
    assert played['robot']['distance_m'] == pytest.approx(shown['robot']['distance_m'], rel=0.05)
    assert played['stop']['measured_s'] == pytest.approx(played['stop']['predicted_s'], abs=1e-9)

    loop = Walk({**motion_overrides(str(file)), 'cmd_vel_timeout': 0.5,
                 'control_rate': SHARED_HZ})

    def step() -> RobotState:
        loop.go(loop.tick_s)
        return loop.state

    play(load_scenario(scenario), loop.robot.tick_ns, step,
         {**loop_takers(loop.loop), **robot_takers(loop.robot)})
    np.testing.assert_array_equal(
        load_recording(tmp_path / 'played' / 'bag').targets.position,
        [tick.targets.position for tick in loop.ticks])

    assert walk('none', '--motion', str(tmp_path / 'no_such.yaml')) == 2
    assert not (tmp_path / 'none').exists()
