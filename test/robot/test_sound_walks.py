# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nothing is named in walks without a failure, however they are disturbed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip('mujoco')
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.watchdog import CommandWatchdog
from dmp_cpg_ros.studies.loop_recording import suite_of
from dmp_cpg_ros.suite import load_gaits

WALKS: dict[str, tuple[str, float, float, dict[str, Any]]] = {
    'pushed amble': ('amble', 0.8, 0.8, {}),
    'pushed trot': ('trot', 1.5, 1.0, {}),
    'pace': ('pace', 0.6, 0.0, {}),
    'bound on blocks': ('bound', 0.5, 0.0, {'world': 'blocks'}),
    'bound on blocks at 50 Hz': ('bound', 0.5, 0.0, {'world': 'blocks', 'control_rate': 50.0}),
    'pronk': ('pronk', 0.5, 0.5, {}),
    'noise times ten': ('trot', 1.0, 0.6, {'sensor_noise': 10.0}),
    'slope': ('amble', 0.5, 0.0, {'world': 'slope', 'world_degrees': 12.0}),
    'slippery': ('trot', 0.8, 0.0, {'world': 'low_friction', 'world_friction': 0.4}),
    'payload': ('trot', 1.0, 0.6, {'payload': 0.5})}
"""Gait, speed [m/s], change of speed by pushes ahead and aside [m/s], other parameters."""

PUSHED_S, LAST_S = (2.0, 3.0), 4.5


@pytest.mark.parametrize('name', WALKS)
def test_sound_walks_name_nothing(name: str) -> None:
    gait, speed, push, values = WALKS[name]
    suite = suite_of(gait=gait, **values)
    robot = MujocoRobot(suite.robot_file, suite.tick_ns, world=suite.world, sensors=suite.sensors,
                        mismatch=suite.mismatch, seed=3)
    loop = WalkingLoop(robot.description, suite.gait, suite.parameters, load_gaits())
    guard = CommandWatchdog(robot.description, round(suite.robot.target_timeout * 1e9))
    guard.drives.cuts = True
    state, pushes = robot.reset(), list(zip(PUSHED_S, np.eye(3), strict=False)) if push else []
    named: set[str] = set()
    for k in range(round(LAST_S * 1e9 / robot.tick_ns)):
        seconds = 1e-9 * k * robot.tick_ns
        if k == 1:
            loop.request(False)
        loop.command(min(seconds, 1.0) * speed)
        if pushes and seconds >= pushes[0][0]:
            along = pushes.pop(0)[1]
            robot.apply_push(robot.description.mass * push * along / 0.1, 100_000_000)
        for leg, targets in loop.tick(state).targets.by_leg().items():
            guard.accept(leg, state.time_ns, targets)
        targets = guard.targets(state)
        assert loop.estimator_state is not None
        named.update((*loop.estimator_state.estimate.problems, *guard.drives.failing,
                      *guard.drives.lame))
        state = robot.step(targets)
    assert not named and not robot.fallen
