# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops and starts the walking robot at many phases, speeds and gaits; tabulates what happened.

The robot is the MuJoCo one in the plain loop, its state estimated, from exact sensors unless the
stops are drawn at random. Exit status 1 when it fell in a case that was stopped by inhibition,
2 when the arguments cannot be used.

Two simple ways to stop, which freeze the phases, are compared with sparse inhibition.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from itertools import groupby, product
from math import isnan, pi
from pathlib import Path
from statistics import median
from typing import Any

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.canonical.inhibition import AUTO
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.studies import loop_recording as runs
from dmp_cpg_ros.studies.loop_recording import StopOutcome, suite_of
from dmp_cpg_ros.studies.output import (
    at_least_one,
    markdown_table,
    parser_of,
    percent,
    write_results,
)
from dmp_cpg_ros.studies.random_stops import random_cases, scenario_bound, summary
from dmp_cpg_ros.studies.stop_trials import METHODS, Results, StopCase, run_cases
from dmp_cpg_ros.studies.workers import Workers

SPREADS = {
    'prediction error %': ('prediction_error', 100.0, 1), 'bound s': ('bound_s', 1.0, 2),
    'rest s': ('measured_s', 1.0, 2), 'body rest s': ('body_rest_s', 1.0, 2),
    'still s': ('still_s', 1.0, 2), 'slip mm': ('slip_m', 1e3, 1),
    'moved m': ('displacement_m', 1.0, 2), 'tilt deg': ('tilt', 180.0 / pi, 1),
    'm/s^2': ('deceleration', 1.0, 1)}
"""Columns with two numbers: what of an outcome, in which unit, with how many digits."""

KEY, COUNTED = (('gait', 'speed', 'leg', 'cadence', 'braking', 'method'),
                ('fell', 'standing', 'walked_on', 'bounded', 'bound_exceeded'))
"""What the stops of a row have in common, as :attr:`.StopCase.row`; what is counted of them."""

FIRST = 'prediction error %'
"""Column that comes before the one of bounds."""

TOLD_SHARES = 0.1, 0.15
"""Shares of the time it was told to take by which a body may stand sooner or later."""

COLUMNS = ('gait', 'm/s', 'leg', 'cadence', 'braking', 'stopped by', 'cases', 'fell', 'stood',
           'walked on', FIRST, 'over bound', *(name for name in SPREADS if name != FIRST))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its table; returns the exit status."""
    parser = parser_of('study_stops', __doc__, 'the numbers that are printed')
    parser.add_argument('file', nargs='?', help="parameter file; the package's own without")
    parser.add_argument('--phases', type=int, default=16, metavar='N',
                        help='request phases, evenly over a cycle (default: 16)')
    parser.add_argument('--speeds', type=float, nargs='+', default=[0.2, 0.5, 0.8], metavar='V',
                        help='commanded speeds [m/s] (default: 0.2 0.5 0.8)')
    parser.add_argument('--gaits', nargs='+', default=['amble', 'walk', 'trot'], metavar='GAIT',
                        help="gaits by name, of the parameter file's gaits_file "
                        '(default: amble walk trot)')
    parser.add_argument('--legs', nargs='+', default=[LEGS[0]], choices=(*LEGS, AUTO),
                        help='legs whose oscillator is inhibited, one at a time; auto: whichever '
                        'comes first (default: fl)')
    parser.add_argument('--braking', type=float, nargs='+', default=[0.0], metavar='A',
                        help='least decelerations of the reference in a stop [m/s^2] (default: 0)')
    parser.add_argument('--no-resume', action='store_true', help='do not walk on after the hold')
    parser.add_argument('--cadences', type=float, nargs='+', default=[1.0], metavar='FACTOR',
                        help='factors on the cadence of the gait (default: 1)')
    parser.add_argument('--push', type=float, default=0.0, metavar='IMPULSE',
                        help='lateral impulse in the instant of the request [N s] (default: 0)')
    parser.add_argument('--baselines', action='store_true',
                        help='also stop by freezing all phases, and by finishing every swing')
    parser.add_argument('--random', type=at_least_one, metavar='N',
                        help='instead of the phases N stops at random: gait, speed between the '
                        'extremes of --speeds, phase, friction 0.3 to 1, payload up to 30 %%, '
                        'push up to 2.6 N s, ground; says how often the body stands as was said')
    parser.add_argument('--seed', type=int, default=0, help='of --random (default: 0)')
    parser.add_argument('--record', type=Path, metavar='FILE',
                        help='add every case and its outcome here, a line of JSON each, and go on '
                        'from those that are there')
    parser.add_argument('--quiet', action='store_true', help='show no progress')
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: RosArguments) -> int:
    cases = random_cases(options) if options.random else cases_of(options)
    suite = suite_of(options.file, inhibited_legs=(cases[0].leg,), braking=cases[0].braking)
    for gait in options.gaits:
        suite.gaits.named(gait)
    results = run_cases(cases, options.file, Workers(
        options.workers, options.cluster, not options.quiet), options.record)
    print(f'{suite.file}: {len(cases)} stops; columns with two numbers are median / worst\n')
    told: Any = summarised(results, by_case=not options.random)
    print(table(told))
    if any(_judged(*result) for result in results):
        print(f'\nwhen the body stood, and was told to; earlier is least / median / most\n\n'
              f'{table_of_told(results)}')
    if options.random:
        told = summary(cases, [outcome for _, outcome in results], options.seed)
        print(f'\n{scenario_bound(told)}')
        print(*(f'not as was said: {case} {outcome}' for case, outcome in results
                if outcome.broken), sep='\n')
    print(*(f'fell: {case}' for case, outcome in results if outcome.fell), sep='\n')
    write_results(options.json, told)
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
    return [StopCase(gait, speed, phase, cadence, leg, options.push, method, braking,
                     not options.no_resume)
            for gait, speed, cadence, leg, braking, method, phase in product(
                options.gaits, options.speeds, options.cadences, options.legs, options.braking,
                methods, phases)]


def summarised(results: Results, by_case: bool = True) -> list[dict[str, Any]]:
    """Rows of the table as numbers: one per gait, speed, leg, cadence, braking and method unless
    there is to be none, and one for each method.

    Returns
    -------
    list of dict
        What the stops of a row have in common (of ``all`` the method only), how many there are,
        in how many something is so, and of numbers the median and the worst; None for how many
        walked on where none was to.
    """
    rows = [(dict(zip(KEY, key, strict=True)), list(group))
            for key, group in groupby(results, lambda result: result[0].row) if by_case]
    rows += [({**dict.fromkeys(KEY), 'gait': 'all', 'method': method},
              [result for result in results if result[0].method == method]) for method in METHODS]
    return [{**key, **_numbers(group)} for key, group in rows if group]


def _numbers(results: Results) -> dict[str, Any]:
    of = runs.StopSummary([outcome for _, outcome in results])
    numbers = {'cases': len(results), **{name: of.number(name) for name in COUNTED},
               **{name: of.spread(name) for name, _, _ in SPREADS.values()}}
    if not any(case.resumes for case, _ in results):
        numbers['walked_on'] = None
    return numbers


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Markdown table of rows as :func:`summarised` makes them, or as their file has them."""
    return markdown_table(COLUMNS, [
        (*('' if row[name] is None else f'{row[name]:g}' if isinstance(row[name], float) else
           row[name] for name in KEY), *_cells(row)) for row in rows])


def table_of_told(results: Results) -> str:
    """Markdown table of when the body stood after a stop by inhibition, beside what was told: of
    those that neither fell nor were stepped out of, which begins a stop anew.
    """
    rows: dict[tuple[str, ...], list[StopOutcome]] = {}
    judged = [result for result in results if _judged(*result)]
    for case, outcome in judged:
        rows.setdefault((case.gait, case.leg, f'{case.cadence:g}', f'{case.braking:g}'),
                        []).append(outcome)
    rows['all', '', '', ''] = [outcome for _, outcome in judged]
    within = (f'within {100.0 * share:g} %' for share in TOLD_SHARES)
    return markdown_table(
        ('gait', 'leg', 'cadence', 'braking', 'stops', *within, 'earlier s', 'over bound'),
        [(*key, str(len(outcomes)), *_kept(outcomes)) for key, outcomes in rows.items()])


def _judged(case: StopCase, outcome: StopOutcome) -> bool:
    return case.method == METHODS[0] and not (
        outcome.fell or outcome.stepped or isnan(outcome.stands_s))


def _kept(outcomes: Sequence[StopOutcome]) -> tuple[str, ...]:
    """How many stood when they were told to; by how much earlier, least, median and most; and how
    many later than the bound.
    """
    early = [(of.stands_s - of.still_s, of.stands_s) for of in outcomes]
    times = sorted(time for time, _ in early)
    return (*(percent(sum(abs(time) <= share * told for time, told in early), len(early))
              for share in TOLD_SHARES),
            ' / '.join(f'{time:.2f}' for time in (times[0], median(times), times[-1])),
            f'{sum(of.late for of in outcomes)}/{len(outcomes)}')


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    count, bounded, walked_on = row['cases'], row['bounded'], row['walked_on']
    prediction_error, *others = (
        '-' if row[name][0] is None or isnan(row[name][0]) else ' / '.join(
            f'{scale * one:.{digits}f}' for one in row[name])
        for name, scale, digits in SPREADS.values())
    return (str(count), str(row['fell']), percent(row['standing'], count),
            percent(walked_on, count) if row['method'] == METHODS[0] and walked_on is not None
            else '-',
            prediction_error, f'{row["bound_exceeded"]}/{bounded}' if bounded else '-', *others)


if __name__ == '__main__':
    sys.exit(main())
