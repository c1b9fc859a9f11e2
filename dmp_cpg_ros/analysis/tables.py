# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables as files: of a recording, as CSV and Parquet, and of runs side by side."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.metrics.definitions import DEFINITIONS
from dmp_cpg_ros.core.errors import MissingFileError
from dmp_cpg_ros.files import writable

AT_ONCE = 10_000
"""Rows that are written together."""


Tables = Mapping[str, Mapping[str, Any]]
"""Columns by table and by name, as of ``Recording.tables``."""


def write_csv(tables: Tables, folder: Path) -> None:
    """Write ``NAME.csv`` of each table, with a line of names of columns."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, columns in tables.items():
        with writable(folder / f'{name}.csv').open('w', encoding='utf-8', newline='') as file:
            write = csv.writer(file)
            write.writerow(columns)
            for first in range(0, len(columns['time_s']), AT_ONCE):
                part = (column[first : first + AT_ONCE] for column in columns.values())
                write.writerows(zip(*(of if isinstance(of, list) else of.tolist()
                                      for of in part), strict=True))


def write_parquet(tables: Tables, folder: Path) -> None:
    """Write ``NAME.parquet`` of each table; raises MissingFileError without ``pyarrow``."""
    try:
        from pyarrow import parquet, table
    except ImportError as error:
        raise MissingFileError('Parquet needs the package pyarrow: pip install pyarrow') from error
    folder.mkdir(parents=True, exist_ok=True)
    for name, columns in tables.items():
        parquet.write_table(table(dict(columns)), writable(folder / f'{name}.parquet'))


def side_by_side(runs: Mapping[str, Mapping[str, Any]]) -> tuple[list[str], list[list[Any]]]:
    """Metrics of runs in columns, and how much more they are than those of the first.

    Parameters
    ----------
    runs : mapping of str to mapping
        As in ``metrics.json``, by the runs' names.

    Returns
    -------
    head : list of str
    rows : list of list
        Name, unit, a value of each run, and differences; None where there is none. Metrics that
        no run has are left out.
    """
    _, *others = runs
    values = {run: flattened({name: of for name, of in metrics.items() if name != 'certificate'})
              for run, metrics in runs.items()}
    head = ['metric', 'unit', *runs, *(f'Δ {run}' for run in others)]
    rows: list[list[Any]] = []
    for name in dict.fromkeys(name for of in values.values() for name in of):
        cells = [of.get(name) for of in values.values()]
        if any(cell is not None for cell in cells):
            rows.append([name, DEFINITIONS.get(name, ('', ''))[0], *cells,
                         *(_difference(cell, cells[0]) for cell in cells[1:])])
    return head, rows


def _difference(value: Any, other: Any) -> float | None:
    both = (value, other)
    if any(isinstance(of, bool) or not isinstance(of, (int, float)) for of in both):
        return None
    return float(value - other)


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown table with columns of even width, from headings and one cell per column."""
    widths = [max(map(len, cells)) for cells in zip(columns, *rows, strict=True)]
    rule = ['-' * width for width in widths]
    return '\n'.join(f"| {' | '.join(map(str.ljust, row, widths))} |"
                     for row in (columns, rule, *rows))


def flattened(values: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    """Nested values by dotted names; lists of mappings are left out."""
    flat: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            flat.update(flattened(value, f'{prefix}{key}.'))
        elif not (isinstance(value, list) and any(isinstance(entry, Mapping) for entry in value)):
            flat[f'{prefix}{key}'] = value
    return flat


def as_text(value: Any) -> str:
    """Value in a table: four significant digits, yes and no, a dash for nothing."""
    if value is None or isinstance(value, bool):
        return {None: '–', True: 'yes', False: 'no'}[value]
    if isinstance(value, float):
        return f'{value:.4g}'
    if isinstance(value, (list, tuple)):
        return ', '.join(as_text(entry) for entry in value)
    return str(value)
