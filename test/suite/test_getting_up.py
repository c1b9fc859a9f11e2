# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MuJoCo robot stands up, lies down, falls and gets up again; left alone it does not drop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from core_examples import GAITS, GRAVITY, suite_parameters

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.modes.manager import ModeParameters
from dmp_cpg_ros.core.modes.motion_library import Movements
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets, RobotState

pytest.importorskip('mujoco')
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.watchdog import CommandWatchdog

HOLD_NS = 200_000_000

TICK = 0.01
"""Tick of those whose rate does not matter [s]."""


class Life:
    """A robot and its loop, with what they went through."""

    def __init__(self, start_pose: str = 'standing', start_mode: str = '', seed: int = 0,
                 push_recovery: bool = True, tick: float = TICK) -> None:
        self.tick = tick
        self.robot = MujocoRobot(tick_ns=round(1e9 * tick), start_pose=start_pose, seed=seed)
        parameters = suite_parameters(
            mode=ModeParameters(start_mode=start_mode or start_pose),
            inhibition=InhibitionParameters(push_recovery=push_recovery))
        self.loop = WalkingLoop(self.robot.description, GAITS['amble'], parameters)
        self.states: list[RobotState] = [self.robot.reset()]
        self.modes: list[str] = []

    def go(self, seconds: float, until: str = '') -> Life:
        for _ in range(round(seconds / self.tick)):
            tick = self.loop.tick(self.states[-1])
            self.states.append(self.robot.step(tick.targets))
            if self.modes[-1:] != [tick.mode.mode]:
                self.modes.append(tick.mode.mode)
            if tick.mode.mode == until:
                break
        return self

    def column(self, name: str) -> np.ndarray:
        return np.array([getattr(state, name) for state in self.states])

    @property
    def stands(self) -> bool:
        last = self.states[-1]
        return (self.modes[-1] == 'standing' and not self.robot.fallen
                and last.foot_force.min() > 0.02 * self.robot.description.mass * GRAVITY
                and last.base_position_in_world[2] > 0.9 * self.robot.description.stance_height)


@pytest.mark.parametrize(('pose', 'mode'), [('lying', 'lying'), ('fallen', 'damped')])
def test_a_robot_that_was_to_stand_and_does_not_is_found_as_it_is(pose: str, mode: str) -> None:
    """It stood up at once, jumped, and fell over."""
    life = Life(pose, 'standing', seed=3).go(0.5)
    assert life.modes[0] == mode
    assert np.abs(life.column('joint_velocity')).max() < 5.0
    if mode == 'lying':
        life.loop.request_mode('stand_up')
        assert life.go(3.0).stands


def test_it_stands_up_from_its_belly_within_its_limits_and_never_sinks() -> None:
    life = Life('lying').go(0.2)
    low = life.robot.description.belly_depth
    assert life.states[0].base_position_in_world[2] == pytest.approx(low, abs=2e-3)
    life.loop.request_mode('stand_up')
    life.go(life.loop.body.modes.movements.duration(('rise',)))
    height = life.column('base_position_in_world')[:, 2]
    assert (np.diff(height) > -5e-4).all()
    life.go(0.8)
    assert life.modes == ['lying', 'rising', 'standing'] and life.stands
    limit = np.concatenate([leg.torque_limit for leg in life.robot.description.legs])
    assert (np.abs(life.column('joint_effort')) < 0.6 * limit).all()
    q = life.column('joint_position')
    assert all((q[:, 3 * i:3 * i + 3] >= leg.position_lower).all()
               and (q[:, 3 * i:3 * i + 3] <= leg.position_upper).all()
               for i, leg in enumerate(life.robot.description.legs))


def test_asked_to_lie_down_while_walking_it_stops_first_and_comes_down_gently() -> None:
    life = Life()
    life.loop.command(0.4)
    life.go(2.0)
    assert life.loop.stop.state == 'walking'
    life.loop.request_mode('lie_down')
    life.go(4.5)
    assert life.modes == ['standing', 'stopping', 'lowering', 'lying']
    down = np.diff(life.column('base_position_in_world')[:, 2]) / TICK
    assert down.min() > -0.4
    with pytest.raises(DataError, match='cannot start: the robot is lying'):
        life.loop.request(False)
    life.loop.command(0.4)
    assert life.go(0.5).modes[-1] == 'lying'


def test_changing_its_mind_half_way_up() -> None:
    life = Life('lying').go(0.1)
    life.loop.request_mode('stand_up')
    life.go(0.8)
    life.loop.request_mode('lie_down')
    life.go(0.5)
    life.loop.request_mode('stand_up')
    life.go(2.5)
    assert life.modes == ['lying', 'rising', 'lowering', 'rising', 'standing'] and life.stands


@pytest.mark.parametrize('begun', ['lying', 'standing'])
def test_half_up_when_its_posture_control_is_restarted_it_lies_down_and_can_stand_up(
        begun: str) -> None:
    life = Life('lying')
    rise_half_way(life)
    modes, low = life.loop.body.modes, life.robot.description.belly_depth
    assert life.states[-1].base_position_in_world[2] > 2.0 * low
    forgotten = replace(modes.initial_state(), mode=begun)
    life.loop.posture = replace(life.loop.posture, mode=modes.picked_up(
        forgotten, life.states[-1]))
    life.go(modes.movements.duration(('fold',)) + 0.1)
    assert life.modes == ['lying', 'rising', 'lowering', 'lying']
    assert life.states[-1].base_position_in_world[2] == pytest.approx(low, abs=5e-3)
    life.loop.request_mode('stand_up')
    life.go(modes.movements.duration(('rise',)) + 0.3)
    assert life.stands


def test_pushed_over_it_is_damped_until_it_is_told_to_recover() -> None:
    # on its feet it would fall otherwise, and later
    life = Life(push_recovery=False, tick=0.004).go(0.3)
    life.robot.apply_push(np.array((0.0, 400.0, 0.0)), 200_000_000)
    life.go(2.0)
    assert life.modes == ['standing', 'damped']
    assert 'fell at' in life.loop.mode.reason
    assert np.abs(life.states[-1].joint_velocity).max() < 0.5  # raised legs sink slowly
    assert np.abs(life.states[-1].joint_effort).max() < 1.0
    for what in ('stand_up', 'lie_down'):
        with pytest.raises(DataError, match='use recover'):
            life.loop.request_mode(what)
    life.loop.request_mode('recover')
    life.loop.command(0.4)
    life.go(25.0, until='standing').go(0.5)
    assert life.modes == ['standing', 'damped', 'recovering', 'rising', 'standing'] and life.stands
    assert life.loop.stop.state == 'at_rest'  # the command that stood while it fell starts nothing
    life.loop.request(False)
    assert life.go(0.5).loop.stop.state == 'walking'


@pytest.mark.parametrize('seed', range(4))
def test_it_recovers_from_however_it_fell(seed: int) -> None:
    life = Life('fallen', 'damped', seed).go(0.1)
    life.loop.request_mode('recover')
    life.go(30.0, until='standing').go(0.4)
    assert life.stands and life.loop.mode.tries <= 3


def test_a_seed_makes_the_fall_vary_reproducibly() -> None:
    falls = [MujocoRobot(start_pose='fallen', seed=seed).reset() for seed in (3, 3, 4)]
    np.testing.assert_array_equal(falls[0].joint_position, falls[1].joint_position)
    assert np.abs(falls[0].joint_position - falls[2].joint_position).max() > 0.1
    assert falls[0].time_ns == 0
    assert np.linalg.norm(falls[0].base_velocity_in_base) < 0.1  # it has come to rest


def test_a_start_pose_that_is_none_is_refused() -> None:
    with pytest.raises(ParameterError, match='standing, lying, fallen'):
        MujocoRobot(start_pose='hanging')


def left_alone(life: Life, seconds: float, prepare: Callable[[Life], None]) -> CommandWatchdog:
    """Let the legs fall silent and the robot look after itself."""
    prepare(life)
    guard = CommandWatchdog(life.robot.description, HOLD_NS)
    for i, leg in enumerate(LEGS):
        joints = slice(3 * i, 3 * i + 3)
        targets = life.loop.tick(life.states[-1]).targets
        guard.accept(leg, life.states[-1].time_ns, JointTargets(
            targets.position[joints], targets.velocity[joints], targets.effort[joints]))
    for _ in range(round(seconds / TICK)):
        life.states.append(life.robot.step(guard.targets(life.states[-1])))
    return guard


def rise_half_way(life: Life) -> None:
    life.go(0.1)
    life.loop.request_mode('stand_up')
    life.go(0.7)


def amble(life: Life) -> None:
    life.loop.command(0.3)
    life.go(1.5)


def fall(life: Life) -> None:
    life.go(0.3)
    life.robot.apply_push(np.array((0.0, 400.0, 0.0)), 200_000_000)
    life.go(0.8)


@pytest.mark.parametrize(('start', 'prepare', 'retreat'), [
    ('lying', rise_half_way, 'lie'), ('standing', amble, 'stand'), ('standing', fall, 'damp')])
def test_left_alone_it_looks_after_itself_and_does_not_drop(
        start: str, prepare: Callable[[Life], None], retreat: str) -> None:
    life = Life(start)
    begin = len(life.states)
    guard = left_alone(life, 3.0, prepare)
    assert guard.fallback == retreat
    down = np.diff(life.column('base_position_in_world')[begin:, 2]) / TICK
    last = life.states[-1]
    assert np.linalg.norm(last.base_velocity_in_base) < 0.02
    if retreat != 'damp':
        assert down.min() > -0.5
    if retreat == 'lie':
        low = life.robot.description.belly_depth
        assert last.base_position_in_world[2] == pytest.approx(low, abs=5e-3)
    if retreat == 'stand':
        assert not life.robot.fallen


def test_durations_are_what_was_said() -> None:
    life = Life('lying').go(0.1)
    text = life.loop.request_mode('stand_up')
    said = Movements(life.robot.description).duration(('rise',))
    assert f'{said:.2f} s' in text
    before = len(life.states)
    life.go(5.0, until='standing')
    assert (len(life.states) - before) * TICK == pytest.approx(said, abs=0.03)
