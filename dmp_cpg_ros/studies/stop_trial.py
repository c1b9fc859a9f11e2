# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops and starts of the MuJoCo robot in the plain loop, as the nodes would do in lock-step.

The robot walks once for all request phases of a gait and speed; every case goes on from a copy of
robot and loop at its phase, and so gives the same numbers as a run of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.stop_outcome import WALKING_ERROR, StopOutcome, body_at_rest
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import recording_of
from dmp_cpg_ros.studies.loop_run import LoopRun
from dmp_cpg_ros.studies.stop_baselines import FreezingLoop

METHODS = ('inhibition', 'freeze', 'finish_swing')
"""Ways to stop: sparse inhibition, and the two of studies/stop_baselines.py."""

WALKING_BEFORE, WALKING_AFTER = 4.0, 3.5
"""Time from the start to the first request, and from the resume to the end [s]."""

SHORTEST_HOLD, LONGEST_HOLD, HOLD_AT_REST = 2.5, 12.0, 1.0
"""The hold takes this at least and at most, and this after the oscillators are at rest [s]."""

SPEED_WINDOW = 2.0
"""Time at the end over which the resumed speed is averaged [s]."""

TimeBound = Callable[[FreezingLoop], float]
"""Bound on the time to rest of a loop in which a stop has just been requested [s]."""


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
        Leg whose oscillator is inhibited.
    push : float
        Lateral impulse in the instant of the request [N s].
    method : str
        One of ``METHODS``.
    """

    gait: str
    speed: float
    phase: float
    cadence: float = 1.0
    leg: str = 'fl'
    push: float = 0.0
    method: str = METHODS[0]


def run_trials(robot: MujocoRobot, cases: Sequence[StopCase], gait: Gait,
               parameters: SuiteParameters, time_bound: TimeBound | None = None
               ) -> Iterator[StopOutcome]:
    """Walk once; at the phase of each case stop and hold, and after an inhibition walk on.

    Parameters
    ----------
    robot : MujocoRobot
        Is reset; equal calls give equal outcomes.
    cases : sequence of StopCase
        Of one gait, speed and cadence, with ascending phases. The leg is in the parameters.
    gait : Gait
        The gait, its cadence included.
    parameters : SuiteParameters
        Parameters of the parts, without a timeout of the command.
    time_bound : callable, optional
        Guaranteed time to rest, asked right after the request.

    Yields
    ------
    StopOutcome
        One per case, in order.

    Raises
    ------
    ParameterError
        If the phases do not ascend or the walks differ.
    """
    phases = [case.phase for case in cases]
    walks = {(case.gait, case.speed, case.cadence) for case in cases}
    if phases != sorted(phases) or len(walks) > 1:
        raise ParameterError('the cases of one walk need one gait, speed and cadence and '
                             f'ascending phases, not {sorted(walks)} at {phases}')
    trial = _Trial(robot, FreezingLoop(robot.description, gait, parameters))
    for case in cases:
        trial.loop.command(case.speed)
        omega = trial.loop.network.omega(np.array((case.speed, 0.0, 0.0)))
        trial.walk_until(WALKING_BEFORE + case.phase * 2.0 * np.pi / omega)
        yield _outcome(deepcopy(trial), case, time_bound)


def _outcome(trial: _Trial, case: StopCase, time_bound: TimeBound | None) -> StopOutcome:
    """What becomes of a trial that walks at the phase of the case."""
    if trial.fell():
        return StopOutcome(fell=True)
    predicted, bound, measured = trial.stop(case, time_bound)
    if trial.fell():
        return StopOutcome(True, predicted_s=predicted, bound_s=bound, measured_s=measured)
    context = RunContext(robot=trial.robot.description)
    at_rest = body_at_rest(
        recording_of(trial.states), trial.robot.description, context.contact_force)
    if case.method != METHODS[0]:
        return at_rest
    resumed = trial.resume(case)
    return replace(at_rest, fell=trial.fell(), predicted_s=predicted, bound_s=bound,
                   measured_s=measured, resumed_speed=resumed,
                   walked_on=abs(resumed - case.speed) <= WALKING_ERROR * case.speed)


class _Trial(LoopRun[FreezingLoop]):
    """A run that can be stopped in each of the ways."""

    def stop(self, case: StopCase, time_bound: TimeBound | None) -> tuple[float, float, float]:
        """Request a stop and hold; return the predicted, bounded and measured time to rest [s]."""
        if case.push:
            self.push(np.array((0.0, case.push, 0.0)))
        self.states = [self.state]
        if case.method != METHODS[0]:
            self.loop.freeze(case.method == 'finish_swing')
            self.walk(SHORTEST_HOLD)
            return (np.nan,) * 3
        predicted = self.loop.request(True)
        bound = np.nan if time_bound is None else time_bound(self.loop)
        held, measured = 0.0, np.inf
        while held < LONGEST_HOLD and not self.fell() and not (
                held >= max(SHORTEST_HOLD, measured + HOLD_AT_REST)):
            self.walk(self.tick_s)
            held += self.tick_s
            if self.loop.stop.state == 'at_rest':
                measured = self.loop.stop.measured_s
        # a robot that fell on the way says nothing of the oscillators' time to rest
        unknown = self.fell() and measured == np.inf
        return predicted, bound, np.nan if unknown else measured

    def resume(self, case: StopCase) -> float:
        """Walk on; return the mean forward speed at the end [m/s]."""
        self.loop.request(False)
        self.walk(WALKING_AFTER)
        count = round(SPEED_WINDOW / self.tick_s)
        return float(np.mean([state.base_velocity_in_base[0] for state in self.states[-count:]]))
