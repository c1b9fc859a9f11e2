# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of random requests: one short sequence with real nodes, and what its judge finds."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import ros_processes
from synthetic_walk import robot

from dmp_cpg_ros.analysis.recording import (
    CanonicalSeries,
    JointSeries,
    OdometrySeries,
    Recording,
    StatusEvent,
    VelocitySeries,
)
from dmp_cpg_ros.core.scenario.scenario import Event
from dmp_cpg_ros.core.suite_parameters import CANONICAL, INHIBITION
from dmp_cpg_ros.studies import random_requests, request_walks
from dmp_cpg_ros.studies.draws import smallest
from dmp_cpg_ros.studies.request_draws import drawn, ending, may_lie
from dmp_cpg_ros.studies.request_player import ASKED, Answer
from dmp_cpg_ros.studies.request_walks import Judge, Walked, scenario_of
from dmp_cpg_ros.suite_table import RECORDER, ROBOT, WALKING_NODES

ros_domain = ros_processes.ros_domain

TICK_S, STOP_S, REST_S = 0.004, 8.0, 9.0

KINDS = {'command', 'twist', 'inhibit', 'stand_up', 'lie_down', 'recover', 'set', 'gait',
         'parameters', 'cycle', 'transition', 'push', 'fail', 'at_once', 'votes', 'shut_down',
         'interrupt'}


def test_all_kinds_are_drawn_and_the_same_seed_draws_the_same() -> None:
    found = set()
    for seed in range(40):
        case = drawn(seed, 'robots/mini_quadruped.yaml', 12.0)
        assert json.dumps(case) == json.dumps(drawn(seed, case['robot'], 12.0))
        scenario = scenario_of(case)
        assert [event.at for event in scenario.events] == sorted(
            event.at for event in scenario.events)
        found |= {event.kind for event in scenario.events if isinstance(event, Event)}
    assert found == KINDS


def test_nodes_are_killed_that_may_die_and_not_in_the_tick_of_a_cycle_before_it() -> None:
    killed = set()
    for seed in range(40):
        usual = drawn(seed, 'robots/mini_quadruped.yaml', 12.0)
        case = drawn(seed, usual['robot'], 12.0, kills=3)
        assert json.dumps([event for event in case['events'] if event[1] != 'kill']) == (
            json.dumps(usual['events']))
        kills = [event for event in case['events'] if event[1] == 'kill']
        assert len(kills) == 3 and case['end'][0] != 'shut_down'
        assert case['events'] == sorted(case['events'], key=lambda event: event[0])
        for nodes in (*(nodes for *_, nodes in kills), case['dies']):
            killed.update(nodes)
            assert not {CANONICAL, INHIBITION} <= set(nodes)
        for place, (at, kind, _) in enumerate(case['events']):
            assert kind != 'cycle' or not any(
                time == at and of == 'kill' for time, of, _ in case['events'][:place])
        assert ['kill', case['dies']] in [event[1:] for event in ending(case)]
    assert killed == {*WALKING_NODES} - {ROBOT}


def walked(**changed: Any) -> tuple[Recording, Walked]:
    """A robot that walks at 0.2 m/s, is told to stop, and rests 1 s later as was said."""
    time = np.arange(0.0, 12.0, TICK_S)
    turning = np.minimum(time, REST_S)
    angle = 2.0 * np.pi * 2.0 * turning[:, None] + np.zeros(4)
    still, joints = np.zeros((len(time), 12)), np.where(time < REST_S, 1.0, 0.0)
    recording = Recording(
        joints=JointSeries(time, still, joints[:, None] + still, still),
        targets=JointSeries(time, still, still, still),
        canonical=CanonicalSeries(time, np.stack((np.cos(angle), -np.sin(angle)), axis=2),
                                  np.zeros((len(time), 4, 2))),
        reference=VelocitySeries(time, np.tile((0.2, 0.0, 0.0), (len(time), 1))),
        odometry=OdometrySeries(
            time, np.tile((0.0, 0.0, robot().stance_height), (len(time), 1)),
            np.tile((0.0, 0.0, 0.0, 1.0), (len(time), 1)),
            np.tile((0.2, 0.0, 0.0), (len(time), 1)), np.zeros((len(time), 3))),
        inhibition=tuple(StatusEvent(at, 0, word, {}) for at, word in (
            (0.0, 'walking'), (STOP_S, 'waiting'), (REST_S - TICK_S, 'at_rest'))),
        modes=(StatusEvent(0.0, 0, 'standing', {}),))
    answers = [Answer(round(STOP_S * 1e9), 'inhibit', True, True,
                      'at rest in 1.000 s, at most 1.500 s; certificate holds')]
    return replace(recording, **changed), Walked(answers=answers)


CASE = {'events': [[8.0, 'inhibit', True]], 'end': ['inhibit', True]}


def wrong(case: Any = None, recording: Recording | None = None, said: Walked | None = None
          ) -> list[str]:
    usual, answers = walked()
    return list(Judge(case or CASE, said or answers, recording or usual, robot(), TICK_S).wrong())


def test_nothing_is_wrong_with_a_walk_that_keeps_what_was_said() -> None:
    recording, said = walked()
    assert list(Judge(CASE, said, recording, robot(), TICK_S).wrong()) == []
    assert (said.checked['stops'], said.checked['rests'], said.checked['walks']) == (1, 1, 1)


@pytest.mark.parametrize(('text', 'found'), [
    ('at rest in 0.900 s, at most 1.500 s', 'predicted 0.900 s'),
    ('at rest in 1.000 s, at most 0.950 s', 'bound 0.950 s'),
    ('done; it could not be predicted: ValueError: x', 'not predicted')])
def test_a_stop_at_another_time_than_was_said_is_found(text: str, found: str) -> None:
    said = Walked(answers=[Answer(round(STOP_S * 1e9), 'inhibit', True, True, text)])
    assert any(found in each for each in wrong(said=said))


@pytest.mark.parametrize(('took', 'events'), [(1.0, ()), (1.5, ()), (1.5, (6.7,))])
def test_a_robot_that_rises_in_another_time_than_was_said_is_found(
        took: float, events: tuple[float, ...]) -> None:
    recording, said = walked()
    modes = tuple(StatusEvent(at, 0, word, {}) for at, word in (
        (0.0, 'standing'), (5.0, 'lying'), (6.5, 'rising'), (6.5 - TICK_S + took, 'standing')))
    said.answers.insert(0, Answer(round(6.5e9), 'stand_up', True, True,
                                  'rising, standing in 1.00 s'))
    said.answers[1:1] = [Answer(round(at * 1e9), 'set', {}, True, '') for at in events]
    late = [text for text in wrong(recording=replace(recording, modes=modes), said=said)
            if 'stand_up' in text]
    assert len(late) == (took > 1.0 and not events)


def test_what_is_accepted_after_a_stop_excuses_it() -> None:
    said = Walked(answers=[
        Answer(round(STOP_S * 1e9), 'inhibit', True, True, 'at rest in 0.9 s, at most 1.5 s'),
        Answer(round((STOP_S + 0.5) * 1e9), 'set', {'rho': 9.0}, True, '')])
    assert wrong(said=said) == []


@pytest.mark.parametrize('kind', ASKED)
def test_a_refusal_without_a_reason_is_found(kind: str) -> None:
    said = Walked(answers=[Answer(0, kind, None, False, '')])
    found = [text for text in wrong(said=said) if 'without a reason' in text]
    assert len(found) == (kind != 'transition')  # whose service has no words


def test_falls_motion_and_numbers_are_found() -> None:
    recording, _ = walked()
    body, joints, targets = recording.odometry, recording.joints, recording.targets
    over = body.quaternion.copy()
    over[1000:1200] = (1.0, 0.0, 0.0, 0.0)
    low = np.where(body.time[:, None] > 9.5, 0.3, 1.0) * body.position_in_world
    restless = np.full_like(joints.velocity, 1.0)
    no_number, far = targets.effort.copy(), targets.position.copy()
    no_number[7, 3], far[9, 2] = np.nan, 9.0
    stuck = replace(recording.canonical, x=np.repeat(recording.canonical.x[:1], len(body.time), 0))
    for changed, found in (
            ({'odometry': replace(body, quaternion=over)}, 'fell: tilted'),
            ({'odometry': replace(body, position_in_world=low)}, 'is low'),
            ({'joints': replace(joints, velocity=restless)}, 'a joint moves'),
            ({'targets': replace(targets, effort=no_number)}, 'not finite: target effort'),
            ({'targets': replace(targets, position=far)}, 'beyond its limit: target position'),
            ({'canonical': stuck}, 'oscillators stand still'),
            ({'inhibition': recording.inhibition[:2]}, 'does not rest')):
        assert any(found in text for text in wrong(recording=walked(**changed)[0])), found


def test_a_gait_that_is_not_in_phase_after_a_death_is_found() -> None:
    recording, _ = walked()
    time, x = recording.canonical.time, recording.canonical.x

    def found(canonical: CanonicalSeries) -> list[str]:
        recording, said = walked(canonical=canonical)
        said.answers.insert(0, Answer(round(4e9), 'kill', 'inhibition', True, ''))
        judge = Judge(CASE, said, recording, robot(), TICK_S)
        of_phases = [text for text in judge.wrong() if 'not in phase' in text]
        assert said.checked['in phase'] == 1
        return of_phases

    assert not found(recording.canonical)
    late, still = x.copy(), x.copy()
    late[time > 4.0, 1] *= -1.0
    still[time > 4.0] = x[time <= 4.0][-1]
    for changed in (late, still):
        assert found(replace(recording.canonical, x=changed))


def test_who_is_killed_has_to_be_named() -> None:
    said = Walked(answers=[Answer(0, 'kill', 'inhibition', True, '')])
    named = ['   4.000  inhibition was ended by signal 9 (SIGKILL); it is started again']
    assert not list(request_walks._unnamed(said, named))
    assert list(request_walks._unnamed(said, [])) == [
        'unnamed: inhibition was killed 1 times, and named 0 times']


def test_a_robot_whose_joints_fail_may_lie() -> None:
    case = {**CASE, 'events': [[1.0, 'fail', {'component': 'joint', 'kind': 'off',
                                              'for_s': 0.1}]]}
    recording, _ = walked()
    modes = (*recording.modes, StatusEvent(2.0, 0, 'damped', {}))
    assert may_lie(case) and not may_lie(CASE)
    assert any('damped' in text for text in wrong(recording=walked(modes=modes)[0]))
    assert not any('damped' in text for text in wrong(case, walked(modes=modes)[0]))


def test_the_smallest_sequence_has_what_the_failure_needs() -> None:
    case = {'events': [[0.1 * k, 'set', k] for k in range(40)]}

    def fails(trial: Any) -> bool:
        left = [value for _, _, value in trial['events']]
        return {7, 23} <= set(left)

    found = smallest(case, random_requests.simpler, fails)
    assert [value for _, _, value in found['events']] == [7, 23]


def test_an_inhibition_that_votes_and_dies_ends_the_tick_and_keeps_what_it_says(
        ros_domain: int, tmp_path: Path) -> None:
    """What others have accepted before it died counts for what it says as soon as it is back."""
    events = [[0.2, 'command', {'v_x': 0.3}], [0.2, 'inhibit', False],
              [0.3, 'set', {'alpha_r': 1.5}], [0.9, 'kill', ['inhibition']],
              [0.9, 'inhibit', True]]
    case = {'seed': 1, 'robot': 'robots/mini_quadruped.yaml', 'gait': 'amble',
            'start_pose': 'standing', 'control_rate': ros_processes.SHARED_HZ,
            'stamped_cmd_vel': False, 'voting': True, 'events': events, 'end': ['inhibit', True],
            'dies': ['reference_filter']}
    result = random_requests._walked(case, tmp_path)
    assert result.wrong == []
    assert result.checked['deaths'] == 2 and result.checked['stops'] == 1


def test_real_nodes_are_asked_and_answer(ros_domain: int, tmp_path: Path,
                                         monkeypatch: pytest.MonkeyPatch) -> None:
    events = [
        [0.0, 'inhibit', True], [0.2, 'command', {'v_x': 0.3}], [0.2, 'inhibit', False],
        [0.4, 'twist', [[float('nan'), 0.0, 0.0], [-1, 0]]],
        [0.5, 'cycle', ['inhibition', ['deactivate', 'cleanup', ['gait', 'trot'], 'configure',
                                       ['lie_down', True], 'activate']]],
        [0.5, 'stand_up', True],
        [0.6, 'at_once', [['inhibit', False], ['parameters', ['canonical_oscillators', {
            'rho': 12.0, 'gait': 'nope'}, False]], ['set', {'alpha_r': 2.5}]]],
        [0.7, 'fail', {'component': 'contact', 'kind': 'off', 'for_s': 0.1}],
        [0.8, 'transition', ['mujoco_robot', 99]]]
    case = {'seed': 1, 'robot': 'robots/mini_quadruped.yaml', 'gait': 'amble',
            'start_pose': 'standing', 'control_rate': ros_processes.SHARED_HZ,
            'stamped_cmd_vel': True, 'voting': False, 'events': events,
            'end': ['shut_down', [WALKING_NODES[-2], RECORDER, *WALKING_NODES[:-2],
                                  WALKING_NODES[-1]]]}
    result = random_requests._walked(case, tmp_path)
    assert result.wrong == []
    answered = {(answer.kind, answer.accepted) for answer in result.answers}
    assert {('inhibit', True), ('set', True), ('parameters', False), ('transition', False),
            ('lie_down', True)} <= answered
    assert next(answer.accepted for answer in result.answers if answer.kind == 'inhibit')  # at 0 s
    assert (tmp_path / 'composed_suite.log').is_file()
