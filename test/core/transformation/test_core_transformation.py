# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Transformation and reference systems, swing activity: exact steps, contraction, limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper, SpringState
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.transformation.foot_path import activity_step

vectors = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(np.array)
durations = st.floats(1e-4, 0.1)
MS = 1_000_000


def spring(k: float, b: float) -> SpringDamper:
    return SpringDamper(np.full(3, k), np.full(3, b))


@given(k=st.floats(10.0, 1e4), b=st.floats(1.0, 300.0), theta=vectors, theta_dot=vectors,
       goal=vectors, goal_velocity=vectors, dt=durations)
def test_two_half_steps_along_a_moving_goal_are_one_step(
        k: float, b: float, theta: np.ndarray, theta_dot: np.ndarray, goal: np.ndarray,
        goal_velocity: np.ndarray, dt: float) -> None:
    of = spring(k, b)
    start = SpringState(theta, theta_dot)
    once = of.follow(start, goal, goal_velocity, dt)
    half = of.follow(start, goal - 0.5 * dt * goal_velocity, goal_velocity, 0.5 * dt)
    twice = of.follow(half, goal, goal_velocity, 0.5 * dt)
    assert np.allclose(once.position, twice.position, atol=1e-8)
    assert np.allclose(once.velocity, twice.velocity, atol=1e-6)


@given(k=st.floats(10.0, 1e4), b=st.floats(1.0, 300.0), theta=vectors, theta_dot=vectors,
       goal=vectors, goal_velocity=vectors)
def test_the_step_starts_with_the_acceleration_of_the_paper(
        k: float, b: float, theta: np.ndarray, theta_dot: np.ndarray, goal: np.ndarray,
        goal_velocity: np.ndarray) -> None:
    of, h = spring(k, b), 1e-7
    start = SpringState(theta, theta_dot)
    rate = (of.follow(start, goal, goal_velocity, h).velocity - theta_dot) / h
    expected = k * (goal - theta) + b * (goal_velocity - theta_dot)
    assert np.allclose(of.acceleration(
        theta, theta_dot - goal_velocity, goal, np.zeros(3)), expected)
    assert np.allclose(rate, expected, rtol=1e-3, atol=1e-3 * k)


@given(k=st.floats(100.0, 1e4), ratio=st.floats(0.3, 3.0), dt=st.floats(1e-3, 0.02),
       seed=st.integers(0, 99))
def test_goals_are_found_again_in_what_followed_them(
        k: float, ratio: float, dt: float, seed: int) -> None:
    of, rng = spring(k, 2.0 * ratio * np.sqrt(k)), np.random.default_rng(seed)
    goals, rates = rng.normal(size=(2, 20, 3))
    states = [SpringState(*rng.normal(size=(2, 3)))]
    for goal, rate in zip(goals, rates, strict=True):
        states.append(of.follow(states[-1], goal, rate, dt))
    found = of.goals(np.array([s.position for s in states]),
                     np.array([s.velocity for s in states]), np.full(20, dt))
    np.testing.assert_allclose(found, goals, rtol=1e-6, atol=1e-6)


def test_two_states_under_the_same_goals_converge_to_one_another() -> None:
    of, rng = spring(6400.0, 160.0), np.random.default_rng(0)
    a, b = SpringState((1.0,) * 3, (0.0,) * 3), SpringState((-1.0,) * 3, (10.0,) * 3)
    for _ in range(100):
        goal, goal_velocity = rng.normal(size=3), rng.normal(size=3)
        a, b = (of.follow(state, goal, goal_velocity, 0.004) for state in (a, b))
    assert np.abs(np.subtract(a.position, b.position)).max() < 1e-9


@given(alpha=st.floats(0.1, 6.0), r=vectors, r_ext=vectors, a=durations, b=durations)
def test_reference_steps_add_up_exactly(
        alpha: float, r: np.ndarray, r_ext: np.ndarray, a: float, b: float) -> None:
    of = ReferenceSystem(ReferenceParameters(alpha_r=alpha, max_acceleration=1e3))
    assert np.allclose(of.step(of.step(r, r_ext, a), r_ext, b), of.step(r, r_ext, a + b))
    slope = (of.step(r, r_ext, 1e-7) - r) / 1e-7
    assert np.allclose(slope, alpha * (r_ext - r), rtol=1e-4, atol=1e-4 * alpha)


@given(r=vectors, r_ext=vectors, dt=durations, most=st.floats(0.5, 10.0))
def test_the_reference_keeps_to_its_acceleration_and_stops_as_a_plain_filter(
        r: np.ndarray, r_ext: np.ndarray, dt: float, most: float) -> None:
    of = ReferenceSystem(ReferenceParameters(max_acceleration=most))
    after = of.step(r, r_ext, dt)
    stopped = r * np.exp(-of.parameters.alpha_r * dt)
    braking, change = np.hypot(*(stopped - r)[:2]), np.hypot(*(after - r)[:2])
    assert change <= max(most * dt, braking) * (1.0 + 1e-9)
    if np.hypot(*after[:2]) > np.hypot(*r[:2]) + 1e-9:
        assert change <= most * dt * (1.0 + 1e-9)
    np.testing.assert_array_equal(of.step(r, np.zeros(3), dt)[:2], stopped[:2])


@given(r_ext=vectors)
def test_a_limited_reference_arrives(r_ext: np.ndarray) -> None:
    of, r = ReferenceSystem(ReferenceParameters(alpha_r=6.0)), -np.ones(3)
    for _ in range(1500):
        r = of.step(r, r_ext, 0.004)
    assert np.allclose(r, r_ext, atol=1e-6)


@given(commands=st.tuples(*[st.floats(-100.0, 100.0)] * 3))
def test_commands_are_limited_to_their_ranges(commands: tuple[float, float, float]) -> None:
    p = ReferenceParameters()
    gate = CommandGate(p)
    gate.accept(*commands)
    limits = (p.max_speed, p.max_lateral_speed, p.max_turn_rate)
    for given_, acting, limit in zip(commands, gate.at(0), limits, strict=True):
        assert abs(acting) <= limit
        assert acting == given_ or abs(given_) > limit


def test_a_command_acts_until_its_timeout_and_then_is_zero() -> None:
    gate = CommandGate(ReferenceParameters(cmd_vel_timeout=0.5))
    assert gate.at(0) == (0.0, 0.0, 0.0)
    gate.accept(0.5, 0.1, 0.2)
    assert gate.at(100 * MS) == (0.5, 0.1, 0.2)
    assert gate.at(600 * MS) == (0.5, 0.1, 0.2)
    assert gate.at(601 * MS) == (0.0, 0.0, 0.0)
    gate.accept(0.3, 0.0, 0.0)
    assert gate.at(700 * MS) == (0.3, 0.0, 0.0)
    assert gate.at(1199 * MS) == (0.3, 0.0, 0.0)


def test_to_foresee_a_command_changes_nothing() -> None:
    gate = CommandGate(ReferenceParameters(cmd_vel_timeout=0.5))
    gate.accept(0.5, 0.0, 0.0)
    assert gate.foreseen(4 * MS) == (0.5, 0.0, 0.0)
    assert gate.at(100 * MS) == gate.foreseen(600 * MS) == (0.5, 0.0, 0.0)
    assert gate.foreseen(601 * MS) == (0.0, 0.0, 0.0) and gate.limited_by == ''
    assert gate.at(600 * MS) == (0.5, 0.0, 0.0)


@pytest.mark.parametrize('first', [True, False])
def test_limits_hold_for_commands_that_come_before_them_or_after(first: bool) -> None:
    gate = CommandGate(ReferenceParameters())
    for limits in (first, not first):
        if limits:
            gate.follow(ReferenceParameters(max_speed=0.2), ())
        else:
            gate.accept(0.5, 0.0, 0.0)
    assert gate.at(0) == (0.2, 0.0, 0.0) and gate.limited_by == 'range'
    gate.follow(ReferenceParameters(), ())
    assert gate.at(4 * MS) == (0.5, 0.0, 0.0) and gate.limited_by == ''


def test_without_a_timeout_a_command_stays() -> None:
    gate = CommandGate(ReferenceParameters(cmd_vel_timeout=0.0))
    gate.accept(0.5, 0.0, 0.0)
    gate.at(0)
    assert gate.at(10**13) == (0.5, 0.0, 0.0)


def test_a_command_does_not_outlive_its_timeout_when_the_clock_starts_again() -> None:
    gate = CommandGate(ReferenceParameters(cmd_vel_timeout=0.5))
    gate.accept(0.5, 0.0, 0.0)
    gate.at(10_000 * MS)
    assert gate.at(4 * MS) == (0.5, 0.0, 0.0)
    assert gate.at(505 * MS) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize('position', range(3))
@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf])
def test_a_command_that_is_not_finite_changes_nothing(position: int, value: float) -> None:
    gate, bad = CommandGate(ReferenceParameters(cmd_vel_timeout=0.5)), [0.1, 0.1, 0.1]
    gate.accept(0.5, 0.0, 0.0)
    gate.at(0)
    bad[position] = value
    with pytest.raises(DataError, match='finite'):
        gate.accept(*bad)
    assert gate.at(400 * MS) == (0.5, 0.0, 0.0)
    assert gate.at(501 * MS) == (0.0, 0.0, 0.0)  # nor does it keep the old one alive


@given(activity=st.floats(0.0, 1.0), phase_rate=st.floats(-50.0, 50.0), omega=st.floats(1.0, 30.0),
       rate=st.floats(0.1, 100.0), dt=st.floats(0.0, 1.0))
def test_swing_activity_stays_between_rest_and_full_swing(
        activity: float, phase_rate: float, omega: float, rate: float, dt: float) -> None:
    following = float(activity_step(activity, phase_rate, omega, rate, dt))
    assert 0.0 <= following <= 1.0
    halves = activity_step(activity_step(activity, phase_rate, omega, rate, 0.5 * dt),
                           phase_rate, omega, rate, 0.5 * dt)
    assert following == pytest.approx(float(halves))
    if phase_rate >= omega:
        assert following >= activity - 1e-12
    if phase_rate <= 0.0:
        assert following <= activity + 1e-12
