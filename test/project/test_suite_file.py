# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The parameter file of the package says what the code's defaults say, and nothing is left out."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_model.grounds import Blocks
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite import load_gaits, load_suite, node_sets
from dmp_cpg_ros.suite_table import WALKING, Kind

FILE = find_config('suite.yaml')

PER_RUN = {'leg', 'stamped_cmd_vel', 'gated', 'viewer', 'live_view'}
"""Parameters that are chosen for a run and not for a robot."""


@pytest.mark.parametrize('namespace', ['', '/robot1'])
@pytest.mark.parametrize('kind', WALKING, ids=lambda kind: kind.name)
def test_the_file_holds_the_defaults(kind: Kind, namespace: str) -> None:
    sets = node_sets(FILE, kind.name, namespace=namespace)
    assert sets == {cls: cls() for cls in kind.sets}


def test_a_robot_in_a_namespace_has_its_world(tmp_path: Path) -> None:
    path = tmp_path / 'blocks.yaml'
    path.write_text(FILE.read_text(encoding='utf-8').replace('world: flat', 'world: blocks'),
                    encoding='utf-8')
    for namespace in ('', '/robot1', '/a/b'):
        assert isinstance(load_suite(path, namespace=namespace).world, Blocks)


def test_the_file_names_every_parameter() -> None:
    content = load_yaml(FILE)
    named = {name for section in content.values() for name in section['ros__parameters']}
    known = {field.name for kind in WALKING for cls in kind.sets
             for field in dataclasses.fields(cls)}
    assert known - PER_RUN <= named


@pytest.mark.parametrize('gait', list(load_gaits()))
def test_every_gait_makes_a_suite(gait: str) -> None:
    assert load_suite(overrides={'gait': gait}).gait.name == gait


@pytest.mark.parametrize(('name', 'value', 'text'), [
    ('rho', float('nan'), 'outside its range'),
    ('rho', 'strong', 'must be a number'),
    ('inhibited_legs', [], 'one or more of'),
    ('inhibited_legs', ['fl', 'fl'], 'none twice'),
    ('coupling_graph', 'tree', 'one of all_to_all'),
    ('no_such_name', 1, 'valid are'),
])
def test_wrong_values_are_named_with_what_is_valid(name: str, value: object, text: str) -> None:
    with pytest.raises(ParameterError, match=text):
        load_suite(overrides={name: value})


@pytest.mark.parametrize(('overrides', 'text'), [
    ({'gait': 'gallop'}, "there is no gait 'gallop'; valid are amble"),
    ({'rho': -1.0}, "parameter 'rho' = -1.0"),
    ({'control_rate': 333.0}, 'control_rate = 333 Hz'),
    ({'inhibited_legs': 'auto'}, r"parameter '\w+' must be a list, such as \[auto\], not"),
    ({'gaitt': 'trot'}, r"there is no parameter 'gaitt'; did you mean gait\?"),
])
def test_an_override_that_is_wrong_is_not_blamed_on_the_file(
        overrides: dict[str, object], text: str, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=f'^{text}'):
        load_suite(overrides=overrides)
    path = tmp_path / 'wrong.yaml'
    path.write_text(FILE.read_text(encoding='utf-8').replace('rho: 8.0', 'rho: -8.0'), 'utf-8')
    with pytest.raises(ParameterError, match=rf"^'{path}', /\w+: .* -8\.0 "):
        load_suite(path, {'gait': 'trot'})


def test_a_robot_is_found_by_its_name_alone() -> None:
    assert load_suite(overrides={'robot': 'go2'}).robot_file == find_config('robots/go2.yaml')
