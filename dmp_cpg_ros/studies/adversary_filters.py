# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on the rows of what the oscillators drive: references, joints, the whole hierarchy."""

from __future__ import annotations

import math

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.certificates.certify import spring_damper_contraction
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper, SpringState
from dmp_cpg_ros.core.reference.filter import ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.reference.stop_distance import slowing_time, stop_distance
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.transformation.foot_path import activity_step
from dmp_cpg_ros.studies.draws import Case, Judged, log_uniform
from dmp_cpg_ros.studies.oscillator_loop import Oscillators

_RATE = 1.1
"""Factor by which rates are taken for more than they are where a row is left out."""


def draw_reference(rng: np.random.Generator, _: bool) -> Case:
    """Two references and a tick, with a speed to slow down to."""
    return {'alpha_r': log_uniform(rng, 0.5, 6.0), 'tick_s': log_uniform(rng, 0.001, 0.01),
            'braking': log_uniform(rng, 0.2, 6.0) if rng.random() < 0.5 else 0.0,
            'reference': rng.uniform(-1.0, 1.0, 3).tolist(), 'foot_distance': 0.3,
            'other': rng.uniform(-1.0, 1.0, 3).tolist(), 'wanted': log_uniform(rng, 0.01, 1.0)}


def judge_reference(_: RobotDescription, case: Case, weaken: bool) -> Judged:
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


def draw_joints(rng: np.random.Generator, _: bool) -> Case:
    """A spring-damper and two states of it."""
    return {'stiffness': log_uniform(rng, 1.0, 1e5), 'damping': log_uniform(rng, 0.1, 1e4),
            'tick_s': log_uniform(rng, 0.001, 0.01), 'apart': rng.normal(size=2).tolist()}


def judge_joints(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Two solutions approach each other in the certified coordinates at the certified rate; the
    slowest mode is left out of it.
    """
    k, b, dt = case['stiffness'], case['damping'], case['tick_s']
    rate, theta = spring_damper_contraction(k, b)
    rate = 0.5 * b if weaken else rate
    return _spring(k, b, theta, rate, dt, np.array(case['apart']))


def _spring(k: float, b: float, theta: Array, rate: float, dt: float, apart: Array) -> Judged:
    system = SpringDamper(np.array([k]), np.array([b]))
    one, other = SpringState((0.0,), (0.0,)), SpringState(*((of,) for of in apart.tolist()))
    before, most = float(np.hypot(*(theta @ apart))), 0.0
    for tick in range(100):
        goal, rate_of_goal = (math.sin(tick),), (math.cos(3.0 * tick),)
        one, other = (system.follow(state, goal, rate_of_goal, dt) for state in (one, other))
        now = float(np.hypot(*(theta @ np.concatenate(
            [np.subtract(other.position, one.position),
             np.subtract(other.velocity, one.velocity)]))))
        if before < 1e-6:
            break
        most, before = max(most, now / before / math.exp(-rate * dt)), now
    return (f'joints approach each other at {most:.3g} times the bound' if most > 1.0 + 1e-6
            else ''), most


def draw_hierarchy(rng: np.random.Generator, _: bool) -> Case:
    """Rates of all filters, and a spring-damper."""
    rates = {name: log_uniform(rng, 0.5, 6.0) for name in (
        'alpha_r', 'activity_rate', 'placement_rate')}
    return {'gait': 'amble', 'tick_s': 0.004, 'parameters': {
        **rates, 'stiffness': log_uniform(rng, 10.0, 1e4),
        'damping': log_uniform(rng, 5.0, 300.0)}}


def judge_hierarchy(description: RobotDescription, case: Case, weaken: bool) -> Judged:
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
