# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trials of pushes: the largest that a walk survives, and drawn ones in manoeuvres."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache, partial
from math import ceil, cos, log2, nan, pi, sin
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.maths.roots import last_that_holds
from dmp_cpg_ros.core.robot_model.world import WORLDS
from dmp_cpg_ros.studies.loop_recording import PUSH_DURATION, LoopRun, Velocity
from dmp_cpg_ros.studies.walking_trials import RECOVERY, Walk, attitude

PUSH_RESOLUTION, LARGEST_PUSH = 0.1, 3.2
"""Of the speed change by a push that is looked for [m/s]."""


def survived_pushes(gait: str, speed: float, phase: float, directions: Sequence[float],
                    robot: str | None = None) -> tuple[float, ...]:
    """Look for the largest speed change Δv = J/m that is survived, per direction, by bisection.

    Every impulse below it that the bisection tried was survived too.

    Parameters
    ----------
    gait : str
        Name of the gait.
    speed : float
        Commanded forward speed [m/s].
    phase : float
        Fraction of a cycle at which the push begins.
    directions : sequence of float
        Directions of the pushes in the base frame [rad].
    robot : str, optional
        Robot file; the suite's own without.

    Returns
    -------
    tuple of float
        [m/s]; NaN where the robot fell before any push.
    """
    run = Walk(gait, robot)
    if not (run.settle((speed, 0.0, 0.0)) and run.walk(phase * run.period())):
        return (nan,) * len(directions)
    return largest_pushes(run, directions)


def largest_pushes(run: LoopRun[Any], directions: Sequence[float], most: float = LARGEST_PUSH
                   ) -> tuple[float, ...]:
    """As :func:`survived_pushes`, for a run as it is, with up to ``most`` [m/s]."""
    halvings = ceil(log2(most / PUSH_RESOLUTION) - 1e-9)
    return tuple(most if survives(run, angle, most) else last_that_holds(
        partial(survives, run, angle), 0.0, most, halvings) for angle in directions)


def survives(run: LoopRun[Any], angle: float, speed_change: float) -> bool:
    """Whether a copy of a run stays on its feet for ``RECOVERY`` after a push in a direction of
    the base frame [rad] that would change the free body's speed by so much [m/s].
    """
    after = deepcopy(run)
    yaw = float(attitude([run.state])[0, 2]) + angle
    impulse = after.robot.description.mass * speed_change
    after.push(np.array((impulse * cos(yaw), impulse * sin(yaw), 0.0)))
    return after.walk(RECOVERY)


class Manoeuvre(NamedTuple):
    """What the robot does when it is pushed: from rest without a velocity; ``then`` begins the
    manoeuvre, and the push comes within ``window`` [s] from there.
    """

    gait: str
    velocity: Velocity | None
    then: Callable[[WalkingLoop], object]
    window: float


def _start(loop: WalkingLoop) -> None:
    loop.command(0.5)
    loop.request(False)


MANOEUVRES = {
    'at rest': Manoeuvre('amble', None, lambda loop: None, 0.0),
    'stopping from an amble at 0.5 m/s': Manoeuvre(
        'amble', (0.5, 0.0, 0.0), lambda loop: loop.request(True), 1.2),
    'stopping from a trot at 1.5 m/s': Manoeuvre(
        'trot', (1.5, 0.0, 0.0), lambda loop: loop.request(True), 1.4),
    'starting': Manoeuvre('amble', None, _start, 0.8),
    'changing from amble to trot at 0.5 m/s': Manoeuvre(
        'amble', (0.5, 0.0, 0.0), lambda loop: loop.change_gait('trot'), 2.0),
    'turning, amble 0.5 m/s and 0.8 rad/s': Manoeuvre(
        'amble', (0.5, 0.0, 0.8), lambda loop: None, 0.6),
}
"""What pushes meet."""

PUSH_DURATIONS = (0.05, 0.4)
"""Least and longest time of a push that is drawn [s]."""


@dataclass(frozen=True)
class PushedOutcome:
    """Whether it fell, rests at the end, how often it was released, and the largest reference
    speed after the push.
    """

    fell: bool
    rests: bool = False
    releases: int = 0
    reference: float = nan


@lru_cache(maxsize=2)
def _before(manoeuvre: str, recovery: bool, robot: str | None) -> Walk:
    gait, velocity, *_ = MANOEUVRES[manoeuvre]
    run = Walk(gait, robot, values=(('push_recovery', recovery),), start=velocity is not None)
    if velocity is not None:
        run.settle(velocity)
    return run


def pushed(manoeuvre: str, speed_change: float, case: int, cases: int, drawn: bool = True,
           recovery: bool = True, robot: str | None = None) -> PushedOutcome:
    """Push the robot in one of ``MANOEUVRES``, begun at phase case/cases.

    Direction, duration and time within the manoeuvre are drawn from the case as seed, or the push
    lasts ``PUSH_DURATION`` and the cases are directions, evenly around.
    """
    run, draw = deepcopy(_before(manoeuvre, recovery, robot)), np.random.default_rng(1000 + case)
    _, velocity, then, window = MANOEUVRES[manoeuvre]
    angle, duration = 2.0 * pi * case / cases, PUSH_DURATION
    if drawn:
        angle, duration = draw.uniform(0.0, 2.0 * pi), round(draw.uniform(*PUSH_DURATIONS), 3)
    if velocity is not None:
        run.walk(case / cases * run.period())
    then(run.loop)
    run.walk(draw.uniform(0.0, window))
    push(run, speed_change, angle, duration)
    releases, reference = 0, 0.0
    for _ in range(ceil((RECOVERY + duration) / run.tick_s)):
        was = run.loop.stop.push.acts
        if not run.walk(run.tick_s):
            return PushedOutcome(True, False, releases, reference)
        releases += run.loop.stop.push.acts and not was
        reference = max(reference, float(np.abs(run.loop.r).max()))
    return PushedOutcome(False, run.loop.stop.state == 'at_rest', releases, reference)


@lru_cache(maxsize=1)
def _steady(gait: str, speed: float, robot: str | None, ground: str, quick: bool) -> Walk:
    world = WORLDS[ground](**({'height': 0.03, 'seed': 1} if ground == 'blocks' else {}))
    run = Walk(gait, robot, world, values=(('step_timing', quick),))
    run.settle((speed, 0.0, 0.0))
    return run


def caught(gait: str, speed: float, speed_change: float, case: int, quick: bool = True,
           robot: str | None = None, ground: str = 'flat') -> bool:
    """Whether a walk stays on its feet for ``RECOVERY`` after a push whose time in the cycle,
    direction and duration are drawn from the case as seed; with steps that are quicker or not.
    """
    draw = np.random.default_rng(2000 + case)
    run, angle = deepcopy(_steady(gait, speed, robot, ground, quick)), draw.uniform(0.0, 2.0 * pi)
    duration = round(draw.uniform(*PUSH_DURATIONS), 3)
    run.walk(draw.uniform(0.0, run.period()))
    push(run, speed_change, angle, duration)
    return run.walk(RECOVERY + duration)


def push(run: Walk, speed_change: float, angle: float, duration: float) -> None:
    """Push a robot from now on so that its free body's speed would change by so much [m/s], in a
    direction of the base frame [rad], for a time [s].
    """
    yaw = angle + float(attitude([run.state])[0, 2])
    force = run.robot.description.mass * speed_change / duration
    run.robot.apply_push(force * np.array((cos(yaw), sin(yaw), 0.0)), round(duration * 1e9))


def unpushed(gait: str, speed: float, seed: int, kind: str, numbers: Mapping[str, float],
             payload: float = 0.0) -> PushedOutcome:
    """Stop from a speed [m/s] at a drawn time without a push, with a payload as share of the
    robot's mass.
    """
    run = Walk(gait, None, WORLDS[kind](**numbers), seed, (('payload', payload),))
    draw = np.random.default_rng(seed)
    upright = run.settle((speed, 0.0, 0.0)) and run.walk(draw.uniform(0.0, 1.0))
    run.loop.request(True)
    releases = 0
    for _ in range(ceil(RECOVERY / run.tick_s)):
        upright = upright and run.walk(run.tick_s)
        releases = max(releases, run.loop.stop.push.releases)
    return PushedOutcome(not upright, run.loop.stop.state == 'at_rest', releases)
