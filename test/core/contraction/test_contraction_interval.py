# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Intervals contain the exact results, which rational arithmetic knows."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture_anywhere import Interval, needed_gain_anywhere
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.paper.matrix_measure import stack

NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False)


@st.composite
def intervals(draw: st.DrawFn) -> tuple[Interval, Fraction]:
    """An interval and a number in it."""
    low, high = sorted((draw(NUMBERS), draw(NUMBERS)))
    share = Fraction(draw(st.integers(0, 1000)), 1000)
    inside = Fraction(low) + share * (Fraction(high) - Fraction(low))
    return Interval(np.array(low), np.array(high)), inside


def contains(interval: Interval, value: Fraction) -> bool:
    return Fraction(float(interval.lower)) <= value <= Fraction(float(interval.upper))


@given(a=intervals(), b=intervals())
def test_sums_differences_and_products_contain_the_exact_ones(
        a: tuple[Interval, Fraction], b: tuple[Interval, Fraction]) -> None:
    (A, x), (B, y) = a, b
    assert contains(A + B, x + y)
    assert contains(A - B, x - y)
    assert contains(A * B, x * y)
    assert contains(-A, -x)
    assert contains(2.5 * A - 1.5, Fraction(5, 2) * x - Fraction(3, 2))
    assert contains(1.5 - A, Fraction(3, 2) - x)
    assert contains(A.square(), x * x)


@given(a=intervals(), b=intervals())
def test_quotients_contain_the_exact_ones_or_refuse_zero(
        a: tuple[Interval, Fraction], b: tuple[Interval, Fraction]) -> None:
    (A, x), (B, y) = a, b
    if float(B.lower) <= 0.0 <= float(B.upper):
        with pytest.raises(DataError, match='without zero'):
            A / B
    elif min(abs(float(B.lower)), abs(float(B.upper))) > 1e-100:
        assert contains(A / B, x / y)


@given(a=intervals())
def test_squares_are_not_negative_and_roots_undo_them(a: tuple[Interval, Fraction]) -> None:
    A, x = a
    square = A.square()
    assert float(square.lower) >= 0.0
    assert contains(square.sqrt(), abs(x))


def test_a_tenth_added_ten_times_contains_one() -> None:
    total = Interval.of(0.0)
    for _ in range(10):
        total = total + Interval(np.nextafter(0.1, 0.0), np.nextafter(0.1, 1.0))
    assert contains(total, Fraction(1))
    assert float(total.upper) - float(total.lower) < 1e-14


def test_ends_in_the_wrong_order_and_what_is_no_number_are_refused() -> None:
    with pytest.raises(DataError, match='lower <= upper'):
        Interval(np.array(1.0), np.array(0.0))
    with pytest.raises(DataError, match='lower <= upper'):
        Interval(np.array(np.nan), np.array(0.0))
    with pytest.raises(DataError, match='zero or above'):
        Interval(np.array(-2.0), np.array(-1.0)).sqrt()


def test_matrices_are_stacked_entry_by_entry() -> None:
    x = Interval(np.zeros(3), np.ones(3))
    matrix = stack([[x, 2.0], [0.0, -x]])
    assert matrix.lower.shape == (3, 2, 2)
    assert np.array_equal(matrix.upper[0], [[1.0, 2.0], [0.0, 0.0]])
    assert np.array_equal(matrix.lower[0], [[0.0, 2.0], [0.0, -1.0]])


def test_middle_and_radius_cover_the_interval() -> None:
    x = Interval(np.array(0.1), np.array(0.7))
    assert float(x.middle - x.radius) <= 0.1 and float(x.middle + x.radius) >= 0.7
    assert float(Interval(np.array(-3.0), np.array(1.0)).magnitude) == 3.0


@pytest.mark.parametrize('coupling', [
    60.0 * np.eye(2), np.array([[60.0, 30.0], [-30.0, 60.0]]), np.diag((60.0, 1.0)),
    np.array([[30.5, 29.5], [29.5, 30.5]])])
@pytest.mark.parametrize('r0', [0.1, 0.5])
def test_wherever_the_others_are_the_field_points_into_the_region(
        coupling: np.ndarray, r0: float) -> None:
    """With couplings that turn, or that are not the same in all directions, C was left."""
    system = CanonicalSystem(graph_from_edges(2, topology('path', 2), coupling),
                             AndronovHopf(200.0, 1.0))
    gains = np.array([1.001 * needed_gain_anywhere(system, 2.0, 0, r0), 0.0])
    for angle in np.linspace(0.0, 2.0 * np.pi, 361):
        n = np.array((np.cos(angle), np.sin(angle)))
        pulls = coupling.T @ n
        x = np.array([system.target[0] + r0 * n * (1.0 - 1e-12), pulls / np.linalg.norm(pulls)])
        assert n @ system.field(x, 2.0, gains)[0] < 0.0


@pytest.mark.parametrize(('node', 'r0'), [(-1, 0.3), (2, 0.3), (0, -0.3), (0, 0.0),
                                          (0, float('nan'))])
def test_a_node_that_is_none_and_a_region_without_radius_are_refused(node: int, r0: float) -> None:
    system = CanonicalSystem(graph_from_edges(2, topology('path', 2), 60.0), AndronovHopf(8.0))
    with pytest.raises(ParameterError, match='must be'):
        needed_gain_anywhere(system, 2.0, node, r0)
