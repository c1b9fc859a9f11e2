# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on single rows of the certificate: each says something that a short run can refute.

Per row one function draws a case and another judges it: nothing where the case has no certificate,
else what is wrong and the share of the row's promise that was needed. A row is left out by running
cases in which it alone need not hold, or, where it is a rate, by taking it for a larger one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.certify import GROUND, spring_damper_contraction
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.certificates.timing import LONGEST_STOP
from dmp_cpg_ros.core.contraction.capture_anywhere import needed_gain_anywhere
from dmp_cpg_ros.core.contraction.synchronisation import comparison_laplacian
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.inhibition.entry import SMALLEST_RADIUS, entry_tolerances
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper, SpringState
from dmp_cpg_ros.core.reference.filter import ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.reference.stop_distance import slowing_time, stop_distance
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.foot_path import FootPath, activity_step
from dmp_cpg_ros.studies import adversary_networks, adversary_steps, delays
from dmp_cpg_ros.studies.adversary_runs import Batch, Case, Setting
from dmp_cpg_ros.studies.adversary_suite import GAITS, Oscillators

Judged = tuple[str, float] | None
"""What is wrong, empty for nothing, and the largest share of a promise that was needed; None where
the case is not certified."""

_RATE = 1.1
"""Factor by which rates are taken for more than they are where a row is left out."""

_FAST = {'alpha_r': 10.0, 'activity_rate': 50.0, 'auto_inhibit': False, 'push_recovery': False}
"""Parameters with which a run is short."""

_SPEED = 0.5  # of the reference while the gait runs [m/s]
_VOTES = {'voting': True, 'vote_fade': 60.0, 'silence_weight': 0.0, 'footing_weight': 0.0,
          'collision_weight': 0.0, 'tilt_weight': 0.0}


class Attack(NamedTuple):
    """How a row is attacked.

    Attributes
    ----------
    draw : callable
        Random numbers, and whether the row is left out, to a case.
    judge : callable
        The robot, a case, and whether the row is left out, to what is wrong.
    """

    draw: Callable[[np.random.Generator, bool], Case]
    judge: Callable[[RobotDescription, Case, bool], Judged]


def attack(rng: np.random.Generator, description: RobotDescription, row: str, weaken: bool
           ) -> tuple[int, list[Case]]:
    """Draw one case of a row and judge it.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    description : RobotDescription
        The robot.
    row : str
        One of ``ROWS``.
    weaken : bool
        Whether the row is left out.

    Returns
    -------
    certified : int
        Whether the case was run, 0 or 1.
    failures : list of dict
        What happened, with the case.
    """
    case = ROWS[row].draw(rng, weaken)
    found = judged(description, row, case, weaken)
    failures = [{'attack': row, 'happened': found[0], **case}] if found and found[0] else []
    return int(found is not None), failures


def judged(description: RobotDescription, row: str, case: Case, weaken: bool) -> Judged:
    """What is wrong with a case of a row; None where it is impossible or not certified."""
    try:
        with np.errstate(all='ignore'):
            return ROWS[row].judge(description, case, weaken)
    except DmpCpgError:
        return None


def smaller(description: RobotDescription, failure: Case, weaken: bool) -> Case:
    """The same failure with rounder numbers and without the parameters that it does not need."""
    row, what = failure['attack'], failure['happened']
    case = {name: value for name, value in failure.items() if name not in ('attack', 'happened')}
    again = True
    while again:
        again = False
        for trial in _simpler(case):
            found = judged(description, row, trial, weaken)
            if found and found[0][:9] == what[:9]:
                case, what, again = trial, found[0], True
                break
    return {'attack': row, 'happened': what, **case}


def _simpler(case: Case) -> Iterator[Case]:
    for name, value in case.items():
        if isinstance(value, dict):
            for key in value:
                yield {**case, name: {one: of for one, of in value.items() if one != key}}
            for key, of in value.items():
                if isinstance(of, float) and of != (short := float(f'{of:.1e}')):
                    yield {**case, name: {**value, key: short}}
        elif isinstance(value, float) and value != (short := float(f'{value:.1e}')):
            yield {**case, name: short}


def _spread(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


# ---- references, joints and filters: rates of what the oscillators drive --------------------


def _draw_reference(rng: np.random.Generator, _: bool) -> Case:
    return {'alpha_r': _spread(rng, 0.5, 40.0), 'tick_s': _spread(rng, 0.001, 0.01),
            'braking': _spread(rng, 0.2, 20.0) if rng.random() < 0.5 else 0.0,
            'reference': rng.uniform(-1.0, 1.0, 3).tolist(), 'foot_distance': 0.3,
            'other': rng.uniform(-1.0, 1.0, 3).tolist(), 'wanted': _spread(rng, 0.01, 1.0)}


def _judge_reference(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Two references approach each other at α_r, and a stop takes the time and the way that follow
    from it (line 3).
    """
    p = ReferenceParameters(alpha_r=case['alpha_r'], braking=case['braking'])
    claimed = ReferenceParameters(alpha_r=p.alpha_r * (_RATE if weaken else 1.0),
                                  braking=p.braking)
    dt, l = case['tick_s'], case['foot_distance']
    system = ReferenceSystem(p, l)
    r, other = np.array(case['reference']), np.array(case['other'])
    apart = float(np.hypot.reduce(system.step(r, np.zeros(3), dt) - system.step(
        other, np.zeros(3), dt)) / np.hypot.reduce(r - other))
    needed = [(apart / math.exp(-claimed.alpha_r * dt), 'references approach each other at {:.4g} '
               'times the bound')]
    stop, way, late = Inhibition(True, np.zeros(4), 0.3), 0.0, math.inf
    speed, turning = float(np.hypot(*r[:2])), abs(float(r[2])) * l
    time = slowing_time(claimed, speed + turning, case['wanted'], dt) + dt
    distance = stop_distance(claimed, speed, 0.0, dt, turning)
    for tick in range(round(20.0 / p.alpha_r / dt)):
        of_feet = float(np.hypot(*r[:2])) + abs(float(r[2])) * l
        if of_feet <= case['wanted']:
            late = min(late, tick * dt)
        way += float(np.hypot(*r[:2])) * dt
        r = system.towards(r, (0.0, 0.0, 0.0), stop, dt)
        if of_feet < 1e-4 * case['wanted']:
            break
    needed += [(late / time, 'slow after {:.3g} times the bound on the time'),
               (way / distance, 'goes {:.3g} times the bound on the way')]
    most, what = max(needed)
    return what.format(most) if most > 1.0 + 1e-9 else '', most


def _draw_joints(rng: np.random.Generator, _: bool) -> Case:
    return {'stiffness': _spread(rng, 1.0, 1e5), 'damping': _spread(rng, 0.1, 1e4),
            'tick_s': _spread(rng, 0.001, 0.01), 'apart': rng.normal(size=2).tolist()}


def _judge_joints(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Two solutions approach each other in the certified coordinates at the certified rate; the
    slowest mode is left out of it.
    """
    k, b, dt = case['stiffness'], case['damping'], case['tick_s']
    rate, theta = spring_damper_contraction(k, b)
    rate = 0.5 * b if weaken else rate
    return _spring(k, b, theta, rate, dt, np.array(case['apart']))


def _spring(k: float, b: float, theta: Array, rate: float, dt: float, apart: Array) -> Judged:
    system = SpringDamper(np.array([k]), np.array([b]))
    one, other = SpringState(np.zeros(1), np.zeros(1)), SpringState(apart[:1], apart[1:])
    before, most = float(np.hypot(*(theta @ apart))), 0.0
    for tick in range(100):
        goal, rate_of_goal = np.array([math.sin(tick)]), np.array([math.cos(3.0 * tick)])
        one, other = (system.follow(state, goal, rate_of_goal, dt) for state in (one, other))
        now = float(np.hypot(*(theta @ np.concatenate(
            [other.position - one.position, other.velocity - one.velocity]))))
        if before < 1e-6:
            break
        most, before = max(most, now / before / math.exp(-rate * dt)), now
    return (f'joints approach each other at {most:.3g} times the bound' if most > 1.0 + 1e-6
            else ''), most


def _draw_hierarchy(rng: np.random.Generator, _: bool) -> Case:
    rates = {name: _spread(rng, 0.5, 40.0) for name in (
        'alpha_r', 'activity_rate', 'placement_rate')}
    return {'gait': 'amble', 'tick_s': 0.004, 'parameters': {
        **rates, 'stiffness': _spread(rng, 10.0, 1e4), 'damping': _spread(rng, 5.0, 300.0)}}


def _judge_hierarchy(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """No part forgets more slowly than the whole is said to; the filters of the swings are left
    out of it.
    """
    loop, dt = Oscillators(description, case), case['tick_s']
    found, p = loop.in_force().certificate(whole=True), loop.parameters
    rate = found['hierarchy'].right
    if weaken:
        rate = min(found['reference'].right, found['transformation'].right,
                   found['synchronisation'].margin)
    system = ReferenceSystem(p.reference)
    slowest = {
        'reference': float(system.step(np.ones(3), np.zeros(3), dt)[0]),
        'joints': math.exp(-spring_damper_contraction(p.leg.stiffness, p.leg.damping)[0] * dt),
        **{f'filter of {filtered:.3g} 1/s': activity_step(1.0, 0.0, 1.0, filtered, dt)
           for filtered in (p.leg.activity_rate, p.leg.placement_rate, p.posture.activity_rate)}}
    part, kept = max(slowest.items(), key=lambda one: one[1])
    needed = kept / math.exp(-rate * dt)
    return (f'the whole forgets more slowly than it is said to: {part}'
            if needed > 1.0 + 1e-9 else ''), needed


_WITH_IT = {'votes_suffice': ('votes_time_to_rest', 'votes_contraction'),
            'votes_time_to_rest': ('time_to_rest',), 'time_to_walking': ('time_to_rest',)}
"""Rows that fail with one that is left out: there is no bound on a stop that does not come, and
what is slow makes both slow."""


# ---- what suites do -------------------------------------------------------------------------


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


def _suite(rng: np.random.Generator, parameters: Case, **more: Any) -> Case:
    return {'gait': str(rng.choice(list(GAITS))), 'tick_s': 0.004,
            'parameters': {**_FAST, **parameters}, **more}


def _draw_posture(rng: np.random.Generator, weaken: bool) -> Case:
    low, lag = (0.55, 16.0) if weaken else (0.2, 100.0)
    case = _suite(rng, {'clearance': float(rng.uniform(low, 0.6)),
                        'activity_rate': _spread(rng, 1.0, 4.0),
                        'coupling_gain': _spread(rng, 16.0, 2.0 * lag),
                        'inhibited_legs': (str(rng.choice(LEGS)),)})
    return {**case, 'gait': str(rng.choice(['walk', 'amble']))} if weaken else case


def _judge_posture(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """When rest is declared no foot is off the ground (line 13)."""
    loop = _rested(description, case, 'rest_posture', weaken)
    if not isinstance(loop, Oscillators):
        return loop
    network, height = loop.network, 0.0
    places = network.gait.cycle_position(np.arctan2(-loop.x[:, 1], loop.x[:, 0]))
    for place, activity in zip(places.tolist(), loop.stop.activity.tolist(), strict=True):
        path = FootPath((0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, network.gait.duty(
            0.0, network.scale), loop.parameters.leg.clearance * activity)
        height = max(height, float(path.at(place)[0][2]))
    return (f'at rest with a foot at {height:.3g} of the standing height' if height > GROUND
            else ''), height / GROUND


def _draw_slow_stop(rng: np.random.Generator, weaken: bool) -> Case:
    slow = rng.uniform(0.05, 0.4) if weaken else _spread(rng, 0.5, 10.0)
    return _suite(rng, {'alpha_r': float(slow),
                        'capture_speed': _spread(rng, 0.02, 0.1 if weaken else 0.5),
                        'max_speed': _spread(rng, 0.3, 2.0), 'max_lateral_speed': 0.0,
                        'max_turn_rate': 0.0}, phase=float(rng.uniform(0.0, 0.5)))


def _judge_slow_stop(description: RobotDescription, case: Case, weaken: bool) -> Judged:
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


def _draw_start(rng: np.random.Generator, weaken: bool) -> Case:
    low, high = (0.1, 0.6) if weaken else (1.0, 20.0)
    return _suite(rng, {'coupling_gain': _spread(rng, 6.0, 100.0), 'rho': _spread(rng, 0.5, 20.0),
                        'activity_rate': _spread(rng, low, high)})


def _judge_start(description: RobotDescription, case: Case, weaken: bool) -> Judged:
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


def _draw_radius(rng: np.random.Generator, weaken: bool) -> Case:
    return _suite(rng, {'coupling_gain': _spread(rng, 4.0, 60.0), 'rho': _spread(rng, 0.3, 8.0),
                        'cadence_scale': _spread(rng, 0.5, 4.0), 'inhibition_gain': 4000.0,
                        'coupling_graph': str(rng.choice(['star', 'path', 'ring'])),
                        'inhibited_legs': (str(rng.choice(LEGS)),), 'max_speed': 0.2,
                        'region_radius': float(rng.uniform(0.3, 1.2))})


def _judge_radius(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """At rest no oscillator is so near to the origin that its phase says nothing."""
    loop = _rested(description, case, 'rest_radius', weaken)
    if not isinstance(loop, Oscillators):
        return loop
    # what is called rest is near the equilibrium, not at it
    least = float(np.hypot(*loop.x.T).min()) / loop.parameters.canonical.radius
    return (f'rests at {least:.3g} r' if least < 0.98 * SMALLEST_RADIUS else ''), (
        SMALLEST_RADIUS / least)


# ---- legs whose frequencies differ ----------------------------------------------------------


def _draw_frequencies(rng: np.random.Generator, weaken: bool) -> Case:
    share = float(rng.uniform(1.0, 4.0) if weaken else rng.uniform(0.3, 0.99))
    return _suite(rng, {'coupling_gain': _spread(rng, 6.0, 60.0), 'rho': _spread(rng, 0.5, 20.0),
                        'coupling_graph': str(rng.choice(list(adversary_networks.KINDS[:5])))},
                  share=share, seed=int(rng.integers(1 << 30)))


def _frequencies(loop: Oscillators, difference: float, rng: np.random.Generator
                 ) -> tuple[Array, Array, Array]:
    """Largest error of phase [rad], distance and |r − |x|| that legs come to whose frequencies
    differ by so much from ω: for ever, or for a while each [rad/s].
    """
    system, p = loop.network.system, loop.parameters.canonical
    signs = 1.0 - 2.0 * ((np.arange(16)[:, None] >> np.arange(4)) & 1)
    omega, tick = float(loop.in_force().certificate().omega_max), loop.tick_ns * 1e-9
    batch = Batch([Setting(system, np.full(4, omega), np.zeros(4), 0.1)] * len(signs), tick)
    lag = np.exp(1j * loop.network.gait.phases)
    x = np.broadcast_to(np.conj(p.radius * lag)[:, None].view(float), (16, 4, 2))
    x, turns = np.array(x), rng.integers(20, 400, 16)
    worst: Array = np.zeros((3, 16))
    for now in range(1500):
        turned = np.where((np.arange(16) < 8) | (now // turns % 2 == 0), 1.0, -1.0)
        batch.omega = np.asarray(omega + difference * signs * turned[:, None], dtype=float)
        x = batch.step(x, False)
        y = np.conj(np.ascontiguousarray(x).reshape(16, -1).view(complex)) / lag
        pair = y[:, :, None] / y[:, None, :]
        np.maximum(worst, [np.abs(np.angle(pair)).max(axis=(1, 2)), np.abs(
            y[:, :, None] - y[:, None, :]).max(axis=(1, 2)), np.abs(p.radius - np.abs(y)).max(1)],
                   out=worst)
    return worst[0], worst[1], worst[2]


def _judge_frequencies(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Legs whose frequencies differ by less than the margin stay near their places; those that
    differ by what is expected are let through where the row is left out.
    """
    loop = Oscillators(description, case)
    found = loop.in_force().certificate(whole=True)
    row = found['frequency_mismatch']
    if not found['synchronisation'].holds or not (row.right > 0.0 or weaken):
        return None
    spread, *_ = _frequencies(loop, row.left if weaken and not row.holds else
                              row.right * min(case['share'], 0.999),
                              np.random.default_rng(case['seed']))
    needed = float(spread.max()) / LOCKED_PHASE_ERROR
    return (f'phases differ by {spread.max():.3g} rad' if needed > 1.0 else ''), needed


def _judge_contacts(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """However the feet touch down, places and radii are those that capture takes for granted."""
    case = {**case, 'parameters': {**case['parameters'], 'contact_feedback': True}}
    loop = Oscillators(description, case)
    found = loop.in_force().certificate(whole=True)
    if not found['synchronisation'].holds or not found['contact_feedback'].right > 0.0:
        return None
    share = 3.0 * case['share'] if weaken else min(case['share'], 0.999)
    _, apart, off = _frequencies(loop, found['contact_feedback'].right * share,
                                 np.random.default_rng(case['seed']))
    places, radii = entry_tolerances(loop.network, loop.parameters.inhibition.region_radius)
    needed = max(float(apart.max()) / places, float(off.max()) / radii)
    return (f'legs are {needed:.3g} times as far from their places as capture allows'
            if needed > 1.0 else ''), needed


# ---- votes ----------------------------------------------------------------------------------


def _draw_votes(rng: np.random.Generator, limits: tuple[float, float], **more: Any) -> Case:
    case = _suite(rng, {**_VOTES, 'vote_majority': int(rng.integers(2, 5)),
                        'coupling_gain': _spread(rng, 30.0, 100.0), **more})
    if limits[1] > 0.0:
        case['parameters']['vote_limit'] = _spread(rng, *limits)
    return {**case, 'legs': rng.permutation(LEGS).tolist()}


def _draw_votes_suffice(rng: np.random.Generator, weaken: bool) -> Case:
    return _draw_votes(rng, (0.02, 0.6) if weaken else (0.1, 1.0) if rng.random() < 0.5 else (
        0.0, 0.0))


def _draw_votes_needed(rng: np.random.Generator, weaken: bool) -> Case:
    return _draw_votes(rng, (0.3, 5.0) if weaken else (0.0, 0.0))


def _draw_votes_time(rng: np.random.Generator, weaken: bool) -> Case:
    slow = _draw_slow_stop(rng, weaken)['parameters']
    return _draw_votes(rng, (0.0, 0.0), **slow)


def _voted(description: RobotDescription, case: Case, row: str, weaken: bool, fewer: int
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


def _judge_votes_suffice(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    return _voted(description, case, 'votes_suffice', weaken, 0)


def _judge_votes_needed(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    return _voted(description, case, 'votes_needed', weaken, 1)


def _judge_votes_time(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    return _voted(description, case, 'votes_time_to_rest', weaken, 0)


def _draw_votes_contraction(rng: np.random.Generator, _: bool) -> Case:
    edges = topology(str(rng.choice(['all_to_all', 'ring', 'path', 'star'])), 4)
    rho = _spread(rng, 0.5, 20.0)
    voters = rng.permutation(4)[:rng.integers(2, 5)]
    return {'edges': [list(edge) for edge in edges],
            'gains': [np.eye(2).tolist() for _ in edges], 'phases': [0.0] * 4, 'rho': rho,
            'radius': [1.0] * 4, 'target_radius': 1.0, 'tick_s': 0.002, 'settings': [{
                'coupling': rho * _spread(rng, 2.0, 10.0), 'held': sorted(voters.tolist()),
                'inhibition': 100.0 * _spread(rng, 0.3, 10.0), 'omega': _spread(rng, 2.0, 20.0),
                'region_radius': _spread(rng, 0.1, 0.8)}],
            'events': [[100, str(rng.choice(['edge', 'gather'])), int(rng.integers(1 << 30))],
                       *([int(rng.integers(1, 150)), 'request', 0] for _ in range(3)),
                       *([int(rng.integers(1, 20)), 'cadence', 1] for _ in range(10))]}


def _judge_votes_contraction(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Under all votes |ẋ| shrinks at the certified rate; growth is left out of it."""
    left_out = 'contraction' if weaken else ''
    if adversary_networks.network(case, left_out) is None:
        return None
    return adversary_networks.happened(case, left_out), 0.0


# ---- nodes that are anywhere, and messages that are late ------------------------------------


def _draw_anywhere(rng: np.random.Generator, weaken: bool) -> Case:
    size = int(rng.integers(2, 7))
    return {'size': size, 'graph': str(rng.choice(list(adversary_networks.KINDS[:5]))),
            'coupling': _spread(rng, 2.0, 200.0), 'rho': _spread(rng, 0.5, 20.0),
            'omega': _spread(rng, 0.5, 30.0), 'region_radius': _spread(rng, 0.05, 1.0),
            'room': float(rng.uniform(0.7, 0.95)) if weaken else _spread(rng, 1.000001, 1.2),
            'seed': int(rng.integers(1 << 30))}


def _judge_anywhere(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """C is not left while the other nodes are anywhere; the gain is taken for less than is
    needed.
    """
    size, r0, rng = case['size'], case['region_radius'], np.random.default_rng(case['seed'])
    edges = topology(case['graph'], size)
    graph = CouplingGraph(size, edges, np.array([case['coupling'] * np.eye(2)] * len(edges)),
                          np.zeros(size))
    system = CanonicalSystem(graph, AndronovHopf(case['rho'], 1.0), state_at(np.zeros(size), 1.0))
    gains = np.zeros(size)
    gains[0] = case['room'] * needed_gain_anywhere(system, case['omega'], 0, r0)
    if not gains[0] > 0.0 or gains[0] > 1e5:
        return None
    angles = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    x = np.exp(2j * np.pi * rng.random((64, size))) * np.sqrt(rng.random((64, size)))
    x[:, 1:][::2] = np.exp(1j * angles)[::2, None]       # all others pull outwards
    x[:, 0] = 1.0 + (1.0 - 1e-9) * r0 * np.exp(1j * angles)
    step = 0.02 / (float(np.diag(comparison_laplacian(graph)).max()) + float(gains[0])
                   + case['omega'] + 4.0 * case['rho'])
    batch = Batch([Setting(system, np.full(size, case['omega']), gains, math.inf)] * 64, step)
    states, most = np.ascontiguousarray(x)[..., None].view(float), 0.0
    for _tick in range(200):
        states = batch.step(states)
        most = max(most, float(np.hypot(states[:, 0, 0] - 1.0, states[:, 0, 1]).max()) / r0)
    return (f'leaves C, to {most:.4g} r0' if most > 1.0 + 1e-6 else ''), most


_TIMES = {'late': (1.2, 1.6), 'held': (8.0, 60.0), 'carried': (1.0, 20.0)}
"""How many times as old as certified samples are where the row is left out."""


def _draw_delay(kind: str) -> Callable[[np.random.Generator, bool], Case]:
    """How a kind of delay is drawn: of what a few legs bear, most of all for states held."""
    def draw(rng: np.random.Generator, weaken: bool) -> Case:
        patterns = ['one age', 'kept'] if kind == 'late' else list(delays.PATTERNS)
        return {'size': int(rng.integers(2, 5)), 'seed': int(rng.integers(1 << 30)),
                'pattern': str(rng.choice(['chosen'] if kind == 'held' and weaken else patterns)),
                'times': _spread(rng, *_TIMES[kind]) if weaken else float(rng.uniform(0.3, 0.999))}
    return draw


def _delayed(case: Case, kind: str, weaken: bool) -> Judged:
    """Capture bears samples, or a switch, of the certified age; it is exceeded where the row is
    left out.
    """
    rng = np.random.default_rng(case['seed'])
    _, capture = next(delays.random_captures(rng, 1, case['size']))
    certified = delays.MARGINS[kind](capture)
    if not certified > 2e-4 or weaken and certified > (0.02 if kind == 'held' else 0.1):
        return None
    age = min(certified, 0.1) * case['times']
    failed = delays.fails(capture, kind, np.array([age]), case['pattern'], rng)[0]
    return (f'fails with samples of {age:.3g} s, {case["pattern"]}' if failed else ''), (
        case['times'])


def _judge_late(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    return _delayed(case, 'late', weaken)


def _judge_held(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    return _delayed(case, 'held', weaken)


def _judge_carried(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    return _delayed(case, 'carried', weaken)


ROWS = {
    'capture_anywhere': Attack(_draw_anywhere, _judge_anywhere),
    'step_capture': Attack(adversary_steps.draw, adversary_steps.judge_capture),
    'step_contraction': Attack(adversary_steps.draw, adversary_steps.judge_contraction),
    'step_synchronisation': Attack(adversary_steps.draw, adversary_steps.judge_synchronisation),
    'reference': Attack(_draw_reference, _judge_reference),
    'transformation': Attack(_draw_joints, _judge_joints),
    'hierarchy': Attack(_draw_hierarchy, _judge_hierarchy),
    'rest_posture': Attack(_draw_posture, _judge_posture),
    'rest_radius': Attack(_draw_radius, _judge_radius),
    'frequency_mismatch': Attack(_draw_frequencies, _judge_frequencies),
    'contact_feedback': Attack(_draw_frequencies, _judge_contacts),
    'late_inhibition': Attack(_draw_delay('late'), _judge_late),
    'held_coupling': Attack(_draw_delay('held'), _judge_held),
    'carried_coupling': Attack(_draw_delay('carried'), _judge_carried),
    'time_to_rest': Attack(_draw_slow_stop, _judge_slow_stop),
    'time_to_walking': Attack(_draw_start, _judge_start),
    'votes_contraction': Attack(_draw_votes_contraction, _judge_votes_contraction),
    'votes_suffice': Attack(_draw_votes_suffice, _judge_votes_suffice),
    'votes_needed': Attack(_draw_votes_needed, _judge_votes_needed),
    'votes_time_to_rest': Attack(_draw_votes_time, _judge_votes_time)}
"""Rows that are attacked here; each can be left out."""
