# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inhibition, the words of a stop and a start, automatic stops, predictions kept to the tick.

The robot only stands: nothing of the body enters the oscillators, the reference or the words.
"""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from core_examples import GAITS
from hypothesis import given, settings
from hypothesis import strategies as st
from standing_run import TICK, Run, walking

from dmp_cpg_ros.core.canonical.inhibition import (
    Inhibition,
    InhibitionParameters,
    initial_inhibition,
)
from dmp_cpg_ros.core.canonical.phase import phase, wrapped
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.inhibition.prediction import DOWN
from dmp_cpg_ros.core.inhibition.supervisor import STATES
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import BORNE
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.foot_path import swing_height


def test_a_copy_of_a_run_goes_on_as_the_run_does_and_leaves_it_alone() -> None:
    whole, parts = Run().go(2 * TICK), walking(seconds=1.0)
    whole.loop.command(0.5)
    whole.go(1.0)
    parts.copy().loop.request(True)
    for run in (whole, parts):
        run.go(0.5).loop.request(True)
        run.go(1.0)
    assert whole.words() == parts.words() and len(whole.ticks) == len(parts.ticks)
    for name in ('x', 'x_dot', 'r'):
        assert np.array_equal([getattr(tick, name) for tick in whole.ticks],
                              [getattr(tick, name) for tick in parts.ticks])


def test_a_whole_stop_and_start_says_its_words_in_order() -> None:
    run = walking()
    assert run.words() == ['at_rest', 'releasing', 'walking']
    run.loop.request(True)
    run.ticks.clear()
    run.go(3.0)
    assert run.words() == ['waiting', 'captured', 'at_rest']
    run.loop.request(False)
    run.ticks.clear()
    run.go(2.0)
    assert run.words() == ['releasing', 'walking']
    assert set(run.words()) <= set(STATES)


def test_rest_is_rest() -> None:
    run = walking()
    run.loop.request(True)
    run.until('at_rest')
    tick = run.ticks[-1]
    assert np.abs(tick.x_dot).max() < 0.06
    assert run.loop.network.scale.foot_speed(*tick.r) <= 0.01
    measured = run.loop.stop.measured_s
    run.go(1.0)
    assert run.loop.stop.state == 'at_rest' and run.loop.stop.measured_s == measured


def test_while_stopping_the_reference_is_zero_and_after_it_is_the_command() -> None:
    run = walking()
    run.loop.request(True)
    run.go(3.0)
    assert np.abs(run.ticks[-1].r).max() < 1e-3
    run.loop.request(False)
    run.go(3.0)
    assert run.ticks[-1].r[0] == pytest.approx(0.5, abs=1e-3)


def test_inhibition_is_armed_only_when_the_reference_is_slow() -> None:
    run = walking(speed=0.8)
    run.loop.request(True)
    run.ticks.clear()
    run.go(2.0)
    speed = [run.loop.network.scale.foot_speed(*tick.r) for tick in run.ticks]
    armed = [tick.supervisor.armed for tick in run.ticks]
    first = armed.index(True)
    assert speed[first] <= 0.1 < speed[first - 1] and all(armed[first:])


@pytest.mark.parametrize(('capture_speed', 'steps_out', 'most'), [
    (8.0, False, BORNE), (8.0, True, inf), (0.1, False, BORNE)])
def test_where_nobody_steps_out_of_a_stop_legs_are_caught_at_what_standing_ones_bear(
        capture_speed: float, steps_out: bool, most: float) -> None:
    run = walking(speed=0.8, inhibition=InhibitionParameters(
        capture_speed=capture_speed, push_recovery=steps_out))
    predicted = run.loop.request(True)
    bound = run.loop.time_to_rest()
    run.ticks.clear()
    run.until('at_rest')
    scale = run.loop.network.scale
    armed = next(tick for tick in run.ticks if tick.supervisor.armed)
    speed, first = scale.foot_speed(*armed.r), min(scale.speed(most), capture_speed)
    assert speed <= first and speed > 0.9 * min(first, 0.8)
    assert predicted == pytest.approx(run.loop.stop.measured_s, abs=1e-9) and predicted <= bound


def test_a_start_in_the_middle_of_a_stop_walks_on() -> None:
    run = walking()
    run.loop.request(True)
    run.go(0.5)
    run.loop.request(False)
    assert not run.loop.stop.armed
    run.until('walking', longest=2.0)


def test_asking_again_changes_neither_the_time_nor_the_word() -> None:
    run = walking()
    run.loop.request(True)
    run.go(0.4)
    before = run.loop.stop
    run.loop.request(True)
    assert run.loop.stop == before


def test_a_zero_command_stops_after_the_delay_and_a_command_resumes() -> None:
    run = walking(inhibition=InhibitionParameters(auto_delay=0.5))
    run.loop.command(0.0)
    run.go(0.4)
    assert not run.loop.stop.requested
    run.go(0.2)
    assert run.loop.stop.requested and run.loop.stop.automatic
    run.until('at_rest')
    run.loop.command(0.3)
    run.go(2 * TICK)
    assert not run.loop.stop.requested
    run.until('walking')


@pytest.mark.parametrize('idle_s', [0.0, 0.3])
def test_a_clock_that_is_set_back_does_not_put_off_a_stop(idle_s: float) -> None:
    run = walking(inhibition=InhibitionParameters(auto_delay=0.5))
    run.time_ns += 1_000_000_000_000
    run.go(2 * TICK).loop.command(0.0)
    run.go(idle_s + TICK).time_ns = 0
    run.go(0.5 + 2 * TICK)
    assert run.loop.stop.requested
    run.until('at_rest')
    assert 0.0 < run.loop.stop.measured_s < 2.0


def test_a_stop_keeps_its_time_when_the_clock_is_set_back() -> None:
    run = walking()
    other = run.copy()
    for each in (run, other):
        each.loop.request(True)
        each.go(0.1)
    run.time_ns -= 1_000_000_000
    for each in (run, other):
        each.until('at_rest')
    assert run.loop.stop.measured_s == other.loop.stop.measured_s


def test_silence_of_the_command_leads_to_the_same_stop() -> None:
    run = walking(reference=ReferenceParameters(cmd_vel_timeout=0.5), seconds=TICK,
                  inhibition=InhibitionParameters(auto_delay=0.5))
    run.go(1.1)
    assert run.loop.stop.requested
    run.until('at_rest')


def test_without_auto_inhibit_a_zero_command_trots_on_the_spot() -> None:
    run = Run('trot', inhibition=InhibitionParameters(auto_inhibit=False, start_inhibited=False))
    run.go(4.0)
    assert not run.loop.stop.requested and run.loop.stop.state == 'free'
    assert np.abs(run.ticks[-1].x_dot).max() > 1.0


def test_a_stop_by_service_is_not_undone_by_commands() -> None:
    run = walking()
    run.loop.request(True)
    run.until('at_rest')
    run.loop.command(0.8)
    run.go(2.0)
    assert run.loop.stop.state == 'at_rest'


def test_a_service_call_makes_an_automatic_stop_its_own() -> None:
    run = walking(inhibition=InhibitionParameters(auto_delay=0.2))
    run.loop.command(0.0)
    run.go(0.5)
    run.loop.request(True)
    run.loop.command(0.5)
    run.go(3.0)
    assert run.loop.stop.state == 'at_rest'


@pytest.mark.parametrize('leg', LEGS)
def test_any_one_leg_can_be_the_inhibited_one(leg: str) -> None:
    run = walking(inhibition=InhibitionParameters(inhibited_legs=(leg,)))
    predicted = run.loop.request(True)
    assert run.until('at_rest') == pytest.approx(predicted, abs=1e-9)
    rest = run.ticks[-1].x
    run.loop.request(False)
    run.until('walking')
    # every leg rests ahead of its place, by what the one that is held must bear and the others lag
    network, p = run.loop.network, run.loop.parameters
    omega = network.omega(np.zeros(3))
    most = 4.0 * omega / p.inhibition.inhibition_gain + omega / p.canonical.coupling_gain
    ahead = wrapped(phase(rest) - network.gait.phases)
    assert np.all((ahead > 0.0) & (ahead < 1.05 * most))


@given(gait=st.sampled_from(list(GAITS)), speed=st.floats(0.1, 1.0), later=st.floats(0.0, 0.8),
       turn=st.floats(-0.5, 0.5))
@settings(max_examples=12)
def test_predictions_are_kept_to_the_tick(
        gait: str, speed: float, later: float, turn: float) -> None:
    run = walking(gait, speed, 1.5 + later)
    run.loop.command(speed, 0.0, turn)
    run.go(0.3)
    predicted = run.loop.request(True)
    assert run.until('at_rest') == pytest.approx(predicted, abs=1e-9)
    assert run.loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)
    predicted = run.loop.request(False)
    assert run.until('walking', 'free') == pytest.approx(predicted, abs=1e-9)
    assert run.loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)


def test_a_stop_that_never_comes_is_predicted_as_such() -> None:
    run = walking(inhibition=InhibitionParameters(inhibition_gain=20.0))
    assert run.loop.request(True) == np.inf


@given(x=st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4), radius=st.floats(0.1, 1.0))
def test_inhibition_acts_inside_its_region_only(x: list[float], radius: float) -> None:
    states, target = np.reshape(x, (2, 2)), np.array([[1.0, 0.0], [0.0, 1.0]])
    acting = Inhibition(True, np.array([3.0, 5.0]), radius).acting_gains(states, target)
    inside = np.hypot(*(states - target).T) <= radius
    clear = np.abs(np.hypot(*(states - target).T) - radius) > 1e-12
    assert np.array_equal(acting[clear], np.where(inside, [3.0, 5.0], 0.0)[clear])


def test_armed_gains_are_those_of_the_inhibited_legs() -> None:
    p = InhibitionParameters(inhibition_gain=7.0, inhibited_legs=('fr', 'rr'))
    assert np.array_equal(p.armed_gains, [0.0, 7.0, 0.0, 7.0])
    assert np.array_equal(initial_inhibition(p).gains, p.armed_gains)
    free = initial_inhibition(InhibitionParameters(start_inhibited=False))
    assert not free.requested and not free.gains.any()


@pytest.mark.parametrize('legs', [(), ('fl', 'fl'), ('fl', 'tail')])
def test_impossible_choices_of_legs_are_refused(legs: tuple[str, ...]) -> None:
    with pytest.raises(ParameterError, match='fl, fr, rl, rr'):
        InhibitionParameters(inhibited_legs=legs)


@pytest.mark.parametrize(('gait', 'wait'), [('amble', 0.0), ('trot', 0.1), ('walk', 0.3)])
def test_feet_are_down_and_the_reference_has_gone_as_far_as_was_looked_ahead(
        gait: str, wait: float) -> None:
    run = walking(gait).go(wait)
    run.ticks.clear()
    run.loop.request(True)
    outlook = run.loop.outlook
    run.until('at_rest')
    assert outlook.way_m == pytest.approx(
        TICK * sum(np.hypot(*tick.r[:2]) for tick in run.ticks), rel=1e-9)
    lifted = []
    for k, tick in enumerate(run.ticks, 1):
        duty = tick.gait.pace(tick.r, run.loop.canonical.scale)[3]
        swung = tick.gait.cycle_position(phase(tick.x)) / (1.0 - duty) + 0.5
        height = [swing_height(s)[0] if 0.0 < s < 1.0 else 0.0 for s in swung.tolist()]
        if max(np.multiply(tick.supervisor.activity, height)) > DOWN:
            lifted.append(k * TICK)
    assert outlook.down_s == pytest.approx(lifted[-1]) and 0.0 < outlook.down_s < outlook.time_s
    assert outlook.stands_s < outlook.stands_within_s
