# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measures how the robot walks, from fixed seeds, and prints the tables of doc/results.md.

speeds: steady velocities against the commanded ones. pushes: largest speed change survived, in
eight directions at every phase. timing: falls by drawn pushes in other gaits, of other robots and
on blocks too, with and without quicker steps. manoeuvres: falls by pushes at rest, while stopping,
starting, changing gait and turning. unpushed: stops that nobody pushes against. rough: share of
seeds that cross 5 m of rough ground; rougher, higher: of harder grounds, and of stairs on a robot
with longer legs. obstacles: steps that are too high. contacts: rough ground with and without the
feedback of touchdown and the stumbling reflex. delays: targets that arrive late. starved: those of
controllers that do not get to run. mismatch: a robot that is not as its controllers know it.
gaits: every ordered pair of gaits changed while moving; fast_gaits: at the highest speeds,
forwards and backwards, of other robots too. restarts: posture control that forgets all in the
middle of a stride, as a node that is started again. robots: other robots, with their files alone;
those of the extra `robots` are left out where it is not installed.

The robot is the MuJoCo one in the plain loop, which is identical to the nodes in lock-step.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from math import ceil, isnan, nan
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.errors import MissingFileError
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies import benchmark_cases as given
from dmp_cpg_ros.studies import late_walks, output, push_trials
from dmp_cpg_ros.studies import walking_trials as trials
from dmp_cpg_ros.studies.loop_recording import StopSummary, suite_of
from dmp_cpg_ros.studies.study_stops import StopCase, run_trials
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import load_gaits

Cell = TypeVar('Cell')

Results = list[tuple[dict[str, Any], Any]]
"""Cases, as the arguments of their trials, with the outcomes."""

@dataclass(frozen=True)
class Table:
    """A table and what it was made of."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    results: Results


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark and print its tables; returns the exit status."""
    parser = output.parser_of('benchmark_walking', __doc__, 'every case and outcome')
    parser.add_argument('--tables', nargs='+', choices=list(TABLES), default=list(TABLES),
                        metavar='TABLE', help=f'which of {", ".join(TABLES)} (default: all)')
    parser.add_argument('--seeds', type=output.at_least_one, default=50, metavar='N',
                        help='seeds for each rough ground (default: 50)')
    parser.add_argument('--phases', type=output.at_least_one, default=16, metavar='N',
                        help='phases of the pushes, evenly over a cycle (default: 16)')
    return run_command(parser, arguments, _benchmark)


def _benchmark(options: argparse.Namespace, _: RosArguments) -> int:
    results: dict[str, Any] = {}
    with Workers(options.workers, options.cluster) as workers:
        for name in options.tables:
            table = TABLES[name](workers, options.seeds, options.phases)
            print(f'{table.title}\n\n{output.markdown_table(table.columns, table.rows)}\n',
                  flush=True)
            results[name] = [{'case': case, 'outcome': outcome} for case, outcome in table.results]
    output.write_results(options.json, results)
    return 0


def _run(workers: Workers, trial: Callable[..., Any], cases: Sequence[dict[str, Any]]) -> Results:
    """Cases with their outcomes."""
    return list(zip(cases, workers.map(partial(_tried, trial), cases), strict=True))


def _tried(trial: Callable[..., Any], case: dict[str, Any]) -> Any:
    return trial(**case)


def _by_cell(cells: Sequence[Cell], results: Results) -> Iterator[tuple[Cell, list[Any]]]:
    """Every cell of a table with its outcomes, as many of each."""
    count = len(results) // len(cells)
    for k, cell in enumerate(cells):
        yield cell, [outcome for _, outcome in results[k * count:(k + 1) * count]]


def speeds(workers: Workers, seeds: int, phases: int) -> Table:
    """Steady velocities in all gaits."""
    walks = [*((gait, (v, 0.0, 0.0)) for gait, vs in given.STRAIGHT.items() for v in vs),
             *given.OTHERS]
    results = _run(workers, trials.steady, [{'gait': gait, 'velocity': v} for gait, v in walks])
    rows = [(case['gait'], _velocity(case['velocity']), *steady_cells(case['velocity'], outcome))
            for case, outcome in results]
    return Table('Speeds; cost of transport with / without losses in the joints',
                 ('gait', 'asked m/s, rad/s', 'reached', 'error %', 'yaw drift deg/10 m',
                  'cost of transport'), rows, results)


def steady_cells(velocity: trials.Velocity, outcome: trials.SteadyOutcome) -> tuple[str, ...]:
    """Cells of one held velocity: reached, error, yaw drift, cost of transport with and without
    the losses in the joints.
    """
    if outcome.fell:
        return 'fell', '-', '-', '-'
    costs = (outcome.cost_of_transport, outcome.without_losses)
    error = 100.0 * trials.relative_error(outcome, velocity)
    return (_velocity(outcome.velocity, 3), _number(error, 1), _number(outcome.yaw_drift, 2),
            ' / '.join(_number(cost, 2) for cost in costs))


def _velocity(velocity: trials.Velocity, digits: int = 2) -> str:
    return ', '.join(f'{value:.{digits}f}' for value in velocity)


def _number(value: float, digits: int) -> str:
    return '-' if isnan(value) else f'{value:.{digits}f}'


def pushes(workers: Workers, seeds: int, phases: int) -> Table:
    """Largest pushes survived, the least and the median over the phases."""
    cases = [{'gait': gait, 'speed': speed, 'phase': i / phases,
              'directions': tuple(given.DIRECTIONS.values())}
             for (gait, speed), i in product(given.PUSHED, range(phases))]
    results = _run(workers, push_trials.survived_pushes, cases)
    rows = [(f'{gait} {speed:g} m/s', *(
        f'{low:.1f} / {middle:.1f}'
        for low, middle in zip(np.min(of, axis=0), np.median(of, axis=0), strict=True)))
        for (gait, speed), of in _by_cell(given.PUSHED, results)]
    return Table(f'Pushes: speed change in m/s that is survived at every one of {phases} phases / '
                 'at half of them; times the mass it is the impulse in N s',
                 ('walking', *given.DIRECTIONS), rows,
                 [(case, {'speed_change': of}) for case, of in results])


def timing(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls by drawn pushes, without and with quicker steps; as many pushes as ``phases``."""
    walks = [walk for walk in given.TIMED if 'robot' not in walk or _is_there(walk['robot'])]
    results = _run(workers, push_trials.caught, [
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
    results = _run(workers, push_trials.pushed, [
        {'manoeuvre': name, 'speed_change': change, 'case': case, 'cases': phases, 'drawn': drawn,
         'recovery': recovery} for name, change, drawn, recovery in cells
        for case in range(phases)])
    rows = []
    for (name, change, drawn, recovery), of in _by_cell(cells, results):
        rows.append((name, 'drawn' if drawn else 'all around', f'{change:g}',
                     'on' if recovery else 'off', f'{sum(one.fell for one in of)}/{phases}',
                     str(sum(one.rests for one in of)), str(max(one.releases for one in of))))
    return Table('Pushes at rest and in manoeuvres: direction, duration and time are drawn, or '
                 '0.1 s from all around',
                 ('while', 'direction', 'm/s', 'push_recovery', 'fell', 'rests after 3 s',
                  'most releases'), rows, results)


def unpushed(workers: Workers, seeds: int, phases: int) -> Table:
    """Releases by stops without a push; half as many seeds as ``phases`` on each ground."""
    results = _run(workers, push_trials.unpushed, [
        {'gait': gait, 'speed': low + (high - low) * seed / max(phases // 2 - 1, 1),
         'seed': seed + 1, 'kind': kind, 'numbers': numbers, 'payload': payload}
        for gait, (low, high), kind, numbers, payload in given.UNPUSHED
        for seed in range(phases // 2)])
    rows = []
    for (gait, speeds_, kind, numbers, payload), of in _by_cell(given.UNPUSHED, results):
        words = ', '.join((kind, *(f'{value:g}' for value in numbers.values()),
                           *([f'payload {payload:g}'] if payload else [])))
        rows.append((gait, '{:g} to {:g}'.format(*speeds_), words, str(len(of)),
                     *(str(sum(bool(getattr(one, name)) for one in of))
                       for name in ('releases', 'fell', 'rests'))))
    return Table('Stops without a push', (
        'gait', 'm/s', 'ground', 'stops', 'released', 'fell', 'rest after 3 s'), rows, results)


def rough(workers: Workers, seeds: int, phases: int) -> Table:
    """Share of the seeds that cross each ground."""
    return _crossed('Rough ground', given.ROUGH, workers, seeds, 0)


def rougher(workers: Workers, seeds: int, phases: int) -> Table:
    """The same of harder grounds."""
    return _crossed('Rougher ground', given.ROUGHER, workers, seeds, given.UNTUNED)


def higher(workers: Workers, seeds: int, phases: int) -> Table:
    """The same of grounds for longer legs, where that robot is there."""
    there = given.HIGHER if _is_there(given.CLIMBER) else ()
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
    results = _run(workers, trials.obstacle, [
        {'gait': gait, 'height': height, 'seed': seed, 'speed': speed}
        for height, gait, speed in cells for seed in range(seeds)])
    rows = []
    for (height, gait, speed), of in _by_cell(cells, results):
        times, ways = ([getattr(one, what) for one in of if one.stopped and not one.fell]
                       for what in ('time', 'away'))
        rows.append((f'{height:g}', f'{gait} {speed:g}', *(
            f'{sum(getattr(one, what) for one in of)}/{seeds}'
            for what in ('stopped', 'fell', 'over', 'rests')),
            *((f'{max(times):.1f}', f'{min(ways):.2f}') if times else ('-', '-'))))
    return Table('Steps that are too high', (
        'height m', 'gait, m/s', 'stopped', 'fell', 'over', 'rests', 'stopped after s, worst',
        'way back m, least'), rows, [(case, one._asdict()) for case, one in results])


def contacts(workers: Workers, seeds: int, phases: int) -> Table:
    """Crossings of rough ground with each of ``FEELING``."""
    walks, rows = product(given.FELT_GROUNDS, given.ROUGH_GAITS, given.FEELING), []
    results = _crossings(workers, seeds, walks)
    for case, words, of, shares in _groups(results, seeds):
        feels = given.FEELING[case['values']]
        rows.append((f'{case["kind"]}, {words}', case['gait'], feels, *shares,
                     f'{np.mean([outcome.distance for outcome in of]):.2f}',
                     f'{np.mean([outcome.distance / outcome.time for outcome in of]):.3f}',
                     f'{np.nanmean([outcome.tilt for outcome in of]):.2f}'))
    return Table('Feeling the ground, blind, at 0.5 m/s within a tenth',
                 ('ground', 'gait', 'feels', 'seeds', 'crossed 5 m', 'fell', 'mean distance m',
                  'mean speed m/s', 'tilt rms deg'), rows, results)


def _crossings(workers: Workers, seeds: int, walks: Iterator[tuple[Any, ...]],
               first: int = 0, robot: str | None = None) -> Results:
    """Crossings of ground, gait and parameters with every seed, the seeds innermost."""
    return _run(workers, trials.cross, [
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
        yield case, words, of, (str(seeds), output.percent(crossed, seeds), str(fell))


def delays(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls and speed by the delay of the targets, without a lead and with one that covers it."""
    cells = [(gait, speed, delay, lead)
             for (gait, speed), delay in product(given.LATE_WALKS, given.DELAYS_MS)
             for lead in sorted({0, 4 * ceil(delay[1] / 4)})]
    results = _run(workers, late_walks.late, [
        {'gait': gait, 'speed': speed, 'delay_ms': delay, 'lead_ms': lead, 'seed': seed + 1}
        for gait, speed, delay, lead in cells for seed in range(seeds)])
    rows = []
    for (gait, speed, delay, lead), of in _by_cell(cells, results):
        upright = [one for one in of if not one.fell]
        means = ((f'{np.mean([one.reached for one in upright]):.2f}',
                  f'{np.mean([one.tilt for one in upright]):.2f}') if upright else ('-', '-'))
        rows.append((f'{gait} {speed:g}', ' to '.join(f'{end:g}' for end in sorted(set(delay))),
                     str(lead), f'{len(of) - len(upright)}/{seeds}', *means))
    return Table('Targets that arrive late', ('gait, m/s', 'delay ms', 'target_lead ms', 'fell',
                                              'reached m/s', 'tilt rms deg'), rows, results)


def starved(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls by how long and how often the controllers do not get to run."""
    cells = list(product(given.STARVED_WALKS, given.STARVED))
    results = _run(workers, late_walks.starved, [
        {'gait': gait, 'speed': speed, 'stalls': stalls, 'seed': seed + 1}
        for (gait, speed), stalls in cells for seed in range(seeds)])
    rows = []
    for ((gait, speed), stalls), of in _by_cell(cells, results):
        rows.append((f'{gait} {speed:g}', str(stalls), f'{sum(one.fell for one in of)}/{seeds}',
                     f'{np.mean([one.stood for one in of]):.1f}'))
    return Table('Controllers that starve', (
        'gait, m/s', 'stalls', 'fell', 'looked after itself, per walk'), rows, results)


def mismatch(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls and speeds of a robot that is not as its controllers know it."""
    cells = list(product(given.MISMATCHED, given.MISMATCHED_WALKS))
    results = _run(workers, trials.steady, [
        {'gait': gait, 'velocity': (speed, 0.0, 0.0), 'seed': seed + 1,
         'values': given.MISMATCHED[what](seed)}
        for what, (gait, speed) in cells for seed in range(seeds)])
    rows = []
    for (what, (gait, speed)), of in _by_cell(cells, results):
        errors = [100.0 * trials.relative_error(one, (speed, 0.0, 0.0))
                  for one in of if not one.fell]
        rows.append((what, f'{gait} {speed:g}', f'{seeds - len(errors)}/{seeds}', *(
            (f'{np.median(errors):.1f}', f'{max(errors):.1f}') if errors else ('-', '-'))))
    return Table('Robots that are not as their controllers know them',
                 ('not known', 'gait, m/s', 'fell', 'error of speed %, median', 'worst'),
                 rows, results)


def gaits(workers: Workers, seeds: int, phases: int) -> Table:
    """Every ordered pair of gaits changed while moving, at a quarter of the phases."""
    walks = _run(workers, trials.run_changes, [
        {'before': before, 'speed': speed, 'phases': max(1, phases // 4)}
        for before, speed in product(load_gaits(), trials.CHANGE_SPEEDS)])
    results = [(case, one) for case, of in walks for one in of]
    rows = []
    for before, after in sorted({(case['before'], one.after) for case, one in results}):
        of = [one for case, one in results if (case['before'], one.after) == (before, after)]
        upright = [one for one in of if not one.fell]
        worst = [f'{max(getattr(one, name) for one in upright):{form}}' if upright else '-'
                 for name, form in (('duration', '.2f'), ('cycles', '.1f'),
                                    ('phase_error', '.1e'), ('sway', '.0f'))]
        rows.append((f'{before} to {after}', str(len(of)), str(len(of) - len(upright)),
                     str(sum(one.in_time for one in upright)), *worst))
    asked = ' and '.join(map(str, trials.CHANGE_SPEEDS))
    return Table(f'Gaits changed while walking, at {asked} m/s',
                 ('change', 'cases', 'fell', 'phase error in bound 3 cycles after', 'longest s',
                  'in cycles', 'largest phase error rad', 'largest roll or pitch deg'),
                 rows, results)


def fast_gaits(workers: Workers, seeds: int, phases: int) -> Table:
    """Every ordered pair of gaits changed while all is asked for that may be."""
    cases: list[dict[str, Any]] = []
    for file in filter(_is_there, given.ROBOTS):
        most = suite_of(robot=file).parameters.reference.max_speed
        cases += [{'before': before, 'speed': speed, 'phases': max(1, phases // 4), 'robot': file}
                  for before, speed in product(load_gaits(), (most, -most))]
    walks = _run(workers, trials.run_changes, cases)
    results = [(case, one) for case, of in walks for one in of]
    rows = []
    for file in dict.fromkeys(str(case['robot']) for case in cases):
        of = [(case, one) for case, one in results if case['robot'] == file]
        fallen = [f'{case["before"]} to {one.after}' for case, one in of if one.fell]
        upright = [one for _, one in of if not one.fell]
        rows.append((Path(file).stem, str(len(of)), str(len(fallen)),
                     ', '.join(dict.fromkeys(fallen)) or '-',
                     f'{max(one.duration for one in upright):.1f}',
                     f'{max(one.sway for one in upright):.0f}'))
    return Table('Gaits changed at the highest speeds, forwards and backwards',
                 ('robot', 'changes', 'fell', 'these', 'longest s',
                  'largest roll or pitch deg'), rows, results)


def restarts(workers: Workers, seeds: int, phases: int) -> Table:
    """Posture control that begins anew in the middle of a stride."""
    walks = _run(workers, trials.run_restarts, [
        {'gait': gait, 'speed': speed, 'phases': phases} for gait, speed in given.RESTARTED])
    results = [(case, one) for case, of in walks for one in of]
    return Table('Posture control begins anew', (
        'gait, m/s', 'restarts', 'fell', 'largest tilt deg, median', 'worst'), [
            (f'{case["gait"]} {case["speed"]:g}', str(len(of)), str(sum(one.fell for one in of)),
             f'{np.median([one.tilt for one in of]):.0f}', f'{max(one.tilt for one in of):.0f}')
            for case, of in walks], results)


def run_robot(file: str, phases: int) -> dict[str, Any]:
    """Walk, trot faster and faster, stop, start, and be pushed.

    Parameters
    ----------
    file : str
        Robot file.
    phases : int
        Number of phases of the stops and the pushes.

    Returns
    -------
    dict
        ``mass`` [kg]; ``amble`` and ``trot`` at 0.5 and 1 m/s, SteadyOutcome; ``top_speed``, the
        fastest trot of ``TOP_SPEEDS`` that was reached, NaN if none was [m/s]; ``stops`` from an
        amble at 0.5 m/s, and how many ``stood``, ``walked_on`` and fell, ``stop_falls``;
        ``pushed``, the sideways speed change survived at every phase of that amble [m/s].
    """
    # a zero command is no request here, but the first command starts the gait
    suite = suite_of(robot=file)
    robot = MujocoRobot(suite.robot_file, suite.tick_ns)
    shares = [i / phases for i in range(phases)]
    stops = StopSummary(list(run_trials(
        robot, [StopCase('amble', 0.5, phase) for phase in shares], suite.parameters)))
    return {
        'mass': robot.description.mass, 'amble': trials.steady('amble', (0.5, 0.0, 0.0), file),
        'trot': trials.steady('trot', (1.0, 0.0, 0.0), file), 'top_speed': _top_speed(file),
        'stops': phases, 'stood': stops.number('standing'),
        'walked_on': stops.number('walked_on'), 'stop_falls': stops.number('fell'),
        'pushed': min(min(push_trials.survived_pushes('amble', 0.5, phase, given.SIDES, file))
                      for phase in shares)}


def _top_speed(file: str) -> float:
    """Fastest trot that is reached within ``TOP_ERROR``, trying faster ones until one is not."""
    top = nan
    for speed in given.TOP_SPEEDS:
        velocity = (speed, 0.0, 0.0)
        error = trials.relative_error(trials.steady('trot', velocity, file), velocity)
        if not error <= given.TOP_ERROR:
            break
        top = speed
    return top


def robots(workers: Workers, seeds: int, phases: int) -> Table:
    """All robots that are there, with their files alone."""
    results = _run(workers, run_robot, [
        {'file': file, 'phases': phases} for file in given.ROBOTS if _is_there(file)])
    rows = []
    for case, of in results:
        amble, trot = (steady_cells((v, 0.0, 0.0), of[gait])
                       for gait, v in (('amble', 0.5), ('trot', 1.0)))
        rows.append((Path(case['file']).stem, f'{of["mass"]:.1f}', *amble[1::2], *trot[1::2],
                     _number(of['top_speed'], 1), f'{of["stood"]}/{of["stops"]}',
                     f'{of["walked_on"]}/{of["stops"]}', str(of['stop_falls']),
                     _number(of['pushed'], 1)))
    return Table('Robots; CoT is positive joint work over m g d, with / without what damping and '
                 'friction in the joints take, the push is survived at every phase of the amble',
                 ('robot', 'kg', 'amble 0.5 m/s: error %', 'CoT', 'trot 1 m/s: error %', 'CoT',
                  'top trot m/s', 'stood', 'walked on', 'fell', 'push sideways m/s'),
                 rows, results)


def _is_there(file: str) -> bool:
    try:
        MujocoRobot(suite_of(robot=file).robot_file)
    except MissingFileError:
        return False
    return True


TABLES = {make.__name__: make for make in (
    speeds, pushes, timing, manoeuvres, unpushed, rough, rougher, higher, obstacles, contacts,
    delays, starved, mismatch, gaits, fast_gaits, restarts,
    robots)}
"""What can be measured."""


if __name__ == '__main__':
    sys.exit(main())
