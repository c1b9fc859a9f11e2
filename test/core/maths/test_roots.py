# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where values change their sign is found, however they change it."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.maths.roots import sign_change

PRECISION = 1e-4
KINDS: dict[str, Callable[[float], float]] = {
    'smooth': lambda way: 1.0 - math.exp(-way),
    'steep at first': lambda way: math.copysign(abs(way)**0.2, way),
    'flat': lambda way: way**3,
    'jumps': lambda way: 0.3 + way if way >= 0.0 else -1.0,
    'unknown below': lambda way: way if way >= 0.0 else -math.inf,
    'unknown': lambda way: math.copysign(math.inf, way)}


@pytest.mark.parametrize('jumps', [False, True])
@pytest.mark.parametrize('kind', KINDS)
@given(place=st.floats(0.1, 10.0), low=st.floats(0.001, 0.1), high=st.floats(10.0, 100.0))
def test_ends_are_close_and_on_both_sides(kind: str, jumps: bool, place: float, low: float,
                                          high: float) -> None:
    asked: list[float] = []

    def value(at: float) -> float:
        asked.append(at)
        return KINDS[kind](math.log(at / place))

    below, not_below = sign_change(value, low, high, PRECISION, jumps=jumps)
    assert not_below <= below * (1.0 + PRECISION)
    assert below == low or (below in asked and value(below) < 0.0)
    assert not_below == high or (not_below in asked and value(not_below) >= 0.0)
    halvings = math.log2(math.log(high / low) / math.log1p(PRECISION))
    assert len(asked) - 2 <= 3.0 * halvings + 3.0


def test_a_jump_at_the_end_of_a_slope_is_found_by_the_slope() -> None:
    def asked(jumps: bool) -> int:
        count = 0

        def value(at: float) -> float:
            nonlocal count
            count += 1
            return 0.5 if at >= 0.7 else 0.01 * (at - 0.7)

        low, high = sign_change(value, 0.5, 1.0, PRECISION, (-0.002, 0.5), jumps=jumps)
        assert low < 0.7 <= high
        return count

    assert 2 * asked(jumps=True) <= asked(jumps=False)


def test_fewer_values_are_asked_for_than_by_halving_where_they_are_smooth() -> None:
    asked: list[float] = []

    def value(at: float) -> float:
        asked.append(at)
        return 1.0 - 0.7 / at

    sign_change(value, 0.01, 100.0, PRECISION)
    assert len(asked) < math.log2(math.log(1e4) / PRECISION)


@pytest.mark.parametrize('kind', KINDS)
@pytest.mark.parametrize('trials', range(5))
def test_it_ends_after_some_trials_with_numbers_on_both_sides(kind: str, trials: int) -> None:
    asked: list[float] = []

    def value(at: float) -> float:
        asked.append(at)
        return KINDS[kind](math.log(at / 1.37))

    ends = value(1.0), value(2.0)
    below, not_below = sign_change(value, 1.0, 2.0, PRECISION, ends, slope=0.0, trials=trials)
    assert len(asked) == 2 + trials
    assert value(below) < 0.0 <= value(not_below)
