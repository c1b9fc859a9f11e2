# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One leg's primitive: goals whose velocity is their derivative, feet that come down at rest."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import GAITS, TICK, network, quadruped

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import phase_generator, state_at
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.primitives.spring_damper import SpringState
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.leg import (
    LegFeedback,
    LegParameters,
    LegPrimitive,
    LegState,
    body_scale,
    nominal_foothold,
)
from dmp_cpg_ros.core.transformation.preview import rest_of_swing, seen_from_now

ROBOT = quadruped()
REFERENCES = {'forward': [0.5, 0.0, 0.0], 'sideways': [0.0, 0.3, 0.0], 'turn': [0.2, 0.0, 0.8]}


def leg_of(leg: str, **changes: object) -> LegPrimitive:
    return LegPrimitive(leg, ROBOT, LegParameters(**changes))  # type: ignore[arg-type]


def asked(leg: LegPrimitive, state: LegState, shift: np.ndarray | None = None) -> LegFeedback:
    """Feedback for a leg whose joints are at their targets, those that act now."""
    shift = (0.0,) * 3 if shift is None else shift
    sent = (*state.sent, state.joints.position)
    acts = sent[-1 - round(leg.parameters.target_lead / TICK):][0]
    return LegFeedback(acts, shift, (0.0,) * 2, (0.0,) * 3)


def walked(leg: LegPrimitive, gait: Gait, r: np.ndarray, shift: np.ndarray, seconds: float
           ) -> np.ndarray:
    """Goals and their velocities of a leg that walks steadily, (ticks, 2, 3)."""
    speed = leg.scale.foot_speed(*r)
    omega, state, rows = gait.omega(speed, leg.scale), leg.initial_state(), []
    for k in range(round(seconds / TICK)):
        x = state_at(omega * k * TICK)
        x_dot = omega * phase_generator() @ x
        state, goal, goal_velocity = leg.step(
            state, gait, x, x_dot, r, asked(leg, state, shift), TICK)
        rows.append((goal, goal_velocity))
    return np.array(rows)


@pytest.mark.parametrize('direction', REFERENCES)
@pytest.mark.parametrize(('leg', 'gait'), [('fl', 'amble'), ('rr', 'trot')])
def test_goal_velocities_are_the_rates_of_the_goals(leg: str, gait: str, direction: str) -> None:
    r, shift = np.array(REFERENCES[direction]), np.array([0.02, -0.01, 0.01])
    goals, velocities = walked(leg_of(leg), GAITS[gait], r, shift, 3.0)[400:].swapaxes(0, 1)
    rates = np.diff(goals, axis=0) / TICK
    middle = 0.5 * (velocities[1:] + velocities[:-1])
    assert np.abs(rates - middle).max() < 0.05 * np.abs(velocities).max()


@pytest.mark.parametrize('direction', REFERENCES)
@pytest.mark.parametrize('ticks', [1, 6, 15])
def test_a_leg_with_a_lead_sends_what_another_sends_that_much_later(
        ticks: int, direction: str) -> None:
    r, shift = np.array(REFERENCES[direction]), np.array([0.02, -0.01, 0.01])
    later = walked(leg_of('rl'), GAITS['trot'], r, shift, 3.0)
    leads = walked(leg_of('rl', target_lead=ticks * TICK), GAITS['trot'], r, shift, 3.0)
    assert np.allclose(leads[500:-ticks], later[500 + ticks:], atol=1e-6)


@pytest.mark.parametrize('place', [-0.1, 0.02, 0.3])
def test_what_a_lead_misses_of_a_changing_cadence_is_of_second_order(place: float) -> None:
    gait, r = GAITS['amble'], np.array([0.5, 0.0, 0.0])
    begin = 2.0 * np.pi * (place - gait.cycle_position(np.zeros(1))[0])

    def goal(lead: float, phi: float, rate: float) -> np.ndarray:
        leg, x = leg_of('fl', target_lead=lead), state_at(phi)
        state = leg.initial_state()._replace(activity=1.0)
        x_dot = rate * phase_generator() @ x
        return np.array(leg.step(state, gait, x, x_dot, r, asked(leg, state), TICK)[1])

    omega, change = gait.omega(leg_of('fl').scale.foot_speed(*r), leg_of('fl').scale), 20.0
    missed = [np.abs(goal(d, begin, omega) - goal(
        0.0, begin + omega * d + 0.5 * change * d * d, omega + change * d)).max()
        for d in (0.004, 0.002, 0.001)]
    assert missed[0] / missed[1] == pytest.approx(4.0, rel=0.2)
    assert missed[1] / missed[2] == pytest.approx(4.0, rel=0.1)


def test_an_unused_foot_path_in_stance_moves_against_the_body() -> None:
    leg, r = leg_of('fl'), np.array([0.5, 0.0, 0.0])
    goals = walked(leg, GAITS['amble'], r, np.zeros(3), 3.0)[400:, 0]
    feet = np.array([leg.kinematics.foot_in_base(goal) for goal in goals])
    standing = feet[:-1, 2] == pytest.approx(leg.foothold_in_base[2], abs=1e-9)
    velocity = np.diff(feet[:, 0])[standing & (np.diff(feet[:, 2]) < 1e-9)] / TICK
    assert np.allclose(velocity, -0.5 * leg.rolling[0], atol=1e-6)


@pytest.mark.parametrize('gait', GAITS)
def test_at_rest_every_foot_is_on_the_ground(gait: str) -> None:
    at, zero = network(gait), np.zeros(3)
    inhibition = Inhibition(True, np.array([400.0, 0.0, 0.0, 0.0]), 0.3)
    x = at.rest_state(inhibition)
    x_dot = at.rate(x, zero, inhibition)
    for i, name in enumerate(LEGS):
        leg = leg_of(name)
        state = leg.initial_state()
        for _ in range(500):
            state, goal, _ = leg.step(
                state, GAITS[gait], x[i], x_dot[i], zero, asked(leg, state), TICK)
        foot = leg.kinematics.foot_in_base(goal)
        assert np.allclose(foot, nominal_foothold(ROBOT, name), atol=1e-6)


def test_the_kinematic_reading_follows_the_goals_closely() -> None:
    leg, gait, r = leg_of('fr'), GAITS['trot'], np.array([0.5, 0.0, 0.0])
    omega, state, errors = gait.omega(0.5, leg.scale), leg.initial_state(), []
    for k in range(750):
        x = state_at(omega * k * TICK)
        state, goal, _ = leg.step(state, gait, x, omega * phase_generator() @ x, r,
                                  asked(leg, state), TICK)
        errors.append(np.abs(np.subtract(state.joints.position, goal)).max())
    assert max(errors[250:]) < 0.03


def test_the_torque_reading_sends_torques_of_the_measured_joints() -> None:
    leg, rng = leg_of('fl', reading='torque'), np.random.default_rng(0)
    q, q_dot, goal, goal_velocity, feedback = rng.normal(size=(5, 3))
    measured = SpringState(q, q_dot)
    out = leg.targets(leg.initial_state(), goal, goal_velocity, feedback, measured)
    p, J = leg.parameters, ROBOT.legs[0].rotor_inertia
    expected = J * (p.stiffness * (goal - q) + p.damping * (goal_velocity - q_dot)) + feedback
    assert np.allclose(out.effort, expected)


def test_scale_of_the_body() -> None:
    scale = body_scale(ROBOT)
    assert scale.leg_length == pytest.approx(0.28)
    assert scale.hip_radius == pytest.approx(np.hypot(0.19, 0.11))


@pytest.mark.parametrize('direction', REFERENCES)
@pytest.mark.parametrize('leg', ['fl', 'rr'])
def test_a_swinging_foot_is_shown_going_to_where_it_will_stand(leg: str, direction: str) -> None:
    r, primitive = np.array(REFERENCES[direction]), leg_of(leg)
    shift = np.array([0.02, -0.01, 0.0])
    gait = GAITS['amble']
    goals = walked(primitive, gait, r, shift, 3.0)[:, 0]
    _, _, omegas, duty = gait.pace(r, primitive.scale)
    omega, still = omegas[primitive.place], np.zeros(2)
    positions = [gait.scalar_cycle_position(omega * k * TICK) for k in range(len(goals))]
    swings = np.abs(positions) < 0.5 * (1.0 - duty)
    landings = np.flatnonzero(swings[:-1] & ~swings[1:]) + 1
    path = FootPath((0.0, 0.0, 0.0), *REFERENCES[direction], omega, duty, 0.0)
    for tick in (landings[-1] - 20, landings[-1] - 6):
        assert swings[tick]
        x, feedback = state_at(omega * tick * TICK), LegFeedback(
            goals[tick].tolist(), shift, still, (0.0,) * 3)
        x_dot = omega * phase_generator() @ x
        way = rest_of_swing(primitive, gait, x, x_dot, r, feedback)
        assert way is not None
        np.testing.assert_allclose(way[0], primitive.kinematics.foot(goals[tick]), atol=1e-9)
        landed = seen_from_now(path, (landings[-1] - tick) * TICK,
                               primitive.kinematics.foot(goals[landings[-1]]))
        np.testing.assert_allclose(way[-1], landed, atol=0.004)
        assert way[:, 2].max() > landed[2] + 0.005
        # A foot whose oscillator is inhibited, or that stands, is shown going nowhere.
        assert rest_of_swing(primitive, gait, x, 0.0 * x_dot, r, feedback) is None
        x = state_at(omega * landings[-1] * TICK)
        x_dot = omega * phase_generator() @ x
        assert rest_of_swing(primitive, gait, x, x_dot, r, feedback) is None
