# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot whose legs fall silent in the middle of a stride ends on its feet, and goes on again."""

from __future__ import annotations

from copy import deepcopy
from functools import cache
from itertools import product
from math import pi, tau

import numpy as np
import pytest

pytest.importorskip('mujoco')
from dmp_cpg_ros.core.canonical.phase import scalar_phase
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets, RobotState
from dmp_cpg_ros.core.transformation.leg import nominal_foothold
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.start_pose import home_joint_position
from dmp_cpg_ros.robot.watchdog import CommandWatchdog
from dmp_cpg_ros.suite import load_gaits, load_suite
from dmp_cpg_ros.suite_table import RETURN_S

PHASES, STOOD = 16, 100
"""Phases in which it is left alone, and ticks after which it stands."""

TIMEOUT_NS = 200_000_000

RETURN_NS = round(1e9 * RETURN_S)


def tilt_of(state: RobotState) -> float:
    x, y = state.base_quaternion[:2]
    return float(np.arccos(1.0 - 2.0 * (x * x + y * y)))


class Walk:
    """A walk in the plain loop whose targets pass the watchdog."""

    def __init__(self, gait: str, speed: float, return_ns: int = 0) -> None:
        suite = load_suite(None, {'gait': gait, 'auto_inhibit': False, 'cmd_vel_timeout': 0.0})
        self.robot = MujocoRobot(suite.robot_file, suite.tick_ns, 0)
        self.loop = WalkingLoop(
            self.robot.description, suite.gait, suite.parameters, load_gaits())
        self.guard = CommandWatchdog(
            self.robot.description, TIMEOUT_NS, return_ns=return_ns)
        self.state: RobotState = self.robot.reset()
        self.phase = 0.0
        self.go(1)
        self.loop.request(False)
        self.loop.command(speed)

    def go(self, ticks: int, silent: str = '') -> Walk:
        """Walk on; some legs are not heard."""
        for _ in range(ticks):
            tick = self.loop.tick(self.state)
            self.phase = scalar_phase(*tick.x[0])
            self.targets = tick.targets
            for leg, targets in tick.targets.by_leg().items():
                if leg not in silent:
                    self.guard.accept(leg, self.state.time_ns, targets)
            self.state = self.robot.step(self.guard.targets(self.state))
        return self

    def left_alone(self, ticks: int) -> float:
        """Walk on without any leg until the robot has stood for a while, or so long; returns the
        largest tilt [rad].
        """
        robot, guard, state = deepcopy(
            (self.robot, self.guard, self.state), {id(self.robot.model): self.robot.model})
        tilt, stood = 0.0, 0
        for _ in range(ticks):
            state = robot.step(guard.targets(state))
            tilt = max(tilt, tilt_of(state))
            still = np.linalg.norm(state.base_velocity_in_base) < 0.05
            stood = stood + 1 if still and guard.fallback == 'stand' else 0
            if stood == STOOD:
                break
        assert guard.fallback == 'stand' and not robot.fallen
        assert np.linalg.norm(state.base_velocity_in_base) < 0.05
        return tilt

    def copy(self) -> Walk:
        """A walk that goes on as this one does."""
        return deepcopy(self, {id(self.robot.model): self.robot.model})


def walking(gait: str, speed: float, return_ns: int = 0) -> Walk:
    """A robot that has walked for three seconds."""
    return walked(gait, speed, return_ns).copy()


@cache
def walked(gait: str, speed: float, return_ns: int) -> Walk:
    return Walk(gait, speed, return_ns).go(750)


@pytest.mark.parametrize(('gait', 'speed'), [
    ('amble', 0.3), ('amble', 0.5), ('amble', 0.8), ('trot', 0.5), ('trot', 1.0), ('trot', 1.5)])
def test_silent_in_any_phase_it_comes_to_a_stand(gait: str, speed: float) -> None:
    walk = walking(gait, speed)
    tilts: list[float] = []
    while len(tilts) < PHASES:
        wanted, before = tau * len(tilts) / PHASES, walk.phase
        walk.go(1)
        if (before - wanted + pi) % tau > pi - 0.5 and (before - wanted + pi) % tau <= pi <= (
                walk.phase - wanted + pi) % tau:
            tilts.append(walk.left_alone(600))
    assert max(tilts) < 0.3


@pytest.mark.parametrize(('gait', 'speed'), [('amble', 0.5), ('trot', 1.0)])
def test_silent_while_it_speeds_up_it_puts_its_feet_down(gait: str, speed: float) -> None:
    walk = Walk(gait, speed)
    for _ in range(8):
        assert walk.go(40).left_alone(500) < 0.6


@pytest.mark.parametrize(('gait', 'speed'), [('amble', 0.5), ('trot', 1.0), ('trot', 1.5)])
@pytest.mark.parametrize('silent', ['fl', 'fl fr rl rr'])
def test_legs_that_are_back_in_time_are_followed_without_a_stop(
        gait: str, speed: float, silent: str) -> None:
    walk = walking(gait, speed, RETURN_NS)
    for ticks in (60, 120, 170, 220):  # up to 0.88 s, in another phase each time
        walk.go(ticks, silent)
        assert not walk.guard.fallback
        assert ticks * 4_000_000 <= TIMEOUT_NS or walk.guard.unheard(walk.state.time_ns)
        slowest = np.inf
        for _ in range(300):
            walk.go(1)
            slowest = min(slowest, float(walk.state.base_velocity_in_base[0]))
            assert not (walk.guard.fallback or walk.robot.fallen)
        assert not walk.guard.silent(walk.state.time_ns) and slowest > 0.5 * speed


def test_legs_that_are_not_back_in_time_are_waited_for_no_longer() -> None:
    walk = walking('trot', 1.0, RETURN_NS)
    last_ns = walk.state.time_ns
    while not walk.guard.fallback:
        walk.go(1, 'fl')
    assert walk.state.time_ns - last_ns == pytest.approx(TIMEOUT_NS + RETURN_NS, abs=1e7)
    assert walk.left_alone(600) < 0.3


def test_legs_that_come_back_elsewhere_in_the_gait_are_not_followed() -> None:
    """Else the feet of a robot in motion would stop below it."""
    walk = walking('trot', 1.0, RETURN_NS).go(150, 'fl fr rl rr')
    home = home_joint_position(walk.robot.description)
    for _ in range(120):
        assert walk.guard.fallback == 'stand' or not walk.guard.silent(walk.state.time_ns)
        for i, leg in enumerate(LEGS):
            walk.guard.accept(leg, walk.state.time_ns, JointTargets(
                home[3 * i:3 * i + 3], np.zeros(3), np.zeros(3)))
        walk.state = walk.robot.step(walk.guard.targets(walk.state))
    assert walk.guard.fallback == 'stand'
    assert walk.left_alone(600) < 0.3


@pytest.mark.parametrize(('gait', 'speed', 'away'), [
    (gait, speed, away) for gait, speed in (('amble', 0.5), ('trot', 1.0))
    for away in (15, 30, 45)])
def test_legs_that_were_late_for_a_moment_and_are_elsewhere_then_are_not_followed(
        gait: str, speed: float, away: int) -> None:
    """Feet that stand would be told to swing, as fast as a foot does that nothing holds; the robot
    gets in step with legs that are not far ahead, and stands up by itself else.
    """
    walk = walking(gait, speed)
    ahead, followed = walk.copy().go(away), 0
    for tick in range(300):
        ahead.go(1)
        for leg, targets in ahead.targets.by_leg().items():
            if tick >= 10:
                walk.guard.accept(leg, walk.state.time_ns, targets)
        given_out = walk.guard.targets(walk.state)
        walk.state = walk.robot.step(given_out)
        assert tilt_of(walk.state) < 0.3
        followed += np.allclose(given_out.position, ahead.targets.position)
    assert not walk.robot.fallen
    assert walk.guard.fallback == 'stand' or (away == 15 and followed > 100)


def test_it_follows_the_legs_again_once_they_are_at_rest() -> None:
    walk = walking('amble', 0.5).go(100, silent='fl')
    assert walk.guard.fallback == 'stand'
    walk.go(300)
    assert walk.guard.fallback == 'stand'  # the legs still walk, the robot stands
    walk.loop.request(True)
    for _ in range(800):
        walk.go(1)
        if not walk.guard.fallback:
            break
    assert walk.guard.leaving == 'stand'  # on the way to the legs it tells so still
    walk.go(800)
    assert walk.loop.stop.state == 'at_rest' and not walk.guard.leaving
    walk.loop.request(False)
    walk.go(500)
    assert not walk.guard.fallback and not walk.robot.fallen
    assert walk.state.base_velocity_in_base[0] == pytest.approx(0.5, rel=0.3)


def test_it_follows_legs_that_rest_on_footholds_a_step_away() -> None:
    """Inhibited legs stay on their footholds, and the robot stands on others by itself."""
    walk = walking('amble', 0.5).go(320, silent='fl')  # after which it stands
    assert walk.guard.fallback == 'stand'
    description = walk.robot.description
    for leg, shift in product(LEGS, ((0.1, 0.0), (-0.1, 0.0), (0.05, 0.05), (0.05, -0.05))):
        robot, guard, state = deepcopy(
            (walk.robot, walk.guard, walk.state), {id(walk.robot.model): walk.robot.model})
        place, q = LEGS.index(leg), home_joint_position(description)
        q[3 * place:3 * place + 3] = LegKinematics(description.legs[place]).inverse(
            nominal_foothold(description, leg) + (*shift, 0.0))
        for _ in range(250):
            for i, each in enumerate(LEGS):
                guard.accept(each, state.time_ns, JointTargets(
                    q[3 * i:3 * i + 3], np.zeros(3), np.zeros(3)))
            state = robot.step(guard.targets(state))
        assert not guard.fallback and not robot.fallen, (leg, shift)
        assert not guard.leaving
        assert np.linalg.norm(state.base_velocity_in_base) < 0.05
        assert np.abs(state.joint_position - q).max() < 0.1
