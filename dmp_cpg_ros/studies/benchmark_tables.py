# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of the walking benchmark: their cases, and the rows made of the outcomes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import isnan, pi
from multiprocessing.pool import Pool
from pathlib import Path
from typing import Any

import numpy as np

from dmp_cpg_ros.core.errors import MissingFileError
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.benchmark_robots import ROBOTS, RobotCase, run_robot
from dmp_cpg_ros.studies.gait_change_trials import SPEEDS, change_cases, run_changes
from dmp_cpg_ros.studies.output import markdown_table
from dmp_cpg_ros.studies.walking_trials import (
    CrossingCase,
    CrossingOutcome,
    PushCase,
    SteadyOutcome,
    Values,
    Velocity,
    cross,
    relative_error,
    steady,
    suite_of,
    survived_pushes,
)

Grounds = tuple[tuple[str, tuple[tuple[str, float], ...]], ...]

DIRECTIONS = tuple(i * pi / 4.0 for i in range(8))
"""Directions of the pushes, from ahead to the left [rad]."""

DIRECTION_WORDS = ('ahead', 'ahead left', 'left', 'back left', 'back', 'back right', 'right',
                   'ahead right')

PUSHED = (('amble', 0.5), ('trot', 0.5), ('trot', 1.0))
"""Gaits and speeds that are pushed."""

ROUGH: Grounds = (
    ('blocks', (('height', 0.05),)),
    ('slope', (('degrees', 15.0),)),
    ('slope', (('degrees', -15.0),)),
    ('steps', (('height', 0.08),)),
    ('low_friction', (('friction', 0.3),)),
)
"""Grounds that are crossed."""

ROUGH_GAITS = ('amble', 'trot')

FELT_GROUNDS: Grounds = (
    ('blocks', (('height', 0.03),)),
    ('blocks', (('height', 0.05),)),
    ('blocks', (('height', 0.07),)),
    ('steps', (('height', 0.05),)),
    ('steps', (('height', 0.08),)),
)
"""Grounds that are crossed with and without feeling them."""

FEELING: tuple[tuple[str, Values], ...] = (
    ('nothing', (('contact_feedback', False), ('stumble_lift', 0.0))),
    ('touchdown, in the phase', (('contact_feedback', True), ('stumble_lift', 0.0))),
    ('obstacles, in the swing', (('contact_feedback', False), ('stumble_lift', 0.13))),
    ('both', (('contact_feedback', True), ('stumble_lift', 0.13))),
)
"""What is felt, and the parameters that make it."""


@dataclass(frozen=True)
class SpeedCase:
    """A velocity to hold.

    Attributes
    ----------
    gait : str
        Name of the gait.
    velocity : tuple of float
        v_x, v_y [m/s], γ [rad/s].
    robot : str or None
        Robot file; None is the suite's own.
    """

    gait: str
    velocity: Velocity
    robot: str | None = None


@dataclass(frozen=True)
class Table:
    """A table and what it was made of."""

    title: str
    text: str
    results: Sequence[tuple[Any, Any]]


def _run(pool: Pool, trial: Callable[[Any], Any], cases: Sequence[Any], chunk: int = 1
         ) -> list[tuple[Any, Any]]:
    """Cases with their outcomes, on several processes."""
    return list(zip(cases, pool.map(trial, cases, chunksize=chunk), strict=True))


def speed_cases() -> list[SpeedCase]:
    """Velocities of the table ``speeds``."""
    ladders = {
        'amble': (0.1, 0.2, 0.5, 0.8, 1.0, 1.25, 1.5),
        'walk': (0.1, 0.2, 0.5, 0.8),
        'trot': (0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0),
        'pace': (0.2, 0.5, 0.8),
        'bound': (0.2, 0.5, 0.8),
        'pronk': (0.2, 0.5, 0.8),
    }
    others: tuple[tuple[str, Velocity], ...] = (
        ('amble', (-0.3, 0.0, 0.0)), ('trot', (-0.5, 0.0, 0.0)), ('amble', (0.0, 0.3, 0.0)),
        ('trot', (0.0, 0.5, 0.0)), ('amble', (0.0, 0.0, 1.0)), ('trot', (0.0, 0.0, 1.0)),
        ('trot', (0.0, 0.0, 2.0)), ('amble', (0.5, 0.0, 0.5)), ('trot', (1.0, 0.0, 1.0)),
    )
    straight = [SpeedCase(gait, (v, 0.0, 0.0)) for gait, vs in ladders.items() for v in vs]
    return straight + [SpeedCase(gait, velocity) for gait, velocity in others]


def speeds(pool: Pool, seeds: int, phases: int) -> Table:
    """Steady velocities in all gaits."""
    results = _run(pool, _steady, speed_cases())
    columns = ('gait', 'asked m/s, rad/s', 'reached', 'error %', 'yaw drift deg/10 m',
               'cost of transport')
    rows = [(case.gait, _velocity(case.velocity), *steady_cells(case.velocity, outcome))
            for case, outcome in results]
    return Table('Speeds', markdown_table(columns, rows), results)


def steady_cells(velocity: Velocity, outcome: SteadyOutcome) -> tuple[str, ...]:
    """Cells of one held velocity: reached, error, yaw drift, cost of transport."""
    if outcome.fell:
        return 'fell', '-', '-', '-'
    return (_velocity(outcome.velocity, 3),
            _number(100.0 * relative_error(outcome, velocity), 1), _number(outcome.yaw_drift, 2),
            _number(outcome.cost_of_transport, 2))


def pushes(pool: Pool, seeds: int, phases: int) -> Table:
    """Largest pushes survived, the least and the median over the phases."""
    results = _run(pool, survived_pushes, [
        PushCase(gait, speed, i / phases, DIRECTIONS)
        for (gait, speed), i in product(PUSHED, range(phases))])
    rows = []
    for gait, speed in PUSHED:
        of = np.array([outcome.speed_change for case, outcome in results
                       if (case.gait, case.speed) == (gait, speed)])
        cells = [f'{low:.1f} / {middle:.1f}' for low, middle in
                 zip(of.min(axis=0), np.median(of, axis=0), strict=True)]
        rows.append((f'{gait} {speed:g} m/s', *cells))
    title = (f'Pushes: speed change in m/s that is survived at every one of {phases} phases / at '
             'half of them; times the mass it is the impulse in N s')
    return Table(title, markdown_table(('walking', *DIRECTION_WORDS), rows), results)


def rough(pool: Pool, seeds: int, phases: int) -> Table:
    """Share of the seeds that cross each ground."""
    results, rows = _crossings(pool, seeds, list(product(ROUGH, ROUGH_GAITS, [('', ())]))), []
    for (kind, words, gait, _), of in _groups(results, seeds):
        times = [outcome.time for outcome in of if outcome.crossed]
        rows.append((kind, words, gait, str(seeds), *_crossed(of),
                     f'{np.median(times):.1f}' if times else '-'))
    columns = ('ground', 'with', 'gait', 'seeds', 'crossed 5 m', 'fell', 'median time s')
    return Table('Rough ground, blind, at 0.5 m/s within a tenth', markdown_table(columns, rows),
                 results)


def contacts(pool: Pool, seeds: int, phases: int) -> Table:
    """Crossings of rough ground with each of ``FEELING``."""
    results, rows = _crossings(pool, seeds, list(product(FELT_GROUNDS, ROUGH_GAITS, FEELING))), []
    feeling_of = {values: feeling for feeling, values in FEELING}
    for (kind, words, gait, values), of in _groups(results, seeds):
        rows.append((f'{kind}, {words}', gait, feeling_of[values], str(seeds), *_crossed(of),
                     f'{np.mean([outcome.distance for outcome in of]):.2f}',
                     f'{np.mean([outcome.distance / outcome.time for outcome in of]):.3f}',
                     f'{np.nanmean([outcome.tilt for outcome in of]):.2f}'))
    columns = ('ground', 'gait', 'feels', 'seeds', 'crossed 5 m', 'fell', 'mean distance m',
               'mean speed m/s', 'tilt rms deg')
    return Table('Feeling the ground, blind, at 0.5 m/s within a tenth',
                 markdown_table(columns, rows), results)


def _crossings(pool: Pool, seeds: int, rows: Sequence[Any]) -> list[tuple[Any, Any]]:
    """Crossings of ground, gait and parameters with every seed, the seeds innermost."""
    return _run(pool, cross, [
        CrossingCase(gait, kind, numbers, seed, values=values)
        for ((kind, numbers), gait, (_, values)), seed in product(rows, range(seeds))], 2)


def _groups(results: Sequence[tuple[CrossingCase, CrossingOutcome]], seeds: int
            ) -> Iterator[tuple[tuple[str, str, str, Values], list[CrossingOutcome]]]:
    """Ground, its numbers in words, gait and parameters, each with the outcomes of all seeds."""
    for i in range(0, len(results), seeds):
        case = results[i][0]
        words = ', '.join(f'{name} {value:g}' for name, value in case.numbers)
        yield ((case.kind, words, case.gait, case.values),
               [outcome for _, outcome in results[i:i + seeds]])


def _crossed(of: Sequence[CrossingOutcome]) -> tuple[str, str]:
    return (f'{100.0 * np.mean([outcome.crossed for outcome in of]):.0f} %',
            str(sum(outcome.fell for outcome in of)))


def gaits(pool: Pool, seeds: int, phases: int) -> Table:
    """Every ordered pair of gaits changed while moving, at a quarter of the phases."""
    walks = _run(pool, run_changes, change_cases(max(1, phases // 4)))
    results = [(case, one) for case, of in walks for one in of]
    rows = []
    for before, after in sorted({(case.before, one.after) for case, one in results}):
        of = [one for case, one in results if (case.before, one.after) == (before, after)]
        upright = [one for one in of if not one.fell]
        worst = [f'{max(getattr(one, name) for one in upright):{form}}' if upright else '-'
                 for name, form in (('duration', '.2f'), ('cycles', '.1f'),
                                    ('phase_error', '.1e'), ('sway', '.0f'))]
        rows.append((f'{before} to {after}', str(len(of)), str(len(of) - len(upright)),
                     str(sum(one.in_time for one in upright)), *worst))
    columns = ('change', 'cases', 'fell', 'phase error in bound 3 cycles after', 'longest s',
               'in cycles', 'largest phase error rad', 'largest roll or pitch deg')
    return Table(f'Gaits changed while walking, at {" and ".join(map(str, SPEEDS))} m/s',
                 markdown_table(columns, rows), results)


def robots(pool: Pool, seeds: int, phases: int) -> Table:
    """All robots that are there, with their files alone."""
    results = _run(
        pool, run_robot, [RobotCase(file, phases) for file in ROBOTS if _is_there(file)])
    rows = []
    for case, of in results:
        amble, trot = (steady_cells((v, 0.0, 0.0), outcome)
                       for v, outcome in ((0.5, of.amble), (1.0, of.trot)))
        rows.append((Path(case.file).stem, f'{of.mass:.1f}', amble[1], amble[3], trot[1], trot[3],
                     _number(of.top_speed, 1), f'{of.stood}/{of.stops}',
                     f'{of.walked_on}/{of.stops}', str(of.stop_falls), _number(of.pushed, 1)))
    columns = ('robot', 'kg', 'amble 0.5 m/s: error %', 'CoT', 'trot 1 m/s: error %', 'CoT',
               'top trot m/s', 'stood', 'walked on', 'fell', 'push sideways m/s')
    return Table('Robots; CoT is positive joint work over m g d, the push is survived at every '
                 'phase of the amble', markdown_table(columns, rows), results)


def _is_there(file: str) -> bool:
    try:
        MujocoRobot(suite_of(file, 'amble').robot_file)
    except MissingFileError:
        return False
    return True


def _steady(case: SpeedCase) -> SteadyOutcome:
    return steady(case.gait, case.velocity, case.robot)


def _velocity(velocity: Velocity, digits: int = 2) -> str:
    return ', '.join(f'{value:.{digits}f}' for value in velocity)


def _number(value: float, digits: int) -> str:
    return '-' if isnan(value) else f'{value:.{digits}f}'
