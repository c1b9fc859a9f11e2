# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scaling in space: diffeomorphisms, transported metrics, daughters and drawn limit cycles."""

from __future__ import annotations

import numpy as np
import pytest
from demonstrations import walking_joints
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import phase, state_at
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.learning.discrete import learn_discrete
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.primitives.discrete import DiscreteInput
from dmp_cpg_ros.paper.daughters import (
    Daughter,
    DaughterSum,
    Homogeneous,
    slowed,
    summed,
    transformed,
    transported_metric,
)
from dmp_cpg_ros.paper.diffeomorphism import (
    ClosedCurveDiffeomorphism,
    FunctionDiffeomorphism,
    canonical_field,
    newton_inverse,
)
from dmp_cpg_ros.paper.jacobians import complex_step_jacobian, difference_jacobian

SEEDS = st.integers(0, 10_000)


def rotation(rng, n):
    R = np.linalg.qr(rng.normal(size=(n, n)))[0]
    R[:, 0] *= np.sign(np.linalg.det(R))
    return R


def warp(seed, n=2):
    """A random nonlinear diffeomorphism: a rotation of y + a tanh(W y) with a |W| < 1."""
    rng = np.random.default_rng(seed)
    R, W = rotation(rng, n), rng.normal(size=(n, n))
    W *= 0.8 / np.linalg.norm(W, 2)
    return FunctionDiffeomorphism(lambda y: R @ (y + np.tanh(W @ y)))


def homogeneous(seed, n=2):
    rng = np.random.default_rng(seed)
    return Homogeneous(float(rng.uniform(0.2, 3.0)), rotation(rng, n), rng.normal(size=n))


def maps(seed, n=2):
    return warp(seed, n), homogeneous(seed, n)


@settings(max_examples=15)
@given(SEEDS, st.integers(1, 4))
def test_inverses_undo_the_map(seed, n):
    y = np.random.default_rng(seed).normal(0.0, 3.0, n)
    for map_ in maps(seed, n):
        np.testing.assert_allclose(map_.inverse(map_.forward(y)), y, atol=1e-9)
        np.testing.assert_allclose(map_.inverse(map_.forward(y), y + 0.01), y, atol=1e-9)


@settings(max_examples=15)
@given(SEEDS, st.integers(1, 4))
def test_jacobians_are_derivatives(seed, n):
    rng = np.random.default_rng(seed)
    y, v, h = rng.normal(size=n), rng.normal(size=n), 1e-6
    for map_ in maps(seed, n):
        slope = (map_.forward(y + h * v) - map_.forward(y - h * v)) / (2.0 * h)
        np.testing.assert_allclose(map_.velocity(y, v), slope, rtol=1e-5, atol=1e-6)


def test_newtons_method_crosses_what_defeats_a_plain_newton_step():
    steep = FunctionDiffeomorphism(lambda y: np.arctan(5.0 * y) + 0.01 * y)
    for target in (-9.0, 0.1, 4.0):
        y = newton_inverse(steep.forward, steep.jacobian, np.array([target]), np.array([50.0]))
        np.testing.assert_allclose(steep.forward(y), target, atol=1e-10)


def test_a_point_outside_of_the_image_is_refused():
    bounded = FunctionDiffeomorphism(np.tanh)
    with pytest.raises(ParameterError, match='no solution'):
        bounded.inverse(np.array([2.0]), np.array([0.0]))


def test_given_jacobian_and_inverse_are_used():
    calls = []
    cube = FunctionDiffeomorphism(
        lambda y: y**3,
        lambda y: calls.append('J') or np.diag(3.0 * y**2),
        lambda y: calls.append('inverse') or np.cbrt(y),
    )
    np.testing.assert_allclose(cube.inverse(np.array([8.0])), 2.0)
    np.testing.assert_allclose(cube.jacobian(np.array([2.0])), 12.0)
    assert calls == ['inverse', 'J']


def test_the_complex_step_refuses_functions_that_drop_imaginary_parts():
    with pytest.raises(ParameterError, match='differences'):
        complex_step_jacobian(np.abs, np.array([1.0]))
    np.testing.assert_allclose(FunctionDiffeomorphism(np.abs).jacobian(np.array([1.0])), 1.0)


@pytest.mark.parametrize(
    ('scale', 'R', 'shift'),
    [
        (0.0, np.eye(2), [0, 0]),
        (1.0, -np.eye(3), [0, 0, 0]),
        (1.0, 2.0 * np.eye(2), [0, 0]),
        (1.0, np.eye(2), [0, 0, 0]),
        (1.0, np.diag([1.0, -1.0]), [0, 0]),
    ],
)
def test_what_is_no_rotation_scale_and_translation_is_refused(scale, R, shift):
    with pytest.raises(ParameterError):
        Homogeneous(scale, R, shift)


@given(SEEDS)
def test_transported_metric_keeps_lengths(seed):
    rng = np.random.default_rng(seed)
    A, J, v = (
        rng.normal(size=(3, 3)),
        rng.normal(size=(3, 3)) + 3.0 * np.eye(3),
        rng.normal(size=3),
    )
    M = A @ A.T + np.eye(3)
    image = J @ v
    np.testing.assert_allclose(image @ transported_metric(M, J) @ image, v @ M @ v, rtol=1e-8)


def contracting_mother(seed):
    """ẏ = −3 y + S y − tanh(y) + input(t) with S skew: contracts at rate 3 in the identity."""
    rng = np.random.default_rng(seed)
    S = rng.normal(size=(2, 2))
    drive = rng.normal(size=2)
    return lambda t, y: -3.0 * y + (S - S.T) @ y - np.tanh(y) + drive * np.sin(2.0 * t)


def spring_metric(k, b):
    """Metric and contraction rate of [[0, 1], [−k, −b]] from AᵀM + MA = −I."""
    A = np.array([[0.0, 1.0], [-k, -b]])
    M = np.linalg.solve(
        np.kron(A.T, np.eye(2)) + np.kron(np.eye(2), A.T), -np.eye(2).ravel()
    ).reshape(2, 2)
    return A, 0.5 * (M + M.T), 0.5 / np.linalg.eigvalsh(M)[-1]


def worst_rate(field, metric, t, y):
    """Largest eigenvalue of Ṁ + AᵀM + MA relative to 2M: minus the contraction rate there."""
    A, M, v, h = difference_jacobian(lambda at: field(t, at), y), metric(y), field(t, y), 1e-5
    M_dot = (metric(y + h * v) - metric(y - h * v)) / (2.0 * h)
    L = np.linalg.cholesky(M)
    inner = np.linalg.solve(L, np.linalg.solve(L, M_dot + A.T @ M + M @ A).T)
    return 0.5 * float(np.linalg.eigvalsh(0.5 * (inner + inner.T))[-1])


@settings(max_examples=15)
@given(SEEDS, st.floats(0.3, 3.0))
def test_a_scaled_contracting_system_contracts_in_the_transported_metric(seed, tau):
    rng = np.random.default_rng(seed)
    for map_ in (warp(seed), homogeneous(seed)):
        daughter = Daughter(contracting_mother(seed), map_, tau)
        t, y = rng.uniform(0.0, 3.0), map_.forward(rng.normal(0.0, 2.0, 2))
        rate = worst_rate(daughter, lambda at, d=daughter: d.metric(at, np.eye(2)), t, y)
        assert rate <= -3.0 / tau + 1e-4


@settings(max_examples=15)
@given(SEEDS, st.floats(1.0, 200.0), st.floats(0.1, 3.0), st.floats(0.3, 3.0))
def test_the_scaled_transformation_system_contracts_in_the_transported_metric(seed, k, ratio, tau):
    A, M, rate = spring_metric(k, 2.0 * ratio * np.sqrt(k))
    rng = np.random.default_rng(seed)
    map_ = warp(seed)
    daughter = Daughter(lambda t, y: A @ y + np.array([0.0, k * np.sin(t)]), map_, lambda t: tau)
    y = map_.forward(rng.normal(size=2))
    assert (
        worst_rate(daughter, lambda at: daughter.metric(at, M), 0.4, y)
        <= -rate / tau + 1e-3 * rate / tau + 1e-5
    )


def runge_kutta(field, y, times):
    path = [y]
    for t, h in zip(times[:-1], np.diff(times), strict=True):
        k1 = field(t, y)
        k2 = field(t + 0.5 * h, y + 0.5 * h * k1)
        k3 = field(t + 0.5 * h, y + 0.5 * h * k2)
        k4 = field(t + h, y + h * k3)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        path.append(y)
    return np.array(path)


@pytest.mark.parametrize('seed', range(3))
def test_a_daughter_moves_as_the_image_of_its_mother(seed):
    map_, S = warp(seed), np.array([[-1.0, 4.0], [-4.0, -1.0]])

    def tau(t):
        return 1.0 + 0.5 * np.sin(t)

    times, start = np.linspace(0.0, 2.0, 401), np.array([1.0, 0.5])
    mother = runge_kutta(lambda t, y: S @ y / tau(t), start, times)
    daughter = runge_kutta(Daughter(lambda t, y: S @ y, map_, tau), map_.forward(start), times)
    np.testing.assert_allclose(daughter, [map_.forward(y) for y in mother], atol=1e-6)


@settings(max_examples=10)
@given(SEEDS)
def test_sums_in_a_common_metric_contract_at_the_summed_rate(seed):
    rng = np.random.default_rng(seed)
    gains = rng.uniform(0.1, 2.0, 3)
    both = DaughterSum([contracting_mother(seed + i) for i in range(3)], gains)
    assert (
        worst_rate(both, lambda y: np.eye(2), 0.3, rng.normal(size=2)) <= -3.0 * gains.sum() + 1e-6
    )


def test_sums_in_different_metrics_may_be_unstable():
    A = np.array([[-1.0, 10.0], [0.0, -1.0]])
    both = DaughterSum([lambda t, y: A @ y, lambda t, y: A.T @ y], np.ones(2))
    assert (
        np.linalg.eigvals(difference_jacobian(lambda y: both(0.0, y), np.zeros(2))).real.max()
        > 0.0
    )


@pytest.mark.parametrize('gains', [[1.0], [0.0, 0.0], [1.0, -1.0], [1.0, np.nan]])
def test_bad_gains_are_refused(gains):
    with pytest.raises(ParameterError, match='gains'):
        DaughterSum([contracting_mother(0), contracting_mother(1)], gains)


def test_tau_must_stay_positive():
    with pytest.raises(ParameterError, match='tau'):
        Daughter(contracting_mother(0), homogeneous(0), lambda t: 1.0 - t)(2.0, np.zeros(2))


def reach(seed=0, count=8):
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, 1.0, 200)
    u = times[:, None]
    path = u**2 * (3.0 - 2.0 * u) * rng.normal(size=3) + np.sin(np.pi * u) ** 2 * rng.normal(
        size=3
    )
    return learn_discrete(Demonstration(times, path), count)


def test_a_transformed_primitive_makes_the_transformed_movement():
    mother, map_, times = reach(), homogeneous(4, 3), np.linspace(0.0, 1.2, 61)
    np.testing.assert_allclose(
        transformed(mother, map_).rollout(times).positions,
        map_.forward(mother.rollout(times).positions),
        atol=1e-12,
    )


def test_a_slowed_primitive_is_the_mother_at_that_tau():
    mother, times = reach(), np.linspace(0.0, 2.0, 101)
    np.testing.assert_allclose(
        slowed(mother, 1.7).rollout(times).positions,
        mother.rollout(times, DiscreteInput(mother.goal, 1.7)).positions,
        atol=1e-10,
    )
    with pytest.raises(ParameterError, match='scaled'):
        slowed(
            learn_discrete(Demonstration(np.arange(9.0), np.arange(9.0)), 3, form='printed'), 2.0
        )


def test_a_sum_of_primitives_makes_the_sum_of_movements():
    mother, times = reach(), np.linspace(0.0, 1.2, 61)
    daughters = [transformed(mother, homogeneous(seed, 3)) for seed in range(3)]
    gains = np.array([0.5, -1.0, 2.0])
    expected = sum(
        gain * daughter.rollout(times).positions
        for gain, daughter in zip(gains, daughters, strict=True)
    )
    np.testing.assert_allclose(
        summed(daughters, gains).rollout(times).positions, expected, atol=1e-12
    )


def test_what_does_not_fit_is_not_summed_or_rotated():
    with pytest.raises(ParameterError, match='basis centres'):
        summed([reach(), reach(count=9)], [1.0, 1.0])
    with pytest.raises(ParameterError, match='one finite gain'):
        summed([reach()], [1.0, 1.0])
    stiff = learn_discrete(
        Demonstration(np.arange(9.0), np.ones((9, 2)) * np.arange(9.0)[:, None]),
        3,
        stiffness=[1.0, 2.0],
    )
    with pytest.raises(ParameterError, match='equal gains'):
        transformed(stiff, homogeneous(1, 2))
    with pytest.raises(ParameterError, match='does not fit'):
        transformed(stiff, homogeneous(1, 3))


def cycle():
    return ClosedCurveDiffeomorphism.through(walking_joints(0.5, 3.0), 0.5)


def test_the_unit_circle_goes_to_the_recorded_curve():
    map_, recording = cycle(), walking_joints(0.5, 3.0)
    phi = 2.0 * np.pi * recording.times[::50] / 0.5
    images = [map_.forward(np.append(state_at(angle), 0.0)) for angle in phi]
    np.testing.assert_allclose(images, recording.positions[::50], atol=1e-6)
    np.testing.assert_allclose(map_.curve(phi), recording.positions[::50], atol=1e-6)


@settings(max_examples=30)
@given(st.floats(-3.1, 3.1), st.floats(0.05, 4.0), st.floats(-2.0, 2.0))
def test_the_drawn_map_is_a_diffeomorphism_away_from_the_axis(phi, radius, rest):
    map_, x = cycle(), np.append(state_at(phi, radius), rest)
    np.testing.assert_allclose(map_.inverse(map_.forward(x)), x, atol=1e-9)
    slope = difference_jacobian(map_.forward, x) if radius > 0.2 else map_.jacobian(x)
    np.testing.assert_allclose(map_.jacobian(x), slope, atol=1e-5)
    assert abs(np.linalg.det(map_.jacobian(x))) > 1e-4


@pytest.mark.parametrize('seed', range(3))
def test_every_start_converges_to_the_drawn_limit_cycle(seed):
    map_, rng, oscillator = cycle(), np.random.default_rng(seed), AndronovHopf(4.0)
    daughter = Daughter(lambda t, x: canonical_field(x, oscillator, 2.0 * np.pi), map_, 0.5)
    start = map_.forward(
        np.append(state_at(rng.uniform(-3, 3), rng.uniform(0.3, 2.0)), rng.normal())
    )
    end = runge_kutta(daughter, start, np.linspace(0.0, 6.0, 1201))[-1]
    x = map_.inverse(end)
    np.testing.assert_allclose(end, map_.curve(np.atleast_1d(phase(x[:2])))[0], atol=1e-4)


def test_curves_that_no_plane_shows_as_a_loop_are_refused():
    times = np.linspace(0.0, 1.0, 200)
    u = 2.0 * np.pi * times
    eight = Demonstration(times, np.stack([np.sin(u), np.sin(2.0 * u)], axis=1))
    with pytest.raises(DataError, match='none of the planes'):
        ClosedCurveDiffeomorphism.through(eight, 1.0)
    with pytest.raises(DataError, match='at least 2'):
        ClosedCurveDiffeomorphism.through(Demonstration(times, np.sin(u)), 1.0)
