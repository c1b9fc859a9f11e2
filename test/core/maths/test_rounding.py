# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""No text says of a number more than is known."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.maths.rounding import exactly, no_less
from dmp_cpg_ros.core.parameters import typed


@given(bound=st.floats(0.0, 1e3), digits=st.integers(0, 4))
def test_a_bound_is_rounded_upwards_by_less_than_its_last_digit(bound: float, digits: int) -> None:
    step = 10.0**-digits
    assert -2e-6 * step <= float(no_less(bound, digits)) - bound < (1.0 + 1e-6) * step
    assert len(no_less(bound, digits).partition('.')[2]) == digits


def test_rounding_of_arithmetic_is_no_digit_and_no_bound_is_none() -> None:
    assert no_less(0.294 + 4e-17) == '0.294' and no_less(0.2941) == '0.295'
    assert no_less(float('inf')) == 'inf'


@given(microseconds=st.integers(0, 10**7))
def test_a_time_of_whole_microseconds_is_told_exactly(microseconds: int) -> None:
    text = exactly(1e-6 * microseconds)
    assert round(1e6 * float(text)) == microseconds
    assert len(text.partition('.')[2]) == 3 or not text.endswith('0')


@given(value=st.floats(1e-3, 1e5))
def test_a_value_is_typed_with_all_digits_but_rounding(value: float) -> None:
    assert abs(float(typed(value)) - value) <= 1e-11 * value
