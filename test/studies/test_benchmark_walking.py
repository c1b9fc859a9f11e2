# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The walking benchmark: that its trials measure what they say."""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace
from functools import lru_cache
from math import isnan, nan, pi
from pathlib import Path

import numpy as np
import pytest

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.metrics.robot import cost_of_transport
from dmp_cpg_ros.analysis.recording import WorkSeries
from dmp_cpg_ros.studies.output import markdown_table

pytest.importorskip('mujoco')
from dmp_cpg_ros.studies import change_trials, walking_trials
from dmp_cpg_ros.studies.benchmark_walking import _largest, main, steady_cells
from dmp_cpg_ros.studies.loop_recording import recording_of
from dmp_cpg_ros.studies.push_trials import survives
from dmp_cpg_ros.studies.trial_tables import Table, tell
from dmp_cpg_ros.studies.walking_trials import (
    SteadyOutcome,
    Walk,
    cross,
    relative_error,
)


def test_the_error_is_along_the_command() -> None:
    reached = SteadyOutcome(False, (0.4, 0.3, 0.0))
    assert relative_error(reached, (0.5, 0.0, 0.0)) == pytest.approx(0.2)
    assert relative_error(reached, (0.0, 0.3, 0.0)) == pytest.approx(0.0)
    assert relative_error(SteadyOutcome(False, (0.0, 0.0, 0.9)), (0.0, 0.0, 1.0)) == (
        pytest.approx(0.1))
    assert isnan(relative_error(SteadyOutcome(True), (1.0, 0.0, 0.0)))
    assert steady_cells((1.0, 0.0, 0.0), SteadyOutcome(True))[0] == 'fell'
    assert steady_cells(
        (0.5, 0.0, 0.0), SteadyOutcome(False, (0.45, 0.0, 0.0), nan, nan))[1] == '10.0'


def test_a_copy_of_a_walk_goes_on_as_the_walk_does() -> None:
    run = Walk('trot')
    assert run.reach((0.3, 0.0, 0.0))
    other = deepcopy(run)
    assert run.walk(0.4) and other.walk(0.4)
    np.testing.assert_array_equal(run.state.joint_position, other.state.joint_position)
    np.testing.assert_array_equal(
        run.state.base_position_in_world, other.state.base_position_in_world)


@lru_cache
def costs(control_rate: float) -> dict[str, float]:
    """Cost of transport of a steady amble by what it is taken from."""
    run = Walk('amble', values=(('control_rate', control_rate),))
    assert run.reach((0.5, 0.0, 0.0)) and run.walk(1.5)
    run.states = [run.state]
    assert run.walk(2.5)
    way = np.hypot(*(run.states[-1].base_position_in_world
                     - run.states[0].base_position_in_world)[:2])
    whole, context = recording_of(run.states), RunContext(robot=run.robot.description)
    stamps = replace(whole, work=WorkSeries())
    found = [cost_of_transport(recording, context, way) for recording in (whole, stamps)]
    assert all(cost is not None for cost, _ in found)
    return {source: cost for cost, source in found}


def test_the_cost_hardly_depends_on_how_often_it_is_told() -> None:
    """What is left is the work itself: held longer, targets are followed less smoothly."""
    assert costs(100.0)['joint_work'] == pytest.approx(costs(500.0)['joint_work'], rel=0.08)


def test_an_estimate_from_the_stamps_alone_misses_more_the_fewer_they_are() -> None:
    missed = [1.0 - costs(rate)['joint_states'] / costs(rate)['joint_work']
              for rate in (500.0, 100.0)]
    assert 0.0 < missed[0] < 0.5 * missed[1]


@pytest.mark.parametrize('quick', [False, True])
def test_a_push_that_slow_steps_do_not_catch_is_caught_by_quicker_ones(quick: bool) -> None:
    run = Walk('trot', values=(('step_timing', quick),))
    assert run.reach((0.3, 0.0, 0.0))
    assert survives(run, 0.5 * pi, 2.4) == quick


def test_a_push_is_felt_and_a_blow_is_fatal() -> None:
    run = Walk('trot')
    assert run.reach((0.3, 0.0, 0.0))
    assert survives(run, 0.5 * pi, 0.3)
    assert not survives(run, 0.5 * pi, 8.0)


def test_a_crossing_ends_at_the_finish_or_on_the_ground(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(walking_trials, 'FINISH', 2.5)
    monkeypatch.setattr(walking_trials, 'CROSSING_TIME', 6.0)  # twice as long as on the flat
    flat = cross('trot', 'flat', {}, 0, speed=0.8)
    assert flat.crossed and not flat.fell
    assert flat.time == pytest.approx(2.5 / 0.8, rel=0.2)
    wall = cross('trot', 'steps', {'height': 0.5}, 0, speed=0.8)
    assert not wall.crossed and wall.distance < 2.0


@pytest.mark.parametrize(('seed', 'chosen'), [(0, True), (1, False)])
def test_a_walk_forth_and_back_tells_what_went_on_at_its_fall(
        monkeypatch: pytest.MonkeyPatch, seed: int, chosen: bool) -> None:
    for name, value in (('FORTH', (0.3, 0.4)), ('BACK', 0.1), ('CHANGED', (0.0, 0.1)),
                        ('STOPPED', (0.1, 0.2)), ('HELD', (0.1, 0.2))):
        monkeypatch.setattr(change_trials, name, value)
    outcome = change_trials.run_return('amble', 'trot', seed)
    assert outcome.fell == '' and outcome.chosen == chosen and 0.0 < outcome.tilt < 20.0
    monkeypatch.setattr(Walk, 'fell', lambda walk: walk.loop.stop.state == 'waiting')
    fell = change_trials.run_return('amble', 'trot', seed).fell
    assert 0.1 <= float(fell.split()[0]) < 0.22 and fell.endswith('waiting')


def test_a_change_that_is_not_done_in_time_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    run = Walk('amble')
    assert run.reach((0.4, 0.0, 0.0))
    monkeypatch.setattr(change_trials, 'WATCHED', 0.1)
    outcome = change_trials._changed(run, change_trials.ChangeOutcome('trot', 0.0, fell=True))
    assert not outcome.fell and isnan(outcome.duration) and not outcome.in_time


def test_what_tables_were_made_of_is_there_when_a_later_one_fails(tmp_path: Path) -> None:
    def tables() -> Iterator[tuple[str, Table]]:
        yield 'first', Table('First', ('a',), (('1',),), [({'v': 1}, 2)])
        raise ValueError('no second')

    with pytest.raises(ValueError, match='no second'):
        tell(tables(), tmp_path / 'file.json')
    assert json.loads((tmp_path / 'file.json').read_text()) == {
        'first': [{'case': {'v': 1}, 'outcome': 2}]}


def test_no_number_is_the_largest_and_of_none_there_is_none() -> None:
    assert (_largest([1.0, nan, 2.0], '.1f'), _largest([], '.1f')) == ('nan', '-')


def test_parameters_of_a_case_reach_the_walk() -> None:
    felt, usual = Walk('trot', values=(('contact_feedback', True),)), Walk('trot')
    assert felt.loop.parameters.canonical.contact_feedback
    assert not usual.loop.parameters.canonical.contact_feedback


def test_tables_are_even() -> None:
    lines = markdown_table(('a', 'bb'), (('1', '2'), ('333', '4'))).splitlines()
    assert len({len(line) for line in lines}) == 1 and len(lines) == 4


@pytest.mark.parametrize('arguments', [['--seeds', '0'], ['--tables', 'jumps']])
def test_bad_arguments_end_with_status_2(
        arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert 'usage: benchmark_walking' in capsys.readouterr().err
