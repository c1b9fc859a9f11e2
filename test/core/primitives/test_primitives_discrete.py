# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Discrete primitives: order, the goal, scaling in time, new goals and speeds on the way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.primitives.discrete import DiscreteInput, DiscretePrimitive
from dmp_cpg_ros.core.primitives.primitive import GaussianBases
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper

DECAY = 4.6


def primitive(seed=0, dofs=2, form='scaled', count=8):
    rng = np.random.default_rng(seed)
    return DiscretePrimitive(
        weights=rng.normal(0.0, 80.0, (count, dofs)),
        bases=GaussianBases.evenly_in_time(count, DECAY, 1.0),
        phase_decay=DECAY,
        transformation=SpringDamper(np.array([100.0]), np.array([20.0]), form),
        start=rng.normal(size=dofs),
        goal=rng.normal(size=dofs),
        duration=1.0,
    )


def final(p, steps, schedule):
    """State after one second of the commands of a schedule, each held for an equal part."""
    state = p.initial_state()
    for command in schedule:
        for _ in range(steps // len(schedule)):
            state = p.step(state, command, 1.0 / steps)
    return np.concatenate([state.position, state.velocity, state.goal, [state.x, state.tau]])


@pytest.mark.parametrize('form', ['scaled', 'printed'])
def test_step_converges_with_fourth_order_while_goal_and_speed_change(form):
    p = primitive(form=form)
    schedule = [DiscreteInput(p.goal + 1.0, 0.8), DiscreteInput(p.goal - 0.5, 1.5)]
    exact = final(p, 2048, schedule)
    errors = [np.abs(final(p, n, schedule) - exact).max() for n in (64, 128, 256)]
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 3.8), errors


def test_phase_and_filters_do_not_depend_on_the_step():
    p = primitive()
    schedule = [DiscreteInput(p.goal + 1.0, 0.8), DiscreteInput(p.goal - 0.5, 1.5)]
    np.testing.assert_allclose(final(p, 2, schedule)[4:], final(p, 200, schedule)[4:], rtol=1e-12)


@settings(max_examples=15)
@given(st.integers(0, 1000), st.sampled_from(['scaled', 'printed']), st.floats(0.5, 2.0))
def test_every_primitive_ends_at_its_goal(seed, form, tau):
    p = primitive(seed, form=form)
    goal = p.goal + 2.0
    made = p.rollout(np.linspace(0.0, 6.0 * tau, 400), DiscreteInput(goal, tau))
    np.testing.assert_allclose(made.positions[-1], goal, atol=1e-4)
    np.testing.assert_allclose(made.velocities[-1], 0.0, atol=1e-3)


@settings(max_examples=15)
@given(st.floats(0.2, 5.0))
def test_tau_changes_the_speed_and_not_the_path(tau):
    p, times = (
        replace(primitive(), start_velocity=np.array([1.0, -2.0])),
        np.linspace(0.0, 1.0, 101),
    )
    plain, scaled = p.rollout(times), p.rollout(tau * times, DiscreteInput(p.goal, tau))
    np.testing.assert_allclose(scaled.positions, plain.positions, atol=1e-12)
    np.testing.assert_allclose(tau * scaled.velocities, plain.velocities, atol=1e-10)
    np.testing.assert_allclose(tau**2 * scaled.accelerations, plain.accelerations, atol=1e-8)


def test_a_speed_that_changes_on_the_way_keeps_the_path():
    p, times = primitive(), np.linspace(0.0, 1.5, 1501)
    state, positions, velocities, taus = p.initial_state(), [], [], []
    for i in range(len(times)):
        positions.append(state.position)
        velocities.append(state.velocity)
        taus.append(state.tau)
        state = p.step(state, DiscreteInput(p.goal, 0.5 if i < 600 else 2.0), 0.001)

    def tau(t):
        first = 0.5 + 0.5 * np.exp(-p.tau_rate * min(t, 0.6))
        return first if t <= 0.6 else 2.0 + (first - 2.0) * np.exp(-p.tau_rate * (t - 0.6))

    scaled = solve_ivp(lambda t, _: [1.0 / tau(t)], (0.0, times[-1]), [0.0], t_eval=times,
                       max_step=0.01, rtol=1e-11, atol=1e-12).y[0]
    plain = p.rollout(scaled)
    np.testing.assert_allclose(positions, plain.positions, atol=1e-8)
    np.testing.assert_allclose(np.array(taus)[:, None] * velocities, plain.velocities, atol=1e-6)


def test_the_printed_form_takes_another_path_when_tau_changes():
    p, times = primitive(form='printed'), np.linspace(0.0, 1.0, 101)
    plain, slow = p.rollout(times), p.rollout(2.0 * times, DiscreteInput(p.goal, 2.0))
    assert np.abs(slow.positions - plain.positions).max() > 0.05 * np.ptp(plain.positions)


@pytest.mark.parametrize('form', ['scaled', 'printed'])
def test_commands_that_jump_make_neither_position_nor_velocity_jump(form):
    p = primitive(form=form)
    state = p.initial_state()
    for _ in range(300):
        state = p.step(state, p.default_input(), 0.001)
    before = np.abs(p.acceleration(state, p.default_input())).max()
    jump = DiscreteInput(p.goal + 10.0, 5.0)
    for dt in (1e-3, 1e-4, 1e-5):
        after = p.step(state, jump, dt)
        assert (
            np.abs(after.position - state.position).max()
            <= 1.1 * dt * np.abs(state.velocity).max() + before * dt**2
        )
        bound = before + np.abs(p.acceleration(state, jump)).max()
        assert np.abs(after.velocity - state.velocity).max() <= 1.1 * bound * dt


def test_without_a_jump_of_tau_even_the_acceleration_is_continuous():
    p = primitive()
    state = p.initial_state()
    for _ in range(300):
        state = p.step(state, p.default_input(), 0.001)
    moved = DiscreteInput(p.goal + 10.0)
    np.testing.assert_allclose(
        p.acceleration(state, moved), p.acceleration(state, p.default_input()), rtol=1e-12
    )


def test_a_translated_movement_is_the_translated_movement():
    p, times, shift = primitive(), np.linspace(0.0, 1.2, 121), np.array([3.0, -7.0])
    moved = p.rollout(
        times, DiscreteInput(p.goal + shift), p.initial_state(p.start + shift, goal=p.goal + shift)
    )
    np.testing.assert_allclose(moved.positions, p.rollout(times).positions + shift, atol=1e-12)


def test_degrees_of_freedom_share_the_phase_and_nothing_else():
    p, times = primitive(dofs=5), np.linspace(0.0, 1.0, 51)
    together = p.rollout(times).positions
    for j in range(5):
        alone = replace(
            p,
            weights=p.weights[:, [j]],
            start=p.start[[j]],
            goal=p.goal[[j]],
            start_velocity=0.0,
            transformation=SpringDamper(np.array([100.0]), np.array([20.0])),
        )
        np.testing.assert_allclose(
            alone.rollout(times).positions[:, 0], together[:, j], atol=1e-13
        )


def test_velocity_and_acceleration_are_derivatives_of_the_position():
    p, times = primitive(), np.linspace(0.0, 1.0, 2001)
    made = p.rollout(times)
    np.testing.assert_allclose(
        np.gradient(made.positions, times, axis=0)[5:-5], made.velocities[5:-5], atol=2e-4
    )
    np.testing.assert_allclose(
        np.gradient(made.velocities, times, axis=0)[5:-5], made.accelerations[5:-5], atol=2e-2
    )


def test_a_step_leaves_the_given_state_alone():
    p = primitive()
    state = p.initial_state()
    copies = state.position.copy(), state.velocity.copy(), state.goal.copy()
    p.step(state, DiscreteInput(p.goal + 1.0, 2.0), 0.1)
    for kept, now in zip(copies, (state.position, state.velocity, state.goal), strict=True):
        np.testing.assert_array_equal(kept, now)


@pytest.mark.parametrize('tau', [0.5, 1.0])
def test_a_rollout_between_few_times_is_that_between_many(tau):
    p = primitive()
    command, times = DiscreteInput(p.goal + 0.5, tau), np.linspace(0.0, tau, 801)
    exact, few = p.rollout(times, command), np.array([0, 30, 400, 800])
    made = p.rollout(times[few], command)
    scale = np.ptp(exact.positions)
    np.testing.assert_allclose(made.positions, exact.positions[few], atol=1e-4 * scale)
    np.testing.assert_allclose(made.velocities, exact.velocities[few], atol=1e-2 * scale)


@pytest.mark.parametrize(
    'change',
    [
        {'weights': np.zeros((3, 2))},
        {'weights': np.full((8, 2), np.nan)},
        {'start': np.zeros(3)},
        {'phase_decay': 0.0},
        {'duration': -1.0},
        {'goal_rate': 0.0},
        {'tau_rate': np.inf},
        {'names': ('one',)},
        {'transformation': SpringDamper(np.ones(3), np.ones(3))},
    ],
)
def test_bad_primitives_are_refused(change):
    with pytest.raises(ParameterError):
        replace(primitive(), **change)


def test_bad_states_and_inputs_are_refused():
    p = primitive()
    with pytest.raises(ParameterError, match='position'):
        p.initial_state(position=[1.0])
    with pytest.raises(ParameterError, match='tau'):
        p.initial_state(tau=0.0)
    with pytest.raises(ParameterError, match='tau'):
        p.step(p.initial_state(), DiscreteInput(p.goal, -1.0), 0.01)
    with pytest.raises(ParameterError, match='dt'):
        p.step(p.initial_state(), p.default_input(), 0.0)
