# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is granted of random commands keeps its limits and is what was asked within them; the body
is asked for the force that its curve needs, and stays up where it fell before."""

from __future__ import annotations

from math import cos, hypot, inf, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.balance.motion_plan import MotionPlan
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.reference.governor import LEAST, Governor
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.studies.random_commands import GAITS, course, trial
from dmp_cpg_ros.suite import load_gaits, load_suite

SCALE = body_scale(load_description(load_suite().robot_file))
KNOWN, TICK = load_gaits(), 0.004
P = ReferenceParameters(cmd_vel_timeout=0.0)
commands = st.tuples(*[st.floats(-5.0, 5.0)] * 3)


@pytest.mark.parametrize('name', GAITS)
@given(sequence=st.lists(commands, min_size=1, max_size=4), seed=st.integers(0, 9))
def test_what_is_granted_keeps_the_limits(
        name: str, sequence: list[tuple[float, float, float]], seed: int) -> None:
    gait, rng = KNOWN[name], np.random.default_rng(seed)
    gate = CommandGate(P, SCALE, (gait,))
    system, r = ReferenceSystem(P, Governor((gait,), SCALE)), np.zeros(3)
    for command in sequence:
        gate.accept(*command)
        granted = gate.at(0)
        assert (granted == command) == (gate.limited_by == '')
        assert SCALE.foot_speed(*granted) <= SCALE.speed(gait.highest_speed) * (1.0 + 1e-9)
        for _ in range(int(rng.integers(1, 60))):
            after = system.step(r, np.array(granted), TICK)
            if hypot(*after[:2]) > hypot(*r[:2]):
                assert hypot(*(after - r)[:2]) <= P.max_acceleration * TICK * (1.0 + 1e-9)
            r = after


@pytest.mark.parametrize('name', GAITS)
def test_the_faster_the_less_is_left_to_accelerate_with(name: str) -> None:
    governor, change = Governor((KNOWN[name],), SCALE), np.array((0.0, 4.0 * TICK))
    shares = [governor.share(np.array((0.0, speed, 0.0)), change, TICK, P.max_acceleration)
              for speed in np.linspace(0.0, 0.3, 20)]
    assert np.all(np.diff(shares) <= 1e-12) and shares[-1] >= LEAST
    slow = LEAST * P.max_acceleration * TICK
    assert governor.share(np.array((9.0, 0.0, 9.0)), np.array((0.0, slow)), TICK,
                          P.max_acceleration) == 1.0


def test_a_pronk_is_not_sent_sideways_as_a_trot_is() -> None:
    across = []
    for name in ('pronk', 'trot'):
        gate = CommandGate(P, SCALE, (KNOWN[name],))
        gate.accept(0.2, 0.6, 0.0)
        across.append(gate.at(0)[1])
    assert across[0] <= SCALE.rolling * SCALE.speed(KNOWN['pronk'].highest_speed) < across[1]


@given(v=commands, change=commands)
def test_the_planned_acceleration_is_that_of_the_body_in_the_world(
        v: tuple[float, float, float], change: tuple[float, float, float]) -> None:
    """d/dt R(γ t) v(t) at t = 0, by differences."""
    h, (x, y, gamma) = 1e-5, v

    def in_world(t: float) -> np.ndarray:
        c, s = cos(gamma * t), sin(gamma * t)
        return np.array(((c, -s), (s, c))) @ (x + change[0] * t, y + change[1] * t)

    before = MotionPlan().followed(
        (x - change[0] * h, y - change[1] * h, gamma), 1.0, 4.0, inf, h)
    plan = before.followed(v, 1.0, 4.0, inf, h)
    np.testing.assert_allclose(plan.acceleration, (in_world(h) - in_world(-h)) / (2.0 * h),
                               atol=1e-3)
    assert np.dot(plan.curve, (x, y)) == pytest.approx(0.0, abs=1e-9)


def test_what_is_expected_of_a_body_waits_for_its_legs() -> None:
    plan = MotionPlan().followed((0.0, 0.0, 0.0), 0.0, 4.0, 4.0, 0.0)
    for _ in range(500):
        plan = plan.followed((0.5, 0.0, 0.0), 0.0, 4.0, 4.0, TICK)
    assert plan.expected == (0.0, 0.0) and plan.acceleration == (0.0, 0.0)
    for _ in range(1000):
        plan = plan.followed((0.5, 0.0, 0.0), 1.0, 4.0, 4.0, TICK)
    assert plan.expected[0] == pytest.approx(0.5)


def test_equal_seeds_give_equal_courses_of_every_kind_of_event() -> None:
    events = course(3, 60.0, (3.5, 0.6, 2.2))
    assert events == course(3, 60.0, (3.5, 0.6, 2.2)) != course(4, 60.0, (3.5, 0.6, 2.2))
    assert {what for _, what, _ in events} == {'command', 'gait', 'stop'}


@pytest.mark.parametrize(('seed', 'seconds'), [(6, 12.0), (7, 14.0)])
def test_a_robot_stays_up_under_random_commands_under_which_it_fell(
        seed: int, seconds: float) -> None:
    outcome = trial(seed, seconds)
    assert outcome.fell == '' and not outcome.late
    assert 0.3 < outcome.granted / outcome.asked <= 1.0
