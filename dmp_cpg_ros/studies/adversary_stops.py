# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on the rows of stops and starts: suites that walk, are stopped, rest and walk again."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dmp_cpg_ros.core.certificates.certify import GROUND
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.certificates.timing import LONGEST_STOP
from dmp_cpg_ros.core.inhibition.entry import SMALLEST_RADIUS
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.studies.draws import Case, Judged, log_uniform
from dmp_cpg_ros.studies.oscillator_loop import GAITS, Oscillators

_FAST = {'alpha_r': 6.0, 'activity_rate': 50.0, 'auto_inhibit': False}
"""Parameters with which a run is short."""

_SPEED = 0.5  # of the reference while the gait runs [m/s]
_VOTES = {'voting': True, 'vote_fade': 60.0, 'silence_weight': 0.0, 'footing_weight': 0.0,
          'collision_weight': 0.0, 'tilt_weight': 0.0}

_WITH_IT = {'votes_suffice': ('votes_time_to_rest', 'votes_contraction'),
            'votes_time_to_rest': ('time_to_rest',), 'time_to_walking': ('time_to_rest',)}
"""Rows that fail with one that is left out: there is no bound on a stop that does not come, and
what is slow makes both slow."""


def _loop(description: RobotDescription, case: Case, row: str, weaken: bool
          ) -> tuple[Oscillators, Certificate] | None:
    """Loop of a case and its certificate, of which a row that is left out is what fails."""
    loop = Oscillators(description, case)
    found = loop.in_force().certificate(whole=True)
    with_it = (row, *_WITH_IT.get(row, ()))
    others = all(one.holds for one in found.inequalities
                 if one.required and one.name not in with_it)
    return (loop, found) if others and found[row].holds != weaken else None


def _walk(loop: Oscillators, speed: float, seconds: float) -> None:
    """Run from rest with the reference at a speed."""
    loop.request(False)
    loop.command(speed)
    for _ in range(round(seconds * 1e9 / loop.tick_ns)):
        loop.advance()
        loop.r = np.array(loop.gate.at(loop.now_ns)) if loop.stop.state != 'at_rest' else loop.r


def _until(loop: Oscillators, done: Callable[[], bool], seconds: float) -> float:
    """Time until something is so, infinite when it takes longer [s]."""
    since = loop.now_ns
    while not done():
        if (loop.now_ns - since) * 1e-9 > seconds:
            return math.inf
        loop.advance()
    return (loop.now_ns - since) * 1e-9


def _at_rest(loop: Oscillators) -> bool:
    return loop.stop.state == 'at_rest'


def _rested(description: RobotDescription, case: Case, row: str, weaken: bool
            ) -> Oscillators | Judged:
    """The loop of a case at rest after a walk, or what is to be said of one that has none."""
    made = _loop(description, case, row, weaken)
    if made is None:
        return None
    loop, _ = made
    _walk(loop, _SPEED, 2.0)
    loop.request(True)
    if _until(loop, lambda: _at_rest(loop), LONGEST_STOP) == math.inf:
        return 'not at rest after the longest stop', math.inf
    return loop


def suite_case(rng: np.random.Generator, parameters: Case, **more: Any) -> Case:
    """A suite in any gait, of which runs are short."""
    return {'gait': str(rng.choice(list(GAITS))), 'tick_s': 0.004,
            'parameters': {**_FAST, **parameters}, **more}


def draw_posture(rng: np.random.Generator, weaken: bool) -> Case:
    """A suite that lowers its feet slowly, and locks fast or not."""
    low, lag = (0.55, 16.0) if weaken else (0.2, 100.0)
    case = suite_case(rng, {'clearance': float(rng.uniform(low, 0.6)),
                            'activity_rate': log_uniform(rng, 1.0, 4.0),
                            'coupling_gain': log_uniform(rng, 16.0, 2.0 * lag),
                            'inhibited_legs': (str(rng.choice(LEGS)),)})
    return {**case, 'gait': str(rng.choice(['walk', 'amble']))} if weaken else case


def judge_posture(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """When rest is declared no foot is off the ground (line 13)."""
    loop = _rested(description, case, 'rest_posture', weaken)
    if not isinstance(loop, Oscillators):
        return loop
    network, height = loop.network, 0.0
    places = network.gait.cycle_position(np.arctan2(-loop.x[:, 1], loop.x[:, 0]))
    for place, activity in zip(places.tolist(), loop.stop.activity, strict=True):
        path = FootPath((0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, network.gait.duty(
            0.0, network.scale), loop.parameters.leg.clearance * activity)
        height = max(height, float(path.at(place)[0][2]))
    return (f'at rest with a foot at {height:.3g} of the standing height' if height > GROUND
            else ''), height / GROUND


def draw_slow_stop(rng: np.random.Generator, weaken: bool) -> Case:
    """A suite whose reference slows down slowly."""
    slow = rng.uniform(0.05, 0.4) if weaken else log_uniform(rng, 0.5, 6.0)
    return suite_case(rng, {'alpha_r': float(slow),
                            'capture_speed': log_uniform(rng, 0.02, 0.1 if weaken else 0.5),
                            'max_speed': log_uniform(rng, 0.3, 2.0), 'max_lateral_speed': 0.0,
                            'max_turn_rate': 0.0}, phase=float(rng.uniform(0.0, 0.5)))


def judge_slow_stop(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """A stop of the locked gait at any phase ends within the bound, and within the longest one."""
    made = _loop(description, case, 'time_to_rest', weaken)
    if made is None:
        return None
    loop, found = made
    _walk(loop, 10.0, 2.0 + case['phase'])
    bound = min(found.time_to_rest, LONGEST_STOP)
    loop.request(True)
    taken = _until(loop, lambda: _at_rest(loop), bound)
    return (f'not at rest after {bound:.3g} s' if taken > bound else ''), taken / bound


def draw_start(rng: np.random.Generator, weaken: bool) -> Case:
    """A suite that locks and lifts its feet slowly."""
    low, high = (0.1, 0.6) if weaken else (1.0, 20.0)
    return suite_case(rng, {
        'coupling_gain': log_uniform(rng, 6.0, 100.0), 'rho': log_uniform(rng, 0.5, 20.0),
        'activity_rate': log_uniform(rng, low, high)})


def judge_start(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """A release at rest leads to locked phases and full swings within the bound."""
    made = _loop(description, case, 'time_to_walking', weaken)
    if made is None:
        return None
    loop, found = made
    bound = min(found.time_to_walking, LONGEST_STOP)
    if _until(loop, lambda: _at_rest(loop) and loop.now_ns > 5e8, LONGEST_STOP) == math.inf:
        return 'does not stay at rest', math.inf
    loop.request(False)
    loop.command(_SPEED)
    taken = _until(loop, lambda: loop.stop.state in ('walking', 'free'), bound)
    return (f'not walking after {bound:.3g} s' if taken > bound else ''), taken / bound


def draw_radius(rng: np.random.Generator, weaken: bool) -> Case:
    """A coupling that is weak beside inhibition and cadence."""
    return suite_case(rng, {
        'coupling_gain': log_uniform(rng, 4.0, 60.0), 'rho': log_uniform(rng, 0.3, 8.0),
        'cadence_scale': log_uniform(rng, 0.7, 4.0), 'inhibition_gain': 4000.0,
        'coupling_graph': str(rng.choice(['star', 'path', 'ring'])),
        'inhibited_legs': (str(rng.choice(LEGS)),), 'max_speed': 0.2,
        'region_radius': float(rng.uniform(0.3, 1.2))})


def judge_radius(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """At rest no oscillator is so near to the origin that its phase says nothing."""
    loop = _rested(description, case, 'rest_radius', weaken)
    if not isinstance(loop, Oscillators):
        return loop
    # what is called rest is near the equilibrium, not at it
    least = float(np.hypot(*loop.x.T).min()) / loop.parameters.canonical.radius
    return (f'rests at {least:.3g} r' if least < 0.98 * SMALLEST_RADIUS else ''), (
        SMALLEST_RADIUS / least)


def _draw_votes(rng: np.random.Generator, limits: tuple[float, float], **more: Any) -> Case:
    case = suite_case(rng, {**_VOTES, 'vote_majority': int(rng.integers(2, 5)),
                            'coupling_gain': log_uniform(rng, 30.0, 100.0), **more})
    if limits[1] > 0.0:
        case['parameters']['vote_limit'] = log_uniform(rng, *limits)
    return {**case, 'legs': rng.permutation(LEGS).tolist()}


def draw_votes_suffice(rng: np.random.Generator, weaken: bool) -> Case:
    """Votes with a limit that is high enough, or with none."""
    return _draw_votes(rng, (0.02, 0.6) if weaken else (0.1, 1.0) if rng.random() < 0.5 else (
        0.0, 0.0))


def draw_votes_needed(rng: np.random.Generator, weaken: bool) -> Case:
    """Votes with a limit, where it is left out, that a vote fewer passes."""
    return _draw_votes(rng, (0.3, 5.0) if weaken else (0.0, 0.0))


def draw_votes_time(rng: np.random.Generator, weaken: bool) -> Case:
    """Votes in a suite that stops slowly."""
    slow = draw_slow_stop(rng, weaken)['parameters']
    return _draw_votes(rng, (0.0, 0.0), **slow)


def judge_votes(description: RobotDescription, case: Case, weaken: bool, row: str, fewer: int = 0
                ) -> Judged:
    """A majority of full votes stops the gait within the bound; one fewer does not."""
    made = _loop(description, case, row, weaken)
    if made is None or 'votes_suffice' not in (one.name for one in made[1].inequalities):
        return None
    loop, found = made
    bound = min(found['votes_time_to_rest'].left, LONGEST_STOP)
    _walk(loop, 10.0 if row == 'votes_time_to_rest' else _SPEED, 2.0)
    count = loop.parameters.voting.majority - fewer
    loop.vote(dict.fromkeys(case['legs'][:count], 10.0))
    if fewer:
        loop.command(0.0)
        taken = _until(loop, lambda: loop.stop.requested, 3.0)
        return (f'{count} legs stop the gait' if taken < math.inf else ''), 0.0
    loop.advance()
    taken = _until(loop, lambda: _at_rest(loop), bound + 2.0 * case['tick_s'])
    return (f'not at rest {bound:.3g} s after {count} legs have voted' if taken == math.inf
            else ''), taken / bound
