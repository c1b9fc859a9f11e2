# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stop outlives whoever watches it, and is carried out when nobody does."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from dmp_cpg_ros.core.inhibition.handover import SilentStop, adopted
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.suite import load_suite

pytest.importorskip('mujoco')
from dmp_cpg_ros.robot.model_reader import load_description

SUITE = load_suite(None, {'cmd_vel_timeout': 0.0})


@cache
def walked() -> tuple[WalkingLoop, PerfectTrackingRobot, RobotState]:
    robot = PerfectTrackingRobot(load_description(SUITE.robot_file), SUITE.tick_ns, 'standing')
    loop = WalkingLoop(robot.description, SUITE.gait, SUITE.parameters)
    state = robot.reset()
    loop.command(0.5)
    state = go(loop, robot, state, 500)
    assert loop.stop.state == 'walking'
    return loop, robot, state


def walking() -> tuple[WalkingLoop, PerfectTrackingRobot, RobotState]:
    """A loop and a robot that have walked for a while, once for all who walk on."""
    loop, robot, state = walked()
    return deepcopy(loop), deepcopy(robot), state


def go(loop: WalkingLoop, robot: PerfectTrackingRobot, state: RobotState, ticks: int
       ) -> RobotState:
    for _ in range(ticks):
        state = robot.step(loop.tick(state).targets)
    return state


def test_a_stop_by_the_service_stays_one_whatever_is_commanded() -> None:
    loop, robot, state = walking()
    loop.request(True)
    state = go(loop, robot, state, 600)
    assert loop.stop.state == 'at_rest'
    loop.stop = adopted(  # as a restarted node would begin
        loop.inhibition, state.time_ns, loop.supervisor.parameters)
    state = go(loop, robot, state, 600)
    assert loop.stop.state == 'at_rest' and loop.stop.requested
    loop.request(False)
    go(loop, robot, state, 500)
    assert loop.stop.state == 'walking'


def test_a_stop_under_way_is_carried_on() -> None:
    loop, robot, state = walking()
    loop.request(True)
    state = go(loop, robot, state, 50)
    assert loop.stop.state == 'waiting'
    loop.stop = adopted(
        loop.inhibition, state.time_ns, loop.supervisor.parameters)
    go(loop, robot, state, 600)
    assert loop.stop.state == 'at_rest'


def test_a_gait_that_runs_is_not_touched() -> None:
    loop, robot, state = walking()
    phases = loop.network.phase_errors(loop.x)
    loop.stop = adopted(
        loop.inhibition, state.time_ns, loop.supervisor.parameters)
    for _ in range(200):
        state = go(loop, robot, state, 1)
        assert not loop.stop.requested and not loop.inhibition.gains.any()
    assert loop.stop.state == 'walking'
    assert np.allclose(loop.network.phase_errors(loop.x), phases, atol=1e-9)


@pytest.mark.parametrize('asked', [False, True])
def test_without_a_watcher_the_oscillators_come_to_rest_within_the_bound(asked: bool) -> None:
    loop, _, state = walking()
    if asked:
        loop.request(True)
    bound, network, x = loop.time_to_rest(), loop.network, loop.x
    silent = SilentStop(loop.supervisor, loop.supervisor.inhibition(loop.stop), state.time_ns)
    r, dt, ticks = loop.r, SUITE.tick_ns * 1e-9, 0
    while not silent.inhibition.at_rest:
        ticks += 1
        r = loop.reference.step(r, np.zeros(3), dt)
        acting = silent.inhibition
        x = network.step(x, r, acting, dt)
        silent.step(state.time_ns + ticks * SUITE.tick_ns, network, x,
                    network.rate(x, r, acting), r)
        assert ticks * dt <= bound
    assert silent.inhibition.automatic != asked
