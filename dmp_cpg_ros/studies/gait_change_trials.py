# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trials of gaits that change while walking: falls, time, phase error, sway."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from itertools import permutations
from math import ceil, nan, pi

import numpy as np

from dmp_cpg_ros.analysis.motion import roll_pitch_yaw
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.studies.walking_trials import Walk
from dmp_cpg_ros.suite import load_gaits

SPEEDS = (0.4, 0.6)
"""Speeds that every gait can do [m/s]."""

CYCLES_AFTER = 3
"""Cycles after a transition within which the phase error must be back under its bound."""

WATCHED = 5.0
"""Time for which the robot is watched after a change was asked for [s]."""


@dataclass(frozen=True)
class ChangeCase:
    """Changes from one gait to all others at one speed.

    Attributes
    ----------
    before : str
        Name of the gait that is walked.
    speed : float
        Commanded forward speed [m/s].
    phases : int
        Number of phases, evenly over a cycle, at which the change is asked for.
    """

    before: str
    speed: float
    phases: int


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
        From the request until the new gait is in force [s].
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


def change_cases(phases: int) -> list[ChangeCase]:
    """All gaits at all speeds."""
    return [ChangeCase(before, speed, phases) for before in load_gaits() for speed in SPEEDS]


def run_changes(case: ChangeCase) -> list[ChangeOutcome]:
    """Walk once, and change to every other gait at every phase in copies of the walk."""
    others = [after for before, after in permutations(load_gaits(), 2) if before == case.before]
    run = Walk(case.before)
    upright = run.reach((case.speed, 0.0, 0.0)) and run.walk(3.0)
    step = 2.0 * pi / run.loop.network.omega(run.loop.r) / case.phases
    outcomes = []
    for k in range(case.phases):
        for after in others:
            fell = ChangeOutcome(after, k / case.phases, True)
            outcomes.append(_changed(deepcopy(run), fell) if upright else fell)
        upright = run.walk(step)
    return outcomes


def _changed(run: Walk, outcome: ChangeOutcome) -> ChangeOutcome:
    run.states.clear()
    reason = run.loop.change_gait(outcome.after)
    if reason:
        raise RuntimeError(reason)
    errors, tick = [], run.tick_s
    duration = nan
    for k in range(ceil(WATCHED / tick)):
        if not run.walk(tick):
            return outcome
        network = run.loop.network
        errors.append(float(np.abs(network.phase_errors(run.loop.x)).max()))
        if network.gait.name == outcome.after and duration != duration:
            duration = (k + 1) * tick
    period = 2.0 * pi / run.loop.network.omega(run.loop.r)
    settled = errors[round((duration + CYCLES_AFTER * period) / tick):]
    attitude = np.array([state.base_quaternion for state in run.states])
    sway = float(np.abs(np.rad2deg(roll_pitch_yaw(attitude)[:, :2])).max())
    return ChangeOutcome(outcome.after, outcome.phase, False, duration, duration / period,
                         max(errors), bool(settled) and max(settled) < LOCKED_PHASE_ERROR, sway)
