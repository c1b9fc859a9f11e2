# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joints without power are named at once, and the robot is on its belly before it tips over."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip('mujoco')
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS, JointTargets
from dmp_cpg_ros.core.scenario.fault import Fault
from dmp_cpg_ros.robot.drive_watch import DriveWatch
from dmp_cpg_ros.robot.mujoco_robot import LYING_TILT, MujocoRobot
from dmp_cpg_ros.studies.failures import FailingWalk, walking

ROBOT = 'robots/mini_quadruped.yaml'


def copied(gait: str, speed: float, ahead_s: float = 0.2) -> FailingWalk:
    walk = deepcopy(walking(gait, ROBOT, speed))
    walk.follow(speed, ahead_s)
    walk.tilt = 0.0
    return walk


def without_power(walk: FailingWalk, leg: str, joints: tuple[str, ...] = JOINTS_OF_LEG) -> None:
    """Take the power from some of a leg's joints: no torque, whatever they are told."""
    strength = walk.robot._strength.copy()
    for joint in joints:
        strength[3 * LEGS.index(leg) + JOINTS_OF_LEG.index(joint)] = 0.0
    walk.robot._strength = strength


@pytest.mark.parametrize('leg', ['fl', 'rr'])
@pytest.mark.parametrize(('gait', 'speed'), [('amble', 0.5), ('trot', 1.0)])
def test_a_robot_with_a_limp_leg_is_on_its_belly_before_it_tips_over(
        gait: str, speed: float, leg: str) -> None:
    for phase in range(2):
        walk = copied(gait, speed, 0.2 + 0.13 * phase)
        without_power(walk, leg)
        walk.run(0.15)
        assert walk.watchdog.fallback == 'lie'
        assert not walk.follow(speed, 0.9)
        assert walk.loop.mode.mode in ('lowering', 'lying')
        assert walk.robot.height_over_ground < 0.5 * walk.robot.description.stance_height


def test_it_is_named_within_half_a_second_and_nothing_else_is() -> None:
    for joints in (JOINTS_OF_LEG, ('knee',), ('hip',)):
        walk = copied('trot', 0.5)
        assert not walk.watchdog.drives.failing
        without_power(walk, 'rl', joints)
        walk.run(0.5)
        named = walk.watchdog.drives.failing
        assert named and set(named) <= {f'rl_{joint}' for joint in JOINTS_OF_LEG}


def test_with_power_again_it_stands_up_when_it_is_asked_to() -> None:
    walk = copied('amble', 0.5)
    sound = walk.robot._strength
    without_power(walk, 'fr')
    walk.follow(0.5, 1.5)
    walk.robot._strength = sound
    walk.run(3.0)
    assert not walk.watchdog.drives.failing and not walk.watchdog.fallback
    walk.loop.request_mode('stand_up')
    walk.run(4.0)
    assert walk.loop.mode.mode == 'standing' and not walk.robot.fallen


def test_a_leg_that_is_trapped_comes_free_as_the_robot_recovers() -> None:
    """It is held with more than the little torque that a leg has which was cut off, and with less
    than all of it; the others are not followed as long as it is not where it is to be.
    """
    walk, leg = copied('amble', 0.5), slice(0, 3)
    sound, most = walk.robot._strength, 0.3 * walk.robot.description.legs[0].torque_limit
    without_power(walk, 'fl')
    walk.follow(0.5, 2.5)
    dof = np.arange(walk.robot.model.nv)[walk.robot._dof][leg]
    trap = walk.state.joint_position[leg] + (0.0, 0.6, -0.7)

    def go(seconds: float) -> None:
        for _ in range(round(1e9 * seconds / walk.robot.tick_ns)):
            q, q_dot = walk.state.joint_position[leg], walk.state.joint_velocity[leg]
            walk.robot.data.qfrc_applied[dof] = np.clip(60.0 * (trap - q) - q_dot, -most, most)
            walk.tick()

    go(1.5)
    walk.robot._strength = sound
    go(3.0)
    assert (walk.loop.mode.mode, walk.watchdog.fallback) == ('lying', 'lie')
    walk.loop.request_mode('stand_up')
    go(4.5)
    assert walk.loop.mode.mode == 'damped' and not walk.watchdog.fallback
    walk.loop.request_mode('recover')
    go(4.5)
    assert walk.loop.mode.mode == 'standing' and not walk.robot.fallen


def test_it_stays_down_without_power_whatever_it_is_asked_to() -> None:
    walk = copied('amble', 0.5)
    without_power(walk, 'fl')
    walk.run(2.0)
    walk.loop.request_mode('stand_up')
    walk.run(1.5)
    assert walk.robot.height_over_ground < 0.7 * walk.robot.description.stance_height
    assert walk.tilt < 0.7


@pytest.mark.parametrize('share', [0.4, 1.0])
def test_a_weak_leg_and_a_push_are_walked_through_without_a_word(share: float) -> None:
    strength = np.ones(12)
    strength[:3] = share
    walk = copied('amble', 0.5)
    walk.robot._strength = strength
    mass = walk.robot.description.mass
    for direction in ((0.0, 0.5, 0.0), (-0.5, 0.0, 0.0)):
        walk.robot.apply_push(mass * np.array(direction) / 0.1, 100_000_000)
        assert not walk.follow(0.5, 1.5)
        assert not walk.watchdog.drives.failing and not walk.watchdog.fallback


class CutOff:
    """A watch of drives that are asked for torque, of which those of a leg gave none for a while,
    were cut off, and have their power again.
    """

    def __init__(self, leg: str) -> None:
        robot = MujocoRobot()
        self._state, self._tick_ns, self._tick = robot.reset(), robot.tick_ns, 0
        self.watch, self._kd = DriveWatch(robot.description), np.tile(robot.description.kd, 4)
        self.watch.cuts = True
        self._leg = np.repeat([of == leg for of in LEGS], 3)
        self._asked = np.tile(robot.description.kp, 4) * 0.1
        self._targets = JointTargets(self._state.joint_position + 0.1, *np.zeros((2, 12)))
        assert not any(self.run(1.0, 0.0) for _ in range(300))
        while not self.run(0.0, 1.0):
            assert self._tick < 400
        assert self.watch.lame == (leg,)
        while self.run(0.0, 0.0):
            assert self._tick < 800

    def run(self, share: float, speed: float) -> bool:
        """Whether a leg is lame after a tick in which the leg gave a share of what it was asked
        for, and moved [rad/s].
        """
        self._tick += 1
        moves = np.where(self._leg, speed, 0.0)
        effort = (self._asked - self._kd * moves) * np.where(self._leg, share, 1.0)
        self.watch.see(replace(self._state, time_ns=self._tick * self._tick_ns,
                               joint_velocity=moves, joint_effort=effort))
        self.watch.tell(self._tick * self._tick_ns, self._targets)
        return bool(self.watch.lame)


def test_a_leg_that_was_cut_off_is_judged_by_what_it_gives_once_its_power_is_back() -> None:
    for speed in (0.0, 1.0, 2.0):
        cut_off = CutOff('fl')
        assert not any(cut_off.run(1.0, speed) for _ in range(400))


def test_a_leg_that_gives_what_nobody_asks_for_once_its_power_is_back_is_cut_off_at_once() -> None:
    for share in (-1.0, 4.0):
        cut_off = CutOff('rr')
        assert any(cut_off.run(share, 0.0) for _ in range(3))
    still_limp = CutOff('fl')
    assert any(still_limp.run(0.0, 1.0) for _ in range(20))


@pytest.mark.parametrize('rate', [50, 100, 250])
def test_a_blow_between_the_last_torque_and_a_reading_makes_no_leg_limp(rate: int) -> None:
    """A foot that lands after the drive's last torque changes the velocity for which it is judged:
    at 50 Hz one such reading is most of what is remembered.
    """
    robot = MujocoRobot()
    state, watch = robot.reset(), DriveWatch(robot.description)
    kp, kd = robot.description.kp[0], robot.description.kd[0]
    watch.cuts, leg, tick_ns = True, np.repeat([of == 'rl' for of in LEGS], 3), 10**9 // rate
    for tick in range(1, 4 * rate):
        ahead, blow = 0.1 if tick < rate else 0.02, 5.0 * leg * (tick % 20 == 19)  # [rad], [rad/s]
        watch.see(replace(state, time_ns=tick * tick_ns, joint_velocity=0.6 * leg - blow,
                          joint_effort=ahead * kp - kd * 0.6 * leg))
        watch.tell(tick * tick_ns, JointTargets(
            state.joint_position + ahead, *np.zeros((2, 12))))
        assert not watch.lame and not watch.failing


def test_drives_that_never_reported_a_torque_are_not_judged() -> None:
    robot = MujocoRobot()
    state, still = robot.reset(), np.zeros(12)
    for reports in (False, True):
        watch = DriveWatch(robot.description)
        targets = JointTargets(state.joint_position + 0.1, still, still)
        for tick in range(1, 100):
            asked = np.tile(robot.description.kp, 4) * 0.1
            effort = asked if reports and tick < 50 else still
            watch.see(replace(state, time_ns=tick * robot.tick_ns, joint_effort=effort))
            watch.tell(tick * robot.tick_ns, targets)
        assert len(watch.failing) == (12 if reports else 0)


@pytest.mark.parametrize(('leg', 'later_s', 'seed', 'requests'), [
    ('fl', 0.0, 0, (('recover', 12.0),)),                    # its leg is under the body
    ('rl', 0.3, 3, (('stand_up', 4.0),))])
def test_a_robot_whose_leg_kicked_lies_and_stands_up_again(
        leg: str, later_s: float, seed: int, requests: tuple[tuple[str, float], ...]) -> None:
    walk = copied('trot', 0.5, later_s)
    walk.injector.seed(seed)
    walk.injector.add(Fault('joint', 'garbage', 0.5, leg), walk.state.time_ns)
    assert not walk.follow(0.5, 2.0)
    walk.loop.request(True)
    walk.run(1.0)
    assert walk.tilt < LYING_TILT and not walk.watchdog.drives.lame
    for request, seconds in requests:
        walk.loop.request_mode(request)
        walk.run(seconds)
    assert walk.loop.mode.mode == 'standing' and not walk.robot.fallen


@pytest.mark.parametrize('cuts', [True, False])
def test_a_leg_that_kicks_is_lame_at_once_where_it_can_be_cut_off(cuts: bool) -> None:
    walk = copied('amble', 0.5)
    walk.watchdog.drives.cuts = cuts
    walk.injector.add(Fault('joint', 'garbage', 1.0, 'fr'), walk.state.time_ns)
    walk.run(0.04)
    assert walk.watchdog.drives.lame == (('fr',) if cuts else ())
    assert {name[:2] for name in walk.watchdog.drives.failing} == {'fr'}
    assert walk.robot.without_power == walk.watchdog.drives.lame
    walk.run(0.5)
    named = walk.watchdog.drives.failing                     # as long as it is cut off, at least
    assert set(named) >= ({f'fr_{joint}' for joint in JOINTS_OF_LEG} if cuts else set())


def test_a_leg_without_power_gives_no_torque_whatever_it_is_told() -> None:
    robot = MujocoRobot()
    state, still = robot.reset(), np.zeros(12)
    robot.without_power = ('rl',)
    for _ in range(10):
        state = robot.step(JointTargets(state.joint_position + 0.3, still, still))
        assert not state.joint_effort[6:9].any()
        assert state.joint_effort[:6].all() and state.joint_effort[9:].all()
