# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands of the README's table of studies, run as they stand there.

They take hours, for robots walk. Here every case ends at once, as the file of the study says that
it ended: the command has to ask for the cases of its file, for no others, and in their order, and
writes that file anew. That the cases themselves run is in the other tests of this folder.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable, Iterable, Iterator
from dataclasses import is_dataclass
from functools import partial
from math import nan
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import headlines_of_faults
from checkout import PACKAGE, ROOT
from headlines import content, table_of_studies

from dmp_cpg_ros.studies import (
    benchmark_walking,
    random_commands,
    study_faults,
    study_recovery,
    workers,
)
from dmp_cpg_ros.studies.walking_trials import SteadyOutcome

HERE: dict[str, Callable[[list[str]], int]] = {
    'benchmark_walking': benchmark_walking.main, 'random_commands': random_commands.main,
    'study_recovery': study_recovery.main}
"""Studies whose files have every case with its outcome."""

MAKEFILE = (ROOT / 'Makefile').read_text(encoding='utf-8')

ELSEWHERE = {
    'study_faults': 'studies/test_readme_commands.py',
    'study_stops': 'studies/test_study_stops.py',
    'tightness': 'core/contraction/test_contraction_tightness.py',
    'certified_grid': 'core/certificates/test_certificate_grid.py',
    'intruder': 'suite/test_intruder.py', 'duel': 'studies/test_learned_policy.py',
    'bench_ros': 'studies/test_bench_ros.py', 'walk': 'project/test_shell_blocks.py'}
"""Where the others are run, with less to do."""


def commands(anchor: str) -> Iterator[list[str]]:
    """Words of the commands of a row: the study's name and its arguments, as make passes them."""
    for command in re.findall(r'`([^`]+)`', table_of_studies()[anchor][2]):
        words = shlex.split(command)
        if words[0] == 'make':
            (line,) = re.findall(rf'^{words[1]}:.*\n\t(.*)$', MAKEFILE, re.MULTILINE)
            for variable, _, value in (word.partition('=') for word in words[2:]):
                line = line.replace(f'$({variable})', value)
            words = shlex.split(re.sub(r'\$\(\w+\)', '', line))
        if words[0].endswith('python'):
            words = [words[2].removeprefix(f'{PACKAGE}.studies.'), *words[3:]]
        yield words


ROWS = {anchor: words for anchor in table_of_studies() for words in commands(anchor)
        if words[0] in HERE}


def test_every_command_of_the_table_is_run_in_a_test() -> None:
    named = {words[0] for anchor in table_of_studies() for words in commands(anchor)}
    assert named == {*HERE, *ELSEWHERE}
    for name, file in ELSEWHERE.items():
        text = (ROOT / 'test' / file).read_text(encoding='utf-8')
        assert re.search(rf"\b{name}('|\.main\(| import .*\bmain\b)", text), (name, file)


class Ended:
    """Workers whose cases have ended before, by what a study has written."""

    def __init__(self, written: Any) -> None:
        self._outcomes: dict[str, list[Any]] = {}
        for one in self._listed(written):
            self._outcomes.setdefault(json.dumps(one[0]), []).append(one[1])

    @staticmethod
    def _listed(written: Any) -> Iterator[tuple[Any, Any]]:
        lists = written.values() if isinstance(written, dict) else [written]
        for one in (one for of in lists for one in of):
            yield (one['case'], one['outcome']) if 'case' in one else (one['seed'], one)

    def map(self, trial: Callable[..., Any], cases: Iterable[Any]) -> Iterator[Any]:
        """Outcomes of cases, in order, of the kind that the trial returns."""
        assert isinstance(trial, partial)
        inner = trial.args[0] if trial.args and callable(trial.args[0]) else trial.func
        kind = get_type_hints(inner)['return']
        for case in cases:
            outcomes = self._outcomes.pop(json.dumps(case))
            if get_args(kind) and is_dataclass(get_args(kind)[0]):  # all changes from one gait
                yield [made(get_args(kind)[0], of) for of in outcomes]
            else:
                (of,) = outcomes
                yield made(kind, of)


def made(kind: Any, written: dict[str, Any]) -> Any:
    """An outcome from its file, which has null for what is no number."""
    values = {name: nan if value is None else value for name, value in written.items()}
    if is_dataclass(kind):
        return kind(**values)
    if [*values] == ['speed_change']:
        return values['speed_change']
    return {name: made(SteadyOutcome, of) if isinstance(of, dict) else of
            for name, of in values.items()}


@pytest.mark.parametrize('anchor', ROWS)
def test_a_command_asks_for_the_cases_of_its_file(
        anchor: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (name, *arguments), written = ROWS[anchor], content(anchor)
    ended = Ended(written)
    monkeypatch.setattr(workers.Workers, 'map', lambda _, *asked: ended.map(*asked))
    monkeypatch.setattr(benchmark_walking, 'is_there', lambda _: True)
    monkeypatch.setattr(study_recovery, 'up_and_down', lambda _: (True, True))
    file = tmp_path / 'written.json'
    assert HERE[name]([*arguments, '--json', str(file)]) == 0
    found = json.loads(file.read_text(encoding='utf-8'))
    if isinstance(written, list):  # an outcome may tell more today than it did
        found = [{name: one[name] for name in of}
                 for one, of in zip(found, written, strict=True)]
    assert found == written


def test_kills_of_a_study_are_written_as_they_ended(
        monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    """Of ``study_faults``, whose file has several runs of it."""
    (words,) = (words for words in commands('hostile-neighbours') if words[0] == 'study_faults')
    outcomes = list(map(headlines_of_faults.outcome, content('killed-nodes')))
    asked: list[tuple[str, bool]] = []
    fell: list[bool] = []

    def run(gait: str, speed: float, lock_step: bool, respawn: bool, *_: Any
            ) -> study_faults.Outcome:
        asked.append((gait, lock_step))
        found = next(of for of in outcomes if of.gait == gait and of.lock_step == lock_step)
        fell.append(found.fell)
        return found

    monkeypatch.setattr(study_faults, 'run', run)
    file = tmp_path / 'written.json'
    status = study_faults.main([
        *words[1:], '--rounds', '1', '--respawn', 'yes', '--json', str(file)])
    assert status == any(fell)
    assert asked == [(gait, how) for how in (True, False) for gait, _ in study_faults.WALKS]
    assert [(one['gait'], one['lock_step']) for one in json.loads(
        file.read_text(encoding='utf-8'))] == asked
    assert study_faults.COLUMNS[0] in capsys.readouterr().out
