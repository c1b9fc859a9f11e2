# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The generated reference and a suite that runs name the same topics, services and parameters."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import yaml

pytest.importorskip('rclpy')

import ros_processes
from checkout import ROOT
from demonstrations import joint_angles, walking_joints
from rcl_interfaces.srv import ListParameters
from ros_processes import Processes, Ros, composed_suite

from dmp_cpg_ros.commands import reference
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.learning.discrete import learn_discrete
from dmp_cpg_ros.core.learning.rhythmic import learn_rhythmic
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.core.scenario.fault import Fault
from dmp_cpg_ros.core.scenario.scenario import EVENT_KINDS, Event, Scenario
from dmp_cpg_ros.nodes.framework.parameters import FOREIGN_PREFIXES
from dmp_cpg_ros.nodes.messages.interfaces import (
    COMMAND_INTERFACES,
    POWER,
    SERVICES,
    TOPICS,
    Interface,
)
from dmp_cpg_ros.primitive_files import load_primitive, save_primitive
from dmp_cpg_ros.robot.robot_file import load_robot_file, own_robot_file
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite_table import DRIVER, KINDS, RECORDER, VISUALIZATION

shared_domain, shared_ros = ros_processes.shared_domain, ros_processes.shared_ros

OF_RCLPY = re.compile(
    r'/parameter_events|/rosout|.*/transition_event|/test/.*|.*/get_type_description')
"""What is there beside the suite: rclpy's own, and the node of the test."""

ALL_OF_IT = {'lock_step': True, 'gated': True, 'voting': True, 'contact_feedback': True}
"""Parameters with which the suite has every topic."""


def documented(section: str) -> set[str]:
    """What stands in code in the first column of a section's tables."""
    return set(re.findall(r'^\| `([^`]+)`', reference.SECTIONS[section](), re.MULTILINE))


def in_the_graph(entries: tuple[Interface, ...]) -> dict[str, str]:
    """Full names of interfaces with their types, private ones for each of their nodes."""
    names = {}
    for entry in entries:
        owners = [name for kind in entry.publishers if kind in KINDS
                  for name in KINDS[kind].instances] if entry.name.startswith('~') else ['']
        for owner in owners:
            name = entry.name.replace('~', f'/{owner}')
            names[name if name.startswith('/') else f'/{name}'] = entry.type_name
    return names


@pytest.fixture(scope='module')
def suite(shared_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Processes]:
    folder: Path = tmp_path_factory.mktemp('suite')
    with composed_suite(shared_domain, folder, **ALL_OF_IT) as started:
        started.node(RECORDER, output=str(folder / 'bag'))
        started.node(VISUALIZATION)
        started.node(DRIVER, command_interfaces=[*COMMAND_INTERFACES, POWER])
        yield started


def test_the_graph_has_the_topics_of_the_reference_and_no_others(
        suite: Processes, shared_ros: Ros) -> None:
    inside = tuple(entry for entry in TOPICS if entry.installed
                   and set(KINDS) & {*entry.publishers, *entry.subscribers})
    expected = in_the_graph(inside)
    assert {entry.name for entry in TOPICS} == documented('topics')

    def found() -> dict[str, str]:
        return {name: types[0] for name, types in shared_ros.node.get_topic_names_and_types()
                if not OF_RCLPY.fullmatch(name)}

    shared_ros.spin_until(lambda: set(found()) >= set(expected),
                          what=lambda: str(set(expected) - set(found())))
    assert found() == {**expected, **{name: kind for name, kind in in_the_graph(TOPICS).items()
                                      if name in found()}}


def test_every_node_has_the_services_of_the_reference_and_no_others(
        suite: Processes, shared_ros: Ros) -> None:
    private = {name for name in documented('services') if name.startswith('~')}
    owned = {service.name: service.publishers for service in SERVICES}
    expected = {f'/{name}' for name in documented('services') - private} | {
        entry.replace('~', f'/{name}') for kind in KINDS.values() for name in kind.instances
        for entry in private if kind.name in owned.get(entry, KINDS)}
    assert set(in_the_graph(SERVICES)) <= expected

    def found() -> set[str]:
        return {name for name, _ in shared_ros.node.get_service_names_and_types()
                if not OF_RCLPY.fullmatch(name)}

    shared_ros.spin_until(lambda: found() >= expected, what=lambda: str(expected - found()))
    assert found() == expected


def test_every_node_has_the_parameters_of_the_reference_and_no_others(
        suite: Processes, shared_ros: Ros) -> None:
    everything = set()
    for name, of in {name: kind for kind in KINDS.values() for name in kind.instances}.items():
        answer = shared_ros.call(ListParameters, f'/{name}/list_parameters',
                                 ListParameters.Request())
        found = {each for each in answer.result.names if not each.startswith(FOREIGN_PREFIXES)}
        assert found == set(reference.tables_of_parameters()[of.name].fields), name
        everything |= found
    assert everything == documented('parameters')


def test_every_kind_of_event_is_in_the_reference_and_has_its_example() -> None:
    assert documented('events') == set(EVENT_KINDS)
    usage = (ROOT / 'doc' / 'usage.md').read_text(encoding='utf-8')
    table = usage.partition('## Scenarios')[2].partition('\n## ')[0]
    rows = [line for line in table.splitlines() if line.startswith('| `')]
    assert {word for row in rows for word in re.findall(r'`(\w+)`', row.split('|')[1])} == set(
        EVENT_KINDS)


def refuses(read: Callable[[Any], Any], whole: dict[str, Any]) -> set[str]:
    """Entries without which a reader refuses what it takes as a whole."""
    read(whole)
    without = set()
    for name in whole:
        try:
            read({key: value for key, value in whole.items() if key != name})
        except DmpCpgError:
            without.add(name)
    return without


def entries(section: str) -> dict[str, bool]:
    """Entries of the tables of a section, and whether they are needed."""
    rows = re.findall(r'^\| `([^`]+)` \| (?:[^|\n]*\|){2} ([^|\n]*) \|',
                      reference.SECTIONS[section](), re.MULTILINE)
    return {name: default == 'refused' for name, default in rows}


def test_the_entries_of_a_scenario_are_those_that_its_reader_takes() -> None:
    event = {'at': 1.0, 'label': 'told', 'inhibit': True}
    whole = {'name': 'it', 'duration': 2.0, 'events': [event], 'parameters': {},
             'world': {'kind': 'flat'}}
    told = entries('scenarios')
    assert told.keys() == whole.keys() | event.keys() - {'inhibit'}
    needed = refuses(Scenario.from_mapping, whole) | refuses(
        lambda entry: Event.from_mapping(entry, 'event'), event) - {'inhibit'}
    assert {name for name, is_needed in told.items() if is_needed} == needed
    with pytest.raises(DmpCpgError):
        Scenario.from_mapping({**whole, 'other': 1})


def test_the_entries_components_and_kinds_of_a_failure_are_those_that_its_reader_takes() -> None:
    whole = {'component': 'joint', 'kind': 'off', 'for_s': 1.0, 'leg': 'fl'}
    told = entries('failures')
    assert told.keys() == whole.keys()
    assert {name for name, is_needed in told.items() if is_needed} == refuses(
        Fault.from_mapping, whole)
    components, kinds = (
        refusal({**whole, name: 'none'}).partition('valid are ')[2].split(', ')
        for name in ('component', 'kind'))
    assert documented('failures') - told.keys() == {*components, *kinds}
    for name in components:
        row = re.search(rf'^\| `{name}` .*', reference.failures(), re.MULTILINE)
        assert row is not None
        assert ('perhaps' in row[0]) == (refusal({**whole, 'component': name}) == '')


def refusal(failure: dict[str, Any]) -> str:
    """Why a failure is refused; empty where it is not."""
    try:
        Fault.from_mapping(failure)
    except DmpCpgError as error:
        return str(error)
    return ''


def test_the_entries_of_a_robot_are_those_that_its_reader_takes(tmp_path: Path) -> None:
    file = own_robot_file()
    names = {leg: list(JOINT_NAMES[3 * k:3 * k + 3]) for k, leg in enumerate(LEGS)}
    whole = {
        'model': str(file.model), 'base': file.base,
        'joints': dict(zip(LEGS, map(list, file.joints), strict=True)),
        'feet': dict(zip(LEGS, file.feet, strict=True)), 'stance_height': 0.3,
        'joint_names': names, 'kp': 1.0, 'kd': [1.0, 1.0, 1.0], 'torque_limit': 1.0,
        'velocity_limit': 1.0}

    def read(content: dict[str, Any]) -> None:
        path = tmp_path / 'robot.yaml'
        path.write_text(yaml.safe_dump(content), encoding='utf-8')
        load_robot_file(path)

    told = entries('robots')
    assert told.keys() == whole.keys()
    assert {name for name, is_needed in told.items() if is_needed} == refuses(read, whole)


def test_the_entries_of_a_gait_are_those_that_its_reader_takes() -> None:
    whole = {'lag': dict.fromkeys(LEGS, 0.0), 'speed': [0.1], 'cadence': [0.5],
             'duty_factor': [0.5], 'highest_speed': 1.0}
    told = entries('gaits')
    assert told.keys() == whole.keys()
    assert {name for name, is_needed in told.items() if is_needed} == refuses(
        partial(Gait.from_mapping, 'it'), whole)


def test_the_entries_of_primitives_are_those_that_are_written_and_needed(tmp_path: Path) -> None:
    path, written = tmp_path / 'primitive.yaml', set()
    for primitive in (learn_discrete(joint_angles(), 7),
                      learn_rhythmic(walking_joints(), 7, period=0.5)):
        save_primitive(primitive, path)
        whole = load_yaml(path)

        def read(content: dict[str, Any]) -> None:
            path.write_text(yaml.safe_dump(content), encoding='utf-8')
            load_primitive(path)

        assert refuses(read, whole) == whole.keys()
        written |= whole.keys()
    told = entries('primitives')
    assert told.keys() == written and all(told.values())


def test_every_file_is_told_of_in_a_whole_sentence_of_its_own() -> None:
    rows = dict(re.findall(r'^\| `([^`]+)` \| (.*) \|$', reference.files(), re.MULTILINE))
    config = ROOT / 'config'
    assert rows.keys() == {str(path.relative_to(config)) for path in config.rglob('*')
                           if path.is_file()}
    for name, sentence in rows.items():
        assert re.fullmatch(r'[A-Z].{8,}[^.:,]\.', sentence), (name, sentence)
    assert rows['gaits.yaml'] == 'Gaits as data.'
    assert len(set(rows.values())) == len(rows)
    assert rows.keys() >= reference.WITHOUT_COMMENT.keys()


def test_a_sentence_may_go_over_lines_of_a_comment_and_a_command_below_is_not_read() -> None:
    for text in ('# What it is\n# in all.yaml. And more.\na: 1\n',
                 '# What it is in all.yaml:\n#   ros2 run it\na: 1\n',
                 '<?xml version="1.0"?>\n<!--\n  What it is in\n  all.yaml. More.\n-->\n<a/>\n'):
        assert reference.first_sentence(text) == 'What it is in all.yaml.', text
    assert reference.first_sentence('{"a": 1}') == ''


def test_the_page_has_every_section_once() -> None:
    page = (ROOT / 'doc' / 'reference.md').read_text(encoding='utf-8')
    assert sorted(re.findall(r'<!-- table: (\w+) -->', page)) == sorted(reference.SECTIONS)


def test_a_wrong_section_is_answered_with_the_right_ones(
        capsys: pytest.CaptureFixture[str]) -> None:
    assert reference.main(['topic']) == 2
    assert 'valid are executables, nodes, topics' in capsys.readouterr().err
