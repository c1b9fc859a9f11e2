# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Targets that act late are carried on, so that a busy machine does not hold the feet back."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets
from dmp_cpg_ros.core.suite_parameters import RobotParameters
from dmp_cpg_ros.robot.absent_legs import CARRIED_NS, IN_TIME_NS
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.robot.slow_motion import SlowMotion, acts_too_long
from dmp_cpg_ros.robot.watchdog import (
    AGAIN_NS,
    AT_EASE_NS,
    HELD_NS,
    LATE_NS,
    MOST_AT_EASE_NS,
    CommandWatchdog,
)
from dmp_cpg_ros.suite import load_gaits, load_suite

pytest.importorskip('mujoco')
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies import late_walks
from dmp_cpg_ros.studies.late_walks import Stalls, late, starved, twice_silent

TICK_NS = 4_000_000
LONGEST = CARRIED_NS // TICK_NS
SUITE = load_suite(None, {'auto_inhibit': False, 'cmd_vel_timeout': 0.0})


def make_guard(description: RobotDescription, lead_ns: int = 0) -> CommandWatchdog:
    timeout_ns = round(1e9 * RobotParameters().target_timeout)
    return CommandWatchdog(description, timeout_ns, lead_ns)


def accept(guard: CommandWatchdog, stamp_ns: int, targets: JointTargets) -> None:
    for leg, of_leg in targets.by_leg().items():
        guard.accept(leg, stamp_ns, of_leg)


@pytest.fixture(scope='module')
def standing() -> PerfectTrackingRobot:
    return PerfectTrackingRobot(load_description(SUITE.robot_file), TICK_NS, 'standing')


@settings(max_examples=40)
@given(age=st.integers(0, 30), seed=st.integers(0, 2**32))
def test_what_moves_steadily_is_where_it_would_have_been_in_time(
        standing: PerfectTrackingRobot, age: int, seed: int) -> None:
    """Up to 24 ms; from then on targets stand still."""
    state, random = standing.reset(), np.random.default_rng(seed)
    position, velocity, effort = random.normal(size=(3, 12))
    guard = make_guard(standing.description)
    accept(guard, -age * TICK_NS, JointTargets(position, velocity, effort))
    given_out = guard.targets(state)
    carried = min(age, LONGEST) * TICK_NS * 1e-9
    assert np.allclose(given_out.position, position + carried * velocity, rtol=0.0, atol=1e-12)
    assert np.array_equal(given_out.velocity, velocity)
    assert np.array_equal(given_out.effort, effort)
    if age == 0:
        assert np.array_equal(given_out.position, position)


def test_each_leg_is_carried_by_its_own_age(standing: PerfectTrackingRobot) -> None:
    state, guard = standing.reset(), make_guard(standing.description)
    for age, leg in enumerate(LEGS):
        guard.accept(leg, -age * TICK_NS, JointTargets(np.zeros(3), np.ones(3), np.zeros(3)))
    moved = guard.targets(state).position.reshape(4, 3)
    assert np.allclose(moved, 1e-9 * TICK_NS * np.arange(4.0)[:, None], rtol=0.0, atol=1e-15)


@settings(max_examples=30)
@given(lead=st.integers(0, 15), seed=st.integers(0, 2**32))
def test_what_comes_within_the_lead_acts_at_its_end_however_it_came(
        standing: PerfectTrackingRobot, lead: int, seed: int) -> None:
    random, state = np.random.default_rng(seed), standing.reset()
    sent = [JointTargets(0.003 * position, *others)  # more would be a jump
            for position, *others in random.normal(size=(40, 3, 12))]
    arrival = np.maximum.accumulate(np.arange(40) + random.integers(0, lead + 1, size=40))
    guard = make_guard(standing.description, lead * TICK_NS)
    accept(guard, 0, sent[0])
    for now in range(40):
        for k in np.flatnonzero(arrival == now):
            accept(guard, int(k) * TICK_NS, sent[k])
        given_out, wanted = guard.targets(replace(state, time_ns=now * TICK_NS)), sent[
            max(0, now - lead)]
        assert all(np.array_equal(*pair) for pair in zip(
            vars(given_out).values(), vars(wanted).values(), strict=True))
        assert guard.lateness_ns <= 0


@pytest.mark.parametrize('away', [0.02, 0.5])
@pytest.mark.parametrize('seed', range(5))
def test_what_comes_now_and_then_is_not_followed_until_it_is_in_time_for_a_while(
        standing: PerfectTrackingRobot, seed: int, away: float) -> None:
    """What the robot does by itself while targets are late is the same with one in between, where
    there is a rhythm with which to go on; it gets in step with legs that are elsewhere in it
    before they are followed.
    """
    state, stride = standing.reset(), np.random.default_rng(seed).normal(size=12)
    never, once, again = guards = [make_guard(standing.description) for _ in range(3)]
    begin, turn = 150, 2.0 * np.pi / 60.0

    def strides(tick: int, ahead: float = 0.0) -> JointTargets:
        phase = turn * tick + ahead
        return JointTargets(np.sin(phase) * stride,
                            np.cos(phase) * stride * turn * 1e9 / TICK_NS, np.zeros(12))

    for tick in range(begin + 1):
        for guard in guards:
            accept(guard, tick * TICK_NS, strides(tick))
            given_out = guard.targets(replace(state, time_ns=tick * TICK_NS)).position
    late, settled = begin + LONGEST + 5, begin + LONGEST + 5 + IN_TIME_NS // TICK_NS
    for tick in range(begin + 1, begin + 200):
        stamp = tick * TICK_NS
        for guard in [once] * (tick == late) + [again] * (tick >= late):
            accept(guard, stamp, strides(tick, away))
        before, given_out = given_out, again.targets(replace(state, time_ns=stamp)).position
        assert np.abs(given_out - before).max() < 1.5 * turn * np.abs(stride).max()
        if tick < begin + 40:
            each = [guard.targets(replace(state, time_ns=stamp)).position
                    for guard in (never, once)]
            assert np.array_equal(*each)
            assert np.array_equal(each[0], given_out) == (tick < settled)
    assert np.allclose(given_out, strides(tick, away).position)


def test_moving_legs_that_are_late_without_a_rhythm_are_held_and_then_left(
        standing: PerfectTrackingRobot) -> None:
    """Until then whatever comes is followed at once: the joints are still where it left off."""
    state, guard = standing.reset(), make_guard(standing.description)
    held = HELD_NS // TICK_NS
    for tick in range(3 * held):
        if tick % held == 0 and tick <= held:
            moving = JointTargets(state.joint_position + 1e-3 * tick, np.ones(12), np.zeros(12))
            accept(guard, tick * TICK_NS, moving)
        given_out = guard.targets(replace(state, time_ns=tick * TICK_NS))
        age = min(tick, tick - held if tick >= held else tick)
        if age <= held:
            assert not guard.fallback
            assert np.allclose(given_out.position, moving.position + min(
                age, LONGEST) * TICK_NS * 1e-9, atol=1e-12)
        else:
            assert guard.fallback == 'stand'


@pytest.mark.parametrize(('gait', 'speed'), [('amble', 0.5), ('trot', 1.0)])
def test_a_robot_whose_controllers_starve_does_not_fall(
        gait: str, speed: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(late_walks, 'STARVED_S', 9.0)  # in which it stands by itself, too
    outcome = starved(gait, speed, Stalls(150.0, 200.0), seed=1)
    assert not outcome.fell and outcome.stood


@pytest.mark.parametrize('seed', [1, 3])
def test_a_robot_whose_controllers_starve_again_and_again_stands_instead_of_starting(
        seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Followed as soon each time, it started to walk into the next stalls, and fell."""
    monkeypatch.setattr(late_walks, 'STARVED_S', 7.0)
    monkeypatch.setattr(late_walks, 'SOUND_NS', 1_000_000_000)
    outcome = starved('trot', 1.0, Stalls(400.0, 120.0, together=1.0, lost=0.2), seed)
    assert not outcome.fell and outcome.stood


@pytest.mark.parametrize('seed', [1, 5])
def test_a_robot_whose_legs_are_silent_once_more_after_a_second_walks_on(seed: int) -> None:
    """It had no rhythm yet, and came to a stand."""
    outcome = twice_silent('amble', 0.5, after_s=1.1, rate=50.0, seed=seed)
    assert outcome.kills == 2 and not (outcome.fell or outcome.stood)


@pytest.mark.parametrize(('rate', 'borne_ms'), [
    (50, 0), (100, 20), (125, 16), (250, 24), (500, 28)])
def test_the_simulation_waits_rather_than_let_targets_act_too_long(
        rate: int, borne_ms: int) -> None:
    """At 50 Hz those that come a tick late throw over an amble that bears 20 ms at 100 Hz."""
    tick_ns, longest_ns = 10**9 // rate, round(1e9 * RobotParameters().longest_lag)
    ages = [age for age in range(0, 10**8, tick_ns)
            if not acts_too_long(age, tick_ns, longest_ns)]
    assert max(ages) == borne_ms * 1_000_000 and 0 in ages
    assert not acts_too_long(10**9, tick_ns, 0)


@pytest.mark.parametrize('capacity', [1.0, 0.6, 0.3])
def test_a_simulation_whose_controllers_cannot_keep_up_is_answered_in_time_again(
        capacity: float) -> None:
    """Controllers that work off less than a state a tick get it in the end: they were left behind
    farther and farther by a robot that looked after itself, for 75 s in a walk. Two seconds of
    nothing, as while a node comes back, are not waited for.
    """
    motion = SlowMotion(TICK_NS, round(1e9 * RobotParameters().longest_lag), 0, 200_000_000)
    now, done, answered, ages, waited = 0, 0.0, 0, [], 0
    for k in range(4000):
        away = 250 <= k < 750  # nobody works off anything
        done += 0.0 if away else min(capacity, now // TICK_NS - done)
        if int(done) > answered or not k:
            answered = int(done)
            for leg in LEGS:
                motion.hear(leg, answered * TICK_NS, k * TICK_NS)
        waits = motion.waits(now, k * TICK_NS)
        now, waited = now + TICK_NS * (not waits), waited + TICK_NS * (waits and away)
        ages.append(now - answered * TICK_NS)
    assert waited <= 200_000_000 + TICK_NS and ages[749] > 10**9  # nobody was waited for longer
    assert max(ages[-500:]) <= 32_000_000
    assert done > 0.9 * capacity * (len(ages) - 500)  # and they had never to wait for the robot


def test_a_leg_whose_targets_come_no_sooner_is_waited_for_now_and_then_only() -> None:
    motion, wall, waited = SlowMotion(TICK_NS, 30_000_000, 0, 200_000_000), 0, 0
    for now in range(0, 4 * 10**9, TICK_NS):
        for leg in LEGS:
            motion.hear(leg, now - 400_000_000 * (leg == 'fl'), wall)
        while motion.waits(now, wall):
            wall, waited = wall + TICK_NS, waited + TICK_NS
        wall += TICK_NS
    assert 0 < waited < 0.5 * 4 * 10**9


def test_who_has_looked_after_itself_again_and_again_follows_later_each_time(
        standing: PerfectTrackingRobot) -> None:
    state, guard, now = standing.reset(), make_guard(standing.description), 0
    resting = JointTargets(state.joint_position, np.zeros(12), np.zeros(12))

    def tick(heard: bool) -> None:
        nonlocal now
        now += TICK_NS
        if heard:
            accept(guard, now, resting)
        guard.targets(replace(state, time_ns=now))

    def waits() -> int:
        for _ in range(500):  # until it stands
            tick(heard=False)
        assert guard.fallback
        begin = now
        while guard.fallback:
            tick(heard=True)
        return now - begin

    tick(heard=True)
    for times in (1, 2, 4, 4):
        assert waits() == pytest.approx(times * AT_EASE_NS, abs=2 * TICK_NS)
    assert MOST_AT_EASE_NS == 4 * AT_EASE_NS
    for _ in range(AGAIN_NS // TICK_NS):
        tick(heard=True)
    assert waits() == pytest.approx(AT_EASE_NS, abs=2 * TICK_NS)


def test_a_robot_whose_targets_come_only_now_and_then_looks_after_itself(
        standing: PerfectTrackingRobot) -> None:
    state, guard, alone = standing.reset(), make_guard(standing.description), []
    for tick in range(400):
        if tick % 25 == 0:
            accept(guard, tick * TICK_NS, JointTargets(*np.zeros((3, 12))))
        guard.targets(replace(state, time_ns=tick * TICK_NS))
        alone.append(bool(guard.fallback))
    begun = (LONGEST + 1) + LATE_NS // TICK_NS
    assert not any(alone[:begun]) and alone[begun + 1]


def test_a_robot_that_looks_after_itself_does_not_follow_what_is_late(
        standing: PerfectTrackingRobot) -> None:
    """Only once targets act in time again; until then it says that they come and are late."""
    state, guard, alone, late = standing.reset(), make_guard(standing.description), [], 10
    held = JointTargets(state.joint_position, np.zeros(12), np.zeros(12))
    for tick in range(1000):
        late = 0 if tick >= 800 else late
        accept(guard, (tick - late) * TICK_NS, held)
        guard.targets(replace(state, time_ns=tick * TICK_NS))
        alone.append(bool(guard.fallback))
        assert guard.outrun == (alone[-1] and late > 0) and not guard.unheard(tick * TICK_NS)
    begun = alone.index(True)
    assert LATE_NS // TICK_NS < begun < 1.2 * LATE_NS / TICK_NS
    assert all(alone[begun:800]) and not alone[-1]


def test_a_robot_that_loses_too_many_targets_looks_after_itself(
        standing: PerfectTrackingRobot) -> None:
    state = standing.reset()
    guard = CommandWatchdog(standing.description, 200_000_000, 0, TICK_NS)
    held, losing = JointTargets(state.joint_position, np.zeros(12), np.zeros(12)), []
    for tick in range(2000):
        every = 10 if tick < 500 else 3 if tick < 1000 else 50  # one of so many is lost
        if tick % every:
            accept(guard, tick * TICK_NS, held)
        guard.targets(replace(state, time_ns=tick * TICK_NS))
        losing.append(guard.losing)
        assert bool(guard.fallback) or not guard.losing
    assert not any(losing[:500]) and losing[999] and not losing[-1] and not guard.fallback


def arrivals(ticks: int, seed: int) -> list[int]:
    """Tick whose targets act at each tick: they come late, in bursts, by 24 ms at most."""
    random, newest, stalled, acting = np.random.default_rng(seed), 0, 0, []
    for tick in range(ticks):
        if stalled:
            stalled -= 1
        else:
            newest = max(newest, tick - int(random.integers(0, 3)))
            stalled = int(random.geometric(0.2)) if random.random() < 0.15 else 0
        newest = max(newest, tick - LONGEST)
        acting.append(newest)
    return acting


@pytest.mark.parametrize('gait', ['amble', 'trot'])
def test_a_robot_whose_targets_come_in_bursts_walks_as_fast_as_it_should(gait: str) -> None:
    suite = load_suite(None, {'gait': gait, 'auto_inhibit': False, 'cmd_vel_timeout': 0.0})
    robot = MujocoRobot(suite.robot_file, suite.tick_ns, 0)
    loop = WalkingLoop(robot.description, suite.gait, suite.parameters, load_gaits())
    guard, state = make_guard(robot.description), robot.reset()
    acting = arrivals(1600, seed=3)
    ages = [tick - acts for tick, acts in enumerate(acting)]
    assert np.mean(ages) > 2.0 and max(ages) == LONGEST
    assert all(before <= after for before, after in pairwise(acting))
    sent, speeds, heights = [], [], []
    for tick, acts in enumerate(acting):
        if tick == 1:
            loop.request(False)
            loop.command(0.5)
        sent.append((state.time_ns, loop.tick(state).targets))
        accept(guard, *sent[acts])
        state = robot.step(guard.targets(state))
        speeds.append(state.base_velocity_in_base[0])
        heights.append(state.base_position_in_world[2])
    assert not robot.fallen and loop.mode.mode == 'standing'
    assert np.mean(speeds[-1000:]) == pytest.approx(0.5, rel=0.05)
    assert min(heights) > 0.9 * heights[0]


@pytest.mark.parametrize(('gait', 'speed', 'delay_ms', 'lead_ms'), [
    ('trot', 2.0, (24.0, 24.0), 24), ('amble', 1.2, (5.0, 30.0), 32)])
def test_with_a_lead_a_robot_whose_targets_come_late_walks_as_fast_as_it_should_at_speed(
        gait: str, speed: float, delay_ms: tuple[float, float], lead_ms: int,
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(late_walks, 'LATE_S', 3.0)
    leads, late_only = (late(gait, speed, delay_ms, lead, seed=1) for lead in (lead_ms, 0))
    assert not leads.fell and leads.reached == pytest.approx(speed, rel=0.02) and leads.tilt < 2.0
    assert late_only.fell or late_only.reached < 0.9 * speed
