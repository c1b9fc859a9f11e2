# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every gait stays within its highest speed, wherever the reference comes from, and slows down
where it must.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from core_examples import GAITS, TICK, quadruped, standing_state
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.balance.controller import PostureController, PostureParameters
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.choice import (
    Changing,
    GaitChoiceParameters,
    changing_to,
    limiting_gaits,
)
from dmp_cpg_ros.core.gait.gait import BACKWARD_WEIGHT, ONE_SIDED_WEIGHT, Gait
from dmp_cpg_ros.core.gait.running import HASTE, approached, limits_on_the_way
from dmp_cpg_ros.core.gait.speed_limit import blended_limit, swing_acceleration, within_limit
from dmp_cpg_ros.core.gait.transition import (
    CHANGING,
    BlendedGait,
    GaitTransition,
    changing_speed,
)
from dmp_cpg_ros.core.inhibition.caution import changing_share
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceParameters
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.leg import (
    LegFeedback,
    LegParameters,
    LegPrimitive,
    body_scale,
)
from dmp_cpg_ros.studies.walking_trials import Walk, is_there

ROBOT = quadruped()
SCALE = body_scale(ROBOT)
ROOT = (GRAVITY * SCALE.leg_length) ** 0.5
velocities = st.tuples(*(st.floats(-4.0, 4.0) for _ in range(3)))
FAST = (4.0, 0.4, 0.5)


@given(velocity=velocities, most=st.floats(0.1, 3.0))
def test_a_velocity_is_shortened_and_keeps_its_curve(
        velocity: tuple[float, float, float], most: float) -> None:
    scale = BodyScale(0.28, 0.2)
    short = within_limit(velocity, scale.foot_speed(*velocity), scale.speed(most))
    reached, speed = scale.foot_speed(*short), scale.foot_speed(*velocity)
    assert reached <= most * (GRAVITY * 0.28) ** 0.5 * (1.0 + 1e-12)
    share = reached / speed if speed > 0.0 else 1.0
    assert np.allclose(short, np.array(velocity) * share, atol=1e-12)
    if speed <= most * (GRAVITY * 0.28) ** 0.5:
        assert short == velocity


@given(velocity=velocities, most=st.floats(0.1, 3.0), curve=st.floats(0.05, 1.0))
def test_a_fast_command_leaves_less_for_its_curve(
        velocity: tuple[float, float, float], most: float, curve: float) -> None:
    scale = BodyScale(0.28, 0.2)

    def share(v: tuple[float, float, float]) -> float:
        speed = scale.foot_speed(*v) / (most * (GRAVITY * 0.28) ** 0.5)
        return speed ** 2 + (np.hypot(v[0], v[1]) * v[2] / (curve * GRAVITY)) ** 2

    short = within_limit(velocity, scale.foot_speed(*velocity), scale.speed(most),
                         curve * GRAVITY)
    assert np.allclose(np.cross(short, velocity), 0.0, atol=1e-12)
    assert np.dot(short, velocity) >= 0.0
    if share(velocity) > 1.0:
        assert share(short) == pytest.approx(1.0)
    else:
        assert short == velocity


def test_every_gait_of_the_package_has_a_limit_that_its_tables_reach() -> None:
    for gait in GAITS.values():
        assert np.isfinite(gait.highest_speed) and gait.highest_speed >= gait.speed[-1]
        assert gait.scaled(1.2).highest_speed == gait.highest_speed


@given(u=st.floats(0.1, 3.0), f=st.floats(0.5, 5.0), duty=st.floats(0.2, 0.9))
def test_the_swing_is_as_hard_at_its_ends_as_the_foot_path_is_bent(
        u: float, f: float, duty: float) -> None:
    """The formula against second differences of the path itself, in both directions of time."""
    path, swing, h = FootPath((0.0, 0.0, -0.3), u, 0.0, 0.0, 2.0 * np.pi * f, duty, 0.05), (
        1.0 - duty), 1e-4
    for end in (-1.0, 1.0):
        c = end * swing * (0.5 - h * np.arange(1, 6))  # cycle positions, inwards
        slopes = np.array([path.at(at)[1][0] * f for at in c])
        rates = np.gradient(slopes, c / f)
        assert abs(np.polyval(np.polyfit(c, rates, 1), end * 0.5 * swing)) == pytest.approx(
            swing_acceleration(u, f, duty), rel=2e-3)


@pytest.mark.parametrize('gait', GAITS)
@given(swing=st.floats(5.0, 1e4), factor=st.floats(0.5, 2.0))
def test_a_robot_is_never_asked_to_swing_its_legs_harder_than_its_hips_can(
        gait: str, swing: float, factor: float) -> None:
    scale, of = replace(SCALE, swing=swing), GAITS[gait]

    def needed(u: float) -> float:
        cadence, duty = (np.interp(u, of.speed, table) for table in (of.cadence, of.duty_factor))
        return swing_acceleration(u, float(cadence), float(duty)) * GRAVITY

    most = of.highest(scale)
    assert 0.0 < most <= of.highest_speed
    assert max(needed(u) for u in np.linspace(0.0, most, 50)) <= swing * (1.0 + 1e-9)
    assert most == of.highest_speed or needed(most * 1.001) > swing
    assert of.scaled(max(factor, 1.0)).highest(scale) == most
    assert of.highest(replace(scale, swing=2.0 * swing)) >= most
    assert of.highest(replace(scale, swing=inf)) == of.highest_speed
    velocity, *_ = of.pace(np.array(FAST), scale)
    assert scale.foot_speed(*velocity) <= scale.speed(most) * (1.0 + 1e-9)


@pytest.mark.parametrize('gait', sorted(GAITS))
@pytest.mark.parametrize('swing', [150.0, inf])
def test_strides_of_a_slower_cadence_are_no_longer_than_the_longest(
        gait: str, swing: float) -> None:
    scale, of = replace(SCALE, swing=swing), GAITS[gait]

    def stride(u: float, factor: float) -> float:
        cadence, duty = (np.interp(u, of.speed, table) for table in (of.cadence, of.duty_factor))
        return float(u * duty / (factor * cadence))

    before, longest = of.highest(scale), stride(of.highest(scale), 1.0)
    for factor in (0.95, 0.8, 0.7, 0.5):
        most = of.scaled(0.5).scaled(2.0 * factor).highest(scale)
        assert most < before
        assert stride(most, factor) == pytest.approx(longest)
        gate = CommandGate(ReferenceParameters(max_speed=9.0, cmd_vel_timeout=0.0), scale,
                           limiting_gaits(GaitChoiceParameters(), gait, GAITS.__getitem__, factor))
        gate.accept(9.0, 0.0, 0.0)
        assert gate.at(0)[0] == pytest.approx(most * ROOT)
        before = most


@pytest.mark.parametrize('gait', sorted(GAITS))
def test_commands_are_limited_to_what_hips_can_swing_at_a_quicker_cadence(gait: str) -> None:
    scale, of = replace(SCALE, swing=150.0), GAITS[gait]

    def needed(u: float, factor: float) -> float:
        cadence, duty = (np.interp(u, of.speed, table) for table in (of.cadence, of.duty_factor))
        return swing_acceleration(u, factor * float(cadence), float(duty)) * GRAVITY

    before = of.highest(scale)
    for factor in (1.5, 2.0, 4.0):
        limiting, = limiting_gaits(GaitChoiceParameters(), gait, GAITS.__getitem__, factor)
        most = limiting.highest(scale)
        assert most <= before and needed(most, factor) <= 150.0 * (1.0 + 1e-9)
        assert most == of.highest_speed or needed(1.001 * most, factor) > 150.0
        assert limiting.omega(0.5, scale) == of.omega(0.5, scale)  # as the governor counts
        before = most
    assert before < of.highest(scale)


@given(gait=st.sampled_from(sorted(GAITS)), before=st.floats(0.7, 4.0), after=st.floats(0.7, 4.0),
       begin_s=st.floats(-5.0, 5.0))
def test_commands_keep_the_limits_of_every_cadence_on_the_way_from_one_to_another(
        gait: str, before: float, after: float, begin_s: float) -> None:
    scale, dt_ns = replace(SCALE, swing=150.0), 50_000_000
    p, way = ReferenceParameters(max_speed=9.0, cmd_vel_timeout=0.0), limits_on_the_way(
        GaitChoiceParameters(), gait, GAITS.__getitem__, after, before)
    gate, time_ns, acting = CommandGate(p, scale), round(1e9 * begin_s), before
    gate.accept(9.0, 0.0, 0.0)
    gate.follow(p, *way)
    while acting != after:
        time_ns, acting = time_ns + dt_ns, approached(acting, after, dt_ns * 1e-9)
        most = scale.speed(GAITS[gait].limiting(acting).highest(scale))
        foreseen = gate.foreseen(time_ns)
        assert gate.at(time_ns) == foreseen
        assert foreseen[0] <= most * (1.0 + 1e-9)
    assert gate.at(time_ns + 2 * dt_ns)[0] == pytest.approx(
        scale.speed(GAITS[gait].limiting(after).highest(scale)))


def test_the_limits_of_a_cadence_that_moves_end_on_a_clock_that_was_set_back() -> None:
    scale, p = replace(SCALE, swing=150.0), ReferenceParameters(cmd_vel_timeout=0.0)
    gate = CommandGate(p, scale)
    gate.accept(3.5, 0.0, 0.0)
    gate.follow(p, *limits_on_the_way(
        GaitChoiceParameters(), 'trot', GAITS.__getitem__, 1.0, 4.0))
    quick = gate.at(10**12)
    assert gate.at(0) == quick == gate.at(5 * 10**9)
    assert gate.at(6 * 10**9 + 1)[0] > quick[0]


@pytest.mark.skipif(not is_there('robots/go1'), reason='the model of Go1 is not installed')
def test_a_robot_stays_up_while_its_cadence_comes_down_from_a_quick_one() -> None:
    """It fell within 1.6 s, told to go faster than its hips could swing the legs yet."""
    run = Walk('trot', 'robots/go1', seed=3, values=(('cadence_scale', 4.0),))
    run.loop.command(3.5)
    assert run.walk(3.0)
    assert run.loop.change({'cadence_scale': 1.0}) == ''
    assert run.walk(3.0)


@pytest.mark.parametrize(('gait', 'velocity'), [
    ('amble', (3.5, 0.0, 0.0)), ('trot', (-3.5, 0.0, 0.0)), ('walk', (0.0, 0.0, 2.2))])
def test_a_robot_stays_up_at_the_slowest_cadence_whatever_it_is_told(
        gait: str, velocity: tuple[float, float, float]) -> None:
    """An amble ahead fell after 6.3 s."""
    run = Walk(gait, seed=3, values=(('cadence_scale', 0.7),))
    run.loop.command(*velocity)
    assert run.walk(8.0)


def test_a_blend_is_limited_between_its_gaits_on_any_robot() -> None:
    way = GaitTransition(GAITS['trot'], GAITS['bound'])
    scale = replace(SCALE, swing=160.0)
    ends = [GAITS[name].highest(scale) for name in ('trot', 'bound')]
    assert ends[1] < GAITS['bound'].highest_speed
    limits = [way.at(share, 0.1).highest(scale) for share in (0.0, 0.3, 0.7, 1.0)]
    assert limits == sorted(limits, reverse=True)
    assert [limits[0], limits[-1]] == pytest.approx(ends)


@pytest.mark.parametrize('wrong', [0.5, -1.0, float('nan'), 'fast'])
def test_an_impossible_limit_is_refused(wrong: object) -> None:
    values = {'lag': dict(fl=0.0, fr=0.5, rl=0.5, rr=0.0), 'speed': [0.0, 0.6],
              'cadence': [0.3, 0.4], 'duty_factor': [0.6, 0.6]}
    assert Gait.from_mapping('own', values).highest_speed == inf
    assert Gait.from_mapping('own', {**values, 'highest_speed': 0.6}).highest_speed == 0.6
    with pytest.raises(ParameterError, match="gait 'own'"):
        Gait.from_mapping('own', {**values, 'highest_speed': wrong})


@given(before=st.floats(0.2, 3.0), after=st.floats(0.2, 3.0))
def test_a_change_leads_from_limit_to_limit(before: float, after: float) -> None:
    weights = np.linspace(0.0, 1.0, 50).tolist()
    limits = np.array([blended_limit(before, after, weight) for weight in weights])
    assert limits[0] == pytest.approx(before) and limits[-1] == pytest.approx(after)
    assert np.all(np.diff(limits) * np.sign(after - before) >= -1e-12)
    assert blended_limit(inf, after, 0.0) == inf
    assert blended_limit(inf, after, 1.0) == pytest.approx(after)
    assert blended_limit(inf, inf, 0.3) == inf


def test_commands_are_followed_up_to_the_gait_or_the_last_that_may_be_chosen() -> None:
    gate = CommandGate(ReferenceParameters(cmd_vel_timeout=0.0), SCALE)
    gate.accept(3.0, 0.0, 0.0)
    assert gate.at(0) == (3.0, 0.0, 0.0)
    choice = GaitChoiceParameters()
    gate.follow(gate.parameters, limiting_gaits(choice, 'walk', GAITS.__getitem__))
    assert gate.at(1)[0] == pytest.approx(GAITS['walk'].highest_speed * ROOT)
    choice = GaitChoiceParameters(auto_gait=True)
    gate.follow(gate.parameters, limiting_gaits(choice, 'walk', GAITS.__getitem__))
    assert gate.at(2)[0] == pytest.approx(3.0)
    choice = GaitChoiceParameters(auto_gait=True, auto_gaits=('trot', 'walk'))
    gate.follow(gate.parameters, limiting_gaits(choice, 'walk', GAITS.__getitem__))
    assert gate.at(3)[0] == pytest.approx(GAITS['walk'].highest_speed * ROOT)


@pytest.mark.parametrize('gait', [GAITS['walk'], GaitTransition(GAITS['trot'], GAITS['walk']).at(
    0.4, 1.0)])
def test_legs_posture_and_cadence_take_the_same_velocity(gait: object) -> None:
    """What exceeds the limit is as if the limit had been asked for."""
    short = gait.limited(FAST, SCALE)  # type: ignore[attr-defined]
    speeds = [SCALE.foot_speed(*velocity) for velocity in (FAST, short)]
    assert speeds[1] < 0.99 * speeds[0]
    assert np.allclose(*([gait.omega(u, SCALE), gait.duty(u, SCALE)] for u in speeds))  # type: ignore[attr-defined]
    x = state_at(gait.phases + 0.7, 1.0)  # type: ignore[attr-defined]
    x_dot = 12.0 * x[:, ::-1] * [1.0, -1.0]
    nothing = LegFeedback((0.0,) * 3, (0.0,) * 3, (0.0,) * 2, (0.0,) * 3)
    leg = LegPrimitive('fr', ROBOT, LegParameters())
    posture = PostureController(ROBOT, PostureParameters())
    goals, torques = [], []
    for velocity in (FAST, short):
        r = np.array(velocity)
        goals.append(np.concatenate(leg.step(
            leg.initial_state(), gait, x[1], x_dot[1], r, nothing, TICK)[1:]))  # type: ignore[arg-type]
        feedback = posture.step(
            posture.initial_state(), standing_state(ROBOT, 0), gait, x, x_dot, r, TICK)[1]  # type: ignore[arg-type]
        torques.append([sum(feedback.torque), np.sum(feedback.shift_in_base)])
    assert np.allclose(*goals) and np.allclose(*torques)


@pytest.mark.parametrize('gait', ['amble', 'walk', 'pronk'])
def test_a_robot_that_is_asked_for_too_much_goes_as_fast_as_it_can(gait: str) -> None:
    run = Walk(gait)
    run.loop.command(3.0)
    assert run.walk(4.0)
    most = GAITS[gait].highest_speed * ROOT
    mean = np.mean([state.base_velocity_in_base[0] for state in run.states[-500:]])
    assert mean == pytest.approx(most, rel=0.05)
    assert SCALE.foot_speed(*run.loop.r.tolist()) <= most * (1.0 + 1e-9)


@pytest.mark.parametrize('command', [(3.5, 0.0, 1.0), (2.0, 0.0, 2.2), (3.0, 0.0, -0.7)])
def test_no_curve_that_is_asked_for_throws_a_trot(command: tuple[float, float, float]) -> None:
    run = Walk('trot')
    run.loop.command(*command)
    assert run.walk(4.5)
    reached = np.mean([(state.base_velocity_in_base[0], state.base_rate_in_base[2])
                       for state in run.states[-500:]], axis=0)
    assert reached[0] > 1.0 and reached[1] * command[2] > 0.3


def test_a_trot_that_is_told_to_turn_back_brakes_first() -> None:
    run = Walk('trot')
    assert run.reach((3.0, 0.0, 0.0)) and run.walk(2.0)
    run.loop.command(-3.0)
    assert run.walk(4.0)
    mean = np.mean([state.base_velocity_in_base[0] for state in run.states[-250:]])
    assert mean == pytest.approx(-3.0, rel=0.05)


@pytest.mark.parametrize('speed', [2.5, 3.5])
def test_a_change_to_a_slower_gait_slows_down_first_and_does_not_fall(speed: float) -> None:
    run = Walk('trot')
    assert run.reach((speed, 0.0, 0.0)) and run.walk(1.0)
    assert not run.loop.change_gait('walk')
    before = inf
    for _ in range(500):
        if run.loop.network.gait.name != 'trot':
            break
        before = SCALE.foot_speed(*run.loop.r.tolist())
        assert run.walk(0.004)
    assert run.loop.network.gait.name == 'trot>walk'
    most = HASTE * changing_speed(GAITS['trot'], GAITS['walk'], SCALE) * ROOT
    assert inf > before > most  # or it would have waited too long
    assert SCALE.foot_speed(*run.loop.r.tolist()) <= most
    assert run.walk(4.0)
    assert run.loop.network.gait.name == 'walk'
    mean = np.mean([state.base_velocity_in_base[0] for state in run.states[-250:]])
    assert mean == pytest.approx(GAITS['walk'].highest_speed * ROOT, rel=0.05)


@pytest.mark.parametrize(('before', 'after', 'speed'), [
    ('trot', 'pronk', -2.6), ('amble', 'trot', 1.6)])
def test_gaits_change_at_a_speed_that_is_neithers_limit_and_walk_on(
        before: str, after: str, speed: float) -> None:
    """The first of them fell when gaits changed at the limit of the slower one."""
    run = Walk(before)
    assert run.reach((speed, 0.0, 0.0)) and run.walk(3.0)
    assert not run.loop.change_gait(after)
    most, fastest = changing_speed(GAITS[before], GAITS[after], SCALE) * ROOT, 0.0
    for _ in range(1500):
        assert run.walk(0.004)
        if isinstance(run.loop.network.gait, BlendedGait):
            fastest = max(fastest, GAITS[after].limiting_speed(run.loop.r.tolist(), SCALE))
    assert 0.9 * most < fastest <= HASTE * most
    assert run.loop.network.gait.name == after and run.loop.stop.share > 0.9
    reached = np.mean([state.base_velocity_in_base[0] for state in run.states[-250:]])
    wanted = GAITS[after].limited((speed, 0.0, 0.0), SCALE)[0]
    assert reached == pytest.approx(wanted, rel=0.2)  # a pronk swings about its speed


def test_who_has_the_gait_that_is_wanted_follows_all_of_the_command() -> None:
    trot, walk = GAITS['trot'], GAITS['walk']
    assert changing_speed(trot, trot, SCALE) == inf
    assert changing_speed(trot, walk, SCALE) == changing_speed(walk, trot, SCALE) == (
        CHANGING * walk.highest_speed)
    way = GaitTransition(trot, walk).at(0.5, 0.1)
    for wanted in (trot, walk):  # it is on its way there, or back again
        assert changing_speed(way, wanted, SCALE) == CHANGING * walk.highest_speed
    network = Walk('trot').loop.network
    command = (2.0, 0.1, -0.3)
    assert changing_share(network, Changing(network.gait), command) == 1.0
    share = changing_share(network, Changing(walk), command)
    shortened = tuple(share * value for value in command)
    assert walk.limiting_speed(shortened, network.scale) == pytest.approx(
        network.scale.speed(CHANGING * walk.highest_speed))
    assert changing_share(network, Changing(walk), (0.0, 0.0, 0.0)) == 1.0


def test_a_reference_does_not_speed_up_while_a_gait_changes_that_was_chosen() -> None:
    trot, walk = GAITS['trot'], GAITS['walk']
    network, choice = Walk('trot').loop.network, GaitChoiceParameters(auto_gait=True)
    assert changing_to(choice, trot, walk) is None
    way, scale, command = GaitTransition(walk, trot).at(0.5, 0.1), network.scale, (-2.0, 0.1, 0.3)
    changing = changing_to(choice, way, walk)
    assert changing == (trot, True)
    for speed, most in ((0.1, CHANGING * walk.highest_speed), (0.9, 0.9), (9.0, None)):
        share = changing_share(network.of(way), changing, command, scale.speed(speed))
        assert share == 1.0 if most is None else scale.foot_speed(
            *(share * value for value in command)) == pytest.approx(scale.speed(most))


@pytest.mark.skipif(not is_there('robots/go1'), reason='the model of Go1 is not installed')
@pytest.mark.parametrize(('gaits', 'border', 'seed', 'end'), [
    (('trot', 'pronk'), 0.25, 1, 2.5), (('pace', 'amble'), 0.3, 3, 2.5),
    (('pace', 'amble'), 0.7, 1, 3.5)])
def test_a_robot_stays_up_whose_gait_is_chosen_while_it_speeds_up(
        gaits: tuple[str, ...], border: float, seed: int, end: float) -> None:
    """It fell: while gaits changed, and in a gait whose reference went on without it."""
    run = Walk(gaits[0], 'robots/go1', seed=seed, values=(
        ('auto_gait', True), ('auto_gaits', gaits), ('auto_speeds', (border,)),
        ('auto_hysteresis', 0.02)))
    run.loop.command(3.5)
    assert run.walk(end)


@given(velocity=velocities, factor=st.floats(0.1, 3.0), name=st.sampled_from(sorted(GAITS)))
def test_backwards_a_pronk_and_a_pace_are_granted_less_and_others_the_same(
        velocity: tuple[float, float, float], factor: float, name: str) -> None:
    (v_x, v_y, gamma), gait = velocity, GAITS[name]
    ahead, back = (abs(v_x), v_y, gamma), (-abs(v_x), v_y, gamma)
    assert SCALE.foot_speed(*back) == SCALE.foot_speed(*ahead)
    counted = gait.limiting_speed(back, SCALE)
    assert counted >= gait.limiting_speed(ahead, SCALE)
    weight = {'pronk': BACKWARD_WEIGHT, 'pace': pytest.approx(ONE_SIDED_WEIGHT, abs=0.2)}
    assert gait.limiting_speed((-1.0, 0.0, 0.0), SCALE) == weight.get(name, 1.0)
    scaled = tuple(factor * value for value in back)  # curves are shortened by one factor
    assert gait.limiting_speed(scaled, SCALE) == pytest.approx(factor * counted)
