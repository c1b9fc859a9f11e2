# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops and starts the walking robot at many phases, speeds and gaits; tabulates what happened.

The robot is the MuJoCo one in the plain loop, its state estimated from exact sensors.
Exit status 1 when it fell in a case that was stopped by inhibition, 2 when the arguments cannot
be used.

The robot walks once for all request phases of a gait and speed; every case goes on from a copy of
robot and loop at its phase, and so gives the same numbers as a run of its own.

Two simple ways to stop, which freeze the phases, are compared with sparse inhibition.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby, product
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.canonical.inhibition import AUTO
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.mismatch import MismatchParameters
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies import loop_recording as runs
from dmp_cpg_ros.studies.freezing_loop import FreezingLoop
from dmp_cpg_ros.studies.loop_recording import LoopRun, StopOutcome, suite_of
from dmp_cpg_ros.studies.output import (
    at_least_one,
    markdown_table,
    parser_of,
    percent,
    write_results,
)
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import load_gait

METHODS = ('inhibition', 'freeze', 'finish_swing')
"""Ways to stop: sparse inhibition, and the two simple ones."""

WALKING_BEFORE, WALKING_AFTER = 4.0, 3.5
"""Time from the start to the first request, and from the resume to the end [s]."""

SHORTEST_HOLD, LONGEST_HOLD, HOLD_AT_REST = 2.5, 12.0, 1.0
"""The hold takes this at least and at most, and this after the oscillators are at rest [s]."""

LARGEST_PUSH = 2.6
"""Of random stops [N s]: 0.3 m/s of the package's robot."""

SPEED_WINDOW = 2.0
"""Time at the end over which the resumed speed is averaged [s]."""

COLUMNS = ('gait', 'm/s', 'leg', 'cadence', 'braking', 'stopped by', 'cases', 'fell', 'stood',
           'walked on', 'prediction error %', 'over bound', 'bound s', 'rest s', 'body rest s',
           'still s', 'slip mm',
           'moved m', 'tilt deg', 'm/s^2')


@dataclass(frozen=True)
class StopCase:
    """One case of the study.

    Attributes
    ----------
    gait : str
        Name of the gait.
    speed : float
        Commanded forward speed [m/s].
    phase : float
        Fraction of a cycle by which the request comes later.
    cadence : float
        Factor on the gait's cadence.
    leg : str
        Leg whose oscillator is inhibited, or ``auto``.
    push : float
        Impulse in the instant of the request [N s].
    direction : float
        Of the push, from ahead to the left [rad].
    method : str
        One of ``METHODS``.
    braking : float
        Least deceleration of the reference [m/s^2].
    resumes : bool
        Whether it walks on after the hold.
    friction : float
        Of the ground; 0: that of the model.
    payload : float
        Carried at the base's centre of mass, as a share of the robot's mass.
    """

    gait: str
    speed: float
    phase: float
    cadence: float = 1.0
    leg: str = 'fl'
    push: float = 0.0
    method: str = METHODS[0]
    braking: float = 0.0
    resumes: bool = True
    friction: float = 0.0
    payload: float = 0.0
    direction: float = pi / 2.0


Results = list[tuple[StopCase, StopOutcome]]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its table; returns the exit status."""
    parser = parser_of('study_stops', __doc__, 'every case and outcome')
    parser.add_argument('file', nargs='?', help="parameter file; the package's own without")
    parser.add_argument('--phases', type=int, default=16, metavar='N',
                        help='request phases, evenly over a cycle (default: 16)')
    parser.add_argument('--speeds', type=float, nargs='+', default=[0.2, 0.5, 0.8], metavar='V',
                        help='commanded speeds [m/s] (default: 0.2 0.5 0.8)')
    parser.add_argument('--gaits', nargs='+', default=['amble', 'walk', 'trot'], metavar='GAIT',
                        help='gaits by name (default: amble walk trot)')
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
                        'push up to 2.6 N s; says how often the body stands as was said')
    parser.add_argument('--seed', type=int, default=0, help='of --random (default: 0)')
    parser.add_argument('--record', type=Path, metavar='FILE',
                        help='of --random: add outcomes here, and go on from those that are there')
    parser.add_argument('--quiet', action='store_true', help='show no progress')
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: RosArguments) -> int:
    cases = random_cases(options) if options.random else cases_of(options)
    suite = suite_of(options.file, inhibited_legs=(cases[0].leg,), braking=cases[0].braking)
    for gait in options.gaits:
        load_gait(gait)
    results = run_cases(cases, options.file, Workers(
        options.workers, options.cluster, not options.quiet), options.record)
    print(f'{suite.file}: {len(cases)} stops; columns with two numbers are median / worst\n')
    print(table(results, by_case=not options.random))
    if options.random:
        print(f'\n{scenario_bound([outcome for _, outcome in results])}')
        print(*(f'not as was said: {case} {outcome}' for case, outcome in results
                if outcome.broken), sep='\n')
    print(*(f'fell: {case}' for case, outcome in results if outcome.fell), sep='\n')
    write_results(options.json, [vars(case) | vars(outcome) for case, outcome in results])
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


def random_cases(options: argparse.Namespace) -> list[StopCase]:
    """Independent stops of one leg, or of any, with one braking; each depends on the seed and its
    number only.
    """
    cases, speeds = [], options.speeds
    for number in range(options.random):
        rng = np.random.default_rng((options.seed, number))
        cases.append(StopCase(
            str(rng.choice(options.gaits)), float(rng.uniform(min(speeds), max(speeds))),
            float(rng.random()), leg=options.legs[0], push=float(rng.uniform(0.0, LARGEST_PUSH)),
            braking=options.braking[0], resumes=not options.no_resume,
            friction=float(rng.uniform(0.3, 1.0)), payload=float(rng.uniform(0.0, 0.3)),
            direction=float(rng.uniform(0.0, 2.0 * pi))))
    return cases


def scenario_bound(outcomes: Sequence[StopOutcome]) -> str:
    """What N independent stops say of the next one: with none that is not as was said, one is so
    with a probability below ε unless something of probability (1 − ε)^N = β has happened.
    """
    count, broken, stepped = len(outcomes), *(
        sum(getattr(outcome, name) for outcome in outcomes) for name in ('broken', 'stepped'))
    of = f'{count} stops, {stepped} stepped out of; in {broken} the body did not stand as was said'
    if broken:
        return of
    shares = (f'{1.0 - doubt ** (1.0 / count):.2g} at confidence 1 - {doubt:g}'
              for doubt in (0.05, 1e-6))
    return (f'{of}: it does not in another one drawn alike with a probability below '
            f'{" and below ".join(shares)}')


def run_walk(cases: Sequence[StopCase], file: str | None) -> list[StopOutcome]:
    """Run the cases of one walk with the robot and the parameters of a parameter file, and the
    certified time to rest, which holds for every phase and is infinite without a certificate.
    """
    suite = suite_of(file, inhibited_legs=(cases[0].leg,), braking=cases[0].braking)
    gait = load_gait(cases[0].gait).scaled(cases[0].cadence)
    robot, p = MujocoRobot(suite.robot_file, suite.tick_ns,
                           world=World(friction=cases[0].friction),
                           mismatch=MismatchParameters(payload=cases[0].payload)), suite.parameters
    certificate = certify(Setting.of(
        GaitNetwork(p.canonical, gait, body_scale(robot.description)), p, suite.tick_ns * 1e-9))
    return list(run_trials(robot, cases, p, certificate.time_to_rest))


def run_cases(cases: Sequence[StopCase], file: str | None, workers: Workers,
              record: Path | None = None) -> Results:
    """Run cases; the results do not depend on the workers, nor on how much of them a record holds
    already.

    Raises
    ------
    DataError
        If the record holds other cases.
    """
    outcomes: list[StopOutcome] = []
    if record is not None and record.exists():
        outcomes = _recorded(record, cases)
    walks = [list(group) for _, group in groupby(
        cases[len(outcomes):], lambda case: (*_key(case), case.friction, case.payload))]
    with workers, open(record or os.devnull, 'a', encoding='utf-8') as kept:
        for of_walk in workers.map(partial(run_walk, file=file), walks):
            now = zip(cases[len(outcomes):], of_walk, strict=False)
            print(*(json.dumps({'case': vars(case), 'outcome': vars(outcome)})
                    for case, outcome in now), sep='\n', file=kept, flush=True)
            outcomes += of_walk
    return list(zip(cases, outcomes[:len(cases)], strict=True))


def _recorded(record: Path, cases: Sequence[StopCase]) -> list[StopOutcome]:
    """Outcomes of the first cases; a last line that was not written to its end is dropped."""
    data = record.read_bytes()
    whole = data[:data.rfind(b'\n') + 1]
    outcomes = []
    for number, (line, case) in enumerate(zip(whole.splitlines(), cases, strict=False), 1):
        try:
            entry = json.loads(line)
            known = StopCase(**entry['case'])
            outcomes.append(StopOutcome(**entry['outcome']))
        except (ValueError, KeyError, TypeError):
            raise DataError(f"'{record}', line {number}, is no recorded stop; name another file "
                            'with --record') from None
        if known != case:
            raise DataError(f"'{record}', line {number}, is of another stop, {known}, than "
                            f'{case}; name another file with --record, or the options of then')
    os.truncate(record, len(whole))
    return outcomes


def run_trials(robot: MujocoRobot, cases: Sequence[StopCase], parameters: SuiteParameters,
               bound_s: float = np.nan) -> Iterator[StopOutcome]:
    """Walk once; at the phase of each case stop and hold, and after an inhibition walk on.

    Parameters
    ----------
    robot : MujocoRobot
        Is reset; equal calls give equal outcomes.
    cases : sequence of StopCase
        Of one gait, speed and cadence, with ascending phases. The leg is in the parameters.
    parameters : SuiteParameters
        Parameters of the parts, without a timeout of the command.
    bound_s : float
        Guaranteed time to rest, for the outcomes; NaN where there is none [s].

    Yields
    ------
    StopOutcome
        One per case, in order.
    """
    gait = load_gait(cases[0].gait).scaled(cases[0].cadence)
    run = LoopRun(robot, FreezingLoop(robot.description, gait, parameters))
    for case in cases:
        run.loop.command(case.speed)
        omega = run.loop.network.omega(np.array((case.speed, 0.0, 0.0)))
        request = round((WALKING_BEFORE + case.phase * 2.0 * np.pi / omega) / run.tick_s)
        run.walk((request - run.state.time_ns // robot.tick_ns) * run.tick_s)
        run.states.clear()
        yield StopOutcome(fell=True) if run.fell() else _outcome(deepcopy(run), case, bound_s)


def _outcome(run: LoopRun[FreezingLoop], case: StopCase, bound_s: float) -> StopOutcome:
    """What becomes of a run that walks at the phase of the case."""
    if case.push:
        run.push(case.push * np.array((cos(case.direction), sin(case.direction), 0.0)))
    run.states = [run.state]
    times: dict[str, Any] = {}
    if case.method == METHODS[0]:
        times = {'bound_s': bound_s, **_held(run)}
    else:
        run.loop.freeze(case.method == 'finish_swing')
        run.walk(SHORTEST_HOLD)
    if run.fell():
        return StopOutcome(True, **times)
    robot = run.robot.description
    at_rest = runs.body_at_rest(
        runs.recording_of(run.states), robot, RunContext(robot=robot).contact_force)
    if case.method != METHODS[0] or not case.resumes:
        return replace(at_rest, **times)
    run.loop.request(False)
    run.walk(WALKING_AFTER)
    last = run.states[-round(SPEED_WINDOW / run.tick_s):]
    resumed = float(np.mean([state.base_velocity_in_base[0] for state in last]))
    return replace(at_rest, fell=run.fell(), **times, resumed_speed=resumed,
                   walked_on=abs(resumed - case.speed) <= runs.WALKING_ERROR * case.speed)


def _held(run: LoopRun[FreezingLoop]) -> dict[str, Any]:
    """Inhibit and hold; return what was predicted, and the measured time to rest [s]."""
    predicted, held, measured, stepped = run.loop.request(True), 0.0, np.inf, False
    of = run.loop.outlook
    assert of is not None
    while held < min(LONGEST_HOLD, max(SHORTEST_HOLD, measured + HOLD_AT_REST)) and not run.fell():
        run.walk(run.tick_s)
        held += run.tick_s
        stepped |= run.loop.stop.push.acts
        if run.loop.stop.state == 'at_rest':
            measured = run.loop.stop.measured_s
    # a robot that fell on the way says nothing of the oscillators' time to rest
    return {'predicted_s': predicted, 'stepped': stepped, 'stands_s': of.stands_s,
            'within_s': of.stands_within_s, 'within_m': of.stands_within_m,
            'measured_s': np.nan if run.fell() and measured == np.inf else measured}


def table(results: Results, by_case: bool = True) -> str:
    """Markdown table: a row per gait, speed, cadence, leg and method unless there is to be none,
    and one for each method.
    """
    rows = [([f'{part:g}' if isinstance(part, float) else part for part in key], list(group))
            for key, group in groupby(results, lambda result: _key(result[0])) if by_case]
    rows += [(['all', '', '', '', '', method], [result for result in results
                                            if result[0].method == method]) for method in METHODS]
    return markdown_table(COLUMNS, [
        (*labels, *_cells([outcome for _, outcome in group], labels[-1]))
        for labels, group in rows if group])


def _key(case: StopCase) -> tuple[str, float, str, float, float, str]:
    return case.gait, case.speed, case.leg, case.cadence, case.braking, case.method


def _cells(outcomes: Sequence[StopOutcome], method: str) -> tuple[str, ...]:
    of = runs.StopSummary(outcomes)
    fell, stood, walked_on, bounded, exceeded = map(of.number, (
        'fell', 'standing', 'walked_on', 'bounded', 'bound_exceeded'))
    prediction_error, *others = (
        of.cell(name, scale, digits) for name, scale, digits in (
            ('prediction_error', 100.0, 1), ('bound_s', 1.0, 2), ('measured_s', 1.0, 2),
            ('body_rest_s', 1.0, 2), ('still_s', 1.0, 2), ('slip_m', 1e3, 1),
            ('displacement_m', 1.0, 2),
            ('tilt', 180.0 / pi, 1), ('deceleration', 1.0, 1)))
    count = len(outcomes)
    return (str(count), str(fell), percent(stood, count),
            percent(walked_on, count) if method == METHODS[0] else '-', prediction_error,
            f'{exceeded}/{bounded}' if bounded else '-', *others)


if __name__ == '__main__':
    sys.exit(main())
