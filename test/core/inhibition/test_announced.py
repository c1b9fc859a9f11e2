# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is told ahead acts at the tick that was told, however late it is heard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.push_recovery import NO_PUSH
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState

TICK_NS, LEAD = 4_000_000, 6
RUNS = Inhibition(False, np.zeros(4), 0.3)
STOPS = replace(RUNS, requested=True)
ARMED = replace(STOPS, gains=np.array([400.0, 0.0, 0.0, 0.0]))
KINDS = (RUNS, STOPS, ARMED, replace(ARMED, at_rest=True), replace(RUNS, share=0.5))


def state_at(tick: int, pushed: bool = False) -> SupervisorState:
    push = NO_PUSH._replace(acts=pushed)
    return SupervisorState(tick * TICK_NS, 'walking', False, True, 0, False, (1.0,) * 4, push=push)


@given(told=st.lists(st.tuples(st.integers(0, 40), st.sampled_from(KINDS),
                               st.integers(0, LEAD - 1)), max_size=12))
def test_who_hears_of_it_within_the_lead_lets_it_act_at_the_same_ticks(
        told: list[tuple[int, Inhibition, int]]) -> None:
    told = sorted(told, key=lambda each: each[0])
    here = there = Announced(RUNS)
    heard: list[tuple[int, int, Inhibition]] = []  # in their order: none overtakes another
    for tick in range(60):
        here = here.at(tick * TICK_NS)
        while heard and heard[0][0] < tick:
            _, from_ns, inhibition = heard.pop(0)
            there = there.told(from_ns, inhibition)
        there = there.at(tick * TICK_NS)
        assert there.acting is here.acting or not there.acting.differs(here.acting)
        for at, inhibition, late in told:
            if at == tick:
                here = here.after(state_at(tick), inhibition, LEAD * TICK_NS)
                arrives = max([tick + late, *(entry[0] for entry in heard)])
                heard.append((arrives, here.latest_ns, here.latest))


def test_a_stop_acts_a_lead_later_and_without_one_at_the_next_tick() -> None:
    for lead, first in ((LEAD, LEAD), (1, 1), (0, 1)):
        told = Announced(RUNS).at(0).after(state_at(0), STOPS, lead * TICK_NS)
        assert told.latest is STOPS and told.acting is RUNS
        acting = [told.at(tick * TICK_NS).acting for tick in range(1, LEAD + 3)]
        assert acting.index(STOPS) == first - 1 and RUNS not in acting[first - 1:]


def test_a_stop_that_is_on_its_way_is_neither_lost_nor_put_off_by_what_follows() -> None:
    told = Announced(RUNS).after(state_at(0), STOPS, LEAD * TICK_NS)
    for tick in range(1, LEAD):
        told = told.at(tick * TICK_NS).after(
            state_at(tick), ARMED if tick > 2 else replace(STOPS, share=0.5), LEAD * TICK_NS)
        assert told.acting is RUNS
    told = told.at(LEAD * TICK_NS)
    assert told.acting.requested and not told.acting.gains.any() and told.latest is ARMED
    assert told.at((LEAD + 2) * TICK_NS).acting is told.acting
    assert told.at((LEAD + 3) * TICK_NS).acting is ARMED


def test_what_a_push_asks_for_does_not_wait() -> None:
    stopped = Announced(RUNS).after(state_at(0), STOPS, LEAD * TICK_NS)
    told = stopped.at(TICK_NS).after(state_at(1, pushed=True), replace(RUNS, opposite=True),
                                     LEAD * TICK_NS)
    assert told.at(2 * TICK_NS).acting.opposite and not told.at(2 * TICK_NS).coming
