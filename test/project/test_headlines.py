# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of the README are those of the files that the commands have written."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from typing import Any

import pytest
from checkout import ROOT, modules, setup_argument, setup_constant
from headlines import (
    BENCHMARK,
    README,
    STOPS,
    STUDIES,
    content,
    headlines,
    missing,
    section,
    table_of_studies,
    tables,
    with_tables,
)
from headlines_of_commands import DEFAULTS, OPTIONS, options_of

from dmp_cpg_ros.configuration import SCENARIOS, find_config
from dmp_cpg_ros.robot.model_loader import LONGEST_PHYSICS_STEP
from dmp_cpg_ros.strict_yaml import load_yaml

ROWS = table_of_studies()
NUMBER = r'\d+(?:,\d{3})*(?:\.\d+)?'


def numbers(text: str) -> list[str]:
    return [number.replace(',', '') for number in re.findall(NUMBER, text)]


def told(text: str) -> set[str]:
    """Numbers of a text, what they are when they are rounded, and the sums of its tables' columns.
    """
    found = numbers(text)
    for table in tables(text):
        for name in table[0]:
            cells = [row.get(name, '').replace(',', '') for row in table]
            if all(map(str.isdigit, cells)):
                found.append(str(sum(map(int, cells))))
    return {*found, *(f'{float(number):.{digits}f}' for number in found for digits in (0, 1))}


def test_headlines_are_what_their_files_say() -> None:
    found = headlines()
    assert found == {anchor: ROWS[anchor][1] for anchor in found}


def test_the_tables_of_stops_are_what_their_files_say() -> None:
    text = STOPS.read_text(encoding='utf-8')
    assert with_tables(text) == text
    wrong = re.sub(r' 0 \| 100 % ', ' 1 | 100 % ', text, count=1)
    assert wrong != text and with_tables(wrong) == text


def test_every_headline_is_of_a_file() -> None:
    assert ROWS.keys() == headlines().keys()


@pytest.mark.parametrize('study', STUDIES)
def test_the_table_of_a_study_is_what_its_file_says(study: str) -> None:
    assert missing(study) == []


def test_falls_are_counted() -> None:
    fallen = [{'stands': False, 'tries': 2, 'seconds': 30.0, 'reason': 'gave up'}]
    results = {robot: of + fallen for robot, of in content('falls').items()}
    assert STUDIES['falls'].rows(results)[0].startswith('50 of 51 falls recovered to standing, ')
    results = content('changes-of-gait')
    fell = {'fell': True, 'duration': None, 'phase_error': None}
    results['gaits'][0]['outcome'] |= fell
    assert '60 changes: 1 fall, ' in STUDIES['changes-of-gait'].rows(results)[0]


def test_falls_by_pushes_and_of_strange_robots_are_told() -> None:
    def told_of(anchor: str, results: Any) -> str:
        headline = STUDIES[anchor].headline
        assert headline is not None
        return headline(results)

    results = content('what-the-controllers-do-not-know')
    results['mismatch'][0]['outcome']['fell'] = True
    assert ' walks, 1 fall, ' in told_of('what-the-controllers-do-not-know', results)
    results = content('pushes')
    results['pushes'][0]['outcome']['speed_change'][3] = 0.4
    assert 'amble 0.5 m/s: 0.4 m/s (3.6 N s)' in told_of('pushes', results)
    rows = content('no-certified-setting-fails')
    rows[0]['stop'] -= 2
    assert told_of('no-certified-setting-fails', rows).endswith('; 2 of them fail in simulation')
    results = content('other-robots')
    results['robots'][-1]['outcome']['stop_falls'] = 2
    assert told_of('other-robots', results).endswith('2 falls in stops')


def test_what_was_asked_for_is_that_of_the_cases() -> None:
    def told_of(anchor: str, change: Callable[[Any], None]) -> str:
        results, headline = content(anchor), STUDIES[anchor].headline
        change(results)
        assert headline is not None
        return headline(results)

    def higher(results: Any) -> None:
        for one in next(iter(results.values())):
            one['case']['numbers'] = {name: 2 * number if name == 'height' else number
                                      for name, number in one['case']['numbers'].items()}

    def weaker(results: Any) -> None:
        for one in results['mismatch']:
            one['case']['values'] = [
                [name, [0.3 if part == 0.4 else part for part in value]
                 if name == 'joint_strength' else value] for name, value in one['case']['values']]

    def shorter(results: Any) -> None:
        for one in results:
            one['seconds'] /= 2.0

    def faster(runs: Any) -> None:
        for one in runs.values():
            one['timing']['rate_hz'] *= 2.0

    assert ' blocks of 10 cm, slopes of 15°, steps of 16 cm, ' in told_of('rough-ground', higher)
    assert told_of('stairs-what-one-foot-felt-all-know', higher).startswith('five of 20 cm up ')
    assert ', a drive at 30 %, ' in told_of('what-the-controllers-do-not-know', weaker)
    assert ' walks of 30 s under ' in told_of('any-command', shorter)
    assert told_of('rate', faster).startswith('ten processes at 500 Hz on ')


@pytest.mark.parametrize('study', ROWS)
def test_a_headline_has_no_number_that_its_document_has_not(study: str) -> None:
    title, headline, command = ROWS[study]
    links = re.findall(r'\]\(([^)]+#[^)]+)\)', title + command)
    assert set(numbers(headline)) <= told('\n'.join(map(section, links)))


@pytest.mark.parametrize('study', OPTIONS)
def test_a_command_has_the_options_with_which_its_file_was_written(study: str) -> None:
    given, written = options_of(ROWS[study][2]), OPTIONS[study](content(study))
    assert {name: given.get(name, DEFAULTS.get(name)) for name in written} == written


@pytest.mark.parametrize('study', ROWS)
def test_an_option_that_no_file_holds_is_that_of_the_document(study: str) -> None:
    title, _, command = ROWS[study]
    known = OPTIONS[study](content(study)) if study in OPTIONS else {}
    text = '\n'.join(map(section, re.findall(r'\]\(([^)]+#[^)]+)\)', title + command)))
    assert [name for name, value in options_of(command).items() if name not in known
            and not re.search(rf'(?<![\w-]){name} ?{re.escape(value)}(?![\w.])', text)] == []


@pytest.mark.parametrize('study', ROWS)
def test_the_commands_of_a_row_exist(study: str) -> None:
    named = [shlex.split(command) for command in re.findall(r'`([^`]+)`', ROWS[study][2])]
    assert named
    for words in named:
        match words:
            case ['make', target, *_]:
                makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
                assert re.search(rf'^{target}:', makefile, re.MULTILINE), words
            case ['python', '-m', module, *_]:
                assert module in modules(), words
            case ['walk', scenario]:
                assert find_config(scenario, SCENARIOS).is_file()
            case _:
                assert words[0] in setup_constant('EXECUTABLES'), words


def test_the_rate_names_the_command_that_writes_the_table_of_its_factor() -> None:
    text = BENCHMARK.read_text(encoding='utf-8')
    (writer,) = (command for command, table in re.findall(
        r'<!-- (.+): begin -->(.*)<!-- \1: end -->', text, re.DOTALL)
        if 'idle: real-time factor' in table)
    first, *_ = re.findall(r'`([^`]+)`', ROWS['rate'][2])
    assert first == writer


def test_options_are_read_from_the_commands_of_a_cell() -> None:
    assert options_of("`make x ARGS='--tables pushes rough --seeds 20'`; `y --all --seed 3`") == {
        '--tables': 'pushes rough', '--seeds': '20', '--all': '', '--seed': '3'}


def test_the_other_numbers_of_the_readme_are_those_of_the_scenarios() -> None:
    text = README.read_text(encoding='utf-8')
    events = load_yaml(find_config('scenarios/start_stop.yaml'))['events']
    requests = [(event['inhibit'], event['at']) for event in events if 'inhibit' in event]
    begin, end = re.findall(r'inhibited at ([\d.]+) s, and released at ([\d.]+) s', text)[0]
    assert {(True, float(begin)), (False, float(end))} <= set(requests)
    assert 'five minutes for your commands' in text
    assert load_yaml(find_config('scenarios/stand_by.yaml'))['duration'] == 5 * 60.0


def test_the_rate_of_the_drive_and_the_pythons_of_the_readme_are_those_of_the_code() -> None:
    text = README.read_text(encoding='utf-8')
    (rate,) = re.findall(r'joint drive at ([\d.]+) kHz', text)
    assert float(rate) * 1e3 == 1.0 / LONGEST_PHYSICS_STEP
    (least, most), = re.findall(r'with Python 3\.(\d+)-3\.(\d+),', text)
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    assert f'(3, {least}) <= sys.version_info < (3, {int(most) + 1})' in makefile
    assert setup_argument('python_requires') == f'>=3.{least}'


def test_a_number_that_nobody_has_measured_is_noticed() -> None:
    text = '| kills | fell |\n|---|---|\n| 1,200 | 0 |\n| 300 | 1 |\n\nIn 12.46 s.\n'
    assert {'1200', '300', '1500', '12.46', '12.5', '12', '1'} <= told(text)
    assert not {'1501', '12.4', '13', '2'} & told(text)
