# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reference filters and temporal scaling: closed forms against their differential equations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths.first_order import FirstOrderFilter
from dmp_cpg_ros.core.primitives.time_scaling import TimeScaling

RATES = st.floats(0.1, 50.0)
TAUS = st.floats(0.2, 5.0)
TIMES = st.floats(1e-4, 2.0)


@given(RATES, st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), TIMES, TIMES)
def test_filter_steps_compose(rate, value, command, first, second):
    system = FirstOrderFilter(rate)
    two = system.step(system.step(value, command, first), command, second)
    np.testing.assert_allclose(two, system.step(value, command, first + second), atol=1e-12)


def test_filter_obeys_its_equation():
    system, value, command, h = (
        FirstOrderFilter(3.0),
        np.array([1.0, -2.0]),
        np.array([0.5, 4.0]),
        1e-5,
    )
    slope = (system.step(value, command, h) - system.step(value, command, -h)) / (2.0 * h)
    np.testing.assert_allclose(slope, 3.0 * (command - value), rtol=1e-8)


@pytest.mark.parametrize('rate', [0.0, -1.0, np.inf, np.nan])
def test_filter_that_would_jump_is_refused(rate):
    with pytest.raises(ParameterError, match='positive finite'):
        FirstOrderFilter(rate)
    with pytest.raises(ParameterError, match='positive finite'):
        TimeScaling(rate)


@given(RATES, TAUS, TAUS, TIMES)
def test_scaled_time_grows_at_one_over_tau(rate, tau, command, t):
    scaling, h = TimeScaling(rate), 1e-6
    ends = scaling.scaled_time(tau, command, [t - h, t + h])
    np.testing.assert_allclose(
        np.diff(ends)[0] / (2.0 * h), 1.0 / scaling.at(tau, command, t), rtol=1e-6
    )
    assert scaling.scaled_time(tau, command, 0.0) == 0.0


@given(st.floats(0.1, 20.0), TAUS, TAUS, TIMES)
def test_real_time_inverts_scaled_time(rate, tau, command, t):
    scaling = TimeScaling(rate)
    np.testing.assert_allclose(
        scaling.real_time(tau, command, scaling.scaled_time(tau, command, t)), t, rtol=1e-7
    )


@given(TAUS, TAUS, TIMES, st.sampled_from(['scaled', 'printed']))
def test_grid_nodes_agree_with_the_closed_forms(tau, command, dt, form):
    scaling = TimeScaling(4.0)
    grid = scaling.grid(tau, command, dt, 5, form)
    np.testing.assert_allclose(grid.elapsed[[0, -1]], [0.0, dt], atol=1e-12)
    np.testing.assert_allclose(
        grid.scaled, scaling.scaled_time(tau, command, grid.elapsed), atol=1e-10
    )
    np.testing.assert_allclose(grid.tau, scaling.at(tau, command, grid.elapsed), rtol=1e-12)
    even = grid.scaled if form == 'scaled' else grid.elapsed
    np.testing.assert_allclose(even, np.linspace(0.0, grid.length, 5), atol=1e-12)


@pytest.mark.parametrize(
    ('tau', 'command', 'dt'),
    [(0.0, 1.0, 0.1), (1.0, -1.0, 0.1), (1.0, 1.0, 0.0), (np.nan, 1.0, 0.1)],
)
def test_grid_refuses_what_has_no_meaning(tau, command, dt):
    with pytest.raises(ParameterError, match='positive finite'):
        TimeScaling(1.0).grid(tau, command, dt, 3, 'scaled')


def test_scaled_time_is_the_integral_of_one_over_tau():
    scaling = TimeScaling(2.0)
    for end in (0.1, 0.5, 1.0):
        by_quadrature, _ = quad(lambda t: 1.0 / float(scaling.at(0.5, 2.0, t)), 0.0, end)
        assert by_quadrature == pytest.approx(float(scaling.scaled_time(0.5, 2.0, end)), abs=1e-12)
