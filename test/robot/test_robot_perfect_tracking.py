# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot without physics: it goes where its feet say, and nothing it needs is MuJoCo."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot

DESCRIPTION = load_description()
LEGS = [LegKinematics(leg) for leg in DESCRIPTION.legs]
ZERO = np.zeros(12)


def feet_of(joints):
    return np.array([leg.foot_in_base(joints[3 * i:3 * i + 3]) for i, leg in enumerate(LEGS)])


def joints_of(feet):
    return np.concatenate([leg.inverse(foot) for leg, foot in zip(LEGS, feet, strict=True)])


def follow(robot, feet_of_tick, ticks):
    state = robot.reset()
    home = feet_of(state.joint_position)
    for k in range(1, ticks + 1):
        state = robot.step(JointTargets(joints_of(feet_of_tick(home, k)), ZERO, ZERO))
    return state


def test_it_stands_still_when_told_to():
    robot = PerfectTrackingRobot(DESCRIPTION)
    start = robot.reset()
    state = follow(robot, lambda home, k: home, 10)
    assert state.time_ns == 10 * robot.tick_ns
    np.testing.assert_allclose(state.base_position_in_world, start.base_position_in_world,
                               atol=1e-9)
    np.testing.assert_allclose(state.acceleration_in_base, (0.0, 0.0, 9.81), atol=1e-6)
    assert state.foot_force.sum() == pytest.approx(DESCRIPTION.mass * 9.81)
    assert start.base_position_in_world[2] == pytest.approx(DESCRIPTION.stance_height)


def test_joints_are_exactly_at_their_targets():
    robot = PerfectTrackingRobot(DESCRIPTION)
    targets = JointTargets(*np.random.default_rng(0).normal(0, 0.3, (3, 12)))
    state = robot.step(targets)
    np.testing.assert_array_equal(state.joint_position, targets.position)
    np.testing.assert_array_equal(state.joint_velocity, targets.velocity)
    np.testing.assert_array_equal(state.joint_effort, targets.effort)


def test_feet_that_go_back_carry_the_body_forward():
    robot = PerfectTrackingRobot(DESCRIPTION)
    state = follow(robot, lambda home, k: home - (0.001 * k, 0.0005 * k, 0.0), 40)
    np.testing.assert_allclose(state.base_position_in_world[:2], (0.04, 0.02), atol=1e-9)
    np.testing.assert_allclose(state.base_velocity_in_base, (0.25, 0.125, 0.0), atol=1e-6)


def test_feet_that_turn_back_turn_the_body_and_it_walks_along_its_heading():
    robot = PerfectTrackingRobot(DESCRIPTION)
    turn = 0.005

    def turned(home, k):
        c, s = np.cos(-turn * k), np.sin(-turn * k)
        x, y, z = home.T
        return np.column_stack((c * x - s * y, s * x + c * y, z))

    state = follow(robot, turned, 40)
    heading = 2 * np.arctan2(state.base_quaternion[2], state.base_quaternion[3])
    assert heading == pytest.approx(40 * turn)
    assert state.base_rate_in_base[2] == pytest.approx(turn / (robot.tick_ns * 1e-9))
    np.testing.assert_allclose(state.base_position_in_world[:2], 0.0, atol=1e-9)


def test_a_lifted_foot_bears_nothing_and_drags_nothing():
    robot = PerfectTrackingRobot(DESCRIPTION)

    def swing(home, k):
        feet = home - (0.001 * k, 0.0, 0.0)
        feet[0] = home[0] + (0.003 * k, 0.0, 0.03)
        return feet

    state = follow(robot, swing, 20)
    assert state.foot_force[0] == 0.0
    assert state.foot_force.sum() == pytest.approx(DESCRIPTION.mass * 9.81)
    assert state.base_position_in_world[0] == pytest.approx(0.02, abs=1e-9)


def test_lower_feet_lift_the_body():
    robot = PerfectTrackingRobot(DESCRIPTION)
    state = follow(robot, lambda home, k: home - (0.0, 0.0, 0.0005 * k), 40)
    assert state.base_position_in_world[2] == pytest.approx(DESCRIPTION.stance_height + 0.02)


def test_bad_input_is_refused():
    with pytest.raises(ParameterError, match='-1 ns'):
        PerfectTrackingRobot(DESCRIPTION, tick_ns=-1)
    with pytest.raises(DataError, match='not finite'):
        PerfectTrackingRobot(DESCRIPTION).step(JointTargets(ZERO, ZERO * np.nan, ZERO))


def test_it_needs_no_mujoco():
    code = ('import sys; import dmp_cpg_ros.robot.perfect_tracking; '
            "sys.exit('mujoco' in sys.modules)")
    assert subprocess.run([sys.executable, '-c', code], check=False, timeout=60).returncode == 0
