# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of trials: cases that run in workers, and the cells that their outcomes fill."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from dmp_cpg_ros.studies.output import markdown_table, write_results
from dmp_cpg_ros.studies.workers import Workers

Cell = TypeVar('Cell')

Results = list[tuple[dict[str, Any], Any]]
"""Cases, as the arguments of their trials, with the outcomes."""


class Table(NamedTuple):
    """A table and what it was made of."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    results: Results


def run(workers: Workers, trial: Callable[..., Any], cases: Sequence[dict[str, Any]]) -> Results:
    """Cases with their outcomes."""
    return list(zip(cases, workers.map(partial(_tried, trial), cases), strict=True))


def _tried(trial: Callable[..., Any], case: dict[str, Any]) -> Any:
    return trial(**case)


def by_cell(cells: Sequence[Cell], results: Results) -> Iterator[tuple[Cell, list[Any]]]:
    """Every cell of a table with its outcomes, as many of each."""
    count = len(results) // len(cells)
    for k, cell in enumerate(cells):
        yield cell, [outcome for _, outcome in results[k * count:(k + 1) * count]]


def least_and_median(outcomes: Sequence[Sequence[float]]) -> Iterator[str]:
    """A cell for each number that the outcomes (cases, numbers) have."""
    for low, middle in zip(np.min(outcomes, axis=0), np.median(outcomes, axis=0), strict=True):
        yield f'{low:.1f} / {middle:.1f}'


def tell(tables: Iterator[tuple[str, Table]], file: Path | None) -> None:
    """Print tables, each as soon as it is there, and write cases and outcomes of those so far by
    their names.
    """
    results: dict[str, Any] = {}
    for name, table in tables:
        print(f'{table.title}\n\n{markdown_table(table.columns, table.rows)}\n', flush=True)
        results[name] = [{'case': case, 'outcome': outcome} for case, outcome in table.results]
        write_results(file, results)
