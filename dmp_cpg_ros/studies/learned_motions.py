# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops with learned motions that nobody would show: whether the certificate holds with them.

``python -m dmp_cpg_ros.studies.learned_motions`` draws motions, learns them and walks with them on
a robot that tracks perfectly. A motion is of random harmonics for each foot: it may lift feet in
stance, swing them aside, and step backwards. Some are beyond what a foot can walk with, and have
to be refused. Goals do not act on the oscillators, so that stops have to be as predicted and
within bounds; what else is promised of the legs is that all feet are on the ground when rest is
declared, and that targets are finite. A body that such feet carry may be taken for one that
fell; its joints are damped then, and the oscillators stop all the same.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.certificates.certify import GROUND
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.learning.rhythmic import learn_rhythmic
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.learned_motion import LARGEST, MOTION_NAMES, LearnedMotion
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.studies.draws import log_uniform
from dmp_cpg_ros.studies.oscillator_loop import GAITS
from dmp_cpg_ros.studies.output import markdown_table, parser_of, write_results
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import load_suite

REFUSED, NOT_CERTIFIED, KEPT, UNASKED = (
    'motion refused', 'suite not certified', 'kept', 'stopped by the body before')
"""What becomes of a case that does not fail."""

_TICK_NS, _LONGEST_S = 4_000_000, 12.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; returns 1 where something that was promised is not kept."""
    parser = parser_of('learned_motions', __doc__.splitlines()[0], 'every case')
    parser.add_argument('--motions', type=int, default=100, metavar='N', help='(default: 100)')
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args(arguments)
    cases = [(options.seed, k) for k in range(options.motions)]
    with Workers(options.workers, options.cluster) as workers:
        found = list(workers.map(partial(tried, True), cases))
    counts = Counter(one['outcome'] for one in found)
    print(markdown_table(('motions', *counts), [(str(len(found)), *map(str, counts.values()))]))
    kept = [one for one in found if one['outcome'] == KEPT]
    if kept:
        print(f'largest share of the bound: {max(one["share"] for one in kept):.3f}; highest foot '
              f'at rest: {max(one["height"] for one in kept):.4f} of the standing height; '
              f'{sum(one["stood"] for one in kept)} stood to the end')
    write_results(options.json, found)
    return int(bool(set(counts) - {REFUSED, NOT_CERTIFIED, KEPT, UNASKED}))


def random_motion(rng: np.random.Generator) -> LearnedMotion:
    """Motion of random harmonics, period, phases and offsets, learned from two and a half cycles.

    Raises
    ------
    DataError
        If no foot can walk with it.
    """
    period = log_uniform(rng, 0.2, 2.0)
    psi = 2.0 * np.pi * np.arange(250) / 100.0
    orders = np.arange(1, 1 + rng.integers(1, 6))
    turned = orders * psi[:, None] + rng.uniform(0.0, 2.0 * np.pi, (12, 1, len(orders)))
    values = (np.cos(turned) * rng.normal(size=(12, 1, len(orders))) / orders).sum(axis=2).T
    values = values + rng.normal(size=12) * (rng.random() < 0.5)
    most = np.array(LARGEST * 4) * np.exp(rng.normal(-0.9, 0.6))
    values *= most / np.abs(values).max(axis=0)
    lifts = values[:, 2::3]
    values[:, 2::3] = lifts - lifts.min(axis=0) if rng.random() < 0.7 else lifts
    primitive = learn_rhythmic(
        Demonstration(np.array(psi * period / (2.0 * np.pi), dtype=np.float64), values), 25,
        period=period, stiffness=6400.0, damping=160.0)
    return LearnedMotion(replace(primitive, names=MOTION_NAMES))


def tried(told: bool, case: tuple[int, int]) -> dict[str, Any]:
    """Walk, stop, rest and walk again with one random motion; ``told`` the certificate knows that
    a motion is played.
    """
    rng = np.random.default_rng(case)
    try:
        motion = random_motion(rng)
    except DataError as error:
        return {'case': case, 'outcome': REFUSED, 'why': str(error)}
    suite = load_suite(overrides={
        'cmd_vel_timeout': 0.0, 'auto_inhibit': False, 'push_recovery': False,
        'gait': str(rng.choice(list(GAITS))), 'cadence_scale': log_uniform(rng, 0.7, 1.5),
        'clearance': log_uniform(rng, 0.05, 0.6), 'coupling_gain': log_uniform(rng, 20.0, 200.0),
        'max_speed': log_uniform(rng, 0.2, 1.5)})
    p = suite.parameters
    p = replace(p, motion=motion, leg=replace(p.leg, motion='drawn' if told else ''))
    description = load_description(find_config(suite.robot_file))
    loop = WalkingLoop(description, suite.gait, p, GAITS)
    robot = PerfectTrackingRobot(description, _TICK_NS)
    state = robot.reset()
    for _ in range(3):                                    # the tick is known from the second on
        state = robot.step(loop.tick(state).targets)
    if not loop.in_force().certificate().holds:
        return {'case': case, 'outcome': NOT_CERTIFIED}
    share = height = 0.0
    for _ in range(2):
        if loop.mode.mode != 'standing':                  # it is not let start again
            break
        loop.command(float(p.reference.max_speed), 0.0, float(rng.uniform(-0.3, 0.3)))
        loop.request(False)
        for _ in range(int(rng.integers(300, 500))):
            state = robot.step(loop.tick(state).targets)
        if loop.stop.requested:                           # the body has lain down or is damped
            break
        bound = loop.time_to_rest()
        most = loop.in_force().stop_distance(loop.r, loop.gate.foreseen(
            state.time_ns + _TICK_NS))
        predicted, began, way = loop.request(True), loop.stop.time_ns, 0.0
        while loop.stop.state != 'at_rest':
            tick = loop.tick(state)
            state, way = robot.step(tick.targets), way + 1e-9 * _TICK_NS * float(
                np.hypot(*tick.r[:2]))
            if not np.all(np.isfinite([tick.targets.position, tick.targets.velocity])):
                return {'case': case, 'outcome': 'targets are not finite'}
            if (state.time_ns - began) * 1e-9 > _LONGEST_S:
                return {'case': case, 'outcome': 'does not stop'}
        took = (tick.time_ns - began) * 1e-9
        height = max(height, _highest(loop, motion, description))
        share = max(share, took / bound)
        wrong = ('later than its bound' if took > bound + 1e-9 else
                 'not as predicted' if abs(took - predicted) > 1e-6 else
                 'goes too far' if way > most + 1e-9 else
                 'a foot is off the ground at rest' if height > GROUND else '')
        if wrong:
            return {'case': case, 'outcome': wrong, 'share': share, 'height': height,
                    'predicted': predicted, 'took': took, 'bound': bound}
        for _ in range(50):
            state = robot.step(loop.tick(state).targets)
    return {'case': case, 'outcome': KEPT if share else UNASKED, 'share': share, 'height': height,
            'stood': loop.mode.mode == 'standing'}


def _highest(loop: WalkingLoop, motion: LearnedMotion, description: RobotDescription) -> float:
    """Height of the highest foot as the motion says it now, over the standing height."""
    of, tall = loop.network, description.stance_height
    places = of.gait.cycle_position(phase(loop.x)).tolist()
    return max(motion.of_leg(leg, description).step(None, FootPath(
        (0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, of.gait.duty(0.0, of.scale),
        loop.parameters.leg.clearance * activity * tall), place, 0.0, 0.0)[1][2]
        for leg, place, activity in zip(LEGS, places, loop.stop.activity, strict=True)
               ) / tall


if __name__ == '__main__':
    sys.exit(main())
