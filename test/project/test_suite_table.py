# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The table of nodes is the only one: others compare equal, and no other file spells the names."""

from __future__ import annotations

import ast
import re
import sys
from importlib import import_module
from pathlib import Path

import pytest
from checkout import PACKAGE, ROOT, modules, setup_constant

from dmp_cpg_ros.__main__ import COMMANDS, STUDIES, main
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite_table import KINDS, RECORDER, SUITE_TABLE, WALKING_NODES, Kind

OWN = {f'{PACKAGE}.suite_table', f'{PACKAGE}.core.suite_parameters'}
"""The table, and the core's part of it: owners of parameters that may change."""


def test_setup_installs_the_nodes_of_the_table_and_the_commands() -> None:
    assert setup_constant('EXECUTABLES') == (*KINDS, *COMMANDS, *STUDIES)


@pytest.mark.parametrize('kind', SUITE_TABLE, ids=lambda kind: kind.name)
def test_a_row_names_its_class(kind: Kind) -> None:
    pytest.importorskip('rclpy')
    node_class = getattr(import_module(kind.module), kind.class_name)
    assert node_class.KIND == kind.name
    assert set(kind.sets) <= set(node_class.parameter_table().sets)
    for own in kind.instances.values():
        assert set(own) <= set(node_class.parameter_table().fields)


def test_every_section_of_the_parameter_file_means_a_node_in_any_namespace() -> None:
    for section in load_yaml(find_config('suite.yaml')):
        if section != '/**':
            assert section.removeprefix('/**/') in WALKING_NODES, section


def test_no_other_file_spells_the_names_of_nodes() -> None:
    # 'inhibition' alone is a word of English, too.
    names = '|'.join(sorted(name for name in {*KINDS, *WALKING_NODES} if '_' in name))
    spelled = re.compile(rf'/?({names})(_[a-z]{{2}})?(/.*)?')
    files = {name: path for name, path in modules().items() if name not in OWN}
    files['launch'] = ROOT / 'launch' / 'suite.launch.py'
    wrong = [f'{name}:{node.lineno}: {node.value!r}' for name, path in files.items()
             for node in ast.walk(ast.parse(path.read_text(encoding='utf-8')))
             if isinstance(node, ast.Constant) and isinstance(node.value, str)
             and spelled.fullmatch(node.value)]
    assert not wrong, '\n'.join(wrong)


def test_the_list_of_executables_has_a_line_for_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    lines = capsys.readouterr().out.splitlines()
    for name in (*COMMANDS, *KINDS):
        assert any(re.match(rf'  {name} +\S.{{6}}', line) for line in lines), name
    assert RECORDER in KINDS


def test_a_wrong_name_is_answered_with_a_near_one(
        capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, 'argv', ['x'])
    assert main(['wlak', '--lock-step']) == 2
    assert 'did you mean walk?' in capsys.readouterr().err


def test_the_table_needs_no_ros() -> None:
    loaded = ast.parse(Path(modules()[f'{PACKAGE}.suite_table']).read_text(encoding='utf-8'))
    imported = {node.module for node in ast.walk(loaded) if isinstance(node, ast.ImportFrom)}
    assert not any(str(name).startswith(('rclpy', f'{PACKAGE}.nodes')) for name in imported)
