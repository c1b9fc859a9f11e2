# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Targets stay within the limits of angle, speed and torque, and do not jump."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import GAITS, TICK, geometry, quadruped
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.modes.leg_control import LegControl
from dmp_cpg_ros.core.modes.motion_library import Movements
from dmp_cpg_ros.core.robot_model.state import LegTargets
from dmp_cpg_ros.core.robot_model.target_limits import TargetLimits
from dmp_cpg_ros.core.transformation.leg import LegParameters

LEG = geometry(position_lower=np.array([-1.0, -2.0, -2.6]),
               position_upper=np.array([1.0, 2.0, -0.4]))
NUMBERS = st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3).map(np.array)
RATE = 2.0


def assert_within(targets: LegTargets, leg=LEG) -> None:
    assert (leg.position_lower <= targets.position).all()
    assert (targets.position <= leg.position_upper).all()
    assert (np.abs(targets.velocity) <= leg.velocity_limit).all()
    assert (np.abs(targets.effort) <= leg.torque_limit).all()


@given(NUMBERS, NUMBERS, NUMBERS, st.lists(st.floats(0.0, 1.0), min_size=3, max_size=3),
       st.floats(0.0, 0.1))
def test_whatever_comes_in_the_limits_hold(position, velocity, effort, at, dt):
    before = LEG.position_lower + at * (LEG.position_upper - LEG.position_lower)
    last = LegTargets(before, np.zeros(3), np.zeros(3))
    limits = TargetLimits(LEG, RATE)
    targets = limits.limited(LegTargets(position, velocity, effort), last, dt)
    assert_within(targets)
    jump = np.abs(targets.position - before)
    assert (jump <= RATE * LEG.velocity_limit * dt * (1.0 + 1e-12) + 1e-12).all()
    assert limits.limited(targets, targets, dt) is targets


def test_what_is_within_the_limits_passes_as_it_is():
    targets = LegTargets(np.array([0.1, 0.5, -1.2]), np.full(3, 39.0), np.full(3, -16.9))
    limits = TargetLimits(LEG, RATE)
    assert limits.limited(targets, None, 0.0) is targets
    last = LegTargets(np.subtract(targets.position, 0.3), np.zeros(3), np.zeros(3))
    assert limits.limited(targets, last, TICK) is targets


@pytest.mark.parametrize('bad', [np.nan, np.inf])
def test_what_is_not_finite_is_not_made_up(bad):
    """A message of it is refused later, where it is told."""
    targets = LegTargets(np.full(3, bad), np.zeros(3), np.zeros(3))
    limited = TargetLimits(LEG, RATE).limited(targets, None, TICK)
    assert np.isnan(limited.position).all() or (np.abs(limited.position) <= 2.6).all()


def test_a_leg_that_is_told_nonsense_keeps_its_limits():
    """Canonical states, references and torques of up to a million."""
    robot, draw = quadruped(), np.random.default_rng(5)
    leg = LegControl('fl', robot, LegParameters(), Movements(robot))
    state, before = leg.initial_state(), None
    for _ in range(300):
        size = 10.0 ** draw.uniform(-1.0, 6.0)
        x, x_dot = draw.normal(0.0, size, (2, 4, 2))
        feedback = PostureFeedback(*(draw.normal(0.0, size, shape) for shape in (
            12, (4, 3), (4, 2), 3)))
        state, targets = leg.step(state, GAITS['amble'], x, x_dot, draw.normal(0.0, size, 3),
                                  feedback, np.zeros(12), np.zeros(12), TICK)
        if not all(np.isfinite(each).all() for each in (
                targets.position, targets.velocity, targets.effort)):
            state, before = leg.initial_state(), None  # refused: nothing is sent
            continue
        assert_within(targets, robot.legs[0])
        if before is not None:
            jump = np.abs(np.subtract(targets.position, before)) / TICK
            assert (jump <= 2.0 * robot.legs[0].velocity_limit * (1.0 + 1e-9)).all()
        before = targets.position
