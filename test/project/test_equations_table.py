# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""doc/equations.md names functions, names and tests that exist, and leaves out no result."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import pytest
from checkout import PACKAGE, ROOT, modules

COLUMNS = ['paper', 'symbol', 'name in the code', 'unit', 'function', 'test', 'decided']

RESULTS = ([f'eq. {n}' for n in range(1, 48)] + [f'def. {n}' for n in (1, 2)]
           + [f'thm. {n}' for n in range(1, 6)] + [f'fig. {n}' for n in range(1, 8)]
           + [f'prop. {n}' for n in (*range(1, 7), 'A1', 'A2', 'A3')])
"""What the paper numbers, counted in the order in which it stands."""


@dataclass(frozen=True)
class Row:
    line: int
    cells: dict[str, str]

    def named(self, column: str) -> list[str]:
        """What stands in code quotes."""
        return re.findall(r'`([^`]+)`', self.cells[column])


def rows() -> list[Row]:
    found = []
    text = (ROOT / 'doc' / 'equations.md').read_text(encoding='utf-8')
    for number, line in enumerate(text.splitlines(), 1):
        if not line.startswith('|') or line.startswith('|---'):
            continue
        cells = [cell.strip() for cell in re.split(r'(?<!\\)\|', line)[1:-1]]
        assert len(cells) == len(COLUMNS), f'line {number} has {len(cells)} columns'
        if cells != COLUMNS:
            found.append(Row(number, dict(zip(COLUMNS, cells, strict=True))))
    return found


ROWS = rows()
each_row = pytest.mark.parametrize('row', ROWS, ids=lambda row: f'line-{row.line}')


@lru_cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding='utf-8'))


def members(node: ast.Module | ast.ClassDef) -> dict[str, ast.stmt]:
    """Classes, functions, attributes and constants by name."""
    found: dict[str, ast.stmt] = {}
    for child in node.body:
        if isinstance(child, (ast.FunctionDef, ast.ClassDef)):
            found[child.name] = child
        elif isinstance(child, ast.AnnAssign) and isinstance(child.target, ast.Name):
            found[child.target.id] = child
    return found


def source_of(function: str) -> Path:
    """File that defines a dotted name below the package; fails when there is none."""
    words, known = function.split('.'), modules()
    for length in range(len(words) - 1, 0, -1):
        module = '.'.join([PACKAGE, *words[:length]])
        if module not in known or known[module].name == '__init__.py':
            continue
        node: ast.stmt | ast.Module = tree(known[module])
        for word in words[length:]:
            assert isinstance(node, (ast.Module, ast.ClassDef)), f'{function}: no {word}'
            assert word in members(node), f'{function}: {module} has no {word}'
            node = members(node)[word]
        return known[module]
    raise AssertionError(f'{function}: there is no such module')


@each_row
def test_the_functions_exist(row: Row) -> None:
    assert row.named('function'), 'names no function'
    for function in row.named('function'):
        source_of(function)


@each_row
def test_the_names_occur_where_the_row_says(row: Row) -> None:
    assert row.named('name in the code'), 'has no name in the code'
    sources = '\n'.join(source_of(function).read_text(encoding='utf-8')
                        for function in row.named('function'))
    for name in row.named('name in the code'):
        assert re.search(rf'\b{re.escape(name)}\b', sources), f'{name} is not there'


@each_row
def test_the_tests_exist(row: Row) -> None:
    assert row.named('test'), 'names no test'
    for test in row.named('test'):
        file, _, name = test.partition('::')
        path = next((ROOT / 'test').rglob(file), ROOT / 'test' / file)
        assert path.is_file(), f'{file} does not exist'
        assert name.startswith('test_') and name in members(tree(path)), f'{file} has no {name}'


@pytest.mark.parametrize('result', RESULTS)
def test_every_result_of_the_paper_has_a_row(result: str) -> None:
    kind, number = result.split()
    for row in ROWS:
        paper = row.cells['paper']
        if re.search(rf'\b{re.escape(kind)} {number}\b', paper):
            return
        for first, last in re.findall(r'\beqs\. (\d+)-(\d+)', paper):
            if kind == 'eq.' and int(first) <= int(number) <= int(last):
                return
    raise AssertionError(f'{result} has no row')


def test_a_name_that_does_not_exist_is_found_out() -> None:
    for wrong in ('core.hopf.AndronovHopf.fields', 'core.hops.AndronovHopf', 'core.hopf.nothing'):
        with pytest.raises(AssertionError):
            source_of(wrong)
