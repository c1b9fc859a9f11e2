# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trials of changes while walking: of the gait, on a straight way and while the robot turns back
and is stopped, and of a posture control that begins anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass, replace
from math import ceil, isnan, nan

import numpy as np

from dmp_cpg_ros.analysis.motion import tilt
from dmp_cpg_ros.core.estimation.body_estimate import estimated_state
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.robot_model.sensor_readings import readings_of
from dmp_cpg_ros.studies.draws import log_uniform
from dmp_cpg_ros.studies.loop_recording import suite_of
from dmp_cpg_ros.studies.walking_trials import Walk, attitude
from dmp_cpg_ros.suite import load_gaits

CHANGE_SPEEDS = (0.4, 0.6)
"""Speeds at which gaits change, which every gait can do [m/s]."""

CYCLES_AFTER = 3
"""Cycles after a transition within which the phase error must be back under its bound."""

WATCHED = 5.0
"""Time for which the robot is watched after a change was asked for [s]."""


@dataclass(frozen=True)
class ChangeOutcome:
    """One change.

    Attributes
    ----------
    after : str
        Name of the new gait.
    phase : float
        Fraction of a cycle at which it was asked for.
    fell : bool
        Whether the robot fell, before or after.
    duration : float
        From the request until the new gait is in force [s]; NaN where it was not within
        ``WATCHED``.
    cycles : float
        The same in cycles of the new gait.
    phase_error : float
        Largest deviation of a leg from its moving place, from the request on [rad].
    in_time : bool
        Whether the error stayed below ``LOCKED_PHASE_ERROR`` from ``CYCLES_AFTER`` cycles after
        the end on.
    sway : float
        Largest roll or pitch from the request on [deg].
    """

    after: str
    phase: float
    fell: bool
    duration: float = nan
    cycles: float = nan
    phase_error: float = nan
    in_time: bool = False
    sway: float = nan


def run_changes(before: str, speed: float, phases: int, robot: str | None = None
                ) -> list[ChangeOutcome]:
    """Walk at a speed [m/s] once, and change to every other gait at some phases, evenly over a
    cycle, in copies of the walk.
    """
    run = Walk(before, robot)
    return [_changed(deepcopy(run), fell) if upright else fell
            for phase, upright in _phases(run, speed, phases)
            for fell in (ChangeOutcome(after, phase, True)
                         for after in load_gaits() if after != before)]


def _phases(run: Walk, speed: float, phases: int) -> Iterator[tuple[float, bool]]:
    """Walk at a speed [m/s] to some phases, evenly over a cycle; tell at each whether it fell."""
    upright = run.settle((speed, 0.0, 0.0))
    step = run.period() / phases
    for k in range(phases):
        yield k / phases, upright
        upright = run.walk(step)


def _changed(run: Walk, fell: ChangeOutcome) -> ChangeOutcome:
    """Outcome of a change that is asked for now."""
    run.states.clear()
    reason = run.loop.change_gait(fell.after)
    if reason:
        raise RuntimeError(reason)
    errors, duration = [], nan
    for k in range(ceil(WATCHED / run.tick_s)):
        if not run.walk(run.tick_s):
            return fell
        network = run.loop.network
        errors.append(float(np.abs(network.phase_errors(run.loop.x)).max()))
        if network.gait.name == fell.after and isnan(duration):
            duration = (k + 1) * run.tick_s
    period = run.period()
    settled = [] if isnan(duration) else errors[
        round((duration + CYCLES_AFTER * period) / run.tick_s):]
    sway = float(np.abs(np.rad2deg(attitude(run.states)[:, :2])).max())
    return replace(fell, fell=False, duration=duration, cycles=duration / period,
                   phase_error=max(errors), sway=sway,
                   in_time=bool(settled) and max(settled) < LOCKED_PHASE_ERROR)


FORTH, BACK = (1.5, 3.0), 1.5
"""Times for which a robot walks before it turns back, and after it is resumed [s]."""

CHANGED, STOPPED, HELD = (-0.3, 1.0), (0.0, 2.0), (0.2, 2.5)
"""When a gait changes and when it is stopped, after the robot is told to turn back, and for how
long the stop is held [s].
"""

BORDERS = (0.15, 0.7)
"""Dimensionless foot speeds between which the border of two gaits is drawn."""


@dataclass(frozen=True)
class ReturnOutcome:
    """A walk forth and back.

    Attributes
    ----------
    fell : str
        What went on at the fall; empty without.
    chosen : bool
        Whether the gait was chosen by speed, at a border; else the change was asked for.
    tilt : float
        Largest tilt [deg].
    """

    fell: str
    chosen: bool
    tilt: float


def run_return(before: str, after: str, seed: int, robot: str | None = None) -> ReturnOutcome:
    """Walk in one gait as fast as may be asked for, and be told to go back as fast in another;
    be stopped about the change, and walk on.

    Half of the walks change gait by speed. Velocities sideways and turn rates are drawn, each zero
    in half of the walks, anew on the way back.

    Parameters
    ----------
    before, after : str
        Names of the gaits.
    seed : int
        Of all that is drawn, and of start and noise.
    robot : str, optional
        Robot file; the suite's own without.
    """
    rng, p = np.random.default_rng(seed), suite_of(robot=robot).parameters.reference
    chosen, ahead = bool(rng.integers(2)), float(rng.choice((-1.0, 1.0)))
    (forth, back), turn = (
        (way * p.max_speed, *(rng.integers(2, size=2) * rng.uniform(-1.0, 1.0, 2) * (
            p.max_lateral_speed, p.max_turn_rate)).tolist()) for way in (ahead, -ahead)
    ), float(rng.uniform(*FORTH))
    change, stop = (turn + float(rng.uniform(*after_it)) for after_it in (CHANGED, STOPPED))
    resume, border = stop + float(rng.uniform(*HELD)), log_uniform(rng, *BORDERS)
    run = Walk(before, robot, seed=seed + 1, values=(
        ('auto_gait', True), ('auto_gaits', (before, after)), ('auto_speeds', (border,)),
        ('auto_hysteresis', 0.02)) if chosen else ())
    loop = run.loop
    events: list[tuple[float, Callable[[], object]]] = sorted([
        (turn, lambda: loop.command(*back)), (stop, lambda: loop.request(True)),
        (resume, lambda: loop.request(False)),
        *([] if chosen else [(change, lambda: loop.change_gait(after))])],
        key=lambda event: event[0])
    loop.command(*forth)
    for k in range(round((resume + BACK) / run.tick_s)):
        while events and events[0][0] <= k * run.tick_s:
            events.pop(0)[1]()
        if not run.walk(run.tick_s):
            break
    largest = float(np.rad2deg(tilt(
        np.array([state.base_quaternion for state in run.states])).max()))
    return ReturnOutcome(
        f'{k * run.tick_s - turn:.2f} s after it was told to turn back, {loop.canon.gait.name}, '
        f'{loop.stop.state}' if run.fell() else '', chosen, largest)


@dataclass(frozen=True)
class RestartOutcome:
    """What became of a walk whose posture control began anew: whether it fell, and its largest
    tilt afterwards [deg].
    """

    fell: bool
    tilt: float


def run_restarts(gait: str, speed: float, phases: int) -> list[RestartOutcome]:
    """Walk at a speed [m/s], and let posture control and estimator forget all at some phases,
    evenly over a cycle, as a node that is started again has.
    """
    run = Walk(gait, seed=1)
    return [_restarted(deepcopy(run)) if upright else RestartOutcome(True, nan)
            for _, upright in _phases(run, speed, phases)]


def _restarted(run: Walk) -> RestartOutcome:
    loop = run.loop
    run.states.clear()
    if loop.estimator is None:
        raise RuntimeError('state_source must be estimate')
    loop.estimator_state, estimate = loop.estimator.step(None, readings_of(run.state))
    loop.posture = loop.body.picked_up(
        loop.body.initial_state(), estimated_state(readings_of(run.state), estimate))
    upright = run.walk(WATCHED)
    return RestartOutcome(not upright, float(np.rad2deg(tilt(
        np.array([state.base_quaternion for state in run.states])).max())))
