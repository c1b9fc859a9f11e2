# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Phase and Andronov-Hopf oscillator: inverses, rates, Jacobians, closed forms, limit cycle."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import differences
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.hopf import FEW, AndronovHopf
from dmp_cpg_ros.core.canonical.phase import (
    phase,
    phase_generator,
    phase_rate,
    phase_rotation,
    state_at,
    wrapped,
)
from dmp_cpg_ros.core.errors import ParameterError

angles = st.floats(-10.0, 10.0)
coordinates = st.floats(-2.0, 2.0)
states = st.tuples(coordinates, coordinates).map(np.array)
oscillators = st.builds(AndronovHopf, st.floats(0.1, 50.0), st.floats(0.2, 3.0))


@given(phi=angles, radius=st.floats(0.01, 10.0))
def test_phase_and_state_at_are_inverse(phi: float, radius: float) -> None:
    x = state_at(phi, radius)
    assert abs(wrapped(phase(x) - phi)) < 1e-9
    assert np.hypot(*x) == pytest.approx(radius)


def test_phase_zero_is_the_target_of_the_paper() -> None:
    assert np.allclose(state_at(0.0), [1.0, 0.0])


@given(phi=angles, turn=angles)
def test_phase_rotation_advances_the_phase(phi: float, turn: float) -> None:
    advanced = phase(phase_rotation(turn) @ state_at(phi))
    assert abs(wrapped(advanced - phi - turn)) < 1e-9


@given(turn=angles)
def test_phase_generator_generates_the_phase_rotation(turn: float) -> None:
    slope = differences(lambda t: phase_rotation(t[0]).ravel(), np.array([turn]))[:, 0]
    assert np.allclose(slope, (phase_generator() @ phase_rotation(turn)).ravel(), atol=1e-8)


@given(x=states.filter(lambda x: np.hypot(*x) > 0.1), x_dot=states)
def test_phase_rate_is_the_derivative_of_the_phase(x: np.ndarray, x_dot: np.ndarray) -> None:
    h = 1e-6
    change = wrapped(phase(x + h * x_dot) - phase(x - h * x_dot)) / (2.0 * h)
    assert phase_rate(x, x_dot) == pytest.approx(float(change), abs=1e-6)


def test_phase_rate_of_the_origin_is_zero() -> None:
    assert phase_rate(np.zeros(2), np.ones(2)) == 0.0


@given(angle=st.floats(-100.0, 100.0))
def test_wrapped_is_the_same_angle_within_half_a_turn(angle: float) -> None:
    result = float(wrapped(angle))
    assert -np.pi <= result < np.pi
    assert abs(np.sin(0.5 * (result - angle))) < 1e-9


@given(oscillator=oscillators, phi=angles, omega=st.floats(0.1, 60.0))
def test_on_the_limit_cycle_the_phase_grows_at_omega(
        oscillator: AndronovHopf, phi: float, omega: float) -> None:
    x = state_at(phi, oscillator.radius)
    x_dot = oscillator.field(x, omega)
    assert phase_rate(x, x_dot) == pytest.approx(omega)
    assert abs(x @ x_dot) < 1e-9 * oscillator.rho * max(oscillator.radius, 1.0)**4 + 1e-9 * omega


@given(oscillator=oscillators, x=states, omega=st.floats(-20.0, 20.0))
def test_the_printed_signs_are_those_of_the_field(
        oscillator: AndronovHopf, x: np.ndarray, omega: float) -> None:
    pull = oscillator.rho * (oscillator.radius**2 - x[0]**2 - x[1]**2)
    printed = [omega * x[1] + pull * x[0], -omega * x[0] + pull * x[1]]
    assert np.allclose(oscillator.field(x, omega), printed, atol=1e-9)


@given(oscillator=oscillators, x=states, omega=st.floats(-20.0, 20.0))
def test_jacobian_against_differences(
        oscillator: AndronovHopf, x: np.ndarray, omega: float) -> None:
    expected = differences(lambda at: oscillator.field(at, omega), x)
    assert np.allclose(oscillator.jacobian(x, omega), expected, atol=1e-5, rtol=1e-5)


@given(oscillator=oscillators, x=states, omega=st.floats(-20.0, 20.0))
def test_closed_form_of_the_symmetric_eigenvalues(
        oscillator: AndronovHopf, x: np.ndarray, omega: float) -> None:
    A = oscillator.jacobian(x, omega)
    numeric = np.linalg.eigvalsh(0.5 * (A + A.T))[::-1]
    closed = oscillator.rho * (oscillator.radius**2 - np.array([1.0, 3.0]) * (x @ x))
    assert np.allclose(closed, numeric, atol=1e-9 * (1.0 + oscillator.rho * 20.0))
    assert closed[0] <= oscillator.rho * oscillator.radius**2 + 1e-12


def test_fields_of_many_states_are_those_of_each() -> None:
    rng = np.random.default_rng(0)
    oscillator, x, omega = AndronovHopf(3.0, 0.7), rng.normal(size=(5, 2)), rng.normal(size=5)
    for i in range(5):
        assert np.allclose(oscillator.field(x, omega)[i], oscillator.field(x[i], omega[i]))
        assert np.allclose(oscillator.jacobian(x, omega)[i], oscillator.jacobian(x[i], omega[i]))


@pytest.mark.parametrize('kind', [np.int64, np.float32])
def test_states_of_another_type_of_number_have_the_same_field(kind: type) -> None:
    oscillator, x = AndronovHopf(3.0), np.array([[2, 0], [0, -1], [1, 3]])
    found = oscillator.field(x.astype(kind), 5.0)
    assert np.array_equal(found, oscillator.field(x.astype(float), 5.0))


@pytest.mark.parametrize('values', [(0.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (1.0, np.inf)])
def test_impossible_oscillators_are_refused(values: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match='positive finite'):
        AndronovHopf(*values)


def test_few_oscillators_are_as_many() -> None:
    """Up to ``FEW`` numbers are plain floats, more are arrays: of one formula."""
    many = np.random.default_rng(5).uniform(-1.5, 1.5, (FEW, 2))
    of = AndronovHopf(rho=8.0, radius=0.7)
    for few in (many[:2], many[:FEW // 2]):
        for compute in (of.field, of.jacobian):
            np.testing.assert_allclose(
                compute(few, 9.0), compute(many, 9.0)[:len(few)], rtol=1e-13, atol=1e-13)
