# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The stop study: what it measures, what it counts, what it prints."""

from __future__ import annotations

import json
import re
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from core_examples import TICK, quadruped, standing_state

from dmp_cpg_ros.analysis.recording import FootForceSeries, JointSeries, OdometrySeries, Recording
from dmp_cpg_ros.core.errors import DataError

pytest.importorskip('mujoco')
from dmp_cpg_ros.core.robot_model.grounds import Blocks, Slope
from dmp_cpg_ros.studies.loop_recording import StopOutcome, StopSummary, body_at_rest, suite_of
from dmp_cpg_ros.studies.random_robots import robot_file
from dmp_cpg_ros.studies.random_stops import ROUGHNESS, random_cases, scenario_bound, summary
from dmp_cpg_ros.studies.stop_trials import StopCase, run_cases, run_walk
from dmp_cpg_ros.studies.workers import Workers

ROBOT = quadruped()


def hold(speed: np.ndarray, force: float = 20.0) -> Recording:
    """A hold in which the body slides forwards at a speed over feet that go with it."""
    n = len(speed)
    state, time = standing_state(ROBOT), TICK * np.arange(n)
    position = np.zeros((n, 3))
    position[:, 0] = np.cumsum(speed) * TICK
    velocity = np.stack([speed, np.zeros(n), np.zeros(n)], axis=1)
    return Recording(
        joints=JointSeries(time, np.tile(state.joint_position, (n, 1)), np.zeros((n, 12)),
                           np.zeros((n, 12))),
        odometry=OdometrySeries(time, position, np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)), velocity,
                                np.zeros((n, 3))),
        feet=FootForceSeries(time, np.full((n, 4), force)))


def test_gaits_are_those_of_the_parameter_file(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from dmp_cpg_ros.studies.study_stops import main

    (tmp_path / 'gaits.yaml').write_text(
        'gaits: {canter: {lag: {fl: 0, fr: 0.7, rl: 0.7, rr: 0.4}, speed: [0, 0.6], '
        'cadence: [0.4, 0.55], duty_factor: [0.65, 0.55]}}\n')
    file = tmp_path / 'suite.yaml'
    file.write_text(f"/**: {{ros__parameters: {{control_rate: 100.0, gait: canter, gaits_file: "
                    f"'{tmp_path / 'gaits.yaml'}'}}}}\n")
    assert main([str(file), '--gaits', 'canter', '--speeds', '0.3', '--phases', '1', '--no-resume',
                 '--quiet', '--jobs', '1']) == 0
    assert '| canter | 0.3 |' in capsys.readouterr().out
    assert main([str(file), '--gaits', 'amble', '--phases', '1']) == 2
    assert "there is no gait 'amble'; valid are canter" in capsys.readouterr().err


def test_the_body_is_at_rest_when_it_stays_slower_than_a_centimetre_per_second() -> None:
    speed = np.repeat([0.2, 0.005, 0.02, 0.0], [100, 50, 50, 300])
    outcome = body_at_rest(hold(speed), ROBOT, 2.0)
    assert outcome.standing
    assert outcome.body_rest_s == pytest.approx(200 * TICK)
    assert outcome.displacement_m == pytest.approx(speed[1:201].sum() * TICK)
    assert outcome.slip_m == pytest.approx(outcome.displacement_m)  # the feet go with the body
    assert outcome.deceleration == pytest.approx(0.195 / 0.04)
    assert outcome.tilt == pytest.approx(0.0, abs=1e-6)


def test_the_body_stands_when_it_stays_below_two_centimetres_per_second_on_four_feet() -> None:
    speed = np.repeat([0.2, 0.015, 0.0], [100, 100, 300])
    assert body_at_rest(hold(speed), ROBOT, 2.0).still_s == pytest.approx(100 * TICK)
    lifted = hold(speed)
    lifted.feet.force[:150, 2] = 0.0
    assert body_at_rest(lifted, ROBOT, 2.0).still_s == pytest.approx(150 * TICK)


AS_SAID = StopOutcome(False, True, still_s=0.9, within_s=1.0, displacement_m=0.1, within_m=0.2)


def test_random_stops_say_of_the_next_one_what_is_wrong_as_rarely_as_is_said() -> None:
    rng, wrong = np.random.default_rng(3), 0
    for failing in rng.uniform(0.0, 0.3, 500):  # the true probability that one is not as was said
        late = rng.random(30) < failing
        told = scenario_bound(summary(
            [], [replace(AS_SAID, still_s=1.1) if bad else AS_SAID for bad in late], 0))
        below = re.search(r'below ([0-9.]+) at confidence 1 - 0.05', told)
        assert bool(below) is not late.any()
        wrong += below is not None and failing > float(below[1])
    assert wrong <= 25                                 # 5 % of 500


def test_a_summary_of_random_stops_counts_what_failed_and_claims_nothing_then() -> None:
    late, far = replace(AS_SAID, still_s=1.1), replace(AS_SAID, displacement_m=0.3)
    stepped = replace(late, stepped=True)
    case = StopCase('trot', 0.5, 0.0)
    of = summary([case] * 3, [AS_SAID, late, far, stepped, StopOutcome(fell=True)], 7)
    assert [of[name] for name in ('stops', 'fell', 'stepped', 'broken', 'late', 'far')] == [
        5, 1, 1, 3, 1, 1]
    assert of['still_s'] == [0.9, 1.1] and of['below'] == {} and of['grounds'] == {'flat': 3}
    held = summary([case], [AS_SAID, stepped], 7)['below']
    assert held == pytest.approx({'0.05': 1.0 - 0.05 ** 0.5, '1e-06': 1.0 - 1e-3})


@pytest.mark.parametrize(('changes', 'broken'), [
    ({}, False), ({'still_s': 1.1}, True), ({'displacement_m': 0.3}, True), ({'fell': True}, True),
    ({'still_s': 1.1, 'stepped': True}, False), ({'within_s': np.nan}, True)])
def test_what_was_said_of_a_body_is_broken_by_falls_delays_and_longer_ways(
        changes: dict[str, Any], broken: bool) -> None:
    assert replace(AS_SAID, **changes).broken is broken


def test_random_stops_depend_on_the_seed_only() -> None:
    options = Namespace(random=5, seed=2, gaits=['amble', 'trot'], speeds=[0.5, 1.5],
                        legs=['auto'], braking=[3.0], no_resume=True)
    cases = random_cases(options)
    assert cases == random_cases(options) and len(set(cases)) == 5
    assert cases[:3] == random_cases(Namespace(**{**vars(options), 'random': 3}))
    assert all(0.5 <= case.speed <= 1.5 and 0.3 <= case.friction <= 1.0 for case in cases)
    many = random_cases(Namespace(**{**vars(options), 'random': 60}))
    assert {case.ground for case in many} == set(ROUGHNESS)
    assert len({case.seed for case in many}) == 60 and all(case.seed for case in many)


def test_a_stop_is_tried_in_its_world_with_the_sensors_of_the_robot() -> None:
    suite, case = suite_of(None), StopCase('trot', 0.5, 0.0, ground='blocks', roughness=0.03)
    drawn = replace(case, seed=7).robot(suite)
    assert drawn.world == Blocks(height=0.03, seed=7)
    assert replace(case, ground='slope', roughness=-4.0).robot(suite).world == Slope(degrees=-4.0)
    exact, *measured = (replace(case, seed=seed).robot(suite).reset().joint_position
                        for seed in (0, 7, 7, 8))
    assert (measured[0] == measured[1]).all() and (measured[0] != measured[2]).all()
    assert (exact.reshape(4, 3) == exact[:3]).all() and (measured[0] != exact).all()


@pytest.mark.parametrize('case', [
    StopCase('amble', 0.148, 0.614, push=1.79, direction=3.96, friction=0.63, ground='blocks',
             roughness=0.038, seed=1579371119),
    StopCase('amble', 0.817, 0.052, push=0.23, direction=5.45, friction=0.48, ground='slope',
             roughness=7.6, seed=1464939176)])
def test_no_foot_is_left_hanging_by_a_stop_on_uneven_ground(case: StopCase) -> None:
    """Feet that searched for the ground at rest left it whenever they found it, for ever."""
    case = replace(case, leg='auto', braking=4.0, resumes=False)
    _, outcome = run_cases([case], None, Workers(1))[0]
    assert outcome.standing and outcome.still_s < 1.0 and outcome.tilt < 0.15


@pytest.mark.parametrize(('gait', 'speed'), [('amble', 0.5), ('walk', 0.4), ('trot', 0.5),
                                             ('pronk', 0.3)])
def test_a_body_stands_when_it_was_told_to(gait: str, speed: float) -> None:
    """Some swing back over their feet and take longer: ambles by themselves, all when fast."""
    cases = [StopCase(gait, speed, phase, resumes=False) for phase in (0.1, 0.6)]
    for of in run_walk(cases, None):
        assert of.standing and of.stands_s == pytest.approx(of.still_s, rel=0.1)


@pytest.mark.parametrize(('seed', 'speed'), [(102, 0.24), (104, 0.43)])
def test_the_body_of_a_robot_of_any_size_stands_when_it_was_told_to(
        seed: int, speed: float, tmp_path: Path) -> None:
    """0.15 and 0.47 m high: the times of one of 0.28 m are too long and too short by more."""
    file = tmp_path / 'suite.yaml'
    file.write_text(f"/**: {{ros__parameters: {{robot: '{robot_file(seed, tmp_path)}'}}}}\n")
    cases = [StopCase('amble', speed, phase, resumes=False) for phase in (0.0, 0.5)]
    for of in run_walk(cases, str(file)):
        assert of.standing and of.stands_s == pytest.approx(of.still_s, rel=0.1)


@pytest.mark.parametrize(('gait', 'speed', 'phases'), [
    ('amble', 0.5, (0.125, 0.375)), ('amble', 1.0, (0.3125, 0.5625)),
    ('amble', -0.5, (0.125, 0.375)), ('trot', 1.0, (0.0, 0.25))])
def test_a_body_that_brakes_stands_when_it_was_told_to(
        gait: str, speed: float, phases: tuple[float, float]) -> None:
    """It stands soon after its reference, or after the last foot, but ahead for a hind foot alone:
    with one time from the last foot on an amble stood up to 36 % earlier than was told.
    """
    cases = [StopCase(gait, speed, phase, leg='auto', braking=3.8, resumes=False)
             for phase in phases]
    for of in run_walk(cases, None):
        assert of.standing and of.stands_s == pytest.approx(of.still_s, rel=0.1)


def slower(folder: Path) -> str:
    """A parameter file with fewer ticks, for what does not depend on how many there are."""
    file = folder / 'slower.yaml'
    file.write_text('/**: {ros__parameters: {control_rate: 100.0}}', encoding='utf-8')
    return str(file)


def test_a_record_is_gone_on_with_and_changes_nothing(tmp_path: Path) -> None:
    cases = random_cases(Namespace(random=2, seed=1, gaits=['trot'], speeds=[0.3], legs=['auto'],
                                   braking=[4.0], no_resume=True))
    record, file = tmp_path / 'record', slower(tmp_path)
    first = run_cases(cases[:1], file, Workers(1), record)
    both = run_cases(cases, file, Workers(1), record)
    assert str(both) == str(run_cases(cases, file, Workers(2))) and str(both[:1]) == str(first)
    lines = record.read_text(encoding='utf-8').splitlines()
    assert len(lines) == 2
    assert not any(outcome.broken for _, outcome in both)
    record.write_text(f'{lines[0]}\n{lines[1][:40]}', encoding='utf-8')  # interrupted
    assert str(run_cases(cases, file, Workers(1), record)) == str(both)
    assert record.read_text(encoding='utf-8').splitlines() == lines
    for others, why in ((cases[1:], 'line 1, is of another stop'), (cases, 'is no recorded stop')):
        with pytest.raises(DataError, match=why):
            run_cases(others, file, Workers(1), record)
        record.write_text('{"fell": false}\n', encoding='utf-8')


@pytest.mark.parametrize(('speed', 'force'), [(0.02, 20.0), (0.0, 1.0)])
def test_it_does_not_stand_when_it_moves_or_a_foot_is_in_the_air(
        speed: float, force: float) -> None:
    assert not body_at_rest(hold(np.full(500, speed), force), ROBOT, 2.0).standing


def test_a_summary_counts_every_case_but_measures_those_that_did_not_fall() -> None:
    good = StopOutcome(False, True, True, predicted_s=1.1, bound_s=2.0, measured_s=1.0)
    late = StopOutcome(False, True, False, predicted_s=1.0, bound_s=0.9, measured_s=1.0)
    of = StopSummary([good, late, StopOutcome(fell=True), StopOutcome(fell=True)])
    assert [of.number(name) for name in ('fell', 'standing', 'walked_on')] == [2, 2, 1]
    assert (of.number('bounded'), of.number('bound_exceeded')) == (2, 1)
    assert of.spread('prediction_error') == pytest.approx((0.05, 0.1))


def test_a_stop_that_never_came_to_rest_exceeds_its_bound() -> None:
    assert StopOutcome(False, bound_s=5.0, measured_s=np.inf).bound_exceeded
    assert not StopOutcome(False, measured_s=1.0).bound_exceeded


def test_the_command_prints_a_row_per_method_and_writes_its_numbers_and_every_case(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from dmp_cpg_ros.studies.study_stops import main, table

    written, printed = [], []
    for jobs in ('1', '2'):
        file, record = tmp_path / f'{jobs}.json', tmp_path / f'{jobs}.jsonl'
        assert main([slower(tmp_path), '--phases', '1', '--speeds', '0.3', '--gaits', 'trot',
                     '--jobs', jobs, '--quiet', '--json', str(file), '--record', str(record)]) == 0
        (line,) = record.read_text(encoding='utf-8').splitlines()
        of = json.loads(line)
        assert of['case']['gait'] == 'trot' and of['outcome']['standing']
        written.append(json.loads(file.read_text(encoding='utf-8')))
        printed.append(capsys.readouterr().out)
    assert written[0] == written[1]
    assert [row['gait'] for row in written[0]] == ['trot', 'all']
    assert all(row['cases'] == row['standing'] == 1 for row in written[0])
    for out in printed:
        assert table(written[0]) in out
        rows = [line for line in out.splitlines() if line.startswith('| trot')]
        assert len(rows) == 2 and 'inhibition' in rows[0] and rows[1].count('|') == 10


def test_how_many_walked_on_is_not_counted_where_none_was_to() -> None:
    from dmp_cpg_ros.studies.study_stops import summarised, table

    ended = StopCase('trot', 0.5, 0.0, resumes=False)
    rows = summarised([(ended, StopOutcome(False, True))])
    assert [row['walked_on'] for row in rows] == [None, None]
    assert '%' not in table(rows).splitlines()[2].split('|')[10]


def test_the_numbers_of_a_row_are_those_of_its_stops_through_their_file() -> None:
    from dmp_cpg_ros.analysis.strict_json import to_json
    from dmp_cpg_ros.studies.study_stops import summarised, table

    case = StopCase('trot', 0.5, 0.0)
    frozen = replace(case, method='freeze')
    rests = [StopOutcome(False, True, True, predicted_s=1.0, bound_s=2.0, measured_s=measured,
                         body_rest_s=rest, slip_m=0.002)
             for measured, rest in ((1.0, 0.5), (1.25, 0.7), (2.5, 0.9))]
    rows = summarised([*((case, one) for one in rests), (frozen, StopOutcome(fell=True))])
    assert [(row['gait'], row['method'], row['cases'], row['fell']) for row in rows] == [
        ('trot', 'inhibition', 3, 0), ('trot', 'freeze', 1, 1),
        ('all', 'inhibition', 3, 0), ('all', 'freeze', 1, 1)]
    first, second = rows[:2]
    assert first['bound_exceeded'] == 1 and first['measured_s'] == (1.25, 2.5)
    assert first['prediction_error'] == pytest.approx((0.2, 0.6))
    again = json.loads(to_json(rows))
    assert table(again) == table(rows)
    cells = [cell.strip() for cell in table(again).splitlines()[2].strip('|').split('|')]
    assert cells[:12] == ['trot', '0.5', 'fl', '1', '0', 'inhibition', '3', '0', '100 %', '100 %',
                          '20.0 / 60.0', '1/3']
    assert '0.70 / 0.90' in cells and '2.0 / 2.0' in cells
    assert again[1]['slip_m'] == [None, None] and np.isnan(second['slip_m']).all()
    assert [cell.strip() for cell in table(again).splitlines()[3].strip('|').split('|')][
        9:12] == ['-', '-', '-']


def test_what_was_told_of_the_body_is_counted_of_the_stops_that_it_holds_for() -> None:
    from dmp_cpg_ros.studies.study_stops import table_of_told

    case = StopCase('trot', 0.5, 0.0, leg='auto', braking=3.0)
    told = StopOutcome(False, True, stands_s=1.0, within_s=1.5)
    outcomes = [replace(told, still_s=still) for still in (0.9, 0.86, 1.2, 1.6)]
    none = [(case, StopOutcome(True, stands_s=1.0)), (case, StopOutcome(False)),
            (case, replace(told, still_s=3.0, stepped=True)),
            (replace(case, method='freeze'), replace(told, still_s=0.2))]
    rows = table_of_told([*((case, one) for one in outcomes), *none]).splitlines()
    cells = [[cell.strip() for cell in row.strip('|').split('|')] for row in rows]
    assert cells[0] == ['gait', 'leg', 'cadence', 'braking', 'stops', 'within 10 %', 'within 15 %',
                        'earlier s', 'over bound']
    assert cells[2] == ['trot', 'auto', '1', '3', '4', '25 %', '50 %', '-0.60 / -0.05 / 0.14',
                        '1/4']
    assert len(cells) == 4 and cells[3] == ['all', '', '', '', *cells[2][4:]]


@pytest.mark.parametrize('arguments', [['--gaits', 'gallop'], ['--phases', '0'], ['none.yaml']])
def test_bad_arguments_end_with_status_2_and_a_reason(
        arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    from dmp_cpg_ros.studies.study_stops import main

    assert main(arguments) == 2
    assert 'study_stops: ' in capsys.readouterr().err
