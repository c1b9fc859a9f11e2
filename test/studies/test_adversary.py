# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The search for a wrong certificate finds one where an inequality is left out, and none else."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from core_examples import quadruped

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.studies import adversary, adversary_networks, adversary_rows
from dmp_cpg_ros.studies.adversary import FOLLOWING, WEAKENED, main, search
from dmp_cpg_ros.studies.adversary_suite import play, smaller
from dmp_cpg_ros.studies.draws import Case
from dmp_cpg_ros.studies.oscillator_loop import CONDITIONS, Oscillators

ROBOT = quadruped()


def case(parameters: dict[str, object], *events: tuple[float, str, object]) -> Case:
    return {'gait': 'amble', 'tick_s': 0.004, 'events': [list(event) for event in events],
            'parameters': {'auto_inhibit': False, **parameters}}


WITHIN_A_START = case(
    {'coupling_graph': 'star', 'coupling_gain': 14.0, 'inhibited_legs': ('fl', 'rr')},
    (0.5, 'start', None), (0.012, 'stop', None), (8.0, 'start', None), (0.02, 'stop', None))
LOWERED_LIMIT = case({}, (0.1, 'start', None), (0.0, 'command', [3.0, 0.0, 0.0]),
                     (4.0, 'set', {'max_speed': 0.05, 'max_lateral_speed': 0.0,
                                   'max_turn_rate': 0.0}), (0.004, 'stop', None))
CADENCE = case(
    {'cadence_scale': 0.7, 'alpha_r': 6.0, 'max_speed': 1.0, 'inhibition_gain': 1200.0},
    (0.1, 'start', None), (3.0, 'set', {'cadence_scale': 4.0}), (0.1, 'stop', None))
AT_REST = case({'coupling_gain': 25.0}, (1.0, 'set', {'inhibited_legs': ('rr',)}),
               (3.0, 'start', None))
AHEAD = case({'alpha_r': 6.0}, (0.0, 'command', [1.5, 0.0, 0.0]), (3.0, 'start', None),
             (2.108, 'stop', None)) | {'lead_s': 0.2}
BROKEN = {'places': WITHIN_A_START, 'arming': LOWERED_LIMIT, 'acting': CADENCE, 'holding': AT_REST,
          'leads': AHEAD, 'way': AHEAD}


def test_legs_that_are_caught_when_a_stop_acts_later_are_not_let_go_again() -> None:
    """Armed before it acted, inhibition was disarmed by a command that still sped the gait up."""
    again = case({'capture_speed': 0.35058810846950283, 'braking': 0.7106366915303948,
                  'coupling_graph': 'directed_ring', 'inhibited_legs': ('auto',)},
                 (0.0, 'command', [1.65, 0.0, 0.0]), (0.1, 'stop', None), (0.02, 'start', None),
                 (0.024, 'command', [2.47, 0.0, -0.37]), (0.068, 'stop', None),
                 (0.44, 'start', None), (0.084, 'stop', None))
    del again['parameters']['auto_inhibit']
    assert play(ROBOT, again | {'gait': 'walk', 'lead_s': 0.021173596})[0] == ''


def test_a_start_that_is_taken_back_before_it_acts_lets_no_leg_go() -> None:
    """Start and stop in one tick, while legs are held: they were free for a tick, a lead later."""
    again = case({'inhibited_legs': ('fl', 'rl', 'fr', 'rr')}, (2.0, 'start', None),
                 (0.0, 'stop', None), (0.2862832348595192, 'start', None))
    del again['parameters']['auto_inhibit']
    assert play(ROBOT, again | {'gait': 'bound', 'lead_s': 0.024})[0] == ''


def test_a_stop_for_which_radii_come_back_slowly_is_waited_for() -> None:
    """It takes 12.4 s, and nothing less was said of it."""
    slow = case({'rho': 0.6644286738287836, 'radius': 0.4388268297057373,
                 'coupling_graph': 'path'},
                (0.1009963132184722, 'start', None),
                (1.025940213398221, 'command', [2.466819375854105, 0.0, 0.4059379119460065]),
                (0.06359551096290893, 'gait', 'pronk'),
                (1.1471430028479475, 'command', [1.3143767099557304, 0.0, 0.43256479351503674]),
                (2.4383223817649085, 'start', None), (2.0, 'stop', None), (2.0, 'start', None))
    del slow['parameters']['auto_inhibit']
    assert play(ROBOT, slow)[0] == ''


@pytest.mark.parametrize('change', [
    ('gait', 'bound'), ('set', {'cadence_scale': 2.0}), ('set', {'rho': 12.0}),
    ('set', {'region_radius': 0.1})], ids=str)
@pytest.mark.parametrize('wait_s', [0.3, 3.0])
@pytest.mark.parametrize('held_by', ['votes', 'service'])
def test_what_is_stopped_stays_so_in_a_change(held_by: str, wait_s: float,
                                              change: tuple[str, object]) -> None:
    stop = ('vote', dict.fromkeys(('fl', 'fr', 'rl'), 1.0)) if held_by == 'votes' else (
        'stop', None)
    held = case({'voting': True, 'silence_weight': 0.0}, (0.1, 'start', None), (1.0, *stop),
                (wait_s, *change), (2.5, 'start', None))
    assert play(ROBOT, held)[0] == ''


def test_a_gait_that_no_service_can_stop_takes_changes() -> None:
    free = Oscillators(ROBOT, case({'inhibition_gain': 0.0}))
    assert free.change({'cadence_scale': 0.9}) == ''


@pytest.mark.parametrize('weaken', CONDITIONS)
def test_a_condition_that_is_left_out_is_noticed(weaken: str) -> None:
    assert Oscillators(ROBOT, BROKEN[weaken]).certified()
    assert play(ROBOT, BROKEN[weaken])[0] == ''
    assert play(ROBOT, BROKEN[weaken], weaken)[0]


EARLY = {'region_per_tick': 1, 'frequency_mismatch': 4, 'late_inhibition': 0}
"""Seeds with which what is left out of a row or an inequality is noticed among the first draws."""


@pytest.mark.parametrize('weaken', adversary_networks.WEAKENED)
def test_an_inequality_that_is_weakened_is_noticed(weaken: str) -> None:
    rng = np.random.default_rng(EARLY.get(weaken, 6))
    counts = itertools.chain([25], itertools.repeat(100))  # most are noticed among a few
    draws = itertools.islice(zip(itertools.cycle((2, 4, 3, 2, 5)), counts, strict=False), 40)
    found = (adversary_networks.attack(rng, *draw, weaken)[1] for draw in draws)
    failure = next(one for one in found if one)[0]
    case = {key: value for key, value in failure.items() if key not in ('attack', 'happened')}
    assert adversary_networks.happened(case, weaken) == failure['happened']


def test_every_row_can_be_left_out_or_follows_from_others() -> None:
    suite = Oscillators(ROBOT, case({'voting': True, 'contact_feedback': True}))
    rows = {row.name for row in suite.in_force().certificate(whole=True).inequalities}
    assert rows - set(WEAKENED) == set(FOLLOWING)
    assert set(WEAKENED) - rows == set(CONDITIONS)


@pytest.mark.parametrize('row', adversary_rows.ROWS)
def test_a_row_that_is_left_out_is_noticed(row: str) -> None:
    rng = np.random.default_rng(EARLY.get(row, 1))
    met = (adversary_rows.attack(rng, ROBOT, row, True)[1] for _ in range(90))
    failure = next(one for one in met if one)[0]
    drawn = {name: value for name, value in failure.items() if name not in ('attack', 'happened')}
    assert adversary_rows.judged(ROBOT, row, drawn, True)[0] == failure['happened']
    honest = adversary_rows.judged(ROBOT, row, drawn, False)
    assert honest is None or not honest[0] or row in TAKEN_FOR_MORE


TAKEN_FOR_MORE = ('capture_anywhere', 'step_capture', 'late_inhibition', 'held_coupling',
                  'carried_coupling')
"""Rows of which the case itself says by how much they are exceeded."""


@pytest.mark.parametrize('row', adversary_rows.ROWS)
def test_no_row_that_holds_is_refuted(row: str) -> None:
    rng, tried = np.random.default_rng(2), 0
    for _ in range(5):
        ran, failures = adversary_rows.attack(rng, ROBOT, row, False)
        assert failures == []
        tried += ran
        if tried >= 3:  # some draws do not apply
            break
    assert tried > 0


def test_a_refuted_row_is_told_with_round_numbers() -> None:
    _, (failure,) = search(1, 60.0, 'transformation', 1)
    assert failure['attack'] == 'transformation' and 'times the bound' in failure['happened']
    assert all(failure[name] == float(f'{failure[name]:.1e}') for name in ('stiffness', 'damping'))


@pytest.mark.parametrize('size', [2, 3, 4, 7, 12])
def test_no_certified_network_fails(size: int) -> None:
    certified, failures = adversary_networks.attack(np.random.default_rng(size), size, 25)
    assert certified > 3 and failures == []


def test_a_failure_is_made_smaller() -> None:
    whole = case({'rho': 7.0}, (0.1, 'start', None), (1.0, 'stop', None), (0.5, 'start', None))

    def fails(one: Case) -> bool:
        return sum(event[1] == 'start' for event in one['events']) >= 1

    small = smaller(whole, fails)
    assert len(small['events']) == 1 and small['parameters'] == {}


def test_the_command_counts_what_it_tried(capsys: pytest.CaptureFixture[str],
                                          monkeypatch: pytest.MonkeyPatch) -> None:
    attack = adversary_networks.attack
    monkeypatch.setattr(adversary, 'SHRINK_S', 1.0)
    monkeypatch.setattr(adversary_networks, 'attack',        # 25 networks at once are enough
                        lambda rng, size, count, *more: attack(rng, size, count // 10, *more))
    monkeypatch.setattr(Progress, 'SILENT_S', 0.0)
    assert main(['--seconds', '60', '--weaken', 'capture', '--failures', '1']) == 1
    told, aside = capsys.readouterr()
    assert re.match(r'search 0: \d+ networks, \d+ suites, \d failures\n', aside), aside
    assert told.startswith('| 0 | 1 x 60 s | capture |') and 'happened: leaves C' in told


def test_a_record_that_is_not_there_is_told_before_the_search(
        tmp_path: Path, capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adversary, 'search', lambda *_: pytest.fail('searched'))
    assert main(['--record', str(tmp_path / 'none.md')]) == 2
    assert 'none.md' in capsys.readouterr().err


@pytest.mark.parametrize('kind', ['leave', 'forget'])
@pytest.mark.parametrize('wait', [0.0, 0.012, 0.1])
def test_who_is_started_again_within_a_lead_carries_out_what_was_told(
        kind: str, wait: float) -> None:
    told = case({}, (0.1, 'start', None), (0.0, 'command', [1.0, 0.0, 0.0]), (2.0, 'stop', None),
                (wait, kind, None), (0.008, 'take_over', None), (0.0, 'command', [2.0, 0.0, 0.0])
                ) | {'lead_s': 0.06}
    assert play(ROBOT, told)[0] == ''
    loop = Oscillators(ROBOT, told)
    loop.request(False)
    for _ in range(500):
        loop.advance()
    loop.request(True)
    loop.leave()
    loop.advance()
    loop.take_over()
    assert loop.stop.requested and loop.acting.requested
