# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measures how the robot walks, from fixed seeds, and prints the tables of doc/results.md.

speeds: steady velocities against the commanded ones. pushes: largest speed change survived, in
eight directions at every phase. timing: falls by drawn pushes in other gaits, of other robots and
on blocks too, with and without quicker steps. manoeuvres: falls by pushes at rest, while stopping,
starting, changing gait and turning. unpushed: stops that nobody pushes against. rough: share of
seeds that cross 5 m of rough ground; rougher, higher: of harder grounds, and of stairs on a robot
with longer legs. obstacles: steps that are too high. contacts: rough ground with and without the
feedback of touchdown and the stumbling reflex. climbing: stairs without and with what all legs
share of one foot's step. delays: targets that arrive late; slow_rates: also where a tick is long.
starved: those of controllers that do not get to run; killed_legs: of legs that die and are started
again; twice_silent: of all legs, soon after such a death. mismatch: a robot that is not as its
controllers know it. gaits: every ordered pair of gaits changed while moving; fast_gaits: at the
highest speeds, forwards and backwards, of other robots too; returns: while they are told to go
back, and stopped. restarts: posture control that forgets all in the middle of a stride, as a node
that is started again. robots: other robots, with their files alone; those of the extra `robots`
are left out where it is not installed.

The robot is the MuJoCo one in the plain loop, which is identical to the nodes in lock-step.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import permutations, product
from math import ceil, isnan, nan
from pathlib import Path
from typing import Any

import numpy as np

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies import benchmark_cases as given
from dmp_cpg_ros.studies import benchmark_grounds as grounds
from dmp_cpg_ros.studies import benchmark_pushes, change_trials, late_walks, output, push_trials
from dmp_cpg_ros.studies import walking_trials as trials
from dmp_cpg_ros.studies.loop_recording import StopSummary, suite_of
from dmp_cpg_ros.studies.stop_trials import StopCase, run_trials
from dmp_cpg_ros.studies.trial_tables import Table, by_cell, run, tell
from dmp_cpg_ros.studies.walking_trials import is_there
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import load_gaits


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
    with Workers(options.workers, options.cluster) as workers:
        tell(((name, TABLES[name](workers, options.seeds, options.phases))
              for name in options.tables), options.json)
    return 0


def speeds(workers: Workers, seeds: int, phases: int) -> Table:
    """Steady velocities in all gaits."""
    walks = [*((gait, (v, 0.0, 0.0)) for gait, vs in given.STRAIGHT.items() for v in vs),
             *given.OTHERS]
    results = run(workers, trials.steady, [{'gait': gait, 'velocity': v} for gait, v in walks])
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


def _largest(values: Sequence[float], form: str) -> str:
    """Largest number as a cell: ``nan`` where one is none, ``-`` where there are none."""
    return f'{np.max(values):{form}}' if values else '-'


def delays(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls and speed by the delay of the targets, without a lead and with one that covers it."""
    cells = [(gait, speed, delay, lead)
             for (gait, speed), delay in product(given.LATE_WALKS, given.DELAYS_MS)
             for lead in sorted({0, 4 * ceil(delay[1] / 4)})]
    results = run(workers, late_walks.late, [
        {'gait': gait, 'speed': speed, 'delay_ms': delay, 'lead_ms': lead, 'seed': seed + 1}
        for gait, speed, delay, lead in cells for seed in range(seeds)])
    rows = []
    for (gait, speed, delay, lead), of in by_cell(cells, results):
        upright = [one for one in of if not one.fell]
        means = ((f'{np.mean([one.reached for one in upright]):.2f}',
                  f'{np.mean([one.tilt for one in upright]):.2f}') if upright else ('-', '-'))
        rows.append((f'{gait} {speed:g}', ' to '.join(f'{end:g}' for end in sorted(set(delay))),
                     str(lead), f'{len(of) - len(upright)}/{seeds}', *means))
    return Table('Targets that arrive late', ('gait, m/s', 'delay ms', 'target_lead ms', 'fell',
                                              'reached m/s', 'tilt rms deg'), rows, results)


def slow_rates(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls by the delay of the targets where a tick is long."""
    cells = list(product(given.SLOW_RATES, given.SLOW_WALKS))
    results = run(workers, late_walks.late, [
        {'gait': gait, 'speed': speed, 'delay_ms': (delay, delay), 'lead_ms': 0, 'seed': seed + 1,
         'rate': rate} for (rate, delay), (gait, speed) in cells for seed in range(seeds)])
    rows = [(f'{gait} {speed:g}', f'{rate:g}', f'{delay:g}',
             f'{sum(one.fell for one in of)}/{seeds}')
            for ((rate, delay), (gait, speed)), of in by_cell(cells, results)]
    return Table('Late targets at slow rates',
                 ('gait, m/s', 'control_rate Hz', 'delay ms', 'fell'), rows, results)


def starved(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls by how long and how often the controllers do not get to run."""
    cells = list(product(given.STARVED_WALKS, given.STARVED))
    results = run(workers, late_walks.starved, [
        {'gait': gait, 'speed': speed, 'stalls': stalls, 'seed': seed + 1}
        for (gait, speed), stalls in cells for seed in range(seeds)])
    rows = []
    for ((gait, speed), stalls), of in by_cell(cells, results):
        rows.append((f'{gait} {speed:g}', str(stalls), f'{sum(one.fell for one in of)}/{seeds}',
                     f'{np.mean([one.stood for one in of]):.1f}'))
    return Table('Controllers that starve', (
        'gait, m/s', 'stalls', 'fell', 'looked after itself, per walk'), rows, results)


def killed_legs(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls by how soon legs that die are back."""
    cells = list(product(given.STARVED_WALKS, given.BACK_WITHIN))
    results = run(workers, late_walks.killed, [
        {'gait': gait, 'speed': speed, 'longest_s': longest_s, 'seed': seed + 1}
        for (gait, speed), longest_s in cells for seed in range(seeds)])
    rows = []
    for ((gait, speed), longest_s), of in by_cell(cells, results):
        tilts = [one.tilt for one in of]
        rows.append((f'{gait} {speed:g}', f'{longest_s:g}', str(sum(one.kills for one in of)),
                     str(sum(one.stood for one in of)), f'{sum(one.fell for one in of)}/{seeds}',
                     f'{np.median(tilts):.2f} / {max(tilts):.2f}'))
    return Table('Legs that die and are started again', (
        'gait, m/s', 'back within s', 'deaths', 'looked after itself', 'fell',
        'largest tilt rad, median / worst'), rows, results)


def twice_silent(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls, and stands, by how soon legs are silent once more."""
    cells = [(*walk, *silent) for walk, silent in product(given.STARVED_WALKS, given.TWICE_SILENT)]
    results = run(workers, late_walks.twice_silent, [
        {'gait': gait, 'speed': speed, 'rate': rate, 'after_s': after_s, 'seed': seed + 1}
        for gait, speed, rate, after_s in cells for seed in range(seeds)])
    rows = [(f'{gait} {speed:g}', f'{rate:g}', f'{after_s:g}',
             f'{sum(one.stood > 0 for one in of)}/{seeds}',
             f'{sum(one.fell for one in of)}/{seeds}')
            for (gait, speed, rate, after_s), of in by_cell(cells, results)]
    return Table('Legs that are silent twice', (
        'gait, m/s', 'control_rate Hz', 's between', 'stood', 'fell'), rows, results)


def mismatch(workers: Workers, seeds: int, phases: int) -> Table:
    """Falls and speeds of a robot that is not as its controllers know it."""
    cells = list(product(given.MISMATCHED, given.MISMATCHED_WALKS))
    results = run(workers, trials.steady, [
        {'gait': gait, 'velocity': (speed, 0.0, 0.0), 'seed': seed + 1,
         'values': given.MISMATCHED[what](seed)}
        for what, (gait, speed) in cells for seed in range(seeds)])
    rows = []
    for (what, (gait, speed)), of in by_cell(cells, results):
        errors = [100.0 * trials.relative_error(one, (speed, 0.0, 0.0))
                  for one in of if not one.fell]
        rows.append((what, f'{gait} {speed:g}', f'{seeds - len(errors)}/{seeds}', *(
            (f'{np.median(errors):.1f}', f'{np.max(errors):.1f}') if errors else ('-', '-'))))
    return Table('Robots that are not as their controllers know them',
                 ('not known', 'gait, m/s', 'fell', 'error of speed %, median', 'worst'),
                 rows, results)


def gaits(workers: Workers, seeds: int, phases: int) -> Table:
    """Every ordered pair of gaits changed while moving, at a quarter of the phases."""
    walks = run(workers, change_trials.run_changes, [
        {'before': before, 'speed': speed, 'phases': max(1, phases // 4)}
        for before, speed in product(load_gaits(), change_trials.CHANGE_SPEEDS)])
    results = [(case, one) for case, of in walks for one in of]
    rows = []
    for before, after in sorted({(case['before'], one.after) for case, one in results}):
        of = [one for case, one in results if (case['before'], one.after) == (before, after)]
        upright = [one for one in of if not one.fell]
        worst = [_largest([getattr(one, name) for one in upright], form)
                 for name, form in (('duration', '.2f'), ('cycles', '.1f'),
                                    ('phase_error', '.1e'), ('sway', '.0f'))]
        rows.append((f'{before} to {after}', str(len(of)), str(len(of) - len(upright)),
                     str(sum(one.in_time for one in upright)), *worst))
    asked = ' and '.join(map(str, change_trials.CHANGE_SPEEDS))
    return Table(f'Gaits changed while walking, at {asked} m/s',
                 ('change', 'cases', 'fell', 'phase error in bound 3 cycles after', 'longest s',
                  'in cycles', 'largest phase error rad', 'largest roll or pitch deg'),
                 rows, results)


def fast_gaits(workers: Workers, seeds: int, phases: int) -> Table:
    """Every ordered pair of gaits changed while all is asked for that may be."""
    cases: list[dict[str, Any]] = []
    for file in filter(is_there, given.ROBOTS):
        most = suite_of(robot=file).parameters.reference.max_speed
        cases += [{'before': before, 'speed': speed, 'phases': max(1, phases // 4), 'robot': file}
                  for before, speed in product(load_gaits(), (most, -most))]
    walks = run(workers, change_trials.run_changes, cases)
    results = [(case, one) for case, of in walks for one in of]
    rows = []
    for file in dict.fromkeys(str(case['robot']) for case in cases):
        of = [(case, one) for case, one in results if case['robot'] == file]
        fallen = [f'{case["before"]} to {one.after}' for case, one in of if one.fell]
        upright = [one for _, one in of if not one.fell]
        rows.append((Path(file).stem, str(len(of)), str(len(fallen)),
                     ', '.join(dict.fromkeys(fallen)) or '-',
                     _largest([one.duration for one in upright], '.1f'),
                     _largest([one.sway for one in upright], '.0f')))
    return Table('Gaits changed at the highest speeds, forwards and backwards',
                 ('robot', 'changes', 'fell', 'these', 'longest s',
                  'largest roll or pitch deg'), rows, results)


def returns(workers: Workers, seeds: int, phases: int) -> Table:
    """Every ordered pair of gaits changed while robots turn back and are stopped."""
    files = [*filter(is_there, given.ROBOTS)]
    pairs = list(permutations(load_gaits(), 2))
    results = run(workers, change_trials.run_return, [
        {'before': before, 'after': after, 'robot': file, 'seed': given.RETURNS + (
            seed * len(given.ROBOTS) + given.ROBOTS.index(file)) * len(pairs) + k}
        for file in files for k, (before, after) in enumerate(pairs) for seed in range(seeds)])
    rows = []
    for file in files:
        of = [(case, one) for case, one in results if case['robot'] == file]
        fallen = [f'{case["before"]} to {case["after"]}' for case, one in of if one.fell]
        rows.append((Path(file).stem, str(len(of)), str(sum(one.chosen for _, one in of)),
                     str(len(fallen)), ', '.join(dict.fromkeys(fallen)) or '-',
                     _largest([one.tilt for _, one in of if not one.fell], '.0f')))
    return Table('Gaits changed while robots are told to go back, and stopped', (
        'robot', 'walks', 'by speed', 'fell', 'these', 'largest tilt deg'), rows, results)


def restarts(workers: Workers, seeds: int, phases: int) -> Table:
    """Posture control that begins anew in the middle of a stride."""
    walks = run(workers, change_trials.run_restarts, [
        {'gait': gait, 'speed': speed, 'phases': phases} for gait, speed in given.RESTARTED])
    results = [(case, one) for case, of in walks for one in of]
    return Table('Posture control begins anew', (
        'gait, m/s', 'restarts', 'fell', 'largest tilt deg, median', 'worst'), [
            (f'{case["gait"]} {case["speed"]:g}', str(len(of)), str(sum(one.fell for one in of)),
             f'{np.median([one.tilt for one in of]):.0f}',
             _largest([one.tilt for one in of], '.0f'))
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
    suite = suite_of(robot=file, gait='amble')
    robot = MujocoRobot(suite.robot_file, suite.tick_ns)
    shares = [i / phases for i in range(phases)]
    stops = StopSummary(list(run_trials(
        robot, suite.gait, [StopCase('amble', 0.5, phase) for phase in shares],
        suite.parameters)))
    return {
        'mass': robot.description.mass, 'amble': trials.steady('amble', (0.5, 0.0, 0.0), file),
        'trot': trials.steady('trot', (1.0, 0.0, 0.0), file), 'top_speed': _top_speed(file),
        'stops': phases, 'stood': stops.number('standing'),
        'walked_on': stops.number('walked_on'), 'stop_falls': stops.number('fell'),
        'pushed': float(np.min([push_trials.survived_pushes('amble', 0.5, phase, given.SIDES, file)
                                for phase in shares]))}


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
    results = run(workers, run_robot, [
        {'file': file, 'phases': phases} for file in given.ROBOTS if is_there(file)])
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


TABLES = {make.__name__: make for make in (
    speeds, benchmark_pushes.pushes, benchmark_pushes.timing, benchmark_pushes.manoeuvres,
    benchmark_pushes.unpushed, grounds.rough, grounds.rougher, grounds.higher, grounds.obstacles,
    grounds.contacts, grounds.climbing, delays, slow_rates, starved, killed_legs, twice_silent,
    mismatch, gaits, fast_gaits, returns, restarts, robots)}
"""What can be measured."""


if __name__ == '__main__':
    sys.exit(main())
