# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The layout: every module is reached, every idea has one home, folders and files stay small."""

from __future__ import annotations

import ast
from functools import cache

import pytest
from checkout import PACKAGE, ROOT, modules
from house import reached

MOST_FILES, MOST_LINES = 12, 350

HOMES = {
    'AndronovHopf': 'core.canonical.hopf',
    'CouplingGraph': 'core.canonical.coupling',
    'CanonicalSystem': 'core.canonical.system',
    'GaitNetwork': 'core.gait.network',
    'SpringDamper': 'core.primitives.spring_damper',
    'FirstOrderFilter': 'core.maths.first_order',
    'minimum_jerk': 'core.primitives.demonstration',
    'TickClock': 'core.clock',
    'GRAVITY': 'core.maths.constants',
    'SUITE_TABLE': 'suite_table',
    'POSTURE_ROWS': 'layouts',
    'parse_yaml': 'strict_yaml',
    'end_with_parent': 'process',
    'give_back_memory': 'process',
}
"""Ideas by the name that defines them."""


@cache
def definitions() -> dict[str, set[str]]:
    """Modules that define a name at their top."""
    found: dict[str, set[str]] = {}
    for module, path in modules().items():
        for node in ast.parse(path.read_text(encoding='utf-8')).body:
            targets = getattr(node, 'targets', [getattr(node, 'target', None)])
            names = ([node.name] if isinstance(node, (ast.FunctionDef, ast.ClassDef)) else
                     [target.id for target in targets if isinstance(target, ast.Name)])
            for name in names:
                found.setdefault(name, set()).add(module.removeprefix(f'{PACKAGE}.'))
    return found


def test_no_module_is_reached_by_tests_alone() -> None:
    assert not set(modules()) - reached() - {f'{PACKAGE}.models'}  # data, found by its path


@pytest.mark.parametrize('name', HOMES)
def test_an_idea_has_one_home(name: str) -> None:
    assert definitions().get(name) == {HOMES[name]}


def test_folders_and_files_of_the_core_stay_small() -> None:
    core = ROOT / PACKAGE / 'core'
    for folder in {path.parent for path in core.rglob('*.py')}:
        files = [path for path in folder.glob('*.py') if path.name != '__init__.py']
        assert len(files) <= MOST_FILES, folder
    long = {path.name: lines for path in core.rglob('*.py')
            if (lines := len(path.read_text(encoding='utf-8').splitlines())) > MOST_LINES}
    assert not long
