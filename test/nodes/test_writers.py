# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A topic's writer is known by the numbers of its messages; nobody else is taken for it."""

from __future__ import annotations

import math
import random
from collections import Counter

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.nodes.framework.writer_watch import (
    FASTEST,
    LOST,
    MADE_UP_NS,
    PROVEN,
    REMEMBERED_NS,
    SILENT_NS,
    WriterWatch,
)

TICK_NS = 4_000_000
KNOWN = 600
"""Messages after which the writer is known well."""


def watched(*, alone: bool = True, ticked: bool = True, known: int = KNOWN) -> WriterWatch:
    """A watch that has heard so many messages of its writer, the last at that tick."""
    watch = WriterWatch(lambda: alone or not watch.known, ticked=ticked)
    assert all(watch.admits(k, k * TICK_NS, k * TICK_NS) for k in range(1, known + 1))
    return watch


@given(st.lists(st.tuples(st.integers(1, 60), st.integers(0, 60), st.sampled_from((0.1, 1, 9))),
                max_size=50))
def test_a_lone_writer_may_lose_messages_and_ticks_and_stall(
        steps: list[tuple[int, int, float]]) -> None:
    watch, number, stamp, now = watched(), KNOWN, KNOWN * TICK_NS, KNOWN * TICK_NS
    for messages, ticks, pace in steps:
        number += messages
        stamp += (messages + ticks) * TICK_NS
        now += round(max(pace * (messages + ticks), 0.25 * (messages + ticks - 125)) * TICK_NS)
        assert watch.admits(number, stamp, now)


def test_messages_that_were_sent_again_may_be_received_late() -> None:
    """A lost one is received after those that wait for it, and is taken before them."""
    watch = watched()
    for k in range(KNOWN + 1, KNOWN + 100):
        late = 100 * TICK_NS if k == KNOWN + 1 else 0
        assert watch.admits(k, k * TICK_NS, k * TICK_NS + late)


@given(st.lists(st.tuples(st.integers(30, 500), st.integers(0, 5), st.integers(0, 480)),
                min_size=1, max_size=6), st.booleans())
def test_after_a_stall_what_the_queue_has_kept_is_heard(
        stalls: list[tuple[int, int, int]], flooded: bool) -> None:
    """All that was sent in a stall is received at once; some is taken, then the queue overflows.
    A stranger's old messages come in between all the time.
    """
    watch, tick, flood = watched(alone=False), KNOWN, 0
    for length, taken, lost in stalls:
        end_ns = (tick + length) * TICK_NS
        for k in range(1, length + 300):
            if taken < k <= min(taken + lost, length):
                continue
            number = tick + k
            now_ns = max(end_ns, number * TICK_NS) + k * 1000
            for _ in range(2 * flooded):
                flood += 1
                assert not watch.may_admit(flood, TICK_NS, now_ns) or not watch.admits(
                    flood, TICK_NS, now_ns)
            assert watch.admits(number, number * TICK_NS, now_ns)
        tick = number


def test_a_stall_is_no_licence_for_later() -> None:
    """Once messages come in time again, no more robot's time is made up than without a stall."""
    watch, stall = watched(), 400
    for k in range(1, 251):
        assert watch.admits(KNOWN + k, (KNOWN + k) * TICK_NS, (KNOWN + stall + k) * TICK_NS)
    number, now = KNOWN + 251, (KNOWN + stall + 251) * TICK_NS
    most = (KNOWN + 250) * TICK_NS + FASTEST * TICK_NS + MADE_UP_NS
    assert not watch.may_admit(number, most + 1, now)
    assert watch.may_admit(number, most, now)


def test_ticks_may_be_lost_while_their_length_is_learned() -> None:
    watch = WriterWatch(lambda: not watch.known)
    ticks = [*range(1, 200, 2), *range(200, 400)]
    for number, tick in enumerate(ticks, 1):
        assert watch.admits(number, tick * TICK_NS, tick * TICK_NS)


@pytest.mark.parametrize('stall', [1, 5, LOST])
def test_messages_may_be_lost_while_the_tick_is_learned(stall: int) -> None:
    watch = WriterWatch(lambda: not watch.known)
    for number in (1, 2, 2 + stall, *range(3 + stall, 200)):
        assert watch.admits(number, number * TICK_NS, number * TICK_NS)


@settings(deadline=None)
@given(st.integers(1, 2000), st.sampled_from((0.004, 0.1, 0.9, 1.0, 1.1, 2.0, 10.0, 80.0)),
       st.integers(-500, 3), st.integers(0, 2**32), st.sampled_from((0.0, 0.05, 0.5)))
def test_a_stranger_is_not_taken_for_the_writer(
        first: int, rate: float, late: int, seed: int, lost: float) -> None:
    """Some messages at each tick, with stamps of long ago to a little ahead of now."""
    watch, draw = watched(alone=False), random.Random(seed)
    assume(rate != 1.0 or abs(first - KNOWN) > 3)  # as many messages as the writer's, always
    heard: Counter[str] = Counter()
    events = [(float(k), 'writer', k, k) for k in range(KNOWN + 1, KNOWN + 500)]
    events += [(KNOWN + 0.5 + k / rate, 'stranger', first + k, late)
               for k in range(round(rate * 498.0)) if draw.random() >= lost]
    for time, who, number, tick in sorted(events):
        stamp = (int(time) + tick if who == 'stranger' else tick) * TICK_NS
        heard[who] += watch.admits(number, stamp, round(time * TICK_NS))
    assert heard['stranger'] <= 12
    assert heard['writer'] >= 499 - 30
    if heard['stranger'] < round(rate * 498.0 * (1.0 - lost)):
        assert watch.has_strangers(watch._heard_ns)


def test_nobody_takes_over_from_a_writer_that_sends() -> None:
    watch = watched()
    for k in range(1, 250):
        now = (KNOWN + k) * TICK_NS
        assert watch.admits(KNOWN + k, now, now)
        assert not watch.admits(k, now, now + 1000)
        assert watch.has_strangers(now + 1000)
    assert not watch.has_strangers(now + REMEMBERED_NS + 1000)


@pytest.mark.parametrize('first', [1, 300, 5000])
@pytest.mark.parametrize('stamp', [0, TICK_NS * KNOWN, 10**15])
def test_a_writer_that_was_started_again_takes_over(first: int, stamp: int) -> None:
    watch, again = watched(), KNOWN * TICK_NS + SILENT_NS + TICK_NS
    for k in range(10):
        assert watch.admits(first + k, stamp + k * TICK_NS, again + k * TICK_NS)


def test_a_stranger_does_not_take_over_while_it_is_in_the_graph() -> None:
    watch = watched(alone=False)
    for k in range(1, KNOWN):
        assert not watch.admits(k, (KNOWN + k) * TICK_NS, (KNOWN + k) * TICK_NS)


@pytest.mark.parametrize('known', [0, KNOWN])
def test_among_silent_strangers_the_writer_proves_itself(known: int) -> None:
    """At the start, and after it was started again."""
    watch = watched(known=known)
    watch._may_take_over = lambda: None
    begin = KNOWN * TICK_NS + SILENT_NS
    taken = [watch.admits(k, k * TICK_NS, begin + k * TICK_NS) for k in range(1, 50)]
    assert taken == [False] * (PROVEN - 1) + [True] * (50 - PROVEN)


def test_of_two_who_send_none_proves_itself() -> None:
    watch = WriterWatch(lambda: None)
    for k in range(1, 500):
        assert not watch.admits(k, k * TICK_NS, KNOWN * TICK_NS + SILENT_NS + k * TICK_NS)
        assert not watch.admits(77 + k, k * TICK_NS, KNOWN * TICK_NS + SILENT_NS + k * TICK_NS)


def test_a_known_stranger_does_not_prove_itself() -> None:
    watch = watched()
    watch._may_take_over = lambda: None
    for k in range(1, 3 * KNOWN):
        assert not watch.admits(k, k * TICK_NS, KNOWN * TICK_NS + k * TICK_NS)


@pytest.mark.parametrize('first', [1, 2, 3])
def test_a_stranger_on_a_topic_of_changes_is_told_from_its_writer(first: int) -> None:
    """The writer has sent four messages, and sends the fifth after many of the stranger."""
    watch = watched(alone=False, ticked=False, known=4)
    for k in range(first, 50):
        assert not watch.admits(k, 0, 10 * SILENT_NS + k)
    assert watch.admits(5, 0, 20 * SILENT_NS)


def test_on_a_topic_of_changes_silence_is_no_chance_for_a_stranger_beside_its_writer() -> None:
    """As the graph tells while both are there; before the first change of the writer, nothing
    tells them apart.
    """
    watch = WriterWatch(lambda: None, ticked=False)
    assert watch.admits(1, 0, SILENT_NS) and watch.admits(7, 0, SILENT_NS) and not watch.known
    watch._may_take_over = lambda: True
    assert all(watch.admits(k, 0, SILENT_NS) for k in range(1, 5)) and watch.known
    watch._may_take_over = lambda: None
    for number in (1, 2, 9, 10):
        assert not watch.admits(number, 0, (10 + number) * SILENT_NS)
    watch.refuse(4, 21 * SILENT_NS)
    assert not watch.admits(5, 0, 22 * SILENT_NS)
    assert watch.admits(5, 0, 30 * SILENT_NS)


@pytest.mark.parametrize('lock_step', [False, True])
def test_a_gap_is_a_loss_of_the_writer_unless_it_may_be_one_of_a_stranger(
        lock_step: bool) -> None:
    """Who floods a queue that keeps one message may push out some of the writer's."""
    watch = WriterWatch(lambda: not watch.known, ticked=False, lock_step=lock_step)
    assert all(watch.admits(k, 0, SILENT_NS) for k in range(1, 5))
    assert watch.admits(4 + LOST, 0, SILENT_NS)
    for stranger, passed in ((1, True), (5000, True), (8 + LOST, False)):
        last = watch._last
        watch.refuse(stranger, SILENT_NS)
        assert watch.admits(last + 3, 0, SILENT_NS) is passed
    watch.refuse(5000, SILENT_NS)
    assert not watch.admits(watch._last + LOST + 1, 0, SILENT_NS)
    watch.refuse(5000, SILENT_NS)
    assert watch.admits(watch._last + 1, 0, SILENT_NS)


@pytest.mark.parametrize('ticked', [True, False])
def test_a_writer_of_which_a_restart_is_known_is_taken_up_before_it_was_silent(
        ticked: bool) -> None:
    watch = watched(ticked=ticked)
    now_ns = KNOWN * TICK_NS
    assert not watch.admits(1, now_ns + TICK_NS, now_ns + TICK_NS)
    watch.forget()
    assert not watch.known
    for k in (2, 3, 5, 6):  # one of which was lost
        assert watch.admits(k, now_ns + k * TICK_NS, now_ns + k * TICK_NS)


def test_who_looks_now_and_then_knows_the_writer_all_the_same() -> None:
    """Many messages pass between two looks, as many as there are."""
    watch = WriterWatch(lambda: not watch.known, most_lost=math.inf)
    for number in range(1, 100 * KNOWN, KNOWN):
        assert watch.admits(number, number * TICK_NS, number * TICK_NS)
        assert not watch.admits(number // 2, number * TICK_NS, number * TICK_NS)


def test_in_lock_step_the_last_two_ticks_may_be_told_again() -> None:
    watch, last = WriterWatch(lambda: not watch.known, lock_step=True), KNOWN
    assert all(watch.admits(k, k * TICK_NS, k) for k in range(1, last + 1))
    assert not watch.admits(last + 1, (last - 2) * TICK_NS, last)
    for k in range(1, 5):
        assert watch.admits(last + k, (last - k % 2) * TICK_NS, last)
    assert not watch.admits(last + 6, (last + 1) * TICK_NS, last)
    assert watch.admits(last + 5, (last + 1) * TICK_NS, last)


def test_in_lock_step_the_writer_does_not_keep_to_the_clock() -> None:
    draw = random.Random(3)
    watch, now = WriterWatch(lambda: not watch.known, lock_step=True), 0
    for number in range(1, 1000):
        now += draw.choice((1, 10**6, 10**10))
        assert watch.admits(number, number * TICK_NS, now)
        if number > 500:
            assert not watch.admits(number - 500, number * TICK_NS, now)


def test_in_lock_step_a_late_reader_hears_the_newest_of_what_was_told_before() -> None:
    """A latched topic that tells at every tick. Afterwards a stranger is one, behind or ahead."""
    watch = WriterWatch(lambda: True, ticked=False, lock_step=True)
    for number in (1, 48, 500, 2000, 2001, 2002):
        assert watch.admits(number, 0, SILENT_NS)
    for stranger in (1, 2, 1000, 5000):
        assert not watch.admits(stranger, 0, SILENT_NS)
    assert watch.admits(2003, 0, SILENT_NS)


def test_without_numbers_everybody_is_heard() -> None:
    assert WriterWatch(lambda: False).admits(None, 0, 0)


def test_in_lock_step_the_writer_may_say_again_what_it_said() -> None:
    watch = WriterWatch(lambda: True, lock_step=True)
    number = 0
    for tick in range(1, 100):
        for _ in range(1 + (tick % 10 == 0) + (tick > 60) * (tick % 20 == 0)):
            number += 1
            assert watch.admits(number, tick * TICK_NS, tick * TICK_NS)
    assert not watch.admits(number + 2, 99 * TICK_NS, 99 * TICK_NS)
    assert not watch.admits(number + 2, 100 * TICK_NS, 99 * TICK_NS)
    assert watch.admits(number + 1, 100 * TICK_NS, 99 * TICK_NS)
