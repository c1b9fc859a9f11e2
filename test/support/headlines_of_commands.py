# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands of the README's table: their options as the files know them that they have written."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

DEFAULTS = {'--seeds': '50', '--phases': '16'}
"""Values of options of ``benchmark_walking`` that a command leaves out."""


def options_of(command: str) -> dict[str, str]:
    """Options of a command with their values, of all commands of a cell of the table."""
    return {name: values.strip() for name, values in re.findall(
        r"(--[\w-]+)((?: (?!--)[^\s'`;]+)*)", command)}


def words(values: Iterable[Any]) -> str:
    """Different values in their order, as they are typed."""
    return ' '.join(dict.fromkeys(f'{value:g}' if isinstance(value, float) else str(value)
                                  for value in values))


def column(rows: Sequence[dict[str, str]], name: str) -> str:
    """Different values of a column of :func:`~headlines.tables`, but those of sums."""
    return words(row[name] for row in rows if row['gait'] != 'all')


def of_cases(results: Any, name: str) -> list[Any]:
    """What the cases of the first table of ``benchmark_walking`` have under a name."""
    return [one['case'][name] for one in next(iter(results.values()))]


def count(values: Iterable[Any]) -> str:
    """How many different values there are."""
    return str(len(set(values)))


OPTIONS: dict[str, Callable[[Any], dict[str, str]]] = {
    'stops-at-every-phase': lambda rows: {
        '--phases': column(rows, 'cases'), '--cadences': column(rows, 'cadence'),
        **({'--baselines': ''} if ' ' in column(rows, 'stopped by') else {})},
    'brisk-stops': lambda rows: {
        '--gaits': column(rows, 'gait'), '--speeds': column(rows, 'm/s'),
        '--legs': column(rows, 'leg'), '--braking': column(rows, 'braking'),
        '--phases': column(rows, 'cases')},
    'when-the-body-stands': lambda of: {'--random': f'{of["stops"]}', '--seed': f'{of["seed"]}'},
    'speeds': lambda of: {'--tables': words(of)},
    'pushes': lambda of: {'--tables': words(of), '--phases': count(of_cases(of, 'phase'))},
    'rough-ground': lambda of: {'--tables': words(of), '--seeds': count(of_cases(of, 'seed'))},
    'stairs-what-one-foot-felt-all-know': lambda of: {
        '--tables': words(of), '--seeds': count(of_cases(of, 'seed'))},
    'any-command': lambda walks: {
        '--runs': f'{len(walks)}', '--seed': f'{min(walk["seed"] for walk in walks)}'},
    'what-the-controllers-do-not-know': lambda of: {
        '--tables': words(of), '--seeds': count(of_cases(of, 'seed'))},
    'changes-of-gait': lambda of: {
        # Gaits change at a quarter of the phases.
        '--tables': words(of), '--phases': words(4 * n for n in of_cases(of, 'phases'))},
    'other-robots': lambda of: {'--tables': words(of), '--phases': words(of_cases(of, 'phases'))},
    'hostile-neighbours': lambda of: {
        '--duration': f'{of["duration_s"]:g}', '--seed': f'{of["seed"]}'}}
"""Options by the anchor of the row, made of the content of the study's file."""
