# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Primitives learned from the joints of a walking robot."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from core_examples import GAITS, TICK, suite_parameters

from dmp_cpg_ros.core.learning.period import find_period, spread_between_cycles
from dmp_cpg_ros.core.learning.rhythmic import learn_rhythmic, reproduction_errors
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES

pytest.importorskip('mujoco')
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

SETTLING, RECORDED = 7.0, 3.0
WHOLE_TICKS = {'amble': 130, 'trot': 120}
"""Ticks of a cycle with which the walk repeats itself: the ticks fall on the same phases in every
cycle."""


def speed_of_period(loop, period):
    """Speed at which the cadence's table gives a period [m/s], by bisection."""
    slow, fast = 0.05, 0.9
    for _ in range(60):
        speed = 0.5 * (slow + fast)
        longer = 2.0 * np.pi / loop.network.omega(np.array((speed, 0.0, 0.0))) > period
        slow, fast = (speed, fast) if longer else (slow, speed)
    return speed


@lru_cache
def recorded_walk(gait, whole_ticks=True):
    """Measured joint angles of the MuJoCo robot once it walks steadily, and their period."""
    robot = MujocoRobot()
    loop = WalkingLoop(robot.description, GAITS[gait], suite_parameters())
    loop.command(speed_of_period(loop, WHOLE_TICKS[gait] * TICK) if whole_ticks else 0.4)
    state, times, angles = robot.reset(), [], []
    for i in range(round((SETTLING + RECORDED) / TICK)):
        if i * TICK >= SETTLING:
            times.append(state.time_ns * 1e-9)
            angles.append(state.joint_position)
        state = robot.step(loop.tick(state).targets)
    recording = Demonstration(np.array(times), np.array(angles), names=JOINT_NAMES)
    return recording, 2.0 * np.pi / float(loop.network.omega(loop.r))


@pytest.mark.parametrize('gait', ['amble', 'trot'])
def test_25_bases_reproduce_a_recorded_walk_to_less_than_one_percent(gait):
    """Every joint, every cycle, in the joint's own range."""
    recording, true_period = recorded_walk(gait)
    period = find_period(recording)
    assert period == pytest.approx(true_period, rel=1e-3)
    primitive = learn_rhythmic(recording, 25, period=true_period)
    assert np.all(reproduction_errors(primitive, recording, true_period) < 0.01)


@pytest.mark.parametrize('gait', ['amble', 'trot'])
def test_no_cycle_of_a_recorded_walk_is_missed_by_much_more_than_cycles_differ(gait):
    recording, _ = recorded_walk(gait, whole_ticks=False)
    period = find_period(recording)
    errors = reproduction_errors(learn_rhythmic(recording, 25, period=period), recording, period)
    own = np.ptp(recording.positions, axis=0)
    assert np.all(errors * own / own.max() < 0.01)
    irregular = spread_between_cycles(recording, period) / own
    assert np.all(errors < np.maximum(0.01, 1.5 * irregular))
