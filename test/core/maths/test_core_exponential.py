# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The exponential step: its functions, its order, its stability, its equilibria."""

from __future__ import annotations

from math import factorial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.maths.exponential import (
    ExponentialStep,
    phi_functions,
    phi_functions_doubled,
)


def random_matrix(seed: int, n: int, size: float) -> np.ndarray:
    M = np.random.default_rng(seed).normal(size=(n, n))
    return size * M / np.linalg.norm(M, 1)


@given(seed=st.integers(0, 1000), n=st.integers(1, 6), size=st.floats(0.0, 30.0))
def test_phi_functions_satisfy_their_recursion(seed: int, n: int, size: float) -> None:
    M = random_matrix(seed, n, size)
    phi = phi_functions(M, 4)
    for k in range(4):
        expected = np.eye(n) / factorial(k) + M @ phi[k + 1]
        scale = np.abs(phi[k]).max() + np.abs(M).max() * np.abs(phi[k + 1]).max()
        assert np.allclose(phi[k], expected, atol=1e-12 * (1.0 + scale))


@given(seed=st.integers(0, 1000), n=st.integers(1, 6), size=st.floats(0.0, 30.0))
def test_phi_functions_of_twice_a_matrix_follow_from_its_own(seed: int, n: int, size: float
                                                             ) -> None:
    M = random_matrix(seed, n, size)
    for doubled, known in zip(phi_functions_doubled(phi_functions(M)), phi_functions(2.0 * M),
                              strict=True):
        assert np.allclose(doubled, known, rtol=1e-11, atol=1e-11 * np.abs(known).max())


@given(seed=st.integers(0, 1000), size=st.floats(0.1, 400.0))
def test_exponential_of_a_symmetric_matrix_by_its_eigenvalues(seed: int, size: float) -> None:
    M = random_matrix(seed, 5, size)
    values, vectors = np.linalg.eigh(-(M @ M.T))
    expected = vectors @ np.diag(np.exp(values)) @ vectors.T
    assert np.allclose(phi_functions(-(M @ M.T), 0)[0], expected, atol=1e-10)


def test_phi_functions_of_zero_are_reciprocal_factorials() -> None:
    for k, phi in enumerate(phi_functions(np.zeros((3, 3)), 4)):
        assert np.allclose(phi, np.eye(3) / factorial(k))


def pendulum(x: np.ndarray) -> np.ndarray:
    """A mild nonlinear part with coupled components."""
    a, b, c = x
    return np.array([np.sin(b) + 0.2 * c**2, -np.sin(a) * c, np.cos(a) - b**3])


STIFF = np.array([[-30.0, 10.0, 0.0], [5.0, -20.0, 8.0], [0.0, 3.0, -12.0]])
CONSTANT = np.array([1.0, -2.0, 0.5])


def integrated(steps: int) -> np.ndarray:
    step, x = ExponentialStep(STIFF, CONSTANT, 1.0 / steps), np.array([1.0, -1.0, 0.5])
    for _ in range(steps):
        x = step(x, pendulum)
    return x


def test_the_order_of_convergence_is_three() -> None:
    exact = integrated(4096)
    errors = [np.abs(integrated(steps) - exact).max() for steps in (64, 128, 256)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((orders > 2.8) & (orders < 3.3)), orders


@given(seed=st.integers(0, 1000), dt=st.floats(1e-4, 1.0))
def test_a_linear_equation_is_integrated_exactly(seed: int, dt: float) -> None:
    M, c = random_matrix(seed, 4, 50.0), np.arange(4.0)
    x, still = np.ones(4), np.zeros_like
    halves = ExponentialStep(M, c, 0.5 * dt)
    twice = halves(halves(x, still), still)
    assert np.allclose(ExponentialStep(M, c, dt)(x, still), twice, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize('rate', [1e2, 1e4, 1e6])
def test_an_equilibrium_of_the_equation_stays(rate: float) -> None:
    M, x = rate * STIFF / 30.0, np.array([0.3, -0.4, 0.9])
    c = -M @ x - pendulum(x)
    assert np.abs(ExponentialStep(M, c, 0.004)(x, pendulum) - x).max() < 1e-12
