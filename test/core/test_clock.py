# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The time step between ticks, whatever the stamps do."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.clock import LONGEST_GAP_S, TickClock


@given(stamps=st.lists(st.integers(0, 10**12), min_size=1, max_size=20))
def test_a_step_is_the_growth_of_the_stamp_or_nothing_and_never_endless(stamps: list[int]) -> None:
    clock = TickClock()
    assert clock.step(stamps[0]) == 0.0
    for before, now in zip(stamps, stamps[1:], strict=False):
        growth = (now - before) * 1e-9
        assert clock.step(now) == min(max(growth, 0.0), LONGEST_GAP_S)
