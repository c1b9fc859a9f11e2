# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The parameter file of the package says what the code's defaults say, and nothing is left out."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from dmp_cpg_ros.configuration import find_config, load_yaml
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_model.grounds import Blocks
from dmp_cpg_ros.suite import load_gaits, load_suite, node_sets
from dmp_cpg_ros.suite_table import WALKING, Kind

FILE = find_config('suite.yaml')

PER_RUN = {'leg', 'stamped_cmd_vel', 'gated', 'viewer'}
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
