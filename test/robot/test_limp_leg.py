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
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
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


@pytest.mark.parametrize('cuts', [True, False])
def test_a_leg_that_kicks_is_lame_at_once_where_it_can_be_cut_off(cuts: bool) -> None:
    walk = copied('amble', 0.5)
    walk.watchdog.drives.cuts = cuts
    walk.injector.add(Fault('joint', 'garbage', 1.0, 'fr'), walk.state.time_ns)
    walk.run(0.04)
    assert walk.watchdog.drives.lame == (('fr',) if cuts else ())
    assert {name[:2] for name in walk.watchdog.drives.failing} == {'fr'}
    assert walk.robot.without_power == walk.watchdog.drives.lame


def test_a_leg_without_power_gives_no_torque_whatever_it_is_told() -> None:
    robot = MujocoRobot()
    state, still = robot.reset(), np.zeros(12)
    robot.without_power = ('rl',)
    for _ in range(10):
        state = robot.step(JointTargets(state.joint_position + 0.3, still, still))
        assert not state.joint_effort[6:9].any()
        assert state.joint_effort[:6].all() and state.joint_effort[9:].all()
