# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of rough ground: crossings, steps that are too high, and what legs feel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from dmp_cpg_ros.studies import benchmark_cases as given
from dmp_cpg_ros.studies import walking_trials as trials
from dmp_cpg_ros.studies.output import percent
from dmp_cpg_ros.studies.trial_tables import Results, Table, by_cell, run
from dmp_cpg_ros.studies.walking_trials import is_there
from dmp_cpg_ros.studies.workers import Workers


def rough(workers: Workers, seeds: int, phases: int) -> Table:
    """Share of the seeds that cross each ground."""
    return _crossed('Rough ground', given.ROUGH, workers, seeds, 0)


def rougher(workers: Workers, seeds: int, phases: int) -> Table:
    """The same of harder grounds."""
    return _crossed('Rougher ground', given.ROUGHER, workers, seeds, given.UNTUNED)


def higher(workers: Workers, seeds: int, phases: int) -> Table:
    """The same of grounds for longer legs, where that robot is there."""
    there = given.HIGHER if is_there(given.CLIMBER) else ()
    return _crossed(f'Higher ground, {Path(given.CLIMBER).stem}', there, workers, seeds,
                    given.UNTUNED, given.CLIMBER)


def _crossed(title: str, grounds: Sequence[given.Ground], workers: Workers, seeds: int,
             first: int, robot: str | None = None) -> Table:
    results, rows = _crossings(
        workers, seeds, product(grounds, given.ROUGH_GAITS, [()]), first, robot), []
    for case, words, of, shares in _groups(results, seeds):
        times = [outcome.time for outcome in of if outcome.crossed]
        rows.append((case['kind'], words, case['gait'], *shares,
                     f'{np.median(times):.1f}' if times else '-',
                     f'{np.median([outcome.distance for outcome in of]):.1f}',
                     str(sum(outcome.blocked for outcome in of))))
    return Table(f'{title}, blind, at 0.5 m/s within a tenth', (
        'ground', 'with', 'gait', 'seeds', 'crossed 5 m', 'fell', 'median time s',
        'median way m', 'stopped as blocked'), rows, results)


def obstacles(workers: Workers, seeds: int, phases: int) -> Table:
    """What becomes of a robot that walks at a step that is too high."""
    cells = list(product(given.OBSTACLES, given.ROUGH_GAITS, given.OBSTACLE_SPEEDS))
    results = run(workers, trials.obstacle, [
        {'gait': gait, 'height': height, 'seed': seed, 'speed': speed}
        for height, gait, speed in cells for seed in range(seeds)])
    rows = []
    for (height, gait, speed), of in by_cell(cells, results):
        times, ways = ([getattr(one, what) for one in of if one.stopped and not one.fell]
                       for what in ('time', 'away'))
        rows.append((f'{height:g}', f'{gait} {speed:g}', *(
            f'{sum(getattr(one, what) for one in of)}/{seeds}'
            for what in ('stopped', 'fell', 'over', 'rests')),
            *((f'{max(times):.1f}', f'{min(ways):.2f}') if times else ('-', '-'))))
    return Table('Steps that are too high', (
        'height m', 'gait, m/s', 'stopped', 'fell', 'over', 'rests', 'stopped after s, worst',
        'way back m, least'), rows, [(case, one._asdict()) for case, one in results])


def climbing(workers: Workers, seeds: int, phases: int) -> Table:
    """Crossings of stairs with each of ``CLIMBING``."""
    return _compared('Stairs, blind, at 0.5 m/s within a tenth', 'climbing', workers, seeds,
                     given.ROUGHER[:1], given.CLIMBING, given.UNTUNED)


def contacts(workers: Workers, seeds: int, phases: int) -> Table:
    """Crossings of rough ground with each of ``FEELING``."""
    return _compared('Feeling the ground, blind, at 0.5 m/s within a tenth', 'feels', workers,
                     seeds, given.FELT_GROUNDS, given.FEELING)


def _compared(title: str, what: str, workers: Workers, seeds: int,
              grounds: Sequence[given.Ground], ways: Mapping[given.Values, str], first: int = 0
              ) -> Table:
    """Crossings of the same grounds with other parameters, each of which has words."""
    results, rows = _crossings(
        workers, seeds, product(grounds, given.ROUGH_GAITS, ways), first), []
    for case, words, of, shares in _groups(results, seeds):
        rows.append((f'{case["kind"]}, {words}', case['gait'], ways[case['values']], *shares,
                     str(sum(outcome.blocked for outcome in of)),
                     f'{np.mean([outcome.distance for outcome in of]):.2f}',
                     f'{np.mean([outcome.distance / outcome.time for outcome in of]):.3f}',
                     f'{np.nanmean([outcome.tilt for outcome in of]):.2f}'))
    return Table(title, ('ground', 'gait', what, 'seeds', 'crossed 5 m', 'fell',
                         'stopped as blocked', 'mean distance m', 'mean speed m/s',
                         'tilt rms deg'), rows, results)


def _crossings(workers: Workers, seeds: int, walks: Iterator[tuple[Any, ...]],
               first: int = 0, robot: str | None = None) -> Results:
    """Crossings of ground, gait and parameters with every seed, the seeds innermost."""
    return run(workers, trials.cross, [
        {'gait': gait, 'kind': kind, 'numbers': numbers, 'seed': seed, 'values': values,
         'robot': robot}
        for ((kind, numbers), gait, values), seed in product(walks, range(first, first + seeds))])


def _groups(results: Results, seeds: int) -> Iterator[tuple[
        dict[str, Any], str, list[trials.CrossingOutcome], tuple[str, str, str]]]:
    """One case of all seeds, the ground's numbers in words, the outcomes, and how many crossed."""
    for i in range(0, len(results), seeds):
        case, of = results[i][0], [outcome for _, outcome in results[i:i + seeds]]
        words = ', '.join(f'{name} {value:g}' for name, value in case['numbers'].items())
        crossed, fell = (sum(getattr(outcome, what) for outcome in of)
                         for what in ('crossed', 'fell'))
        yield case, words, of, (str(seeds), percent(crossed, seeds), str(fell))
