# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The suite in settings for which its certificate was once wrong: bounds and predictions hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from core_examples import TICK, quadruped

from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.inhibition.handover import adopted
from dmp_cpg_ros.studies.oscillator_loop import Oscillators

ROBOT = quadruped()


class Walk:
    """The oscillators of the suite with what drives and stops them, without a body."""

    def __init__(self, gait: str = 'amble', tick_s: float = TICK, **parameters: Any) -> None:
        self.loop = Oscillators(ROBOT, {'gait': gait, 'tick_s': tick_s, 'parameters': {
            'auto_inhibit': False, **parameters}})
        self.left_region = 0
        self.turned = np.zeros(4)
        self.tick()

    def tick(self) -> None:
        loop = self.loop
        before, held = phase(loop.x), loop.held
        loop.advance()
        self.turned += (phase(loop.x) - before + np.pi) % (2.0 * np.pi) - np.pi
        self.left_region += held and loop.inhibition.requested and not loop.held

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self.loop.tick_ns * 1e9)):
            self.tick()

    def walk(self, speed: float, seconds: float) -> None:
        self.loop.command(speed)
        self.loop.request(False)
        self.run(seconds)

    def hand_over(self) -> None:
        """Let another one watch the stop from now on, who has heard no votes."""
        loop = self.loop
        loop.votes = loop.voting.initial_state(loop.network)
        loop.stop = adopted(loop.inhibition, loop.now_ns, loop.supervisor.parameters)

    def stop(self) -> tuple[float, float, float]:
        """Stop: bound, prediction and what it took [s]; C is not left once it is entered."""
        bound, predicted = self.loop.time_to_rest(), self.loop.request(True)
        ticks = 0
        while self.loop.stop.state != 'at_rest':
            self.tick()
            ticks += 1
            assert ticks * TICK < bound + TICK, 'beyond the bound'
        assert self.left_region == 0
        return bound, predicted, ticks * TICK


def accepted(walk: Walk, **values: Any) -> bool:
    return walk.loop.change(values) == ''


@pytest.mark.parametrize('delay', [0.012, 0.02, 0.04, 0.2])
@pytest.mark.parametrize('gain', [14.0, 16.0])
def test_several_inhibited_legs_stop_within_a_start(gain: float, delay: float) -> None:
    walk = Walk(inhibited_legs=('fl', 'rr'), coupling_graph='star', coupling_gain=gain)
    certificate = walk.loop.in_force().certificate()
    assert certificate.holds, certificate.explained()
    walk.run(1.0)
    walk.walk(0.5, delay)
    bound, predicted, measured = walk.stop()
    assert measured == pytest.approx(predicted, abs=1e-9)
    assert measured <= bound


@pytest.mark.parametrize('values', [{'inhibition_gain': 155.0}, {'region_radius': 0.126}])
def test_a_gain_for_the_accepted_cadence_waits_for_the_acting_one(values: dict[str, float]
                                                                  ) -> None:
    walk = Walk(capture_speed=2.0, cadence_scale=2.0)
    walk.walk(1.2, 2.0)
    assert accepted(walk, cadence_scale=0.7)
    told = walk.loop.change(values)
    assert 'capture' in told and 'nearest value' in told
    walk.run(3.5)                                            # the cadence has arrived
    assert accepted(walk, **values)
    _, predicted, measured = walk.stop()
    assert measured == pytest.approx(predicted, abs=1e-9)


@pytest.mark.parametrize(('first', 'then'), [(0.7, 2.0), (1.0, 2.0), (1.0, 0.7)])
@pytest.mark.parametrize('wait', [0.0, 0.1, 0.35, 0.6])
def test_a_stop_while_the_cadence_moves_is_predicted_to_the_tick(first: float, then: float,
                                                                 wait: float) -> None:
    walk = Walk(cadence_scale=first)
    walk.walk(0.6, 1.5)
    assert accepted(walk, cadence_scale=then)
    walk.run(wait)
    _, predicted, measured = walk.stop()
    assert measured == pytest.approx(predicted, abs=1e-9)


@pytest.mark.parametrize('asked_first', [True, False])
def test_a_stop_in_whose_tick_a_change_of_gait_begins_is_bounded_with_its_pause(
        asked_first: bool) -> None:
    walk = Walk(alpha_r=6.0)
    walk.walk(0.3, 2.0)
    plain = walk.loop.time_to_rest()
    if asked_first:
        walk.loop.request(True)
    assert accepted(walk, gait='trot')
    bound, predicted = walk.loop.time_to_rest(), walk.loop.request(True)
    walk.tick()
    assert walk.loop.canon.gait.name == 'amble>trot'
    assert walk.loop.time_to_rest() <= bound
    assert bound > plain + 0.1
    ticks = 1
    while walk.loop.stop.state != 'at_rest':
        walk.tick()
        ticks += 1
    assert ticks * TICK == pytest.approx(predicted, abs=1e-9)


def test_a_stop_after_the_speed_limit_was_lowered_is_bounded_from_where_the_reference_is() -> None:
    walk = Walk('trot')
    walk.walk(3.0, 4.0)
    assert accepted(walk, max_speed=0.2)
    assert accepted(walk, max_lateral_speed=0.0, max_turn_rate=0.0)
    walk.tick()
    bound, predicted, measured = walk.stop()
    assert measured == pytest.approx(predicted, abs=1e-9)
    walk.walk(0.2, 4.0)                                      # slow, the bound is that of the limit
    assert walk.loop.time_to_rest() < bound


@pytest.mark.parametrize('leg', ['fr', 'rl', 'rr'])
@pytest.mark.parametrize('gain', [25.0, 40.0, 50.0, 100.0])
def test_no_leg_takes_a_stride_when_the_inhibited_leg_changes_at_rest(gain: float, leg: str
                                                                      ) -> None:
    walk = Walk(coupling_gain=gain)
    walk.run(1.0)
    walk.turned[:] = 0.0
    told = walk.loop.change({'inhibited_legs': (leg,)})
    walk.run(1.5)                                            # a turn takes half of it
    assert walk.loop.stop.state == 'at_rest'
    assert np.abs(walk.turned).max() < np.radians(50.0)      # atan(omega/k), not a turn
    assert not told or f'{leg} rests' in told
    if gain == 100.0:
        assert not told
    walk.walk(0.3, 1.0)                                      # while the gait runs it may change
    assert accepted(walk, inhibited_legs=(leg,))
    walk.stop()


@pytest.mark.parametrize('gain', [25.0, 1000.0])
def test_no_leg_takes_a_stride_when_the_coupling_changes_at_rest(gain: float) -> None:
    walk = Walk(coupling_gain=25.0 if gain > 100.0 else 100.0)
    walk.run(1.0)
    walk.turned[:] = 0.0
    walk.loop.change({'coupling_gain': gain})
    walk.run(1.5)
    assert walk.loop.stop.state == 'at_rest' and np.abs(walk.turned).max() < np.radians(50.0)


def test_what_captures_cannot_change_while_it_captures() -> None:
    walk = Walk()
    walk.walk(0.3, 2.0)
    walk.loop.request(True)
    while walk.loop.stop.state != 'captured':
        walk.tick()
    assert 'being captured' in walk.loop.change({'inhibition_gain': 500.0})
    while walk.loop.stop.state != 'at_rest':
        walk.tick()
    assert accepted(walk, inhibition_gain=500.0)


@pytest.mark.parametrize('seed', range(12))
def test_stops_within_starts_keep_the_bound_that_is_stated(seed: int) -> None:
    rng = np.random.default_rng(seed)
    while True:
        graph = rng.choice(['all_to_all', 'ring', 'path', 'star', 'directed_ring'])
        legs = tuple(rng.permutation(['fl', 'fr', 'rl', 'rr'])[:rng.integers(1, 4)].tolist())
        walk = Walk(str(rng.choice(['amble', 'trot', 'walk', 'bound'])), inhibited_legs=legs,
                    region_radius=rng.uniform(0.05, 0.4),
                    inhibition_gain=np.exp(rng.uniform(np.log(200.0), np.log(3000.0))),
                    max_speed=1.0, coupling_graph=str(graph), rho=rng.uniform(1.0, 12.0),
                    coupling_gain=np.exp(rng.uniform(np.log(10.0), np.log(200.0))))
        if walk.loop.in_force().certificate().holds:
            break
    walk.run(0.5)
    for _ in range(4):
        walk.walk(0.4, rng.uniform(0.004, 0.6))
        bound, predicted, measured = walk.stop()
        assert measured == pytest.approx(predicted, abs=1e-9) and measured <= bound


@pytest.mark.parametrize('wait', [0.02, 0.1, 0.2])
@pytest.mark.parametrize(('graph', 'gain'), [('path', 60.0), ('all_to_all', 30.0)])
def test_legs_that_are_held_are_not_let_go_by_who_takes_the_stop_over(
        graph: str, gain: float, wait: float) -> None:
    walk = Walk(coupling_graph=graph, coupling_gain=gain, capture_speed=1.0, alpha_r=6.0)
    walk.walk(0.5, 2.0)
    walk.loop.request(True)
    while walk.loop.stop.state != 'captured':
        walk.tick()
    walk.run(wait)
    walk.turned[:] = 0.0
    walk.hand_over()
    walk.run(1.5)
    assert walk.loop.stop.state == 'at_rest'
    assert walk.left_region == 0 and np.abs(walk.turned).max() < np.radians(90.0)


VOTED = {'coupling_graph': 'ring', 'coupling_gain': 40.0, 'voting': True, 'silence_weight': 0.0,
         'vote_fade': 4.0}
"""With which three legs hold the fourth outside of its region."""


@pytest.mark.parametrize('resume', [False, True])
@pytest.mark.parametrize('taken_over', [False, True])
def test_legs_that_votes_hold_are_not_let_go_by_who_asks_for_the_stop_too(
        resume: bool, taken_over: bool) -> None:
    walk = Walk(**VOTED, vote_resume=resume)
    walk.walk(0.3, 2.0)
    walk.loop.vote(dict.fromkeys(('fr', 'rl', 'rr'), 10.0))
    walk.run(2.0)
    assert walk.loop.stop.state == 'at_rest' and not walk.loop.stop.asked
    walk.turned[:] = 0.0
    if taken_over:
        walk.hand_over()
    else:
        walk.loop.request(True)
    walk.run(8.0)                                            # the votes have faded
    assert not walk.loop.stop.tally.alive and walk.loop.stop.state == 'at_rest'
    assert np.abs(walk.turned).max() < np.radians(30.0)
    assert 'votes alone hold' in walk.loop.change({'cadence_scale': 1.5})
    walk.walk(0.3, 1.0)
    assert walk.loop.stop.state == 'walking'


@pytest.mark.parametrize(('first', 'then'), [
    ('service', ('fr', 'rl', 'rr')), (('fr', 'rl', 'rr'), ('fl',)),
    (('fr', 'rl', 'rr'), 'service')], ids=str)
@pytest.mark.parametrize('limit', [0.0, 1.0])
def test_who_joins_a_stop_does_not_let_go_of_the_legs_that_others_hold(
        first: str | tuple[str, ...], then: str | tuple[str, ...], limit: float) -> None:
    def stop(who: str | tuple[str, ...]) -> None:
        if who == 'service':
            walk.loop.request(True)
        else:
            walk.loop.vote(dict.fromkeys(who, 10.0))
        walk.run(2.5)
        assert walk.loop.stop.state == 'at_rest'

    walk = Walk(**{**VOTED, 'vote_fade': 30.0}, vote_limit=limit, vote_majority=1 if limit else 3)
    walk.walk(0.3, 2.0)
    stop(first)
    walk.turned[:] = 0.0
    stop(then)
    walk.loop.request(False)
    walk.run(1.0)
    assert walk.loop.stop.state == 'at_rest'                 # held by votes
    assert np.abs(walk.turned).max() < np.radians(90.0)


@pytest.mark.parametrize('wait', [0.0, 0.004, 0.1, 0.6])
def test_a_gain_for_the_gait_that_is_wanted_waits_until_it_is_walked(wait: float) -> None:
    walk = Walk('bound', capture_speed=2.0)
    walk.walk(0.7, 2.0)
    assert accepted(walk, gait='amble')
    walk.run(wait)
    told = walk.loop.change({'inhibition_gain': 210.0})
    assert 'among bound, amble' in told and 'when the gait has changed' in told
    assert 'nearest value' in walk.loop.change({'inhibition_gain': 150.0})  # for an amble neither
    walk.stop()
    walk.walk(0.7, 3.0)
    assert walk.loop.canon.gait.name == 'amble' and accepted(walk, inhibition_gain=210.0)
    walk.stop()


SLOW = {'max_speed': 0.05, 'max_lateral_speed': 0.0, 'max_turn_rate': 0.0}
"""Limits at which a trot needs a gain of 162 1/s, and at 3 m/s one of 300."""


@pytest.mark.parametrize('wait', [0.0, 0.08, 0.16, 0.24])
def test_legs_are_caught_at_a_cadence_that_the_limits_of_commands_allow(wait: float) -> None:
    walk = Walk('trot', capture_speed=3.0)
    walk.walk(3.0, 3.0 + wait)
    assert accepted(walk, **SLOW) and accepted(walk, inhibition_gain=162.0)
    _, predicted, measured = walk.stop()
    assert measured == pytest.approx(predicted, abs=1e-9)


@pytest.mark.parametrize('tick_s', [0.004, 0.01])
def test_what_captures_cannot_change_from_when_legs_may_be_caught(tick_s: float) -> None:
    walk = Walk('trot', tick_s, capture_speed=3.0)
    walk.walk(3.0, 3.0)
    walk.loop.request(True)
    while not walk.loop.stop.armed:
        walk.tick()
    assert walk.loop.stop.state == 'waiting'
    assert accepted(walk, **SLOW)                            # armed at 2 m/s, which is caught
    assert 'being captured' in walk.loop.change({'inhibition_gain': 162.0})
    walk.run(4.0)
    assert walk.loop.stop.state == 'at_rest' and walk.left_region == 0
    assert accepted(walk, inhibition_gain=162.0)


def test_a_stop_within_limits_of_zero_is_bounded() -> None:
    walk = Walk()
    walk.walk(0.5, 2.0)
    assert accepted(walk, **{**SLOW, 'max_speed': 0.0})
    bound, *_ = walk.stop()
    assert bound < 4.0


@pytest.mark.parametrize('delay', [0.0, 0.05, 0.2, 0.4])
def test_a_start_that_is_stopped_before_it_walks_is_not_said_to_walk(delay: float) -> None:
    walk, words = Walk(auto_inhibit=True, auto_delay=delay), set[str]()
    walk.run(0.5)
    predicted = walk.loop.request(False)
    for _ in range(300):
        walk.tick()
        words.add(walk.loop.stop.state)
    assert 'at_rest' in words
    assert (predicted < np.inf) == ('free' in words) == (delay == 0.4)
