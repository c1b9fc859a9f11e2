# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops of a walking robot: what happens after a request at some phase of some walk.

A robot walks once for all request phases of a gait and speed; every case goes on from a copy of
robot and loop at its phase, and so gives the same numbers as a run of its own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.robot_model.mismatch import MismatchParameters
from dmp_cpg_ros.core.robot_model.world import WORLDS
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.files import readable, writable
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies import loop_recording as runs
from dmp_cpg_ros.studies.freezing_loop import FreezingLoop
from dmp_cpg_ros.studies.loop_recording import LoopRun, StopOutcome, suite_of
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import Suite

METHODS = ('inhibition', 'freeze', 'finish_swing')
"""Ways to stop: sparse inhibition, and the two simple ones."""

WALKING_BEFORE, WALKING_AFTER = 4.0, 3.5
"""Time from the start to the first request, and from the resume to the end [s]."""

SHORTEST_HOLD, LONGEST_HOLD, HOLD_AT_REST = 2.5, 12.0, 1.0
"""The hold takes this at least and at most, and this after the oscillators are at rest [s]."""

GROUNDS = {'flat': '', 'slope': 'degrees', 'blocks': 'height', 'hills': 'degrees'}
"""Worlds that stops are tried in, and the parameter that says how rough they are."""

SPREAD = 0.03
"""Of the joints at the start where there is a seed [rad]."""

SPEED_WINDOW = 2.0
"""Time at the end over which the resumed speed is averaged [s]."""


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
    ground : str
        One of ``GROUNDS``; it begins 0.7 m ahead of where the robot starts.
    roughness : float
        Of the ground: the parameter that ``GROUNDS`` names [deg], [m].
    seed : int
        Of the ground, of the joints' initial spread and of the noise of the sensors; with 0 the
        sensors are exact.
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
    ground: str = 'flat'
    roughness: float = 0.0
    seed: int = 0

    @property
    def row(self) -> tuple[str, float, str, float, float, str]:
        """Of the table: stops that are counted together."""
        return self.gait, self.speed, self.leg, self.cadence, self.braking, self.method

    @property
    def walk(self) -> tuple[float, float, str, float, int]:
        """What else a walk depends on that stops are tried of."""
        return self.friction, self.payload, self.ground, self.roughness, self.seed

    def robot(self, suite: Suite) -> MujocoRobot:
        """The robot in its world."""
        kind, value = WORLDS[self.ground], GROUNDS[self.ground]
        drawn = {'seed': self.seed} if hasattr(kind, 'seed') else {}
        world = kind(friction=self.friction, **({value: self.roughness} if value else {}), **drawn)
        return MujocoRobot(suite.robot_file, suite.tick_ns, self.seed, SPREAD * bool(self.seed),
                           world=world, sensors=suite.sensors if self.seed else None,
                           mismatch=MismatchParameters(payload=self.payload))


Results = list[tuple[StopCase, StopOutcome]]


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
        cases[len(outcomes):], lambda case: (*case.row, *case.walk))]
    with workers, writable(record or os.devnull).open('a', encoding='utf-8') as kept:
        for of_walk in workers.map(partial(run_walk, file=file), walks):
            now = zip(cases[len(outcomes):], of_walk, strict=False)
            print(*(json.dumps({'case': vars(case), 'outcome': vars(outcome)})
                    for case, outcome in now), sep='\n', file=kept, flush=True)
            outcomes += of_walk
    return list(zip(cases, outcomes[:len(cases)], strict=True))


def _recorded(record: Path, cases: Sequence[StopCase]) -> list[StopOutcome]:
    """Outcomes of the first cases; a last line that was not written to its end is dropped."""
    data = readable(record).read_bytes()
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


def run_walk(cases: Sequence[StopCase], file: str | None) -> list[StopOutcome]:
    """Run the cases of one walk with the robot and the parameters of a parameter file, and the
    certified time to rest, which holds for every phase and is infinite without a certificate.
    """
    suite = suite_of(file, gait=cases[0].gait, inhibited_legs=(cases[0].leg,),
                     braking=cases[0].braking)
    gait = suite.gait.scaled(cases[0].cadence)
    robot, p = cases[0].robot(suite), suite.parameters
    certificate = certify(Setting.of(
        GaitNetwork(p.canonical, gait, body_scale(robot.description)), p, suite.tick_ns * 1e-9))
    return list(run_trials(robot, gait, cases, p, certificate.time_to_rest))


def run_trials(robot: MujocoRobot, gait: Gait, cases: Sequence[StopCase],
               parameters: SuiteParameters, bound_s: float = np.nan) -> Iterator[StopOutcome]:
    """Walk once; at the phase of each case stop and hold, and after an inhibition walk on.

    Parameters
    ----------
    robot : MujocoRobot
        Is reset; equal calls give equal outcomes.
    gait : Gait
        At the cadence of the cases.
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
