# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Standing up and lying down as discrete primitives: smooth, within limits, from anywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_examples import geometry, quadruped

from dmp_cpg_ros.core.balance.body_command import BodyCommand
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.modes.leg_control import LegMotion
from dmp_cpg_ros.core.modes.motion_library import (
    Movements,
    folded_length,
    leg_angles,
    lying_posture,
    phase_at,
    raised_posture,
    standing_posture,
)
from dmp_cpg_ros.core.primitives.demonstration import minimum_jerk
from dmp_cpg_ros.core.primitives.spring_damper import SpringState
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.leg import LegParameters, LegPrimitive, LegState

LOWER, UPPER = np.array((-1.0, -1.2, -2.7)), np.array((1.0, 2.8, -0.2))


def robot(size: float = 1.0, knee_sign: int = -1) -> RobotDescription:
    """A quadruped with the joint limits of a real one, of any size, knees either way."""
    plain = quadruped()
    lower, upper = LOWER.copy(), UPPER.copy()
    if knee_sign > 0:
        lower[1:], upper[1:] = -UPPER[1:], -LOWER[1:]
    legs = tuple(
        replace(leg, hip_in_base=size * leg.hip_in_base, hip_offset=size * leg.hip_offset,
                thigh=size * leg.thigh, shank=size * leg.shank, knee_sign=knee_sign,
                foot_radius=size * leg.foot_radius, position_lower=lower, position_upper=upper)
        for leg in plain.legs)
    return replace(plain, legs=legs, stance_height=size * plain.stance_height,
                   belly_depth=size * 0.05)


ROBOT = robot()
ROBOTS = [ROBOT, robot(knee_sign=1), robot(2.0)]


def soles(description: RobotDescription, q: np.ndarray) -> np.ndarray:
    """Heights of the soles over base_link (4,)."""
    return np.array([LegKinematics(leg).foot_in_base(q[3 * i:3 * i + 3])[2] - leg.foot_radius
                     for i, leg in enumerate(description.legs)])


def within(description: RobotDescription, q: np.ndarray, slack: float = 0.0) -> bool:
    lower = np.concatenate([leg.position_lower for leg in description.legs])
    upper = np.concatenate([leg.position_upper for leg in description.legs])
    return bool(((q >= lower - slack) & (q <= upper + slack)).all())


@pytest.mark.parametrize('description', ROBOTS)
def test_lying_has_belly_and_soles_on_the_ground_and_folded_legs(
        description: RobotDescription) -> None:
    q = lying_posture(description)
    assert within(description, q)
    np.testing.assert_allclose(soles(description, q), -description.belly_depth, atol=1e-6)
    for i, leg in enumerate(description.legs):
        knee = LegKinematics(leg)
        hip = leg.hip_in_base + leg.hip_offset
        foot = knee.foot_in_base(q[3 * i:3 * i + 3])
        assert abs(foot[0] - hip[0]) < 0.1 * knee.thigh_length  # beside the hip


@pytest.mark.parametrize('description', ROBOTS)
def test_all_four_soles_stay_on_one_ground_all_the_way_up(description: RobotDescription) -> None:
    low, high = description.belly_depth, description.stance_height
    for share in np.linspace(0.0, 1.0, 41):
        q = raised_posture(description, share)
        assert within(description, q)
        height = low + (high - low) * share
        np.testing.assert_allclose(soles(description, q), -height, atol=0.01 * high)


def test_the_way_ends_in_the_stance_of_the_gait() -> None:
    for leg in LEGS:
        joints = slice(3 * LEGS.index(leg), 3 * LEGS.index(leg) + 3)
        stance = LegPrimitive(leg, ROBOT, LegParameters()).initial_state()
        np.testing.assert_allclose(standing_posture(ROBOT)[joints], stance.joints.position)
        np.testing.assert_allclose(raised_posture(ROBOT, 1.0)[joints], stance.joints.position)


def test_a_leg_that_cannot_spread_far_enough_puts_its_foot_behind() -> None:
    narrow = np.array((0.5, 2.8, -0.2))
    legs = tuple(replace(leg, position_lower=np.array((-0.5, -1.2, -2.7)), position_upper=narrow)
                 for leg in ROBOT.legs)
    description = replace(ROBOT, legs=legs)
    q = lying_posture(description)
    assert within(description, q)
    np.testing.assert_allclose(soles(description, q), -description.belly_depth, atol=1e-6)
    for i, leg in enumerate(legs):
        assert LegKinematics(leg).foot_in_base(q[3 * i:3 * i + 3])[0] < leg.hip_in_base[0] - 0.01


@pytest.mark.parametrize('size', [0.5, 1.0, 2.0])
def test_the_folded_length_is_the_shortest_within_the_limits(size: float) -> None:
    leg = robot(size).legs[0]
    knees = np.linspace(leg.position_lower[2], leg.position_upper[2], 400)
    hip = leg.hip_in_base + leg.hip_offset
    lengths = [np.linalg.norm(LegKinematics(leg).foot_in_base((0.0, 0.0, knee)) - hip)
               for knee in knees]
    assert min(lengths) <= folded_length(leg) <= 1.3 * min(lengths)


@pytest.mark.parametrize('knee_sign', [-1, 1])
@pytest.mark.parametrize('left', [1.0, -1.0])
def test_leg_angles_mean_what_they_say(knee_sign: int, left: float) -> None:
    leg = geometry(left=left, knee_sign=knee_sign)
    kinematics = LegKinematics(leg)
    hip = leg.hip_in_base + leg.hip_offset
    straight = kinematics.foot_in_base(leg_angles(leg, 0.0, 0.0, 0.0)) - hip
    np.testing.assert_allclose(straight, (0.0, 0.0, -0.39), atol=1e-9)
    spread = kinematics.foot_in_base(leg_angles(leg, 0.5, 0.0, 0.0))
    assert left * (spread[1] - leg.hip_in_base[1] - leg.hip_offset[1]) > 0.1
    swung = kinematics.foot_in_base(leg_angles(leg, 0.0, 1.0, 0.0)) - hip
    assert np.sign(swung[0]) == knee_sign  # knees that bend backwards point backwards
    bent = kinematics.foot_in_base(leg_angles(leg, 0.0, 0.0, 1.0)) - hip
    assert np.sign(bent[0]) == -knee_sign


def test_durations_scale_with_the_root_of_the_leg_length() -> None:
    small, large = Movements(robot(1.0)), Movements(robot(4.0))
    for name in ('rise', 'lower', 'fold', 'tuck', 'push_left'):
        ratio = large.named(name).duration / small.named(name).duration
        assert ratio == pytest.approx(2.0, rel=1e-6)


def test_an_unknown_movement_lists_the_valid_ones() -> None:
    with pytest.raises(DataError, match='rise, lower, fold'):
        Movements(ROBOT).named('jump')


class Mover:
    """The four legs of a robot, driven by commands."""

    def __init__(self, start: np.ndarray, dt: float = 0.004) -> None:
        self.dt, self.movements = dt, Movements(ROBOT)
        primitives = [LegPrimitive(leg, ROBOT, LegParameters()) for leg in LEGS]
        self.legs = [LegMotion(slice(3 * i, 3 * i + 3), self.movements, one.transformation)
                     for i, one in enumerate(primitives)]
        zero = np.zeros(3)
        self.states = [LegState(SpringState(start[3 * i:3 * i + 3], zero), 0.0,
                                np.zeros(3)) for i in range(4)]
        self.motions = [None] * 4
        self.measured = start
        self.goals: list[np.ndarray] = []
        self.goal_velocities: list[np.ndarray] = []
        self.positions: list[np.ndarray] = []
        self.velocities: list[np.ndarray] = []

    def tick(self, command: BodyCommand) -> None:
        goals, speeds = [], []
        for i, leg in enumerate(self.legs):
            self.motions[i], self.states[i], goal, speed = leg.step(
                self.motions[i], self.states[i], command, self.measured[3 * i:3 * i + 3],
                self.dt)
            goals.append(goal)
            speeds.append(speed)
        self.goals.append(np.concatenate(goals))
        self.goal_velocities.append(np.concatenate(speeds))
        self.positions.append(np.concatenate([s.joints.position for s in self.states]))
        self.velocities.append(np.concatenate([s.joints.velocity for s in self.states]))

    def move(self, name: str, share: float = 1.0) -> Mover:
        duration = self.movements.named(name).duration
        for k in range(round(share * duration / self.dt) + 1):
            x = phase_at(k * self.dt / duration)
            self.tick(BodyCommand('recovering', name, x))
        return self


def random_posture(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.concatenate([rng.uniform(LOWER + 0.1, UPPER - 0.1) for _ in LEGS])


@pytest.mark.parametrize('name', ['fold', 'tuck', 'turn_left', 'push_right', 'over_left'])
@pytest.mark.parametrize('seed', range(3))
def test_from_anywhere_within_the_limits_it_arrives_without_leaving_them(
        name: str, seed: int) -> None:
    mover = Mover(random_posture(seed)).move(name)
    goal = mover.movements.named(name).goal
    assert np.abs(mover.goals[-1] - goal).max() < 3e-3
    assert np.abs(mover.goal_velocities[-1]).max() < 0.1
    assert all(within(ROBOT, q, slack=2e-3) for q in mover.goals)
    assert all(within(ROBOT, q, slack=5e-3) for q in mover.positions)


@pytest.mark.parametrize('start', ['lying', 'random'])
def test_targets_are_continuously_differentiable_also_where_movements_change(start: str) -> None:
    begin = lying_posture(ROBOT) if start == 'lying' else random_posture(5)

    def largest_jumps(dt: float) -> tuple[float, float]:
        mover = Mover(begin, dt)
        if start == 'random':
            mover.move('tuck', 0.6).move('push_left', 0.3)
        mover.move('fold').move('rise', 0.5).move('lower', 0.4).move('rise')
        positions, velocities = np.array(mover.positions), np.array(mover.velocities)
        mean = 0.5 * (velocities[1:] + velocities[:-1])
        wrong = np.abs(np.diff(positions, axis=0) / dt - mean).max()
        return float(wrong), float(np.abs(np.diff(velocities, axis=0)).max())

    coarse, fine = largest_jumps(0.006), largest_jumps(0.002)
    assert fine[0] < 0.5 * coarse[0] and fine[1] < 0.5 * coarse[1]


@pytest.mark.parametrize(('name', 'sign'), [('rise', 1.0), ('lower', -1.0)])
def test_the_height_is_monotone_on_the_way_and_the_robot_stays_level(
        name: str, sign: float) -> None:
    start = lying_posture(ROBOT) if name == 'rise' else standing_posture(ROBOT)
    mover = Mover(start).move(name)
    heights = np.array([-soles(ROBOT, q) for q in mover.goals])
    assert (sign * np.diff(heights.mean(axis=1)) > -1e-4).all()
    assert np.ptp(heights, axis=1).max() < 2e-3
    ends = heights.mean(axis=1)[[0, -1]]
    expected = sorted((ROBOT.belly_depth, ROBOT.stance_height), reverse=sign < 0.0)
    np.testing.assert_allclose(ends, expected, atol=3e-3)


def test_the_phase_of_the_command_rules_when_ticks_are_lost() -> None:
    whole, gappy = Mover(lying_posture(ROBOT)), Mover(lying_posture(ROBOT))
    duration = whole.movements.named('rise').duration
    for k in range(201):
        command = BodyCommand('rising', 'rise', phase_at(k * 0.004 / duration))
        whole.tick(command)
        if k % 7 != 3:
            gappy.dt = 0.008 if k % 7 == 4 else 0.004
            gappy.tick(command)
    np.testing.assert_allclose(gappy.goals[-1], whole.goals[-1], atol=2e-3)


def test_damped_legs_follow_what_is_measured_and_lying_legs_stay() -> None:
    mover = Mover(lying_posture(ROBOT))
    for k in range(10):
        mover.measured = lying_posture(ROBOT) + 0.01 * k
        mover.tick(BodyCommand('damped'))
        np.testing.assert_array_equal(mover.positions[-1], mover.measured)
        assert not mover.velocities[-1].any()
    held = mover.positions[-1]
    for _ in range(10):
        mover.measured = held + 1.0
        mover.tick(BodyCommand('lying'))
    np.testing.assert_array_equal(mover.positions[-1], held)


def test_a_leg_that_begins_somewhere_takes_its_joints_where_they_are() -> None:
    mover = Mover(standing_posture(ROBOT), 0.0)
    mover.measured = lying_posture(ROBOT)
    mover.tick(BodyCommand('lying'))
    np.testing.assert_array_equal(mover.positions[-1], lying_posture(ROBOT))


def test_minimum_jerk_is_a_smooth_step() -> None:
    s = np.linspace(-0.5, 1.5, 401)
    u = minimum_jerk(s)
    assert (np.diff(u) >= 0.0).all() and u[0] == 0.0 and u[-1] == 1.0
    np.testing.assert_allclose(u + u[::-1], 1.0, atol=1e-12)
    assert np.abs(np.diff(u, 2)).max() < 1.1 * 5.7735 * (s[1] - s[0]) ** 2
