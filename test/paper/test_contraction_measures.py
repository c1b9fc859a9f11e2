# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Matrix measures by their definition, Jacobians against differences, the generalized Jacobian."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture_anywhere import Interval
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.paper.jacobians import (
    complex_step_jacobian,
    difference_jacobian,
    generalized_jacobian,
    numerical_jacobian,
)
from dmp_cpg_ros.paper.matrix_measure import NORMS, interval_measure, matrix_measure

SEEDS = st.integers(0, 10_000)


@pytest.mark.parametrize('norm', NORMS)
@given(seed=SEEDS, n=st.integers(1, 6))
def test_a_measure_is_the_one_sided_derivative_of_the_norm(norm: float, seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    A, w = 5.0 * rng.normal(size=(n, n)), rng.uniform(0.3, 3.0, n)
    turned = np.diag(w) @ A @ np.diag(1.0 / w)
    h, rounding = 1e-7, 1e-6
    quotient = (np.linalg.norm(np.eye(n) + h * turned, norm) - 1.0) / h
    # The norm is convex in h, so the quotient falls to the measure; ‖I + hA‖₂² ≤ 1 + 2hμ + h²‖A‖₂²
    # bounds how far above it is.
    above = quotient - matrix_measure(A, norm, w)
    assert -rounding < above < 0.5 * h * np.linalg.norm(turned, 2) ** 2 + rounding


@pytest.mark.parametrize('norm', NORMS)
@given(seed=SEEDS)
def test_measures_are_subadditive_and_bound_the_spectrum(norm: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(2, 4, 4))
    assert matrix_measure(A + B, norm) <= matrix_measure(A, norm) + matrix_measure(B, norm) + 1e-12
    assert np.linalg.eigvals(A).real.max() <= matrix_measure(A, norm) + 1e-12
    shifted = matrix_measure(A + 3.0 * np.eye(4), norm)
    assert shifted == pytest.approx(matrix_measure(A, norm) + 3.0)


@pytest.mark.parametrize('norm', NORMS)
@given(seed=SEEDS)
def test_interval_measures_bound_every_matrix_inside(norm: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    lower = rng.normal(size=(3, 3))
    box = Interval(lower, lower + rng.uniform(0.0, 0.5, (3, 3)))
    bound = interval_measure(box, norm)
    for _ in range(20):
        inside = rng.uniform(box.lower, box.upper)
        assert matrix_measure(inside, norm) <= bound
    assert interval_measure(Interval.of(lower), norm) == pytest.approx(matrix_measure(lower, norm))


def test_another_norm_and_bad_coordinates_are_refused() -> None:
    with pytest.raises(ParameterError, match='valid are 1, 2 and inf'):
        matrix_measure(np.eye(2), 3)
    with pytest.raises(ParameterError, match='positive'):
        matrix_measure(np.eye(2), 2, np.array([1.0, 0.0]))
    with pytest.raises(ParameterError, match='invertible 2 x 2'):
        matrix_measure(np.eye(2), 2, np.ones((2, 2)))


@given(seed=SEEDS)
def test_the_shipped_jacobians_agree_with_the_complex_step_and_with_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    oscillator = AndronovHopf(rng.uniform(0.5, 20.0), rng.uniform(0.5, 2.0))
    omega = rng.uniform(1.0, 20.0)
    x = rng.normal(size=2)

    def field(x: np.ndarray) -> np.ndarray:
        return oscillator.field(x, omega)

    exact = oscillator.jacobian(x, omega)
    assert np.allclose(complex_step_jacobian(field, x), exact, rtol=1e-12, atol=1e-12)
    assert np.allclose(difference_jacobian(field, x), exact, rtol=1e-7, atol=1e-6)
    graph = graph_from_edges(4, topology('ring', 4), 30.0, rng.uniform(-3.0, 3.0, 4))
    system = CanonicalSystem(graph, oscillator)
    gains, states = np.array([100.0, 0.0, 0.0, 0.0]), rng.normal(size=(4, 2))
    assert np.allclose(
        difference_jacobian(lambda y: system.field(y.reshape(4, 2), omega, gains).ravel(),
                            states.ravel()),
        system.jacobian(states, omega, gains), rtol=1e-6, atol=1e-5)


def test_fields_that_are_not_analytic_fall_back_to_differences() -> None:
    def kinked(x: np.ndarray) -> np.ndarray:
        return np.array([np.abs(x[0]) * x[1], x[0]])

    def real_only(x: np.ndarray) -> np.ndarray:
        return np.array([np.arctan2(x[0], x[1]), x[0] * x[1]])

    x = np.array([-2.0, 3.0])
    assert np.allclose(numerical_jacobian(kinked, x), [[-3.0, 2.0], [1.0, 0.0]], atol=1e-6)
    assert np.allclose(numerical_jacobian(real_only, x),
                       [[3.0 / 13.0, 2.0 / 13.0], [3.0, -2.0]], atol=1e-6)
    with pytest.raises(DataError, match='not finite'):
        numerical_jacobian(lambda x: x + (np.inf if x[0] > 0 else 0.0), np.array([0.0]))


@given(seed=SEEDS)
def test_the_generalized_jacobian_moves_transformed_displacements(seed: int) -> None:
    # δz = Θ(t) δx has d/dt δz = F δz when d/dt δx = A δx.
    rng = np.random.default_rng(seed)
    A, Theta, Theta_dot = rng.normal(size=(3, 3, 3))
    Theta += 4.0 * np.eye(3)
    delta = rng.normal(size=3)
    F = generalized_jacobian(A, Theta, Theta_dot)
    assert np.allclose(F @ Theta @ delta, Theta_dot @ delta + Theta @ A @ delta)
    assert np.allclose(generalized_jacobian(A, Theta), Theta @ A @ np.linalg.inv(Theta))
