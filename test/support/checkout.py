# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the checkout as text: setup.py's tables, the modules and their imports, the Makefile."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = 'dmp_cpg_ros'


def setup_tree() -> ast.Module:
    return ast.parse((ROOT / 'setup.py').read_text(encoding='utf-8'))


def setup_constant(name: str) -> object:
    """Value of a constant at the top of setup.py."""
    for statement in setup_tree().body:
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == name:
            return ast.literal_eval(statement.value)
    raise AssertionError(f'setup.py has no constant {name}')


def setup_argument(name: str) -> object:
    """Value of a literal argument of setup()."""
    for node in ast.walk(setup_tree()):
        if isinstance(node, ast.keyword) and node.arg == name:
            return ast.literal_eval(node.value)
    raise AssertionError(f'setup() has no argument {name}')


def needs_make() -> None:
    """Skip a test where make has not installed the package."""
    if not (ROOT / '.venv' / '.installed').exists():
        pytest.skip('make has not installed it here')


def recipe(*words: str) -> str:
    """The last line that ``make WORDS`` runs in the environment that it has made."""
    done = subprocess.run(['make', '--dry-run', '--directory', str(ROOT), *words], check=True,
                          capture_output=True, text=True, timeout=60)
    return [line for line in done.stdout.splitlines() if f'{ROOT}/.venv/bin/' in line][-1]


@cache
def modules() -> dict[str, Path]:
    """Every module of the package with its file."""
    found = {}
    for path in sorted((ROOT / PACKAGE).rglob('*.py')):
        parts = path.relative_to(ROOT).with_suffix('').parts
        found['.'.join(parts[:-1] if parts[-1] == '__init__' else parts)] = path
    return found


@cache
def imports(module: str, path: Path, *, at_import_time: bool = False) -> set[str]:
    """Full names of all modules that a module imports.

    With ``at_import_time`` only those that run when the module is imported: none inside functions
    or under ``if TYPE_CHECKING``. What a script imports from beside it is a module of the package.
    """
    tree = ast.parse(path.read_text(encoding='utf-8'))
    names: set[str] = set()
    for node in _at_import_time(tree) if at_import_time else ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            names.update(_from_names(node, module, path))
    return {f'{module.rpartition(".")[0]}.{name}' if _beside(name, path) else name
            for name in names}


def _beside(name: str, path: Path) -> bool:
    return name not in sys.stdlib_module_names and path.with_name(f'{name}.py').is_file()


def _from_names(node: ast.ImportFrom, module: str, path: Path) -> set[str]:
    base = node.module or ''
    if node.level:
        package = module if path.name == '__init__.py' else module.rpartition('.')[0]
        above = package.split('.')[:len(package.split('.')) - node.level + 1]
        base = '.'.join([*above, *filter(None, [base])])
    known = modules() if base.split('.')[0] == PACKAGE else {}
    return {f'{base}.{alias.name}' if f'{base}.{alias.name}' in known else base
            for alias in node.names}


def _at_import_time(node: ast.AST) -> Iterator[ast.AST]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            continue
        if isinstance(child, ast.If) and 'TYPE_CHECKING' in ast.unparse(child.test):
            continue
        yield child
        yield from _at_import_time(child)
