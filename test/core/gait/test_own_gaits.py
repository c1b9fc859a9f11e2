# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Any gait that a file may hold can be walked, changed to, turned in and stopped."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import quadruped

from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.speed_limit import ONE_SIDED
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceParameters
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.studies.adversary_draws import own_gaits

TICK_NS = 4_000_000
TICKS = 300
EVERY = 50


@pytest.mark.parametrize('seed', range(12))
def test_the_loop_walks_in_any_gaits_and_asks_for_nothing_that_legs_cannot_do(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gaits = {name: Gait.from_mapping(name, entry) for name, entry in own_gaits(rng).items()}
    robot = PerfectTrackingRobot(quadruped(), TICK_NS)
    loop = WalkingLoop(robot.description, next(iter(gaits.values())), SuiteParameters(), gaits)
    lower, upper = (np.concatenate([getattr(leg, name) for leg in robot.description.legs])
                    for name in ('position_lower', 'position_upper'))
    state = robot.reset()
    loop.request(False)
    for k in range(TICKS):
        if k % EVERY == 0:
            loop.command(*rng.uniform(-2.0, 2.0, 3).tolist())
            loop.change_gait(str(rng.choice(list(gaits))))
        if k == TICKS - EVERY:
            loop.request(True)
        tick = loop.tick(state)
        at = tick.targets.position
        assert np.all(np.isfinite(tick.x)) and np.all(np.isfinite(tick.targets.effort))
        assert np.all((at >= lower - 1e-9) & (at <= upper + 1e-9))
        state = robot.step(tick.targets)


@pytest.mark.parametrize('duty', [0.4, 0.5, 0.501])
def test_a_gait_whose_sides_never_stand_together_turns_slowly(duty: float) -> None:
    """It could not be asked to turn: the largest curve was 0, by which the share is divided."""
    lag = dict(zip(LEGS, (0.0, 0.5, 0.0, 0.5), strict=True))
    pace = Gait.from_mapping('fast_pace', {
        'lag': lag, 'speed': [0.0], 'cadence': [0.5], 'duty_factor': [duty]})
    gate = CommandGate(ReferenceParameters(), BodyScale(0.28, 0.2))
    gate.follow(gate.parameters, (pace,))
    gate.accept(0.5, 0.0, 1.0)
    v_x, v_y, gamma = gate.at(0)
    assert v_y == 0.0 and v_x / gamma == pytest.approx(0.5)
    most = gate.parameters.max_curve * ONE_SIDED * GRAVITY
    assert 0.1 < gamma and v_x * gamma <= most * (1.0 + 1e-9)
