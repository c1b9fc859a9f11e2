# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Contraction on regions: sampled tests say so, proved bounds hold at every point."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.contraction.capture_anywhere import Interval
from dmp_cpg_ros.core.contraction.finding import PROVED, SAMPLED, weakest
from dmp_cpg_ros.core.contraction.hopf_bounds import growth, transverse_rate
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.matrix_measure import (
    NORMS,
    matrix_measure,
    proved_contraction,
    sampled_contraction,
    sampled_transverse_contraction,
    stack,
)
from dmp_cpg_ros.paper.region import Annulus, Ball, Box, Finding

OSCILLATOR, OMEGA = AndronovHopf(8.0, 1.0), 11.0


def jacobian(x: np.ndarray) -> np.ndarray:
    return OSCILLATOR.jacobian(x, OMEGA)


def enclosure(x: Interval) -> Interval:
    """Enclosure of the Jacobian on boxes: (k, 2) → (k, 2, 2) [1/s]."""
    rho, r_squared = OSCILLATOR.rho, Interval.of(OSCILLATOR.radius).square()
    x1, x2 = x[..., 0], x[..., 1]
    first, second = x1.square(), x2.square()
    shared = -2.0 * rho * (x1 * x2)
    return stack([[rho * (r_squared - 3.0 * first - second), shared + OMEGA],
                  [shared - OMEGA, rho * (r_squared - first - 3.0 * second)]])


@pytest.mark.parametrize('norm', NORMS)
@settings(max_examples=20)
@given(seed=st.integers(0, 1000))
def test_a_proved_rate_is_never_above_what_any_point_shows(norm: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    corner = rng.uniform(-1.5, 1.0, 2)
    box = Box(corner, corner + rng.uniform(0.0, 0.6, 2))
    weights = rng.uniform(0.5, 2.0, 2)
    proved = proved_contraction(enclosure, box, norm, weights)
    points = box.sample(300, seed)
    shown = -matrix_measure(np.stack([jacobian(x) for x in points]), norm, weights).max()
    assert proved.grade == PROVED
    assert proved.rate <= shown + 1e-12
    sampled = sampled_contraction(jacobian, box, norm, weights, 300, seed)
    assert sampled.grade == SAMPLED and sampled.rate >= proved.rate - 1e-12


def test_intervals_come_close_to_the_closed_form() -> None:
    # On a box whose nearest point to the origin has the norm s, growth is rho (r^2 - s^2).
    box = Box(np.array([0.9, -0.2]), np.array([1.1, 0.3]))
    proved = proved_contraction(enclosure, box)
    assert -proved.rate == pytest.approx(float(growth(8.0, 1.0, 0.9)), rel=2e-3)
    around = Box(np.array([-0.5, -0.5]), np.array([0.5, 0.5]))
    assert -proved_contraction(enclosure, around).rate == pytest.approx(
        8.0, rel=2e-3)


def test_a_small_budget_costs_tightness_and_not_truth() -> None:
    box = Box(np.array([0.2, -0.9]), np.array([1.4, 0.9]))
    poor = proved_contraction(enclosure, box, budget=3)
    rich = proved_contraction(enclosure, box)
    assert poor.rate <= rich.rate
    assert poor.evaluations <= 3 < rich.evaluations


def test_samples_lie_in_their_regions() -> None:
    ball = Ball(np.array([1.0, 0.0]), 0.3)
    assert np.all(np.linalg.norm(ball.sample(500) - ball.center, axis=1) <= 0.3 + 1e-12)
    radii = np.linalg.norm(Annulus(0.5, 1.2).sample(500), axis=1)
    assert radii.min() >= 0.5 - 1e-12 and radii.max() <= 1.2 + 1e-12
    box = Box(np.array([0.0, -1.0]), np.array([1.0, 2.0]))
    points = box.sample(500)
    assert np.all(points >= box.lower) and np.all(points <= box.upper)
    assert [0.0, -1.0] in points.tolist() and [1.0, 2.0] in points.tolist()


@given(rho=st.floats(0.5, 20.0), omega=st.floats(1.0, 30.0), inner=st.floats(0.3, 0.95),
       outer=st.floats(1.05, 1.6))
def test_the_transverse_rate_in_closed_form_is_what_sampling_finds(
        rho: float, omega: float, inner: float, outer: float) -> None:
    oscillator, annulus = AndronovHopf(rho), Annulus(inner, outer)
    closed = transverse_rate(rho, 1.0, omega, inner, outer)
    found = sampled_transverse_contraction(
        lambda x: oscillator.field(x, omega), annulus, lambda x: np.eye(2) / (x @ x),
        lambda x: oscillator.jacobian(x, omega), count=60)
    assert found.grade == SAMPLED and closed > 0.0
    assert found.rate >= closed * (1.0 - 1e-5)
    assert found.rate <= closed * (1.0 + 1e-5)           # the ends are among the samples


def test_under_the_identity_metric_transverse_contraction_holds_near_the_cycle_only() -> None:
    def test(annulus: Annulus) -> float:
        return sampled_transverse_contraction(lambda x: OSCILLATOR.field(x, OMEGA), annulus).rate

    assert test(Annulus(0.95, 1.05)) == pytest.approx(14.0, rel=0.2)  # 2 rho r^2 on the cycle
    assert test(Annulus(0.2, 1.05)) < 0.0


def test_equilibria_impossible_regions_and_grades_are_refused() -> None:
    with pytest.raises(ParameterError, match='equilibrium'):
        sampled_transverse_contraction(lambda x: OSCILLATOR.field(x, OMEGA),
                                       Ball(np.zeros(2), 0.0), count=2)
    with pytest.raises(ParameterError, match='inner <= outer'):
        Annulus(2.0, 1.0)
    with pytest.raises(ParameterError, match='lower <= upper'):
        Box(np.ones(2), np.zeros(2))
    with pytest.raises(ParameterError, match='>= 0'):
        Ball(np.zeros(2), -1.0)
    with pytest.raises(ParameterError, match='proved, continuous, sampled'):
        Finding(1.0, 'hoped', 0, '')


def test_a_chain_is_as_good_as_its_weakest_premise() -> None:
    assert weakest((PROVED, PROVED)) == PROVED
    assert weakest((PROVED, SAMPLED)) == SAMPLED
