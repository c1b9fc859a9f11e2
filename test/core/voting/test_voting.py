# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What makes legs vote, how votes fade and add up, and what is refused at the box."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from core_examples import GRAVITY, TICK_NS, network, quadruped, standing_state
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.voting.parameters import VoteSourceParameters, VotingParameters
from dmp_cpg_ros.core.voting.voters import (
    FootWatch,
    LastGood,
    UpFilter,
    VoteSensors,
    vote_sensors,
    watch_feet,
)
from dmp_cpg_ros.core.voting.votes import FADE_STEPS, MOST_VOTERS, NO_VOTES, VoteInbox, VoteMemory
from dmp_cpg_ros.core.voting.voting import (
    VoteClamp,
    Voting,
    acting_gains,
    holds_at_rest,
    vote_clamp,
)

NAN = float('nan')
ROBOT = quadruped()
STANDING = standing_state(ROBOT)
SOURCES = VoteSourceParameters(judged_after=0.0)
FADE_NS = 1_000_000_000
R = np.zeros(3)


def voting(sources: VoteSourceParameters = SOURCES, **changes: object) -> Voting:
    return Voting(InhibitionParameters(), VotingParameters(**{'voting': True, **changes}),  # type: ignore
                  sources, ReferenceParameters(), ROBOT.mass * GRAVITY)


def fits(clamp: VoteClamp) -> bool:
    """Whether a majority stops the gait for certain and fewer votes cannot."""
    return clamp.window.lowest < clamp.gain < clamp.window.highest


# Fading --------------------------------------------------------------------------------------


@given(weights=st.lists(st.floats(0.0, 5.0), min_size=4, max_size=4),
       ages=st.lists(st.integers(0, 3 * FADE_NS), min_size=2, max_size=2))
def test_a_vote_only_fades_and_is_gone_after_its_time(weights: list[float], ages: list[int]
                                                      ) -> None:
    memory = VoteMemory().heard('user', weights, 0)
    early, late = (memory.weights(age, FADE_NS) for age in sorted(ages))
    assert np.all(late <= early) and np.all(early <= weights)
    assert np.array_equal(memory.weights(0, FADE_NS), weights)
    assert not memory.weights(FADE_NS, FADE_NS).any()
    assert not memory.alive(FADE_NS, FADE_NS).asks


def test_a_vote_fades_in_equal_steps() -> None:
    memory = VoteMemory().heard('user', (1.0, 0.0, 0.0, 0.0), 0)
    levels = [memory.weights(t, FADE_NS)[0] for t in range(0, FADE_NS + 1, 10_000_000)]
    assert len(set(levels)) == FADE_STEPS + 1
    np.testing.assert_allclose(-np.diff(sorted(set(levels), reverse=True)), 1.0 / FADE_STEPS)


def test_votes_of_sources_add_up_and_a_new_vote_replaces_the_old_one() -> None:
    memory = VoteMemory().heard('a', (0.3, NAN, NAN, NAN), 0).heard('b', (0.2, 0.4, NAN, NAN), 0)
    np.testing.assert_allclose(memory.weights(0, FADE_NS), (0.5, 0.4, 0.0, 0.0))
    assert memory.causes(0, FADE_NS) == ('a+b', 'b', '', '')
    lower = memory.heard('b', (0.1, NAN, NAN, NAN), 1)
    np.testing.assert_allclose(lower.weights(1, FADE_NS), (0.4, 0.4, 0.0, 0.0))
    assert memory.heard('c', (NAN,) * 4, 0) is memory


# From outside --------------------------------------------------------------------------------


@pytest.mark.parametrize(('weights', 'voter', 'text'), [
    ({}, '', 'fl, fr, rl, rr'),
    ({'tail': 1.0}, '', 'fl, fr, rl, rr'),
    ({'fl': NAN}, '', 'finite and at least 0'),
    ({'fl': math.inf}, '', 'finite and at least 0'),
    ({'fl': -0.1}, '', 'finite and at least 0'),
    ({'fl': 1.0}, 'tilt', 'none of footing'),
    ({'fl': 1.0}, 'a\nb', 'printable'),
    ({'fl': 1.0}, 'x' * 41, '40 characters'),
])
def test_what_cannot_be_a_vote_is_refused_and_leaves_nothing(
        weights: dict[str, float], voter: str, text: str) -> None:
    box = VoteInbox()
    with pytest.raises(DataError, match=text):
        box.accept(weights, voter)
    assert box.take() == ()


def test_voters_are_limited_in_number_but_not_in_votes() -> None:
    box = VoteInbox()
    for i in range(MOST_VOTERS):
        box.accept({'fl': 1.0}, f'voter {i}')
    with pytest.raises(DataError, match='one voter too many'):
        box.accept({'fl': 1.0}, 'late')
    for i in range(100):
        box.accept({'rr': 0.01 * i}, 'voter 3')
    box.accept({'rr': 0.5, 'fl': 0.25}, 'voter 3')
    votes = box.take()
    assert [voter for voter, _ in votes] == [f'voter {i}' for i in range(MOST_VOTERS)]
    assert dict(votes)['voter 3'] == pytest.approx((0.25, NAN, NAN, 0.5), nan_ok=True)


def test_a_voter_whose_votes_have_faded_makes_room_for_another() -> None:
    box, memory, fade_ns = VoteInbox(), VoteMemory(), 1_000_000_000

    def tick(time_ns: int) -> None:
        nonlocal memory
        for voter, weights in box.take(memory.asks):
            memory = memory.heard(voter, weights, time_ns)
        memory = memory.alive(time_ns, fade_ns)

    for i in range(MOST_VOTERS):
        box.accept({'fl': 1.0}, f'voter {i}')
    for time_ns in (0, fade_ns // 2):
        tick(time_ns)
        with pytest.raises(DataError, match='one voter too many'):
            box.accept({'fl': 1.0}, 'late')
        box.accept({'fl': 1.0}, 'voter 3')
    for time_ns in (fade_ns, fade_ns + 1):
        tick(time_ns)
    box.accept({'fl': 1.0}, 'late')
    tick(fade_ns + 2)
    assert set(memory.asks) == {'voter 3', 'late'} and box.take() == ()


# Sensors -------------------------------------------------------------------------------------


def judged(position: float, load: float, seconds: float, **changes: object
           ) -> tuple[bool, bool]:
    """Whether fl votes for lost footing and for a collision after a time at a place."""
    p, state = replace(SOURCES, **changes), FootWatch()  # type: ignore[arg-type]
    places, loads = np.full(4, 0.5), np.full(4, 0.25)
    places[0], loads[0] = position, load
    lost = hit = np.zeros(4, bool)
    for k in range(round(seconds * 1e9) // TICK_NS + 1):
        state, lost, hit = watch_feet(state, p, k * TICK_NS, True, places, 0.6, 10.0, loads)
        assert not lost[1:].any() and not hit[1:].any()
    return bool(lost[0]), bool(hit[0])


def test_a_foot_without_load_in_stance_and_with_load_in_swing_votes() -> None:
    stance = 0.6 * 2.0 * math.pi / 10.0
    assert judged(0.5, 0.0, 0.55 * stance) == (True, False)
    assert judged(-0.45, 0.0, 0.55 * stance) == (True, False)
    assert judged(0.5, 0.0, 0.45 * stance) == (False, False)
    assert judged(0.0, 0.5, 0.04) == (False, True)
    assert judged(0.0, 0.5, 0.02) == (False, False)


@pytest.mark.parametrize(('position', 'load'), [
    (0.5, 0.25), (0.0, 0.0), (0.0, 0.1), (0.24, 0.0), (0.18, 0.6), (0.5, NAN), (0.0, NAN)])
def test_normal_loads_edges_of_the_phases_and_dead_sensors_do_not(
        position: float, load: float) -> None:
    assert judged(position, load, 2.0) == (False, False)


def test_nothing_is_judged_until_the_gait_has_run_for_a_while() -> None:
    assert judged(0.0, 0.5, 1.02, judged_after=1.0) == (False, False)
    assert judged(0.0, 0.5, 1.05, judged_after=1.0) == (False, True)


def felt(rate: np.ndarray, force: np.ndarray, time_ns: int) -> VoteSensors:
    return VoteSensors(time_ns, time_ns, np.zeros(4), rate, force)


def up_after(rate: tuple[float, float, float], seconds: float, true: bool = True
             ) -> tuple[UpFilter, np.ndarray]:
    """Estimate of a body that turns from upright, and the truth; the accelerometer feels gravity,
    or nothing.
    """
    up, omega, truth = UpFilter(), np.array(rate), np.array([0.0, 0.0, 1.0])
    speed = float(np.linalg.norm(omega))
    axis, start = omega / (speed or 1.0), truth
    for k in range(round(seconds / 0.004) + 1):
        angle = -speed * 0.004 * k
        truth = (start * math.cos(angle) + np.cross(axis, start) * math.sin(angle)
                 + axis * (axis @ start) * (1.0 - math.cos(angle)))
        up = up.after(felt(omega, GRAVITY * truth * true, k * TICK_NS))
    return up, truth


@given(x=st.floats(-1.0, 1.0), y=st.floats(-1.0, 1.0), z=st.floats(-1.0, 1.0),
       feels=st.booleans())
@settings(max_examples=20)
def test_up_follows_a_body_that_turns(x: float, y: float, z: float, feels: bool) -> None:
    up, truth = up_after((x, y, z), 0.8, feels)
    np.testing.assert_allclose(up.up_in_base, truth, atol=1e-6)
    assert up.tilt == pytest.approx(math.acos(min(1.0, truth[2])), abs=1e-5)


def test_up_forgets_a_wrong_start_and_bears_blows_repeats_and_gaps() -> None:
    up = UpFilter(np.array([1.0, 0.0, 0.0]), 0)
    still, gravity = np.zeros(3), np.array([0.0, 0.0, GRAVITY])
    for k in range(1, 2000):
        blow = gravity if k % 10 else 20.0 * gravity[[2, 1, 0]]
        up = up.after(felt(still, blow, k * TICK_NS))
    assert up.tilt < 0.01
    assert up.after(felt(still, gravity[[2, 1, 0]], up.time_ns)) is up
    late = up.after(felt(np.array([50.0, 0.0, 0.0]), gravity, up.time_ns + 10**9))
    assert late.tilt == pytest.approx(0.0)


def test_a_sensor_is_silent_after_its_time_and_heard_again_at_once() -> None:
    last, dead = LastGood.at(0), np.array([10.0, NAN, 10.0, 10.0])
    for time_ns in range(0, 600_000_000, TICK_NS):
        last = last.after(vote_sensors(replace(STANDING, time_ns=time_ns, foot_force=dead)))
        contact, imu = last.silent(time_ns, 500_000_000)
        assert contact.tolist() == [False, time_ns > 500_000_000, False, False] and not imu
    last = last.after(vote_sensors(replace(STANDING, time_ns=600_000_000)))
    assert not last.silent(600_000_000, 500_000_000)[0].any()


@pytest.mark.parametrize(('changes', 'cause', 'legs'), [
    ({'acceleration_in_base': np.array([GRAVITY, 0.0, 1.0])}, 'tilt', LEGS),
    ({'acceleration_in_base': np.full(3, NAN)}, 'silence', LEGS),
    ({'gyro_in_base': np.array([0.0, NAN, 0.0])}, 'silence', LEGS),
    ({'foot_force': np.array([10.0, 10.0, NAN, 10.0])}, 'silence', ('rl',)),
    ({}, '', ()),
])
def test_each_sensor_votes_with_its_legs(changes: dict[str, object], cause: str,
                                         legs: tuple[str, ...]) -> None:
    counting, of = voting(), network()
    x, state = of.locked_state(), counting.initial_state(of)
    for time_ns in range(0, 600_000_000, TICK_NS):
        reading = vote_sensors(replace(STANDING, time_ns=time_ns, **changes))  # type: ignore
        state = counting.step(state, time_ns, of, reading, x, R, False)
    tally = state.tally
    assert tally.causes == tuple(cause if leg in legs else '' for leg in LEGS)
    np.testing.assert_array_equal(tally.weights > 0.0, [leg in legs for leg in LEGS])
    assert tally.stops == (len(legs) >= 3)


def test_a_source_of_weight_zero_is_silent_and_time_that_goes_back_forgets() -> None:
    counting, of = voting(replace(SOURCES, tilt_weight=0.0)), network()
    tilted = replace(STANDING, time_ns=10 * TICK_NS,
                     acceleration_in_base=np.array([0.0, 0.0, -GRAVITY]))
    x, state = of.locked_state(), counting.initial_state(of)
    state = counting.step(state, 10 * TICK_NS, of, vote_sensors(tilted), x, R, False)
    assert state.tally is NO_VOTES
    voted = counting.step(state, 11 * TICK_NS, of, vote_sensors(tilted), x, R, False,
                          (('user', (1.0, NAN, NAN, NAN)),))
    assert voted.tally.alive
    again = counting.step(voted, 0, of, vote_sensors(STANDING), x, R, False)
    assert not again.tally.alive


# Counting ------------------------------------------------------------------------------------


@given(weights=st.lists(st.floats(0.0, 2.0), min_size=4, max_size=4))
def test_gains_follow_the_rule(weights: list[float]) -> None:
    alpha = np.array(weights)
    np.testing.assert_allclose(acting_gains(alpha, 50.0, 'sum'), 50.0 * alpha)
    won = acting_gains(alpha, 50.0, 'winner_take_all')
    assert np.count_nonzero(won) <= 1 and won.max() == 50.0 * alpha.max()


def test_weights_are_clamped_and_the_tally_changes_only_with_a_vote() -> None:
    counting, of = voting(), network()
    x, state = of.locked_state(), counting.initial_state(of)
    state = counting.step(state, 0, of, vote_sensors(STANDING), x, R, False,
                          (('user', (5.0, 0.01, NAN, NAN)),))
    assert state.clamp is not None
    np.testing.assert_allclose(state.tally.weights, (state.clamp.limit, 0.01, 0.0, 0.0))
    same = counting.step(state, TICK_NS, of, vote_sensors(replace(STANDING, time_ns=TICK_NS)), x,
                         R, False)
    assert same.tally is state.tally


@pytest.mark.parametrize('graph', ['all_to_all', 'ring'])
@pytest.mark.parametrize('count', [0, 1, 2, 3, 4])
def test_the_computed_clamp_takes_a_majority_to_overcome(graph: str, count: int) -> None:
    of = network(coupling_graph=graph)
    in_force = voting().initial_state(of).clamp
    assert in_force is not None and fits(in_force.clamp)
    gains = np.where(np.arange(4) < count, in_force.clamp.gain, 0.0)
    assert holds_at_rest(of, gains, 0.3) == (count >= 3)


def test_a_vote_too_weak_to_hold_its_own_node_does_not_hinder_the_others() -> None:
    gains = np.array([60.0, 60.0, 60.0, 1e-3])
    assert holds_at_rest(network(coupling_gain=5.0), gains, 0.3)


def test_votes_must_hold_the_cadence_that_the_gait_is_on_its_way_to() -> None:
    slow = network()
    gains = np.array([57.0, 57.0, 57.0, 0.0])
    faster = slow.with_parameters(replace(slow.parameters, cadence_scale=2.0))
    assert faster.omega(R) == slow.omega(R)
    assert holds_at_rest(slow, gains, 0.3) and not holds_at_rest(faster, gains, 0.3)


@pytest.mark.parametrize('changes', [
    {'vote_limit': 0.05}, {'vote_limit': 0.05, 'vote_rule': 'winner_take_all'}])
def test_a_given_clamp_is_kept_and_told_apart_from_one_that_fits(changes: dict[str, object]
                                                                 ) -> None:
    rules = VotingParameters(voting=True, **changes)  # type: ignore[arg-type]
    gait, inhibition = network(), InhibitionParameters()
    clamp = vote_clamp(gait, inhibition, rules,
                       operating_range(gait, inhibition, ReferenceParameters()))
    assert clamp.gain == pytest.approx(20.0) and not fits(clamp)


@pytest.mark.parametrize(('name', 'value'), [
    ('vote_limit', NAN), ('vote_limit', -1.0), ('vote_majority', 5), ('vote_majority', 0),
    ('vote_rule', 'loudest'), ('vote_fade', 0.0)])
def test_impossible_rules_are_refused(name: str, value: object) -> None:
    with pytest.raises(ParameterError, match=name):
        VotingParameters(**{name: value})  # type: ignore[arg-type]


def test_the_clamp_follows_the_cadence_and_settles_where_it_stays() -> None:
    counting, of = voting(), network('amble')
    x, state, slow = of.locked_state(), counting.initial_state(of), of.gait
    assert state.clamp is not None
    before = state.clamp.limit
    for k, factor in enumerate((1.0, 1.05, 1.1, 1.1, 1.1)):
        of = of.of(slow.scaled(factor))
        reading = vote_sensors(replace(STANDING, time_ns=k * TICK_NS))
        state = counting.step(state, k * TICK_NS, of, reading, x, R, False,
                              (('user', (9.0, 9.0, 9.0, NAN)),))
        assert state.tally.weights[0] == pytest.approx(factor * before, rel=0.02)
        assert state.tally.stops
    fresh = counting.initial_state(of)
    assert state.clamp == fresh.clamp and fresh.clamp is not None
    assert state.tally.weights[0] == fresh.clamp.limit


def test_changed_parameters_act_from_the_next_step_on() -> None:
    of = network()
    x, votes = of.locked_state(), (('user', (9.0, NAN, NAN, NAN)),)
    state = voting().initial_state(of)
    state = voting(vote_limit=0.05).step(state, 0, of, vote_sensors(STANDING), x, R, False, votes)
    assert state.tally.weights[0] == 0.05


def test_without_voting_nothing_is_counted() -> None:
    counting, of = voting(voting=False), network()
    state = counting.initial_state(of)
    assert counting.step(state, 0, of, vote_sensors(STANDING), of.locked_state(), R, True,
                         (('user', (9.0, 9.0, 9.0, 9.0)),)).tally is NO_VOTES
