# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The plain loop moves the MuJoCo robot: it stands, ambles, stops by any leg, repeats itself."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import GAITS, GRAVITY, TICK, suite_parameters

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState
from dmp_cpg_ros.studies.freezing_loop import FreezingLoop

pytest.importorskip('mujoco')
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot


@pytest.fixture(scope='module')
def robot() -> MujocoRobot:
    return MujocoRobot()


def walk(robot: MujocoRobot, loop: WalkingLoop, seconds: float,
         state: RobotState) -> list[RobotState]:
    states = [state]
    for _ in range(round(seconds / TICK)):
        states.append(robot.step(loop.tick(states[-1]).targets))
        assert not robot.fallen
    return states[1:]


def stands(states: list[RobotState], weight: float) -> bool:
    """Whether the body is slower than 1 cm/s and every foot carries more than 2 % of it."""
    return all(np.linalg.norm(state.base_velocity_in_base) < 0.01
               and state.foot_force.min() > 0.02 * weight for state in states)


def test_it_stands(robot: MujocoRobot) -> None:
    loop = WalkingLoop(robot.description, GAITS['amble'])
    states = walk(robot, loop, 1.0, robot.reset())
    assert stands(states[-100:], robot.description.mass * GRAVITY)
    assert states[-1].base_position_in_world[2] == pytest.approx(
        robot.description.stance_height, abs=0.01)
    assert np.hypot(*states[-1].base_position_in_world[:2]) < 0.01


@pytest.mark.parametrize('gait', ['amble', 'trot'])
def test_it_walks_at_the_commanded_speed_and_straight(robot: MujocoRobot, gait: str) -> None:
    loop = WalkingLoop(robot.description, GAITS[gait], suite_parameters())
    loop.command(0.5)
    states = walk(robot, loop, 4.0, robot.reset())[-500:]
    moved = states[-1].base_position_in_world - states[0].base_position_in_world
    assert moved[0] / (499 * TICK) == pytest.approx(0.5, rel=0.1)
    assert abs(moved[1]) < 0.1
    assert loop.stop.state == 'walking'


@pytest.mark.parametrize('leg', LEGS)
def test_any_one_of_the_four_oscillators_stops_it(robot: MujocoRobot, leg: str) -> None:
    parameters = suite_parameters(inhibition=InhibitionParameters(inhibited_legs=(leg,)))
    loop = WalkingLoop(robot.description, GAITS['amble'], parameters)
    loop.command(0.5)
    states = walk(robot, loop, 2.5, robot.reset())
    predicted = loop.request(True)
    states = walk(robot, loop, 2.2, states[-1])
    assert loop.stop.state == 'at_rest'
    assert loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)
    assert stands(states[-100:], robot.description.mass * GRAVITY)


def test_two_runs_are_identical_bit_for_bit(robot: MujocoRobot) -> None:
    def run() -> list[bytes]:
        loop = WalkingLoop(robot.description, GAITS['walk'], suite_parameters())
        loop.command(0.4, 0.1, 0.2)
        return [state.joint_position.tobytes() + state.base_position_in_world.tobytes()
                for state in walk(robot, loop, 1.0, robot.reset())]

    assert run() == run()


@pytest.mark.parametrize('finish_swing', [False, True])
def test_the_baselines_freeze_every_leg(
        robot: MujocoRobot, finish_swing: bool) -> None:
    loop = FreezingLoop(robot.description, GAITS['walk'], suite_parameters())
    loop.command(0.3)
    states = walk(robot, loop, 2.0, robot.reset())
    at_request = loop.x.copy()
    loop.freeze(finish_swing)
    states = walk(robot, loop, 1.0, states[-1])
    frozen = loop.tick(states[-1]).targets
    later = loop.tick(walk(robot, loop, 0.2, states[-1])[-1]).targets
    assert np.array_equal(frozen.position, later.position) and not later.velocity.any()
    moved = np.abs(loop.x - at_request).max(axis=1) > 1e-9
    assert moved.any() == finish_swing and not moved.all()
