# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of faults: what it does with a walk that goes wrong."""

from __future__ import annotations

import random
from math import inf
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dmp_cpg_ros.studies import study_faults
from dmp_cpg_ros.suite import load_gaits


class Refused(study_faults.WalkProcess):
    """A walk that says why it does not walk, and does not end by itself."""

    ended = 0

    def __init__(self, _: object) -> None:
        self.lines = ['walk: a suite is already running\n']

    def said(self, pattern: str, begin: int = 0) -> float:
        """Nothing."""
        return inf

    def end(self) -> int:
        """End it."""
        Refused.ended += 1
        return 137


def test_a_walk_that_never_walks_ends_the_study_with_what_it_says(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
        ) -> None:
    """Sixteen walks that were refused were told as a table without a kill and without a fall."""
    monkeypatch.setattr(study_faults, 'WalkProcess', Refused)
    written = tmp_path / 'kills.json'
    assert study_faults.main(['--rounds', '2', '--json', str(written)]) == 2
    assert Refused.ended == 1 and not written.exists()
    told = capsys.readouterr()
    assert 'does not walk: walk: a suite is already running' in told.err
    assert '| gait' not in told.out


def recording(gait: str, off_s: tuple[float, float], slow_s: tuple[float, float],
              fell: bool) -> SimpleNamespace:
    """Ten seconds of a walk with a period of 0.5 s: a leg is out of phase and the body slow from
    a moment to another one, and in the end it lies on its side.
    """
    time = np.arange(0.0, 10.0, 0.004)
    phases = 4.0 * np.pi * time[:, None] + load_gaits()[gait].phases
    phases[:, 2] += 1.0 * ((time >= off_s[0]) & (time < off_s[1]))
    speed = np.where((time >= slow_s[0]) & (time < slow_s[1]), 0.1, 0.5)
    side = 0.5 * np.pi * fell * (time > 9.5)
    zero = np.zeros_like(time)
    return SimpleNamespace(
        canonical=SimpleNamespace(
            time=time, x=0.8 * np.stack((np.cos(phases), -np.sin(phases)), axis=2)),
        odometry=SimpleNamespace(
            time=time, velocity_in_base=np.stack((speed, zero, zero), axis=1),
            quaternion=np.stack((np.sin(0.5 * side), zero, zero, np.cos(0.5 * side)), axis=1),
            position_in_world=np.stack((zero, zero, zero + 0.3), axis=1)))


@pytest.mark.parametrize('fell', [False, True])
def test_phase_and_speed_are_told_apart_and_a_fall_is_seen(
        monkeypatch: pytest.MonkeyPatch, tmp_path: Path, fell: bool) -> None:
    monkeypatch.setattr(study_faults, 'load_recording', lambda _: recording(
        'amble', (2.0, 3.5), (2.0, 4.5), fell))
    kills = [study_faults.Kill('inhibition', 2.0, back_s=3.0, follows_s=3.2),
             study_faults.Kill('posture_control', 6.0, back_s=6.5, follows_s=7.0),
             study_faults.Kill('reference_filter', 6.8, back_s=7.0)]
    outcome = study_faults.Outcome('amble', False, True, 0, kills=kills)
    study_faults._judge(outcome, 0.5, tmp_path)
    assert (outcome.fell, outcome.end) == (fell, 'fallen' if fell else 'standing')
    first, forestalled, last = kills
    assert first.period_s == pytest.approx(0.5, rel=0.01)
    assert first.in_phase_s == pytest.approx(3.5, abs=0.01)
    assert first.as_fast_s == pytest.approx(4.5, abs=0.01)
    assert first.cycles(first.in_phase_s) == pytest.approx(1.0, abs=0.05)
    assert forestalled.in_phase_s == inf  # before the robot followed, the next one was killed
    assert last.in_phase_s == pytest.approx(7.0, abs=0.01)
    (row,) = study_faults.rows([outcome])
    assert row[:8] == ['amble', 'real', 'yes', '1', '3', str(int(fell)), 'unknown', '2 of 3']


def test_who_turns_in_phase_for_a_moment_only_is_not_in_phase_again(
        monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(study_faults, 'load_recording', lambda _: recording(
        'amble', (4.0, 5.0), (4.0, 5.0), False))
    kills = [study_faults.Kill('canonical_oscillators', 3.0, back_s=3.2),
             study_faults.Kill('inhibition', 8.0, back_s=8.5)]
    outcome = study_faults.Outcome('amble', False, True, 0, kills=kills)
    study_faults._judge(outcome, 0.5, tmp_path)
    assert kills[0].in_phase_s == pytest.approx(5.0, abs=0.01)  # and not 3.2
    assert kills[0].cycles(kills[0].in_phase_s) == pytest.approx(3.6, abs=0.1)
    assert kills[1].in_phase_s == pytest.approx(8.5, abs=0.01)  # as far as is known


class Told:
    """A walk of which a robot came to a stand by itself after its first death."""

    process = None
    lines = ['   1.00 s  walking\n', '   3.00 s  inhibition was ended by signal 9\n',
             '   3.20 s  all nodes are ready again\n', '   3.90 s  the robot looks after itself\n']
    deaths = iter((3.0, 8.0))

    def said(self, pattern: str, begin: int = 0) -> float:
        """Whatever is waited for comes."""
        return next(self.deaths) if 'was ended' in pattern else 1.0

    def told(self, pattern: str, begin: int = 0) -> list[float]:
        """Times of the stands."""
        return [3.9] if pattern == study_faults.STANDS else []

    def pid_of(self, nodes: list[str]) -> int:
        """A process that is not signalled."""
        return 1

    def walks(self) -> bool:
        """It does."""
        return True

    def end(self) -> int:
        """End it."""
        return 130


def test_a_stand_is_told_with_the_death_before_it(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_faults.WalkProcess, 'of', lambda *_, **__: Told())
    for name in ('os.kill', 'time.sleep'):
        monkeypatch.setattr(f'{study_faults.__name__}.{name}', lambda *_: None)
    monkeypatch.setattr(study_faults, '_judge', lambda *_: None)
    outcome = study_faults.run('amble', 0.5, False, True, ['inhibition', 'reference_filter'],
                               random.Random(0), tmp_path)
    assert [kill.stood for kill in outcome.kills] == [True, False]
    (row,) = study_faults.rows([outcome])
    assert row[6] == '1 of 2'


def test_each_node_has_its_turn_also_where_a_walk_ends_with_a_death(
        monkeypatch: pytest.MonkeyPatch) -> None:
    killed: list[tuple[str, str]] = []

    def run(gait: str, speed: float, lock_step: bool, respawn: bool, nodes: list[str],
            *_: object) -> study_faults.Outcome:
        killed.extend((gait, node) for node in nodes)
        return study_faults.Outcome(gait, lock_step, respawn)

    monkeypatch.setattr(study_faults, 'run', run)
    rounds = str(len(study_faults.VICTIMS))
    study_faults.main(['--rounds', rounds, '--respawn', 'no', '--lock-step', 'no'])
    assert sorted(killed) == sorted(
        (gait, node) for gait, _ in study_faults.WALKS for node in study_faults.VICTIMS)
