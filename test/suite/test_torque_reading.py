# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The torque reading walks too: measured angles in, torques out, no gains in the joint drive."""

from __future__ import annotations

import numpy as np
import pytest
from played_scenario import loop_takers, play, robot_takers

pytest.importorskip('mujoco')

from dmp_cpg_ros.commands.walk import load_scenario
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.robot_file import load_robot_file
from dmp_cpg_ros.suite import load_suite


def test_the_torque_reading_ambles_and_stops() -> None:
    scenario = load_scenario('torque_reading.yaml')
    suite = load_suite(overrides=scenario.parameters)
    robot = MujocoRobot(load_robot_file(suite.robot_file).without_gains(), suite.tick_ns)
    loop = WalkingLoop(robot.description, suite.gait, suite.parameters)
    states = [robot.reset()]

    def step() -> None:
        states.append(robot.step(loop.tick(states[-1]).targets))

    play(scenario, suite.tick_ns, step, {**loop_takers(loop), **robot_takers(robot)})
    assert not robot.fallen
    speed = np.array([state.base_velocity_in_base[0] for state in states])
    walking = speed[round(3e9 / suite.tick_ns) : round(8e9 / suite.tick_ns)]
    assert walking.mean() == pytest.approx(0.4, rel=0.1)
    assert np.linalg.norm(states[-1].base_velocity_in_base) < 0.01
    assert states[-1].foot_force.min() > 0.0
