# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The time step between ticks, whatever the stamps do."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.clock import LONGEST_GAP_S, RESET_NS, TickClock, carried, fresh


@given(stamps=st.lists(st.integers(0, 10**12), min_size=1, max_size=20))
def test_a_step_is_the_growth_of_the_stamp_or_nothing_and_never_endless(stamps: list[int]) -> None:
    clock = TickClock()
    assert clock.step(stamps[0]) == 0.0
    for before, now in zip(stamps, stamps[1:], strict=False):
        growth = (now - before) * 1e-9
        assert clock.step(now) == min(max(growth, 0.0), LONGEST_GAP_S)


@given(told=st.integers(0, 10**12), age=st.integers(-10**12, 10**12), limit=st.integers(1, 10**10))
def test_what_is_told_is_fresh_until_its_limit_and_not_before_a_clock_that_was_set_back(
        told: int, age: int, limit: int) -> None:
    assert fresh(told, told + age, limit) == (-RESET_NS < age <= limit)


@given(last=st.integers(0, 10**12), now=st.integers(0, 10**12), age=st.integers(0, 10**12))
def test_on_a_clock_that_is_set_back_no_stamp_lies_ahead_and_none_becomes_older(
        last: int, now: int, age: int) -> None:
    stamp = max(0, last - age)
    there = carried(stamp, last, now)
    assert carried(-1, last, now) == -1
    if now >= last:
        assert there == stamp
    else:
        assert there >= 0 and now - there == min(last - stamp, now)
