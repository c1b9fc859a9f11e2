# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rhythmic primitives: flow, order, limit cycle, new centres, amplitudes and speeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import phase, state_at, wrapped
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.primitives.primitive import VonMisesBases
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicInput, RhythmicPrimitive, hopf_flow
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.core.primitives.time_scaling import StepGrid

OMEGA = 2.0 * np.pi


def primitive(seed=0, dofs=2, form='scaled', count=9):
    rng = np.random.default_rng(seed)
    return RhythmicPrimitive(
        weights=rng.normal(0.0, 60.0, (count, dofs, 2)),
        bases=VonMisesBases.evenly_around(count),
        omega=OMEGA,
        rho=8.0,
        transformation=SpringDamper(np.array([150.0]), np.array([24.0]), form),
        centre=rng.normal(size=dofs),
    )


def flow(x, omega, rho, radius_of, h):
    nodes = np.linspace(0.0, h, 5)
    grid = StepGrid(nodes, nodes, np.ones(5), h, np.ones(5))
    return hopf_flow(x, omega, rho, np.array([radius_of(s) for s in nodes]), grid)


def runge_kutta(x, omega, rho, radius_of, h, steps=400):
    d = h / steps
    for i in range(steps):
        fields = [AndronovHopf(rho, radius_of(i * d + c * d)) for c in (0.0, 0.5, 1.0)]
        k1 = fields[0].field(x, omega)
        k2 = fields[1].field(x + 0.5 * d * k1, omega)
        k3 = fields[1].field(x + 0.5 * d * k2, omega)
        k4 = fields[2].field(x + d * k3, omega)
        x = x + d / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return x


@settings(max_examples=25)
@given(
    st.floats(-3.0, 3.0),
    st.floats(0.05, 3.0),
    st.floats(0.1, 20.0),
    st.floats(0.5, 20.0),
    st.floats(0.3, 2.0),
    st.floats(0.01, 0.2),
)
def test_flow_solves_the_oscillator_with_constant_radius(phi, start, rho, omega, radius, h):
    x = state_at(phi, start)
    np.testing.assert_allclose(
        flow(x, omega, rho, lambda s: radius, h)[-1],
        runge_kutta(x, omega, rho, lambda s: radius, h),
        atol=1e-7,
    )


def test_flow_is_of_fourth_order_in_a_changing_radius():
    def radius_of(s):
        return 1.0 + 0.6 * np.tanh(4.0 * s - 1.0)

    def end(steps):
        x, h = state_at(0.3, 1.7), 1.0 / steps
        for i in range(steps):
            x = flow(x, OMEGA, 5.0, lambda s, at=i * h: radius_of(at + s), h)[-1]
        return x

    exact = runge_kutta(state_at(0.3, 1.7), OMEGA, 5.0, radius_of, 1.0, 4000)
    errors = [np.abs(end(n) - exact).max() for n in (8, 16, 32)]
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 3.7), errors


@pytest.mark.parametrize('rho', [1.0, 1e3, 1e7])
def test_flow_keeps_the_limit_cycle_and_the_origin_however_strong_the_attraction(rho):
    states = flow(state_at(0.4, 2.0), 3.0, rho, lambda s: 2.0, 0.5)
    np.testing.assert_allclose(np.hypot(*states.T), 2.0, rtol=1e-12)
    np.testing.assert_allclose(wrapped(phase(states[-1]) - 0.4 - 1.5), 0.0, atol=1e-12)
    np.testing.assert_array_equal(flow(np.zeros(2), 3.0, rho, lambda s: 2.0, 0.5), 0.0)


def final(p, steps, schedule):
    state = p.initial_state()
    for command in schedule:
        for _ in range(steps // len(schedule)):
            state = p.step(state, command, 1.0 / steps)
    return np.concatenate([state.position, state.velocity, state.x])


@pytest.mark.parametrize('form', ['scaled', 'printed'])
def test_step_converges_with_fourth_order_while_everything_changes(form):
    p = primitive(form=form)
    schedule = [RhythmicInput(p.centre + 1.0, 1.5, 0.8), RhythmicInput(p.centre - 1.0, 0.5, 1.4)]
    exact = final(p, 2048, schedule)
    errors = [np.abs(final(p, n, schedule) - exact).max() for n in (64, 128, 256)]
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 3.7), errors


@settings(max_examples=10)
@given(
    st.integers(0, 1000),
    st.sampled_from(['scaled', 'printed']),
    st.floats(0.4, 2.5),
    st.floats(-3.0, 3.0),
)
def test_initial_state_is_on_the_limit_cycle(seed, form, tau, phi):
    p = primitive(seed, form=form)
    command = RhythmicInput(p.centre + 0.5, 1.3, tau)
    start = p.initial_state(phi, command)
    made = p.rollout(np.linspace(0.0, tau * p.period, 401), command, start)
    np.testing.assert_allclose(made.positions[-1], start.position, atol=1e-5)
    np.testing.assert_allclose(made.velocities[-1], start.velocity, atol=1e-3)
    np.testing.assert_allclose(
        p.on_cycle(phi, tau)[0][0] * 1.3 + command.centre, start.position, atol=1e-12
    )


@settings(max_examples=10)
@given(st.integers(0, 1000), st.floats(0.1, 3.0), st.floats(0.1, 3.0))
def test_every_start_ends_on_the_same_cycle(seed, radius, offset):
    p = primitive(seed)
    command = p.default_input()
    start = replace(
        p.initial_state(), x=state_at(1.0, radius), position=p.centre + offset, velocity=np.ones(2)
    )
    state = start
    for _ in range(300):
        state = p.step(state, command, 0.01)
    on_cycle = p.initial_state(float(phase(state.x)))
    np.testing.assert_allclose(state.position, on_cycle.position, atol=1e-5)
    np.testing.assert_allclose(np.hypot(*state.x), 1.0, atol=1e-9)


@given(st.floats(0.1, 4.0))
def test_forcing_is_proportional_to_the_amplitude(amplitude):
    p, x = primitive(), state_at(np.linspace(0.0, 6.0, 20))
    np.testing.assert_allclose(
        p.forcing(amplitude * x), amplitude * p.forcing(x), rtol=1e-9, atol=1e-9
    )


def test_forcing_is_the_printed_formula():
    p, x = primitive(), state_at(0.7, 1.2)
    theta, centres = np.arctan2(x[1], x[0]), -p.bases.centres
    phi = np.exp((np.cos(theta - centres) - 1.0) / (2.0 * p.bases.widths**2))
    expected = sum(phi[i] * (p.weights[i] @ x) for i in range(len(phi))) / phi.sum()
    np.testing.assert_allclose(p.forcing(x), expected, rtol=1e-12)


def test_tau_changes_the_speed_and_not_the_path():
    p, times = primitive(), np.linspace(0.0, 2.0, 201)
    plain = p.rollout(times)
    for tau in (0.3, 2.7):
        scaled = p.rollout(tau * times, RhythmicInput(p.centre, 1.0, tau))
        np.testing.assert_allclose(scaled.positions, plain.positions, atol=1e-10)
        np.testing.assert_allclose(tau * scaled.velocities, plain.velocities, atol=1e-8)


def test_a_new_centre_and_amplitude_are_reached():
    p = primitive()
    state, command = p.initial_state(), RhythmicInput(p.centre + 2.0, 0.4, 1.6)
    for _ in range(1600):
        state = p.step(state, command, 0.01)
    expected = p.initial_state(float(phase(state.x)), command)
    np.testing.assert_allclose(state.position, expected.position, atol=1e-5)
    np.testing.assert_allclose(state.velocity, expected.velocity, atol=1e-4)


@pytest.mark.parametrize('form', ['scaled', 'printed'])
def test_commands_that_jump_make_neither_position_nor_velocity_jump(form):
    p = primitive(form=form)
    state = p.initial_state(0.9)
    jump = RhythmicInput(p.centre + 10.0, 5.0, 4.0)
    speed = np.abs(state.velocity).max()
    bound = (
        np.abs(p.acceleration(state, p.default_input())).max()
        + np.abs(p.acceleration(state, jump)).max()
    )
    for dt in (1e-3, 1e-4, 1e-5):
        after = p.step(state, jump, dt)
        assert np.abs(after.position - state.position).max() <= 1.1 * dt * speed + bound * dt**2
        assert np.abs(after.velocity - state.velocity).max() <= 1.1 * bound * dt
        assert np.abs(after.x - state.x).max() <= 20.0 * dt


def test_following_an_outer_oscillator_is_the_same_as_the_own_one():
    p = primitive()
    own = followed = p.initial_state(0.2)
    command = RhythmicInput(p.centre + 0.3, 1.0, 1.5)
    for _ in range(50):
        half = p.step(own, command, 0.005)
        after = p.step(half, command, 0.005)
        followed = p.follow(followed, np.stack([own.x, half.x, after.x]), command, 0.01)
        own = after
    np.testing.assert_allclose(followed.x, own.x, atol=1e-14)
    np.testing.assert_allclose(followed.position, own.position, atol=1e-5)


def test_at_rest_in_the_origin_there_is_no_force():
    p = primitive()
    np.testing.assert_array_equal(p.forcing(np.zeros(2)), 0.0)
    state = replace(p.initial_state(), x=np.zeros(2))
    for _ in range(200):
        state = p.step(state, p.default_input(), 0.01)
    np.testing.assert_allclose(state.position, p.centre, atol=1e-6)


@pytest.mark.parametrize('tau', [0.5, 1.0])
def test_a_rollout_between_few_times_is_that_between_many(tau):
    p = primitive()
    command, times = RhythmicInput(p.centre + 0.5, 0.7, tau), np.linspace(0.0, tau, 801)
    exact, few = p.rollout(times, command), np.array([0, 30, 400, 800])
    made = p.rollout(times[few], command)
    scale = np.ptp(exact.positions)
    np.testing.assert_allclose(made.positions, exact.positions[few], atol=1e-4 * scale)
    np.testing.assert_allclose(made.velocities, exact.velocities[few], atol=1e-2 * scale)


@pytest.mark.parametrize(
    'change',
    [
        {'weights': np.zeros((9, 2))},
        {'weights': np.full((9, 2, 2), np.inf)},
        {'centre': np.zeros(3)},
        {'omega': 0.0},
        {'rho': -1.0},
        {'names': ('one',)},
        {'amplitude_rate': 0.0},
    ],
)
def test_bad_primitives_are_refused(change):
    with pytest.raises(ParameterError):
        replace(primitive(), **change)


@pytest.mark.parametrize(
    'command', [RhythmicInput(np.zeros(2), 0.0), RhythmicInput(np.zeros(2), 1.0, np.nan)]
)
def test_bad_inputs_are_refused(command):
    with pytest.raises(ParameterError, match='positive finite'):
        primitive().step(primitive().initial_state(), command, 0.01)


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('seconds', [30.0, 60.0])
@pytest.mark.parametrize('amplitude', [0.05, 10.0, 20.0])
def test_long_steps_bear_an_amplitude_that_changes_fast(seconds: float, amplitude: float) -> None:
    """They ended in NaN, or 39 % beside the movement."""
    slow = replace(primitive(), omega=OMEGA / seconds)
    asked = RhythmicInput(slow.centre, amplitude)
    coarse, fine = (slow.rollout(np.linspace(0.0, seconds, count), asked,
                                 slow.initial_state()).positions for count in (21, 4001))
    assert np.abs(coarse - fine[::200]).max() < 0.1 * np.ptp(fine)
