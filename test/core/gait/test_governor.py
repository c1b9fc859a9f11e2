# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is granted of random commands keeps its limits and is what was asked within them; the body
is asked for the force that its curve needs, and stays up where it fell before."""

from __future__ import annotations

from math import cos, hypot, inf, sin

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.balance.controller import PostureController, PostureParameters
from dmp_cpg_ros.core.balance.motion_plan import MotionPlan
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.reference.governor import LEAST, Governor
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.studies.disturbances import Disturbance, pushes
from dmp_cpg_ros.studies.random_commands import GAITS, course, drawn_gaits, touches_itself, trial
from dmp_cpg_ros.studies.walking_trials import Walk, attitude, is_there, steady
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
            if any(granted[:2]) or hypot(*after[:2]) > hypot(*r[:2]):
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


def test_a_gait_on_one_side_at_a_time_is_sent_into_wider_curves() -> None:
    """A pace stands on one side for most of the time, a trot never."""
    curve = {}
    for name in ('pace', 'amble', 'trot', 'pronk'):
        gate = CommandGate(P, SCALE, (KNOWN[name],))
        gate.accept(-1.0, 0.0, 1.1)
        v_x, _, gamma = gate.at(0)
        assert gamma / v_x == pytest.approx(-1.1)  # the same curve, more slowly
        curve[name] = -v_x * gamma
    assert curve['pace'] < 0.5 * curve['amble'] < 0.5 * curve['trot'] + 1e-9
    assert KNOWN['trot'].two_sided == KNOWN['pronk'].two_sided == 1.0


def test_a_pronk_leaves_small_errors_to_its_feet_and_catches_large_ones() -> None:
    of = PostureController(load_description(load_suite().robot_file), PostureParameters())
    planned = (0.5, 0.0, 0.2)
    for error in (0.05, 0.6):
        measured = (0.5, error, 0.2)
        assert of.placement.caught(measured, planned, 1.0) == measured
        _, y, _ = of.placement.caught(measured, planned, 0.0)
        assert (y == 0.0) == (error < 0.1) and 0.0 <= y < error


def test_equal_seeds_give_equal_courses_of_every_kind_of_event() -> None:
    limits = (3.5, 0.6, 2.2)
    events = course(3, 60.0, limits)
    assert events == course(3, 60.0, limits) != course(4, 60.0, limits)
    assert events[:20] == course(3, 61.0, limits)[:20]
    assert {what for _, what, _ in events} == {'command', 'gait', 'stop'}
    more = course(3, 60.0, limits, changes_too=True)
    assert [event for event in more if event[1] in ('command', 'gait', 'stop')] == events
    assert {what for _, what, _ in more} == {'command', 'gait', 'stop', 'set', 'mode'}
    by_speed = course(3, 60.0, limits, auto_gait=True)
    assert [event for event in by_speed if event[1] != 'set'] == [
        event for event in events if event[1] != 'gait']
    assert all(GaitChoiceParameters(**value) for _, what, value in by_speed if what == 'set')


def test_a_walk_is_disturbed_by_some_of_everything() -> None:
    drawn = [Disturbance.drawn(seed) for seed in range(40)]
    assert Disturbance.drawn(3) == drawn[3] != drawn[4]
    for name in ('friction', 'payload', 'bumps'):
        assert 10 < sum(name in each.told for each in drawn) < 30
    world = next(each.world for each in drawn if 'bumps' in each.told)
    assert world is not None and world.height_at(0.2, -0.3) == 0.0
    assert np.std(world.height_at(*np.random.default_rng(1).uniform(-50.0, 50.0, (2, 99)))) > 0.0
    assert pushes(3, 61.0)[:5] == pushes(3, 60.0)[:5]
    outcome = trial(1, 8.5, changes=True, auto_gait=True, disturbed=True)
    assert outcome.fell == '' and outcome.disturbed and outcome.pushed > 0


def test_a_robot_stays_up_under_random_commands_under_which_it_fell() -> None:
    """It fell after 7.3 s, in a pronk."""
    outcome = trial(5, 9.0)
    assert outcome.fell == '' and not outcome.late
    assert 0.3 < outcome.granted / outcome.asked <= 1.0


@pytest.mark.skipif(not is_there('robots/b2'), reason='the model of B2 is not installed')
def test_a_robot_stays_up_that_may_catch_its_legs_at_any_speed_and_does_not_step() -> None:
    """It fell 0.8 s after a stop at -1.0 m/s, in which its legs were caught within 0.05 s."""
    assert trial(96151, 18.0, 'robots/b2', changes=True, auto_gait=True).fell == ''


def test_a_robot_that_lies_down_and_gets_other_parameters_meanwhile_has_not_fallen() -> None:
    outcome = trial(71004, 14.0, changes=True)
    assert outcome.fell == '' and outcome.changed > 3 and not outcome.late


def test_a_robot_stays_up_in_gaits_with_any_lags() -> None:
    lags, again, others = ([gait.lag.tolist() for gait in drawn_gaits(seed).values()]
                           for seed in (41002, 41002, 41003))
    assert lags == again != others and len({*map(tuple, lags)}) == len(lags)
    outcome = trial(41002, 9.0, drawn=True)
    assert outcome.fell == '' and not outcome.late


def test_gaits_may_be_asked_for_while_they_are_chosen_by_speed() -> None:
    """Which is refused, and ended the study."""
    assert trial(3158, 2.2, changes=True).fell == ''


@pytest.mark.parametrize(('apart', 'touches'), [(0.3, False), (0.15, True)])
def test_legs_that_kick_each_other_are_told_from_feet_on_the_ground(
        apart: float, touches: bool) -> None:
    leg = ('<body pos="{0} 0 0"><joint axis="0 1 0"/><geom type="sphere" size="0.1" mass="1"/>'
           '</body>')
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 0.09"><freejoint/>'
        f'<geom size="0.01" pos="0 0 0.5" mass="1"/>{leg.format(0)}{leg.format(apart)}'
        '</body></worldbody></mujoco>')
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon >= 2
    assert touches_itself(model, data) == touches
    data.qpos[2] = 1.0
    mujoco.mj_forward(model, data)
    assert touches_itself(model, data) == touches


def test_a_pace_backwards_through_a_curve_stays_up() -> None:
    assert not steady('pace', (-1.0, 0.0, 1.1)).fell


def test_a_fast_trot_backwards_does_not_roll_to_one_side() -> None:
    """By 3 degrees in the mean, where feet went along no further than forwards."""
    run = Walk('trot', seed=3, values=(('caution', False),))
    assert run.reach((-2.5, 0.0, 0.0)) and run.walk(4.0)
    assert abs(np.mean(attitude(run.states[-500:])[:, 0])) < 0.026
