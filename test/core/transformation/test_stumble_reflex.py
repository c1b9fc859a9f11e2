# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The stumbling reflex: when it acts, how high, and that the foot comes down again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.leg import LegFeedback, LegParameters, LegPrimitive, LegState
from dmp_cpg_ros.core.transformation.stumble import (
    GENTLENESS,
    HIGHEST,
    HIGHEST_SWING,
    LATENCY,
    LEAST_LIFT,
    POST_STUMBLE_SWINGS,
    Stumble,
    SwingProgress,
    compliant_offset_rate,
    lift_left,
    stumble_step,
    swing_clearance,
    swing_progress,
)
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_gait, load_suite

LIFT, THRESHOLD, TICK = 0.05, 0.01, 0.004
DUTY, HEIGHT = 0.6, 0.05

Met = Callable[[float, np.ndarray], np.ndarray]


def free(t: float, foot: np.ndarray) -> np.ndarray:
    """Nothing is in the foot's way."""
    return foot


def walked(swing: float, met: Met, speed: float = 0.5, late: float = 0.0,
           swings: int = 1, feels: bool = False) -> list[Stumble]:
    """Reflex of a foot that follows its path, ``late`` seconds after it, but for what it met.

    ``met`` takes the time since the swing began [s] and the foot in the world, with the body's
    speed taken out, and says where the foot is.
    """
    omega = 2.0 * np.pi * (1.0 - DUTY) / swing
    path = FootPath((0.2, 0.1, -0.26), speed, 0.0, 0.0, omega, DUTY, HEIGHT)
    period, states = swing / (1.0 - DUTY), [Stumble()]

    def foot_at(t: float) -> np.ndarray:
        cycle = t / period - 0.5 * (1.0 - DUTY)
        return np.array(path.at((cycle + 0.5) % 1.0 - 0.5)[0])

    for k in range(round(swings * period / TICK)):
        t = k * TICK
        into = t % period
        progress = None
        if into < swing:
            body = np.array((speed * into, 0.0, 0.0))
            alone = foot_at(t - late) + body
            foot = met(into, alone)
            touches = feels and bool((foot != alone).any())
            progress = swing_progress(
                path, into / swing, tuple(foot - body), tuple(foot_at(t)), touches)
        states.append(stumble_step(states[-1], progress, LIFT, THRESHOLD, TICK))
    return states


def riser(at: float) -> Met:
    """A wall ahead of the foot, as far as it is into its swing at ``at`` of its way."""
    return lambda t, foot: np.minimum(foot, (at, np.inf, np.inf))


def ground(height: float) -> Met:
    """Ground that is higher than where the foot left it."""
    return lambda t, foot: np.maximum(foot, (-np.inf, -np.inf, height - 0.26))


@pytest.mark.parametrize('late', (0.0, LATENCY))
@pytest.mark.parametrize('speed', (0.1, 0.5, 1.5))
@pytest.mark.parametrize('swing', (0.12, 0.2, 0.4))
def test_a_foot_that_nothing_meets_is_left_alone_also_where_targets_act_late(
    swing: float, speed: float, late: float
) -> None:
    states = walked(swing, free, speed, late)
    assert not any(s.tripped or s.landed or s.height for s in states)


@pytest.mark.parametrize('swing', (0.15, 0.2, 0.4))
@pytest.mark.parametrize('place', (0.18, 0.2, 0.22))
def test_a_foot_that_trips_is_lifted_and_comes_down_gently(
    swing: float, place: float
) -> None:
    states = walked(swing, riser(place), 1.0)
    height = np.array([s.height for s in states])
    steps = round(swing / TICK)
    assert any(s.tripped for s in states)
    assert 0.3 * LIFT < height.max() <= LIFT and height.min() >= 0.0
    assert np.diff(height).min() >= -1.001 * GENTLENESS * LIFT * TICK  # it comes down gently
    assert not height[steps + round(1.0 / GENTLENESS / TICK) + 1:].any()
    np.testing.assert_allclose(np.cumsum([s.rate * TICK for s in states]), height, atol=1e-12)


def test_the_swings_after_a_stumble_step_higher_and_then_no_more() -> None:
    swing, first = 0.2, 0.2 / (1.0 - DUTY)
    tripping: list[bool] = []

    def once(t: float, foot: np.ndarray) -> np.ndarray:
        tripping.append(t == 0.0)
        return riser(0.2)(t, foot) if sum(tripping) == 1 else foot

    states = walked(swing, once, 1.0, swings=POST_STUMBLE_SWINGS + 3)
    period = round(first / TICK)
    counts = [states[(i + 1) * period - 2].post_stumble for i in range(POST_STUMBLE_SWINGS + 2)]
    assert counts == [*range(POST_STUMBLE_SWINGS, -1, -1), 0]


def test_a_foot_that_trips_again_steps_higher_each_time_and_no_more_than_highest() -> None:
    swing, swings = 0.2, HIGHEST + 2
    states = walked(swing, riser(0.2), 1.0, swings=swings + POST_STUMBLE_SWINGS)
    period = round(swing / (1.0 - DUTY) / TICK)
    lifts = [states[(i + 1) * period - 2].lifts for i in range(swings)]
    assert lifts == [min(i + 1, HIGHEST) for i in range(swings)]


@pytest.mark.parametrize('height', (0.025, 0.04))
@pytest.mark.parametrize('late', (0.0, 0.01))
def test_a_foot_that_lands_early_yields_and_is_not_lifted(height: float, late: float) -> None:
    states = walked(0.3, ground(height), 0.3, late)
    assert any(s.landed and s.compliant for s in states)
    assert not any(s.tripped or s.height for s in states)


@pytest.mark.parametrize('met', (riser(0.2), ground(0.025)))
def test_a_foot_that_feels_the_touch_reacts_sooner(met: Met) -> None:
    without, feeling = walked(0.3, met, 0.5), walked(0.3, met, 0.5, feels=True)
    first = [next(k for k, s in enumerate(states) if s.compliant) for states in (without, feeling)]
    assert first[1] < first[0]


def test_a_foot_that_yields_brings_its_target_to_where_it_is() -> None:
    stumble, velocity = Stumble(tripped=True, compliant=True), (1.5, 0.2, -0.5)
    foot, target = np.array((0.1, 0.0, 0.0)), np.array((0.15, 0.01, -0.02))
    wanted = (0.0, 0.0, 0.3)
    for landed, axes in ((False, 2), (True, 3)):
        held, at = Stumble(landed=landed, tripped=not landed, compliant=True), target.copy()
        for _ in range(50):
            away = tuple(foot - at)
            rate = np.array(compliant_offset_rate(held, wanted, velocity, away))
            at = at + (rate + velocity) * TICK
        np.testing.assert_allclose(at[:axes], foot[:axes], atol=1e-4)
    assert compliant_offset_rate(stumble, wanted, velocity, (0.0, 0.0, 0.0))[2] == wanted[2]
    assert compliant_offset_rate(Stumble(), wanted, velocity, (1.0, 1.0, 1.0)) == wanted


def test_a_standing_foot_feels_nothing() -> None:
    standing = stumble_step(Stumble(), None, LIFT, THRESHOLD, TICK)
    assert standing == Stumble()

TROT = load_gait('trot')


def leg_and_state(lift: float) -> tuple[LegPrimitive, LegState]:
    """A leg of the package's robot."""
    suite = load_suite()
    leg = LegPrimitive('fl', load_description(suite.robot_file), LegParameters(stumble_lift=lift))
    return leg, leg.initial_state()


@pytest.mark.parametrize('blocked', (False, True))
def test_the_leg_feels_an_obstacle_by_its_joints(blocked: bool) -> None:
    """A foot that is where it should be moves as without the reflex, to the last bit."""
    (without, state_0), (leg, state) = leg_and_state(0.0), leg_and_state(0.13)
    r = np.array((0.5, 0.0, 0.0))
    omega = TROT.omega(leg.scale.foot_speed(0.5, 0.0, 0.0), leg.scale)
    highest = highest_0 = -np.inf
    wall = float(leg.foothold_in_base[0])
    for k in range(500):
        x = state_at(np.array(omega * k * TICK))
        x_dot = omega * np.array((x[1], -x[0]))
        measured = state.joints.position
        if blocked:
            foot = np.array(leg.kinematics.foot(measured))
            free_way = foot[0] < leg.foothold_in_base[0]  # a wall stands below the hip
            wall = leg.foothold_in_base[0] if free_way else wall - r[0] * TICK
            foot[0] = min(foot[0], wall)
            measured = leg.kinematics.angles(foot)
        feedback = LegFeedback(measured, (0.0,) * 3, (0.0,) * 2, (0.0,) * 3)
        state, goal, _ = leg.step(state, TROT, x, x_dot, r, feedback, TICK)
        state_0, goal_0, _ = without.step(state_0, TROT, x, x_dot, r, feedback, TICK)
        if not blocked:
            np.testing.assert_array_equal(goal, goal_0)
        if k > 150:
            highest = max(highest, leg.kinematics.foot(goal)[2])
            highest_0 = max(highest_0, leg.kinematics.foot(goal_0)[2])
    if blocked:
        assert highest - highest_0 > 0.5 * leg.stumble_lift


def landing_tick(force: float) -> int:
    """First tick at which a leg that comes down on ground 25 mm high knows that it has landed."""
    leg, state = leg_and_state(0.13)
    r, high = np.array((0.5, 0.0, 0.0)), float(leg.foothold_in_base[2]) + 0.025
    omega = TROT.omega(leg.scale.foot_speed(0.5, 0.0, 0.0), leg.scale)
    for k in range(500):
        x = state_at(np.array(omega * k * TICK))
        foot = np.array(leg.kinematics.foot(state.joints.position))
        stands = k > 150 and foot[2] < high
        foot[2] = high if stands else foot[2]
        feedback = LegFeedback(leg.kinematics.angles(foot), (0.0,) * 3, (0.0,) * 2,
                               (0.0,) * 3, force * stands)
        state, _, _ = leg.step(state, TROT, x, omega * np.array((x[1], -x[0])), r, feedback, TICK)
        if state.stumble.landed:
            return k
    return 500


def test_the_leg_takes_the_force_of_its_foot_for_a_touch() -> None:
    touch = leg_and_state(0.13)[0].touch_force
    assert landing_tick(1.1 * touch) < landing_tick(0.0) == landing_tick(0.9 * touch) < 500


@pytest.mark.parametrize(('behind', 'above'), [(0.03, 0.0), (0.03, 0.02), (0.02, 0.03)])
@pytest.mark.parametrize('rough', [False, True])
def test_a_foot_that_went_on_yields_again_at_an_edge_and_stands_where_it_is_held_from_below(
        behind: float, above: float, rough: bool) -> None:
    """Friction lifts less than it holds back."""
    held = SwingProgress(0.7, 0.0, above, behind, 0.0, 0.5, 1.0, 1.0, True)
    went_on = Stumble(tripped=True, up=True, progress=held)
    now = stumble_step(went_on, held, LIFT, THRESHOLD, TICK, rough)
    if rough:
        assert now.landed == (above > behind)
        assert now.compliant
    elif above <= THRESHOLD:
        assert not now.compliant


@pytest.mark.parametrize('rough', [0.0, 0.02, 0.1, 0.5])
def test_over_rough_ground_a_swing_is_no_higher_than_the_highest(rough: float) -> None:
    leg, state = leg_and_state(0.13)
    length, tripped = leg.scale.leg_length, state.stumble._replace(lifts=HIGHEST)
    height = swing_clearance(leg.clearance, leg.stumble_lift, tripped, rough, length)
    path = FootPath((0.2, 0.1, -0.3), 0.5, 0.0, 0.0, 6.0, 0.7, height)
    left = lift_left(leg.stumble_lift, path, rough, length)
    if not rough:
        assert height == leg.clearance + HIGHEST * leg.stumble_lift and left == leg.stumble_lift
        return
    assert height <= HIGHEST_SWING * length
    assert LEAST_LIFT * leg.stumble_lift <= left <= leg.stumble_lift
    assert height + left <= HIGHEST_SWING * length + LEAST_LIFT * leg.stumble_lift
