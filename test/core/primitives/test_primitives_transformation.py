# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The spring-damper: its exact propagator, its step and the two readings of τ."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.primitives.spring_damper import (
    SpringDamper,
    default_gains,
    spring_exponential,
)
from dmp_cpg_ros.core.primitives.time_scaling import TimeScaling

STIFFNESS = st.floats(0.01, 1e4)
RATIOS = st.one_of(st.just(1.0), st.floats(0.01, 20.0))


def exponential(A, s):
    """Matrix exponential by scaling, Taylor series and squaring."""
    M = A * s / 2.0**24
    result = np.eye(2) + M + M @ M / 2.0 + M @ M @ M / 6.0
    for _ in range(24):
        result = result @ result
    return result


@given(STIFFNESS, RATIOS, st.floats(1e-4, 0.3))
def test_propagator_is_the_matrix_exponential(k, ratio, s):
    b = 2.0 * ratio * np.sqrt(k)
    expected = exponential(np.array([[0.0, 1.0], [-k, -b]]), s)
    scale = np.array([[1.0, 1.0 / np.sqrt(k)], [np.sqrt(k), 1.0]])
    np.testing.assert_allclose(spring_exponential(k, b, s) / scale, expected / scale, atol=2e-7)


@given(STIFFNESS, st.floats(-1e-6, 1e-6), st.floats(1e-3, 1.0))
def test_propagators_compose_around_critical_damping(k, detuning, s):
    b = 2.0 * (1.0 + detuning) * np.sqrt(k)
    half = spring_exponential(k, b, 0.5 * s)
    scale = np.array([[1.0, 1.0 / np.sqrt(k)], [np.sqrt(k), 1.0]])
    np.testing.assert_allclose(half @ half / scale, spring_exponential(k, b, s) / scale, atol=1e-9)


def test_an_equilibrium_is_kept_exactly_however_stiff_it_is():
    spring = SpringDamper(np.array([1.0, 1e8]), np.array([2.0, 2e4]))
    grid = TimeScaling(1.0).grid(1.0, 1.0, 0.1, 3, 'scaled')
    goal = np.array([0.3, -0.7])
    y, v = spring.step(goal, np.zeros(2), np.tile(goal, (3, 1)), np.zeros((3, 2)), grid)
    np.testing.assert_allclose(y, goal, rtol=1e-14)
    np.testing.assert_allclose(v, 0.0, atol=1e-12)


@pytest.mark.parametrize('stiffness', [1e2, 1e6, 1e10])
def test_steps_are_stable_for_every_stiffness(stiffness):
    spring = SpringDamper(np.array([stiffness]), np.array([0.02 * np.sqrt(stiffness)]))
    grid = TimeScaling(1.0).grid(1.0, 1.0, 0.05, 3, 'scaled')
    y, v = np.array([1.0]), np.array([0.0])
    energy = [stiffness * y[0] ** 2 + v[0] ** 2]
    for _ in range(50):
        y, v = spring.step(y, v, np.zeros((3, 1)), np.zeros((3, 1)), grid)
        energy.append(stiffness * y[0] ** 2 + v[0] ** 2)
    assert np.all(np.diff(energy) <= 0.0)


def advance(spring, steps, duration, tau, command):
    """Integrate with goal and force that vary in scaled time, and τ on its way to the command."""
    scaling, dt, t_scaled = TimeScaling(2.0), duration / steps, 0.0
    y, v = np.array([0.5, -1.0]), np.array([0.2, 1.0])
    for _ in range(steps):
        grid = scaling.grid(tau, command, dt, 3, spring.form)
        s = t_scaled + grid.scaled
        goals = np.stack([np.cos(3.0 * s), np.sin(2.0 * s)], axis=1)
        forces = np.stack([40.0 * np.sin(5.0 * s), 30.0 * np.exp(-s)], axis=1)
        y, v = spring.step(y, v, goals, forces, grid)
        tau, t_scaled = float(grid.tau[-1]), s[-1]
    return np.concatenate([y, v])


@pytest.mark.parametrize('form', ['scaled', 'printed'])
@pytest.mark.parametrize(('tau', 'command'), [(1.0, 1.0), (0.7, 0.7), (0.7, 1.6)])
def test_step_converges_with_fourth_order(form, tau, command):
    spring = SpringDamper(np.array([100.0, 30.0]), np.array([20.0, 3.0]), form)
    exact = advance(spring, 2048, 1.0, tau, command)
    errors = [np.abs(advance(spring, n, 1.0, tau, command) - exact).max() for n in (32, 64, 128)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(orders > 3.8), orders


def test_both_forms_are_one_at_tau_1():
    results = [
        advance(
            SpringDamper(np.array([50.0, 9.0]), np.array([14.0, 6.0]), form), 400, 1.0, 1.0, 1.0
        )
        for form in ('scaled', 'printed')
    ]
    np.testing.assert_allclose(*results, atol=1e-7)


@given(st.floats(0.3, 3.0))
def test_printed_form_is_the_scaled_one_with_tau_times_stiffness_and_force(tau):
    k, b, rng = np.array([30.0]), np.array([8.0]), np.random.default_rng(1)
    y, v, g, f = rng.normal(size=(4, 1))
    printed = SpringDamper(k, b, 'printed').acceleration(y, v, g, f, tau)
    scaled = SpringDamper(tau * k, b, 'scaled').acceleration(y, v, g, tau * f, tau)
    np.testing.assert_allclose(printed, scaled, rtol=1e-12)


@pytest.mark.parametrize('form', ['scaled', 'printed'])
def test_acceleration_is_the_slope_of_the_stepped_velocity(form):
    spring, scaling, h = (
        SpringDamper(np.array([30.0]), np.array([8.0]), form),
        TimeScaling(5.0),
        1e-5,
    )
    y, v, g, f = np.array([[0.4], [1.0], [0.1], [3.0]])
    tau, command = 1.3, 0.6
    _, after = spring.step(
        y, v, np.tile(g, (3, 1)), np.tile(f, (3, 1)), scaling.grid(tau, command, h, 3, form)
    )
    expected = spring.acceleration(y, v, g, f, tau, 5.0 * (command - tau))
    np.testing.assert_allclose((after - v) / h, expected, rtol=1e-3)


@given(st.sampled_from(['scaled', 'printed']), st.floats(0.2, 4.0), st.integers(0, 99))
def test_required_force_is_the_inverse_of_the_acceleration(form, tau, seed):
    rng = np.random.default_rng(seed)
    spring = SpringDamper(rng.uniform(1.0, 99.0, 3), rng.uniform(1.0, 20.0, 3), form)
    y, v, a, g = rng.normal(size=(4, 3))
    force = spring.required_force(y, v, a, g, tau)
    np.testing.assert_allclose(spring.acceleration(y, v, g, force, tau), a, atol=1e-9)


@given(st.floats(0.05, 20.0))
def test_default_gains_damp_critically_and_settle_in_time(duration):
    k, b = default_gains(duration)
    assert b**2 == pytest.approx(4.0 * k)
    slowest = np.exp(-0.5 * b * duration) * (1.0 + 0.5 * b * duration)
    assert slowest < 1e-4


def test_groups_cover_every_degree_of_freedom_once():
    spring = SpringDamper(np.array([1.0, 2.0, 1.0, 2.0]), np.array([3.0, 3.0, 3.0, 4.0]))
    groups = spring.groups()
    assert sorted(np.concatenate([members for _, _, members in groups]).tolist()) == [0, 1, 2, 3]
    for k, b, members in groups:
        assert np.all(spring.stiffness[members] == k)
        assert np.all(spring.damping[members] == b)


@pytest.mark.parametrize(
    ('k', 'b', 'form'),
    [
        ([0.0], [1.0], 'scaled'),
        ([1.0], [-1.0], 'scaled'),
        ([1.0, 2.0], [1.0], 'scaled'),
        ([np.inf], [1.0], 'scaled'),
        ([1.0], [1.0], 'squared'),
    ],
)
def test_bad_springs_are_refused(k, b, form):
    with pytest.raises(ParameterError):
        SpringDamper(np.array(k), np.array(b), form)
