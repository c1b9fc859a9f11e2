# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of pushes: while walking, at rest and in manoeuvres, and stops without any."""

from __future__ import annotations

from itertools import product
from pathlib import Path

from dmp_cpg_ros.studies import benchmark_cases as given
from dmp_cpg_ros.studies import push_trials
from dmp_cpg_ros.studies.trial_tables import Table, by_cell, least_and_median, run
from dmp_cpg_ros.studies.walking_trials import is_there
from dmp_cpg_ros.studies.workers import Workers


def pushes(workers: Workers, seeds: int, phases: int) -> Table:
    """Largest pushes survived, the least and the median over the phases."""
    cases = [{'gait': gait, 'speed': speed, 'phase': i / phases,
              'directions': tuple(given.DIRECTIONS.values())}
             for (gait, speed), i in product(given.PUSHED, range(phases))]
    results = run(workers, push_trials.survived_pushes, cases)
    rows = [(f'{gait} {speed:g} m/s', *least_and_median(of))
            for (gait, speed), of in by_cell(given.PUSHED, results)]
    return Table(f'Pushes: speed change in m/s that is survived at every one of {phases} phases / '
                 'at half of them; times the mass it is the impulse in N s',
                 ('walking', *given.DIRECTIONS), rows,
                 [(case, {'speed_change': of}) for case, of in results])


def timing(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls by drawn pushes, without and with quicker steps; as many pushes as ``phases``."""
    walks = [walk for walk in given.TIMED if 'robot' not in walk or is_there(walk['robot'])]
    results = run(workers, push_trials.caught, [
        {**walk, 'speed_change': change, 'case': case, 'quick': quick}
        for walk in walks for quick in (False, True) for change in given.TIMED_CHANGES
        for case in range(phases)])
    fell = [sum(not upright for _, upright in results[k:k + phases])
            for k in range(0, len(results), phases)]
    count = len(given.TIMED_CHANGES)
    rows = [(f'{walk["gait"]} {walk["speed"]:g} m/s', Path(walk.get('robot', 'its own')).stem,
             walk.get('ground', 'flat'), *(
                 f'{fell[2 * count * k + i]} / {fell[2 * count * k + count + i]}'
                 for i in range(count))) for k, walk in enumerate(walks)]
    return Table(f'Falls of {phases} drawn pushes without / with quicker steps',
                 ('walking', 'robot', 'ground',
                  *(f'{change:g} m/s' for change in given.TIMED_CHANGES)),
                 rows, [(case, {'upright': upright}) for case, upright in results])


def manoeuvres(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls by pushes at rest and in manoeuvres, without and with the steps that catch them."""
    cells = [(name, change, drawn, recovery)
             for name, changes, draws in given.PUSHED_IN for change, drawn, recovery in product(
                 changes, draws, (False, True)) if recovery or name.startswith(given.STOPPED)]
    results = run(workers, push_trials.pushed, [
        {'manoeuvre': name, 'speed_change': change, 'case': case, 'cases': phases, 'drawn': drawn,
         'recovery': recovery} for name, change, drawn, recovery in cells
        for case in range(phases)])
    rows = []
    for (name, change, drawn, recovery), of in by_cell(cells, results):
        rows.append((name, 'drawn' if drawn else 'all around', f'{change:g}',
                     'on' if recovery else 'off', f'{sum(one.fell for one in of)}/{phases}',
                     str(sum(one.rests for one in of)), str(max(one.releases for one in of))))
    return Table('Pushes at rest and in manoeuvres: direction, duration and time are drawn, or '
                 '0.1 s from all around',
                 ('while', 'direction', 'm/s', 'push_recovery', 'fell', 'rests after 3 s',
                  'most releases'), rows, results)


def unpushed(workers: Workers, seeds: int, phases: int) -> Table:
    """Releases by stops without a push; half as many seeds as ``phases`` on each ground."""
    results = run(workers, push_trials.unpushed, [
        {'gait': gait, 'speed': low + (high - low) * seed / max(phases // 2 - 1, 1),
         'seed': seed + 1, 'kind': kind, 'numbers': numbers, 'payload': payload}
        for gait, (low, high), kind, numbers, payload in given.UNPUSHED
        for seed in range(phases // 2)])
    rows = []
    for (gait, speeds_, kind, numbers, payload), of in by_cell(given.UNPUSHED, results):
        words = ', '.join((kind, *(f'{value:g}' for value in numbers.values()),
                           *([f'payload {payload:g}'] if payload else [])))
        rows.append((gait, '{:g} to {:g}'.format(*speeds_), words, str(len(of)),
                     *(str(sum(bool(getattr(one, name)) for one in of))
                       for name in ('releases', 'fell', 'rests'))))
    return Table('Stops without a push', (
        'gait', 'm/s', 'ground', 'stops', 'released', 'fell', 'rest after 3 s'), rows, results)
