# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops and starts the walking robot at many phases, speeds and gaits; tabulates what happened.

The robot is the MuJoCo one in the plain loop, which is identical to the nodes in lock-step.
Exit status 1 when it fell in a case that was stopped by inhibition, 2 when the arguments cannot
be used.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict
from functools import lru_cache, partial
from itertools import groupby, product
from math import isnan, pi
from multiprocessing import Pool

from dmp_cpg_ros.analysis.stop_outcome import StopOutcome, StopSummary
from dmp_cpg_ros.commands.ros_arguments import parse_arguments
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.output import markdown_table, parser_of, percent, write_results
from dmp_cpg_ros.studies.stop_trial import METHODS, StopCase, run_trials
from dmp_cpg_ros.suite import Suite, load_gait, load_suite

Results = list[tuple[StopCase, StopOutcome]]

COLUMNS = ('gait', 'm/s', 'leg', 'cadence', 'stopped by', 'cases', 'fell', 'stood', 'walked on',
           'prediction error %', 'over bound', 'bound s', 'rest s', 'body rest s', 'slip mm',
           'moved m', 'tilt deg', 'm/s^2')


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its table; returns the exit status."""
    options, _ = parse_arguments(_parser(), arguments)
    try:
        cases = cases_of(options)
        suite = suite_of(options.file, cases[0].leg)
        for gait in options.gaits:
            load_gait(gait)
    except DmpCpgError as error:
        print(f'study_stops: {error}', file=sys.stderr)
        return 2
    results = run_cases(cases, options.file, options.jobs, quiet=options.quiet)
    print(f'{suite.file}: {len(cases)} stops; columns with two numbers are median / worst\n')
    print(table(results))
    for case, outcome in results:
        if outcome.fell:
            print(f'\nfell: {case}', end='')
    write_results(options.json, [asdict(case) | asdict(outcome) for case, outcome in results])
    return int(any(outcome.fell for case, outcome in results if case.method == METHODS[0]))


def cases_of(options: argparse.Namespace) -> list[StopCase]:
    """All combinations of the options, phases innermost.

    Raises
    ------
    ParameterError
        If there are no phases.
    """
    if options.phases < 1:
        raise ParameterError(f'--phases {options.phases} must be at least 1')
    methods = METHODS if options.baselines else METHODS[:1]
    phases = [i / options.phases for i in range(options.phases)]
    return [StopCase(gait, speed, phase, cadence, leg, options.push, method)
            for gait, speed, cadence, leg, method, phase in product(
                options.gaits, options.speeds, options.cadences, options.legs, methods, phases)]


@lru_cache
def suite_of(file: str | None, leg: str) -> Suite:
    """Parameter file with one inhibited leg, and a command that needs no repetition."""
    return load_suite(file, {'inhibited_legs': [leg], 'cmd_vel_timeout': 0.0})


@lru_cache
def robot_of(file: str | None, leg: str) -> MujocoRobot:
    """The robot of a parameter file; a walk resets it."""
    suite = suite_of(file, leg)
    return MujocoRobot(suite.robot_file, suite.tick_ns)


@lru_cache
def bound_of(file: str | None, leg: str, gait: str, cadence: float) -> float:
    """Certified time to rest [s]; it holds for every phase and speed, and is infinite without."""
    suite, scale = suite_of(file, leg), body_scale(robot_of(file, leg).description)
    p = suite.parameters
    network = GaitNetwork(p.canonical, load_gait(gait).scaled(cadence), scale)
    return certify(network, p.inhibition, p.reference, p.leg, p.posture,
                   suite.tick_ns * 1e-9, voting=p.voting).time_to_rest


def run_walk(cases: Sequence[StopCase], file: str | None) -> list[StopOutcome]:
    """Run the cases of one walk with the robot and the parameters of a parameter file."""
    case = cases[0]
    gait = load_gait(case.gait).scaled(case.cadence)
    bound = bound_of(file, case.leg, case.gait, case.cadence)
    return list(run_trials(robot_of(file, case.leg), cases, gait,
                           suite_of(file, case.leg).parameters, bound))


def run_cases(cases: Sequence[StopCase], file: str | None, jobs: int,
              quiet: bool = True) -> Results:
    """Run cases on several processes; the results do not depend on how many."""
    outcomes: list[StopOutcome] = []
    walks = [list(group) for _, group in groupby(cases, _key)]
    with Pool(jobs) as pool:
        for of_walk in pool.imap(partial(run_walk, file=file), walks):
            outcomes += of_walk
            if not quiet:
                print(f'\r{len(outcomes)}/{len(cases)}', end='', file=sys.stderr, flush=True)
    if not quiet:
        print('\r', end='', file=sys.stderr)
    return list(zip(cases, outcomes, strict=True))


def table(results: Results) -> str:
    """Markdown table: a row per gait, speed, cadence, leg and method, and one for each method."""
    rows = []
    for key, group in groupby(results, lambda result: _key(result[0])):
        labels = [f'{part:g}' if isinstance(part, float) else part for part in key]
        rows.append((*labels, *_cells([outcome for _, outcome in group], key[-1])))
    for method in METHODS:
        outcomes = [outcome for case, outcome in results if case.method == method]
        if outcomes:
            rows.append(('all', '', '', '', method, *_cells(outcomes, method)))
    return markdown_table(COLUMNS, rows)


def _key(case: StopCase) -> tuple[str, float, str, float, str]:
    return case.gait, case.speed, case.leg, case.cadence, case.method


def _cells(outcomes: Sequence[StopOutcome], method: str) -> tuple[str, ...]:
    of = StopSummary(outcomes)
    fell, stood, walked_on, bounded, exceeded = map(of.number, (
        'fell', 'standing', 'walked_on', 'bounded', 'bound_exceeded'))
    prediction_error, *others = (
        '-' if isnan(of.spread(name)[0])
        else ' / '.join(f'{scale * value:.{digits}f}' for value in of.spread(name))
        for name, scale, digits in (
            ('prediction_error', 100.0, 1), ('bound_s', 1.0, 2), ('measured_s', 1.0, 2),
            ('body_rest_s', 1.0, 2), ('slip_m', 1e3, 1), ('displacement_m', 1.0, 2),
            ('tilt', 180.0 / pi, 1), ('deceleration', 1.0, 1)))
    count = len(outcomes)
    return (str(count), str(fell), percent(stood, count),
            percent(walked_on, count) if method == METHODS[0] else '-', prediction_error,
            f'{exceeded}/{bounded}' if bounded else '-', *others)


def _parser() -> argparse.ArgumentParser:
    parser = parser_of('study_stops', __doc__, 'every case and outcome')
    parser.add_argument('file', nargs='?', help="parameter file; the package's own without")
    parser.add_argument('--phases', type=int, default=16, metavar='N',
                        help='request phases, evenly over a cycle (default: 16)')
    parser.add_argument('--speeds', type=float, nargs='+', default=[0.2, 0.5, 0.8], metavar='V',
                        help='commanded speeds [m/s] (default: 0.2 0.5 0.8)')
    parser.add_argument('--gaits', nargs='+', default=['amble', 'walk', 'trot'], metavar='GAIT',
                        help='gaits by name (default: amble walk trot)')
    parser.add_argument('--legs', nargs='+', default=[LEGS[0]], choices=LEGS,
                        help='legs whose oscillator is inhibited, one at a time (default: fl)')
    parser.add_argument('--cadences', type=float, nargs='+', default=[1.0], metavar='FACTOR',
                        help='factors on the cadence of the gait (default: 1)')
    parser.add_argument('--push', type=float, default=0.0, metavar='IMPULSE',
                        help='lateral impulse in the instant of the request [N s] (default: 0)')
    parser.add_argument('--baselines', action='store_true',
                        help='also stop by freezing all phases, and by finishing every swing')
    parser.add_argument('--quiet', action='store_true', help='show no progress')
    return parser


if __name__ == '__main__':
    sys.exit(main())
