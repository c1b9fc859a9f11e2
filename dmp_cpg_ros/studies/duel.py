# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Walks the suite and a learned policy on one robot, and prints what each of them does.

tracking: velocities held, from creeping to running, sideways and turning. pushes: largest speed
change survived at 0.5 m/s, in eight directions at every phase. stops: time until the body stands,
and its way. standing: ten seconds without a command.

Both walk the same model in the same simulation with the same limits of its joints. The policy
knows the true state, as it is used to, and its joints are held by its own gains; the suite has
what it estimates from noisy sensors. A policy is stopped by a command of zero, the suite by
inhibition, of the leg that comes first, and with --braking.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.studies import loop_recording as runs
from dmp_cpg_ros.studies import output
from dmp_cpg_ros.studies import walking_trials as trials
from dmp_cpg_ros.studies.benchmark_cases import DIRECTIONS
from dmp_cpg_ros.studies.benchmark_walking import steady_cells
from dmp_cpg_ros.studies.learned_policy import PolicyFile, PolicyRun, load_policy
from dmp_cpg_ros.studies.push_trials import largest_pushes
from dmp_cpg_ros.studies.trial_tables import Results, Table, by_cell, least_and_median, run, tell
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import load_gait

POLICY = 'policy'

VELOCITIES: tuple[runs.Velocity, ...] = (
    *((v, 0.0, 0.0) for v in (0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)),
    (-0.5, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.5), (0.0, 0.0, 1.0), (0.5, 0.0, 0.5))
"""Velocities that are held [m/s], [rad/s]."""

PUSHED_SPEED, LARGEST_PUSH = 0.5, 4.8
"""Speed at which they are pushed, and the largest speed change that is tried [m/s]."""

STOPPED_SPEEDS, HOLD = (0.5, 1.0, 1.5), 2.5
"""Speeds from which they stop [m/s], and the time for which they are watched then [s]."""

STANDING = 10.0
"""Time without a command [s]."""


class Walker(NamedTuple):
    """Who walks.

    Attributes
    ----------
    name : str
        Gait of the suite, or ``POLICY``.
    robot : str
        Robot file.
    policy : PolicyFile or None
        The policy.
    braking : float
        Of the suite's stops [m/s^2].
    """

    name: str
    robot: str
    policy: PolicyFile | None
    braking: float

    def begin(self, start: bool = True) -> trials.Walk | PolicyRun:
        """Run of this walker, ready to be commanded; the suite rests where it does not start."""
        if self.policy is None:
            brisk = (('inhibited_legs', ('auto',)), ('braking', self.braking))
            return trials.Walk(self.name, self.robot, values=brisk, start=start)
        run = PolicyRun(self.policy, self.robot)
        run.walk(trials.STANDING)
        return run


def tracking(walker: Walker, velocity: runs.Velocity) -> trials.SteadyOutcome:
    """Hold a velocity."""
    return trials.held(walker.begin(), velocity)


def pushed(walker: Walker, phase: float) -> tuple[float, ...]:
    """Largest speed changes that are survived, by direction [m/s]; NaN where it fell before."""
    run = walker.begin()
    if not (run.settle((PUSHED_SPEED, 0.0, 0.0)) and run.walk(phase * run.period())):
        return (np.nan,) * len(DIRECTIONS)
    return largest_pushes(run, tuple(DIRECTIONS.values()), LARGEST_PUSH)


def stopped(walker: Walker, speed: float, phase: float) -> runs.StopOutcome:
    """Stop from a speed at a phase, and hold."""
    run = walker.begin()
    if not (run.settle((speed, 0.0, 0.0)) and run.walk(phase * run.period())):
        return runs.StopOutcome(True)
    run.states = [run.state]
    run.stop()
    if not run.walk(HOLD):
        return runs.StopOutcome(True)
    robot = run.robot.description
    return runs.body_at_rest(
        runs.recording_of(run.states), robot, RunContext(robot=robot).contact_force)


def standing(walker: Walker) -> dict[str, float]:
    """Stand without a command: way between begin and end [m], root mean square of speed [m/s] and
    of torque [N m], and the share of the time with all feet loaded.
    """
    run = walker.begin(start=False)
    run.states = [run.state]
    upright = run.walk(STANDING)
    of, robot = runs.recording_of(run.states), run.robot.description
    path, loaded = of.odometry.position_in_world[:, :2], RunContext(robot=robot).contact_force
    return {
        'fell': not upright, 'way': float(np.hypot(*(path[-1] - path[0]))),
        'speed': float(np.sqrt(np.mean(of.odometry.velocity_in_base[:, :2] ** 2) * 2.0)),
        'torque': float(np.sqrt(np.mean(of.joints.effort ** 2))),
        'loaded': float((of.feet.force > loaded).all(axis=1).mean())}


def tracking_table(walkers: Sequence[Walker], phases: int, workers: Workers) -> Table:
    """Velocities held, of each walker."""
    asked = list(product(VELOCITIES, walkers))
    results = run(workers, tracking, [{'walker': walker, 'velocity': v} for v, walker in asked])
    rows = []
    for v, of in by_cell(VELOCITIES, results):
        cells = []
        for outcome in of:
            reached, error, drift, cost = steady_cells(v, outcome)
            cells.append(reached if outcome.fell else f'{error} %, {drift}°, {cost}')
        rows.append((', '.join(f'{part:g}' for part in v), *cells))
    return Table('Velocities held: error of the speed, yaw drift per 10 m, cost of transport '
                 'with / without losses in the joints',
                 ('m/s, m/s, rad/s', *(walker.name for walker in walkers)), rows, _named(results))


def pushes_table(walkers: Sequence[Walker], phases: int, workers: Workers) -> Table:
    """Pushes survived, of each walker."""
    results = run(workers, pushed, [{'walker': walker, 'phase': k / phases}
                                    for walker, k in product(walkers, range(phases))])
    rows = [(walker.name, *least_and_median(of)) for walker, of in by_cell(walkers, results)]
    return Table(f'Pushes at {PUSHED_SPEED:g} m/s: speed change in m/s, up to {LARGEST_PUSH:g}, '
                 f'survived at every one of {phases} phases / at half of them',
                 ('', *DIRECTIONS), rows,
                 [(case, {'speed_change': of}) for case, of in _named(results)])


def stops_table(walkers: Sequence[Walker], phases: int, workers: Workers) -> Table:
    """Stops, of each walker."""
    cells = list(product(walkers, STOPPED_SPEEDS))
    results, rows = run(workers, stopped, [
        {'walker': walker, 'speed': speed, 'phase': k / phases}
        for (walker, speed), k in product(cells, range(phases))]), []
    for (walker, speed), outcomes in by_cell(cells, results):
        of = runs.StopSummary(outcomes)
        rows.append((walker.name, f'{speed:g}', str(of.number('fell')), str(of.number('standing')),
                     *(of.cell(name, scale, digits) for name, scale, digits in (
                           ('still_s', 1.0, 2), ('displacement_m', 1.0, 2), ('slip_m', 1e3, 1),
                           ('tilt', 180.0 / np.pi, 1), ('deceleration', 1.0, 1)))))
    return Table(f'Stops at {phases} phases, median / worst: time until the body stays below '
                 '2 cm/s with four feet loaded, way, slip of the feet, tilt, deceleration',
                 ('', 'm/s', 'fell', 'stood', 's', 'm', 'mm', 'deg', 'm/s^2'), rows,
                 _named(results))


def standing_table(walkers: Sequence[Walker], phases: int, workers: Workers) -> Table:
    """Standing still, of the policy and of the suite, whose gaits stand alike."""
    of = [next(each for each in walkers if each.policy), next(
        each for each in walkers if not each.policy)]
    results = run(workers, standing, [{'walker': walker} for walker in of])
    rows = [('policy' if case['walker'].policy else 'suite', 'yes' if at['fell'] else 'no',
             f'{1e3 * at["way"]:.1f}', f'{1e3 * at["speed"]:.1f}', f'{at["torque"]:.2f}',
             f'{100.0 * at["loaded"]:.0f} %') for case, at in results]
    return Table(f'Standing for {STANDING:g} s without a command',
                 ('', 'fell', 'moved mm', 'speed rms mm/s', 'torque rms N m', 'four feet loaded'),
                 rows, _named(results))


def _named(results: Results) -> Results:
    """Results with walkers by their names."""
    return [({**case, 'walker': case['walker'].name}, outcome) for case, outcome in results]


TABLES = {'tracking': tracking_table, 'pushes': pushes_table, 'stops': stops_table,
          'standing': standing_table}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the duel and print its tables; returns the exit status."""
    parser = output.parser_of('duel', __doc__, 'every case and outcome')
    parser.add_argument('policy', metavar='POLICY', help='description of the policy, as '
                        'policies/playground_go1.yaml of the configuration')
    parser.add_argument('robot', metavar='ROBOT', help='robot file')
    parser.add_argument('--network', metavar='FILE.onnx',
                        help='instead of the network that the description names')
    parser.add_argument('--gaits', nargs='+', default=['trot', 'amble'], metavar='GAIT',
                        help='gaits of the suite (default: trot amble)')
    parser.add_argument('--tables', nargs='+', choices=list(TABLES), default=list(TABLES),
                        metavar='TABLE', help=f'which of {", ".join(TABLES)} (default: all)')
    parser.add_argument('--phases', type=output.at_least_one, default=16, metavar='N',
                        help='phases of pushes and stops, evenly over a cycle (default: 16)')
    parser.add_argument('--braking', type=float, default=2.9, metavar='A', help="deceleration of "
                        "the suite's reference in a stop, half of what friction of 0.6 allows "
                        '(default: 2.9 m/s^2)')
    return run_command(parser, arguments, _duel)


def _duel(options: argparse.Namespace, _: RosArguments) -> int:
    policy = load_policy(options.policy, options.network)
    robot = str(find_config(options.robot, ROBOTS))
    walkers = [Walker(POLICY, robot, policy, 0.0), *(
        Walker(load_gait(gait).name, robot, None, options.braking)
        for gait in options.gaits)]
    PolicyRun(policy, robot).walk(0.1)  # what does not fit is said at once
    with Workers(options.workers, options.cluster) as workers:
        tell(((name, TABLES[name](walkers, options.phases, workers)) for name in options.tables),
             options.json)
    return 0


if __name__ == '__main__':
    sys.exit(main())
