# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages are matched by stamp in whatever order they arrive; commands act in their tick."""

from __future__ import annotations

import random

import pytest
import ros_processes
from hypothesis import given
from hypothesis import strategies as st
from ros_processes import Ros
from std_msgs.msg import Int64

from dmp_cpg_ros.nodes.framework.execution import make_executor
from dmp_cpg_ros.nodes.framework.ticks import (
    AHEAD_NS,
    CONFIRMED,
    HOLD_TICKS,
    PATIENCE,
    PENDING_TICKS,
    RESET_NS,
    TickInputs,
    drain,
)

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain

TICK = 4_000_000
INPUTS = ('a', 'b', 'c')
SEEDS = st.integers(0, 2**32)


def recorder(**options: object) -> tuple[TickInputs, list]:
    fired: list[tuple[int, dict]] = []
    inputs = TickInputs(lambda stamp, values: fired.append((stamp, dict(values))), INPUTS, 'a',
                        **options)
    return inputs, fired


def interleaving(seed: int, names: tuple[str, ...] = INPUTS, ticks: int = 12,
                 lead: int = 3) -> list[tuple[str, int]]:
    """Arrivals (name, tick): every input in its order, none more than ``lead`` ticks ahead."""
    draw, at, arrivals = random.Random(seed), dict.fromkeys(names, 0), []
    while any(tick < ticks for tick in at.values()):
        name = draw.choice([n for n in names if at[n] < min(ticks, min(at.values()) + lead)])
        arrivals.append((name, at[name]))
        at[name] += draw.random() < 0.9  # else it arrives twice
    return arrivals


def test_it_tells_what_the_oldest_tick_lacks() -> None:
    inputs, _ = recorder(lock_step=True, delayed=('d',))
    assert inputs.awaited() == (-1, [])
    for name in INPUTS:
        inputs.add(name, 0, 0)
    inputs.add('b', 2 * TICK, 0)
    inputs.add('b', TICK, 0)
    assert inputs.awaited() == (TICK, ['a', 'c', 'd'])
    inputs.add('d', 0, 0)
    inputs.add('a', TICK, 0)
    assert inputs.awaited() == (TICK, ['c'])
    inputs.add('c', TICK, 0)
    assert inputs.awaited() == (2 * TICK, ['a', 'c', 'd'])


@given(SEEDS)
def test_in_lock_step_every_tick_has_exactly_its_messages(seed: int) -> None:
    inputs, fired = recorder(lock_step=True)
    arrivals = interleaving(seed)
    for place, (name, tick) in enumerate(arrivals):
        first = arrivals.index((name, tick)) == place
        inputs.add(name, tick * TICK, (name, tick) if first else 'repeated')
    assert inputs.ignored == len(arrivals) - len(set(arrivals))
    assert [stamp for stamp, _ in fired] == [tick * TICK for tick in range(12)]
    for stamp, values in fired:
        assert values == {name: (name, stamp // TICK) for name in INPUTS}


@given(SEEDS)
def test_a_delayed_input_acts_one_tick_later(seed: int) -> None:
    inputs, fired = recorder(lock_step=True, delayed=('late',))
    for name, tick in dict.fromkeys(interleaving(seed, (*INPUTS, 'late'))):
        inputs.add(name, tick * TICK, tick)
    assert [values['late'] for _, values in fired] == [None, *range(11)]
    assert [stamp for stamp, _ in fired] == [tick * TICK for tick in range(12)]


def test_in_lock_step_who_is_told_of_ticks_before_its_first_one_passes_them_over() -> None:
    """A restarted node is told again what some have said of the tick before; what others said of
    it does not come any more.
    """
    inputs, fired = recorder(lock_step=True)
    for name, tick in (('b', 1), ('c', 1), ('b', 2), ('c', 2), ('a', 2), ('a', 3), ('b', 3)):
        inputs.add(name, tick * TICK, tick)
    assert [stamp for stamp, _ in fired] == [2 * TICK]
    inputs.add('a', 4 * TICK, 4)
    inputs.add('b', 4 * TICK, 4)
    inputs.add('c', 4 * TICK, 4)
    assert [stamp for stamp, _ in fired] == [2 * TICK]
    inputs.add('c', 3 * TICK, 3)
    assert [stamp for stamp, _ in fired] == [2 * TICK, 3 * TICK, 4 * TICK]


def test_in_lock_step_a_delayed_input_of_another_tick_does_not_count() -> None:
    inputs, fired = recorder(lock_step=True, delayed=('late',))
    for name in INPUTS:
        inputs.add(name, TICK, name)
    for name in INPUTS:
        inputs.add(name, 2 * TICK, name)
    inputs.add('late', 0, 'old')
    inputs.add('late', 2 * TICK, 'early')
    assert len(fired) == 1
    inputs.add('late', TICK, 'right')
    assert [values['late'] for _, values in fired] == [None, 'right']


@given(SEEDS, st.sets(st.tuples(st.sampled_from(INPUTS), st.integers(1, 29))))
def test_in_real_time_losses_cost_no_tick_that_was_triggered(
        seed: int, lost: set[tuple[str, int]]) -> None:
    inputs, fired = recorder()
    later = [arrival for arrival in interleaving(seed, ticks=30) if arrival[1] > 0]
    seen: set[tuple[str, int]] = set()
    for name, tick in [*((name, 0) for name in INPUTS), *later]:
        if (name, tick) in lost:
            continue
        seen.add((name, tick))
        before = len(fired)
        inputs.add(name, tick * TICK, tick)
        for stamp, values in fired[before:]:
            for other in INPUTS:
                arrived = (other, stamp // TICK) in seen
                assert (values[other] == stamp // TICK) == arrived
        assert len(inputs._pending) <= PENDING_TICKS
    stamps = [stamp // TICK for stamp, _ in fired]
    triggers = [tick for tick in range(30) if ('a', tick) not in lost]
    assert stamps == triggers[:len(stamps)]
    # Those that wait still lack something of which nothing later has come.
    newest = {name: max(tick for n, tick in seen if n == name) for name in INPUTS}
    for tick in triggers[len(stamps):len(stamps) + 1]:
        assert any((name, tick) not in seen and newest[name] < tick for name in INPUTS)


def test_a_dead_input_delays_ticks_only_until_patience_ends() -> None:
    inputs, fired = recorder()
    for tick in range(3):
        for name in INPUTS:
            inputs.add(name, tick * TICK, tick)
    behind = []
    for tick in range(3, 30):
        inputs.add('b', tick * TICK, tick)
        inputs.add('a', tick * TICK, tick)
        behind.append(tick - fired[-1][0] // TICK - 1)  # later than the oldest that waits
    assert max(behind) == HOLD_TICKS
    assert set(behind[HOLD_TICKS + PATIENCE:]) == {-1}  # nothing waits
    assert {values['c'] for _, values in fired[3:]} == {2}
    # It comes back, a little later than the others, and is waited for again.
    for tick in range(30, 34):
        inputs.add('b', tick * TICK, tick)
        inputs.add('a', tick * TICK, tick)
        inputs.add('c', tick * TICK, tick)
    assert [values['c'] for _, values in fired[-3:]] == [31, 32, 33]


@pytest.mark.parametrize('late', INPUTS)
@given(st.lists(st.integers(0, HOLD_TICKS), min_size=30, max_size=30))
def test_a_node_that_stalls_costs_no_tick_its_inputs(late: str, stalls: list[int]) -> None:
    """One input lags by a number of ticks that changes, and comes in bursts."""
    inputs, fired = recorder()
    sent = 0
    for tick, stall in enumerate([*stalls, *range(HOLD_TICKS, -1, -1)]):
        for name in INPUTS:
            if name != late:
                inputs.add(name, tick * TICK, tick)
        while sent <= tick - stall:
            inputs.add(late, sent * TICK, sent)
            sent += 1
    assert [stamp // TICK for stamp, _ in fired] == list(range(sent))
    for stamp, values in fired:
        assert set(values.values()) == {stamp // TICK}


@pytest.mark.parametrize('behind', [HOLD_TICKS, 40, PENDING_TICKS - 2])
def test_a_trigger_that_is_late_finds_the_inputs_of_its_own_ticks(behind: int) -> None:
    """As where the trigger's writer was started again on a full machine."""
    inputs, fired = recorder()
    for tick in range(200):
        for name in INPUTS[1:]:
            inputs.add(name, tick * TICK, tick)
        if tick >= 100 + behind:
            inputs.add('a', (tick - behind) * TICK, tick - behind)
    assert [stamp // TICK for stamp, _ in fired] == list(range(100, 200 - behind))
    assert all(set(values.values()) == {stamp // TICK} for stamp, values in fired)


def test_an_optional_input_may_never_come_but_others_must() -> None:
    inputs, fired = recorder(optional=('c',))
    for tick in range(6):
        inputs.add('a', tick * TICK, tick)
    assert not fired
    for tick in range(6, 12):
        inputs.add('b', tick * TICK, tick)
        inputs.add('a', tick * TICK, tick)
    assert fired and all(values['c'] is None for _, values in fired)


@pytest.mark.parametrize('lock_step', [True, False])
def test_a_robot_that_starts_again_is_followed(lock_step: bool) -> None:
    inputs, fired = recorder(lock_step=lock_step)
    first = range(100, 110)
    for tick in (*first, *range(5)):
        for name in INPUTS:
            inputs.add(name, tick * TICK, tick)
    assert [stamp // TICK for stamp, _ in fired] == [*first, *range(5)]
    # A stamp that is only a little older is a late message.
    for name in INPUTS:
        inputs.add(name, 4 * TICK - RESET_NS + 1, 'late')
    assert len(fired) == 15


Told = tuple[int, int]
"""Run of the robot, and its tick."""

SOUND = 60
"""Ticks in the end in which nothing stalls or is lost; the first tick has everything too."""


def stalling(draw: random.Random, runs: list[list[int]], longest: int) -> list[tuple[str, Told]]:
    """Arrivals of the ticks of one run of the robot after another: each input keeps its order,
    stalls now and then for up to ``longest`` ticks, after which what it was about to tell comes
    at once, and loses some.
    """
    sent = [(run, tick) for run, ticks in enumerate(runs) for tick in ticks]
    arrivals = []
    for place in range(len(INPUTS)):
        late = [0] * len(sent)
        lost = [draw.random() < 0.05 for _ in sent]
        for _ in range(draw.randrange(6)):
            begin, length = draw.randrange(1, len(sent)), draw.randint(2, longest)
            end = min(begin + length, len(sent) - SOUND)
            for k in range(begin, end):
                late[k] = max(late[k], end - k)
        arrivals += [(k + late[k], place, k) for k in range(len(sent))
                     if not lost[k] or k == 0 or k >= len(sent) - SOUND]
    return [(INPUTS[place], sent[k]) for _, place, k in sorted(arrivals)]


def fed(arrivals: list[tuple[str, Told]]) -> tuple[list[bool], list[tuple[int, dict]]]:
    """What was taken to be of this run, and the ticks that fired, of messages that bear the run
    and the tick in which they were sent.
    """
    inputs, fired = recorder()
    return [inputs.add(name, tick * TICK, (run, tick)) for name, (run, tick) in arrivals], fired


@given(SEEDS, st.sampled_from([20, 100, 700]))
def test_messages_of_writers_that_stalled_are_late_and_no_other_run(
        seed: int, longest: int) -> None:
    """Among them stalls that last longer than any stamp may lie behind or ahead."""
    draw = random.Random(seed)
    taken, fired = fed(stalling(draw, [list(range(draw.randrange(100), 1000))], longest))
    stamps = [stamp for stamp, _ in fired]
    assert all(taken)
    assert stamps == sorted(set(stamps))
    for stamp, values in fired[-SOUND // 2:]:
        assert set(values.values()) == {(0, stamp // TICK)}


@given(SEEDS, st.sampled_from([20, 100, 700]), st.booleans())
def test_a_robot_that_starts_again_is_followed_once_whatever_stalls(
        seed: int, longest: int, ahead: bool) -> None:
    """Its clock begins anew below what it was or, where it is set, ahead of it."""
    draw = random.Random(seed)
    far = AHEAD_NS // TICK
    apart = draw.randrange(RESET_NS // TICK + 1, 5 * far) + ahead * far
    first = list(range(6000, 6400))
    begin = first[-1] + apart if ahead else first[-1] - apart
    second = list(range(begin, begin + 500))
    _, fired = fed(stalling(draw, [first, second], longest))
    told = [values['a'] for _, values in fired]
    assert told == sorted(set(told))
    for _, values in fired[-SOUND // 2:]:
        assert values == dict.fromkeys(INPUTS, values['a']) and values['a'][0] == 1
    if abs(apart) > far + len(first) + len(second):  # else stamps alone do not tell the runs apart
        assert all({run for run, _ in values.values()} == {values['a'][0]} for _, values in fired)


@given(SEEDS)
def test_a_single_writer_does_not_take_the_others_to_another_time(seed: int) -> None:
    """One tells any stamps for a while, by which the others' ticks are none the worse."""
    draw, (inputs, fired) = random.Random(seed), recorder()
    for tick in range(1000, 1200):
        for name in INPUTS:
            false = name == 'c' and 1050 <= tick < 1150
            stamp = draw.randrange(2000 * TICK) if false else tick * TICK
            inputs.add(name, stamp, None if false else tick)
    stamps = [stamp // TICK for stamp, _ in fired]
    assert stamps == list(range(1000, 1200))
    assert all(values['a'] == values['b'] == stamp for stamp, (_, values) in zip(
        stamps, fired, strict=True))
    late = RESET_NS // TICK + 1  # what lies ahead by less is not told from the truth
    assert [values['c'] for _, values in fired[150 + late:]] == stamps[150 + late:]


def test_in_real_time_what_is_sent_on_change_survives_a_reset() -> None:
    inputs, fired = recorder(delayed=('late',))
    inputs.add('late', 0, 'state')
    for tick in (1000, *range(CONFIRMED)):
        for name in INPUTS:
            inputs.add(name, tick * TICK, tick)
    inputs.add('late', 0, 'state of long ago')
    assert [values['late'] for _, values in fired] == ['state'] * (1 + CONFIRMED)
    assert inputs.last_ns == (CONFIRMED - 1) * TICK


def test_memory_is_bounded() -> None:
    for lock_step in (True, False):
        inputs, fired = recorder(lock_step=lock_step, delayed=('late',))
        for tick in range(1000):
            inputs.add('b', tick * TICK, tick)
            inputs.add('late', tick * TICK, tick)
        assert len(inputs._pending) <= PENDING_TICKS and not fired
        assert len(inputs._late['late']) <= PENDING_TICKS


def test_wrong_names_are_errors() -> None:
    for options in ({'trigger': 'x'}, {'trigger': 'a', 'optional': ('a',)},
                    {'trigger': 'a', 'delayed': ('b',)}):
        with pytest.raises(ValueError, match='must'):
            TickInputs(lambda stamp, values: None, INPUTS, **options)


@pytest.mark.parametrize('kind', ['events', 'single'])
def test_commands_that_arrived_before_a_tick_act_in_it(ros: Ros, kind: str) -> None:
    """Ten ticks; before each five commands arrive, and after it one that nobody drains."""
    got: list[int] = []
    at_tick: list[int] = []
    commands = ros.node.create_subscription(Int64, 'command', lambda m: got.append(m.data), 100)

    def tick(message: Int64) -> None:
        drain(commands)
        at_tick.append(len(got))

    ros.node.create_subscription(Int64, 'tick', tick, 100)
    sender = ros.node.create_publisher(Int64, 'command', 100)
    ticker = ros.node.create_publisher(Int64, 'tick', 100)
    ros.spin_until(lambda: sender.get_subscription_count() and ticker.get_subscription_count())
    ros.executor.remove_node(ros.node)
    executor = make_executor(kind, ros.context)
    executor.add_node(ros.node)
    sent = 0

    def until(condition: object) -> None:
        ros_processes.wait_until(condition, between=lambda: executor.spin_once(timeout_sec=0.02))

    try:
        for k in range(10):
            for _ in range(5):
                sender.publish(Int64(data=sent))
                sent += 1
            assert sender.wait_for_all_acked()
            ticker.publish(Int64(data=k))
            until(lambda k=k: len(at_tick) > k)
            assert at_tick[-1] == sent
            sender.publish(Int64(data=sent))
            sent += 1
            until(lambda sent=sent: len(got) == sent)
        assert got == list(range(sent))
    finally:
        executor.remove_node(ros.node)


def test_in_lock_step_a_trigger_that_comes_again_is_passed_on() -> None:
    repeats: list[int] = []
    inputs, fired = recorder(lock_step=True, on_repeat=repeats.append)
    for name in INPUTS:
        inputs.add(name, 0, name)
    for name in INPUTS:
        inputs.add(name, 0, name)
    assert len(fired) == 1 and repeats == [0]
    inputs.add('a', TICK, 'a')  # waits for the others
    inputs.add('a', TICK, 'a')
    assert repeats == [0, TICK]


def test_in_lock_step_a_restarted_node_begins_with_the_former_of_two_ticks_that_it_is_told_of(
        ) -> None:
    inputs, fired = recorder(lock_step=True)
    for name in INPUTS:
        inputs.add(name, 5 * TICK, name)  # of which others may lack the one before
    assert not fired
    for name in INPUTS:
        inputs.add(name, 4 * TICK, name)
    assert [stamp for stamp, _ in fired] == [4 * TICK, 5 * TICK]


def test_in_lock_step_a_restarted_node_begins_with_a_tick_of_which_alone_it_is_told_again(
        ) -> None:
    inputs, fired = recorder(lock_step=True)
    for name in (*INPUTS, 'b', 'c', 'a'):
        assert not fired
        inputs.add(name, 5 * TICK, name)
    assert [stamp for stamp, _ in fired] == [5 * TICK]


def test_in_lock_step_what_is_missing_of_a_tick_that_all_others_have_ended_is_not_waited_for(
        ) -> None:
    inputs, fired = recorder(lock_step=True, delayed=('d',))
    for tick in (0, 1, 2):
        for name in INPUTS:
            inputs.add(name, tick * TICK, name)
    assert [stamp for stamp, _ in fired] == [0]
    inputs.add('a', 2 * TICK, 'a')
    assert [stamp for stamp, _ in fired] == [0, TICK]


def test_a_node_that_is_started_late_begins_with_the_delayed_input_that_was_kept() -> None:
    inputs, fired = recorder(lock_step=True, delayed=('d',))
    inputs.add('d', 4 * TICK, 'kept')
    for tick in (5, 6):
        for name in INPUTS:
            inputs.add(name, tick * TICK, name)
    assert [values['d'] for _, values in fired] == ['kept']
    inputs.add('d', 5 * TICK, 'new')
    assert fired[-1][1]['d'] == 'new'
