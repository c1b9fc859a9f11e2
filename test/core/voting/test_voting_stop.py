# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops by vote in the plain loop: a majority stops the gait, fewer do not, and how they end."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from core_examples import GAITS, TICK, TICK_NS, network
from standing_run import Run, walking

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.changes import certify_changes
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.suggest import suggest_gains
from dmp_cpg_ros.core.certificates.votes import vote_bound, votes_needed
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.prediction import look_ahead
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.voting.parameters import VotingParameters

WEAK = CanonicalParameters(coupling_gain=5.0)
"""Couplings with which the legs synchronise, and no leg alone can stop the others."""


def voters(**changes: object) -> dict[str, Any]:
    """Parts of the suite's parameters with voting."""
    rules = {field.name for field in fields(VotingParameters)}
    return {
        'inhibition': InhibitionParameters(
            **{name: value for name, value in changes.items() if name not in rules}),
        'voting': VotingParameters(
            voting=True, **{name: value for name, value in changes.items() if name in rules}),
    }


def vote(run: Run, legs: tuple[str, ...], seconds: float, until: str = '') -> Run:
    """Let legs vote for a time, or until the stop has a state, as a node does that repeats its
    message.
    """
    end_ns = run.time_ns + round(seconds * 1e9)
    while run.time_ns < end_ns and run.loop.stop.state != until:
        run.loop.vote(dict.fromkeys(legs, 1.0))
        run.go(0.1)
    return run


@pytest.mark.parametrize('gait', ['amble', 'trot'])
@pytest.mark.parametrize('canonical', [CanonicalParameters(), WEAK])
@pytest.mark.parametrize('legs', [('rr',), ('fr', 'rl')])
def test_a_minority_does_not_stop_the_gait(
        gait: str, canonical: CanonicalParameters, legs: tuple[str, ...]) -> None:
    run = walking(gait, **voters(inhibited_legs=LEGS[:3]), canonical=canonical)
    run.ticks.clear()
    vote(run, legs, 2.0)
    assert not run.loop.stop.requested and set(run.words()) <= {'walking', 'free'}
    rates = [np.abs(tick.x_dot).max() for tick in run.ticks[-250:]]
    assert min(rates) > 1.0
    assert {tick.supervisor.tally.cause for tick in run.ticks[-20:]} == {
        ', '.join(f'{leg} user' for leg in legs)}


@pytest.mark.parametrize('gait', ['amble', 'trot'])
@pytest.mark.parametrize('canonical', [CanonicalParameters(), WEAK])
@pytest.mark.parametrize('missing', ['fr', ''])
def test_a_majority_stops_it_through_the_states_of_a_requested_stop(
        gait: str, canonical: CanonicalParameters, missing: str) -> None:
    run = walking(gait, **voters(inhibited_legs=LEGS[:3]), canonical=canonical)
    run.ticks.clear()
    vote(run, tuple(leg for leg in LEGS if leg != missing), 3.5)
    words = [word for word in run.words() if word not in ('free', 'walking')]
    assert words[0] == 'waiting' and words[-1] == 'at_rest'
    assert set(words) == {'waiting', 'captured', 'at_rest'}
    assert np.abs(run.ticks[-1].r).max() < 1e-3 and np.abs(run.ticks[-1].x_dot).max() < 0.06
    p, loop = run.loop.parameters, run.loop
    bound = vote_bound(Setting.of(loop.network, p, TICK), loop.inhibition.gains)
    assert loop.stop.measured_s <= bound


@pytest.mark.parametrize('graph', ['path', 'star', 'directed_ring'])
def test_a_certified_majority_whose_legs_relieve_each_other_stops_and_fewer_do_not(
        graph: str) -> None:
    canonical = CanonicalParameters(coupling_graph=graph)
    p = SuiteParameters(**voters(inhibited_legs=LEGS[:3]))
    assert certify(Setting.of(network(coupling_graph=graph), p, TICK)).holds
    for missing in LEGS:
        run = walking('amble', **voters(inhibited_legs=LEGS[:3]), canonical=canonical)
        majority = tuple(leg for leg in LEGS if leg != missing)
        vote(run, majority[1:], 1.5)
        assert not run.loop.stop.requested
        vote(run, majority, 3.5, until='at_rest')
        bound = vote_bound(Setting.of(run.loop.network, p, TICK), run.loop.inhibition.gains)
        assert run.loop.stop.state == 'at_rest' and run.loop.stop.measured_s <= bound


def test_gains_are_held_back_until_the_reference_is_slow() -> None:
    run = walking(speed=0.8, **voters())
    run.ticks.clear()
    vote(run, LEGS[:3], 2.0)
    first = next(i for i, tick in enumerate(run.ticks) if tick.supervisor.armed)
    speed = [run.loop.network.scale.foot_speed(*tick.r) for tick in run.ticks]
    assert speed[first] <= 0.1 < speed[first - 1]


def test_what_holds_the_gait_does_not_fade_and_the_service_releases_it() -> None:
    run = walking(**voters())
    vote(run, LEGS[:3], 2.5)
    assert run.loop.stop.state == 'at_rest'
    held = run.loop.inhibition.gains
    run.loop.request(False)
    assert run.loop.stop.requested and run.loop.stop.voted
    run.go(1.5)
    assert not run.loop.stop.tally.alive
    assert run.loop.stop.state == 'at_rest' and np.array_equal(run.loop.inhibition.gains, held)
    run.loop.command(0.8)
    run.go(1.0)
    assert run.loop.stop.state == 'at_rest'
    run.loop.request(False)
    assert not run.loop.stop.requested
    run.until('walking')


def test_a_stop_by_votes_can_end_by_itself() -> None:
    run = walking(**voters(vote_resume=True))
    vote(run, LEGS, 2.5)
    assert run.loop.stop.state == 'at_rest'
    run.until('walking', longest=3.0)


def test_a_stop_that_was_also_asked_for_outlasts_the_votes() -> None:
    run = walking(**voters(vote_resume=True))
    vote(run, LEGS, 0.3)
    run.loop.request(True)
    run.go(3.0)
    assert run.loop.stop.state == 'at_rest' and not run.loop.stop.tally.alive
    assert np.all(run.loop.inhibition.gains >= run.loop.parameters.inhibition.armed_gains)
    run.loop.request(False)
    run.until('walking')


def test_votes_of_a_minority_leave_a_requested_stop_as_it_is() -> None:
    def stopped(legs: tuple[str, ...]) -> np.ndarray:
        run = walking(**voters())
        run.loop.request(True)
        run.ticks.clear()
        vote(run, legs, 2.0) if legs else run.go(2.0)
        return np.array([tick.x for tick in run.ticks])

    assert np.array_equal(stopped(()), stopped(('fl', 'rr')))


def test_the_prediction_of_a_stop_by_votes_is_kept_to_the_tick() -> None:
    run = walking(**voters(vote_fade=10.0))
    run.loop.vote(dict.fromkeys(LEGS[1:], 1.0))
    run.go(TICK)
    loop = run.loop
    assert loop.stop.voted
    predicted = look_ahead(loop.supervisor, loop.reference, loop.canonical, loop.stop,
                        Announced(loop.inhibition), loop.canon, loop.r,
                        loop.gate.at(run.time_ns - TICK_NS), TICK).time_s
    run.until('at_rest')
    assert loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)


@pytest.mark.parametrize('leg', LEGS)
def test_where_the_winner_takes_all_the_largest_vote_is_inhibited_alone(leg: str) -> None:
    run = walking(**voters(vote_rule='winner_take_all'))
    run.loop.vote({**dict.fromkeys(LEGS, 0.05), leg: 1.0})
    run.go(2.5)
    assert run.loop.stop.state == 'at_rest'
    assert [gain > 0.0 for gain in run.loop.inhibition.gains] == [name == leg for name in LEGS]


def test_legs_that_step_into_the_void_stop_the_gait_and_one_leg_does_not() -> None:
    def after(legs: tuple[str, ...], seconds: float) -> Run:
        run = walking('trot', **voters())
        force = np.where([leg in legs for leg in LEGS], 0.0, 20.0)
        tick = run.loop.tick
        run.loop.tick = lambda state: tick(replace(state, foot_force=force))
        return run.go(seconds)

    run = after(('fr',), 4.0)
    assert not run.loop.stop.requested
    assert 'fr footing' in {tick.supervisor.tally.cause for tick in run.ticks}
    run = after(LEGS, 4.0)
    assert run.loop.stop.state == 'at_rest' and run.loop.stop.voted


def test_without_voting_nobody_is_heard() -> None:
    run = walking()
    vote(run, LEGS, 1.0)
    assert not run.loop.stop.requested and not run.loop.stop.tally.alive


# The certificate of a setting with votes -------------------------------------------------------


def certificate(parts: dict[str, Any], gait: str = 'amble', **canonical: object) -> Certificate:
    return certify(Setting.of(network(gait, **canonical), SuiteParameters(**parts), TICK))


@pytest.mark.parametrize('graph', ['all_to_all', 'ring'])
@pytest.mark.parametrize('gait', ['amble', 'trot', 'pronk'])
def test_the_computed_clamp_is_certified(gait: str, graph: str) -> None:
    found = certificate(voters(), gait, coupling_graph=graph)
    assert found.holds, found.explained()
    assert 'votes_needed' in found.sampled


def test_votes_are_certified_in_every_gait_of_a_change() -> None:
    def failing(**changes: object) -> list[str]:
        p = SuiteParameters(**voters(**changes))
        found = certify_changes(p, [GAITS['amble'], GAITS['trot']], network().scale, TICK)
        return [entry.name for entry in found.failing]

    assert failing() == []
    fits_amble = {'vote_limit': 0.13}
    assert certificate(voters(**fits_amble), 'amble').holds
    assert 'votes_suffice' in failing(**fits_amble)


def test_weak_couplings_are_certified_with_several_inhibited_legs() -> None:
    assert certificate(voters(inhibited_legs=LEGS[:3]), coupling_gain=5.0).holds
    assert not certificate(voters(), coupling_gain=5.0).holds


@pytest.mark.parametrize(('name', 'changes'), [
    ('votes_suffice', {'vote_limit': 0.08}),
    ('votes_contraction', {'vote_limit': 1e-3}),
    ('votes_needed', {'vote_limit': 0.18}),
    ('votes_needed', {'vote_majority': 4, 'vote_limit': 0.12}),
    ('votes_time_to_rest', {'vote_limit': 0.08}),
])
def test_a_clamp_that_does_not_fit_fails_by_name(name: str, changes: dict[str, object]) -> None:
    assert name in [entry.name for entry in certificate(voters(**changes)).failing]
    voting = VotingParameters(**changes)  # type: ignore[arg-type]
    assert certificate({'voting': voting}).holds


@pytest.mark.parametrize('majority', [1, 2, 3, 4])
def test_as_many_votes_are_needed_as_are_wanted(majority: int) -> None:
    gait, p = network(), SuiteParameters(**voters(vote_majority=majority))
    needed = votes_needed(gait, p.inhibition, p.voting,
                          operating_range(gait, p.inhibition, p.reference))
    assert needed.certain == majority and needed.powerless == majority - 1


def test_gains_are_suggested_with_which_votes_are_certified_too() -> None:
    p = SuiteParameters(**voters(inhibited_legs=LEGS[:3]))
    running = Setting.of(network('pronk', coupling_gain=5.0), p, TICK)
    assert [entry.name for entry in certify(running).failing] == ['votes_needed']
    pronk = Running(p, GAITS['pronk'], network().scale, TICK)
    found = suggest_gains(pronk.changed({'coupling_gain': 5.0}))
    assert found is not None and found.changed and found.certificate['votes_needed'].holds
    fast = {'capture_speed': 1.0, 'coupling_graph': 'path'}  # minorities meet slower legs
    assert suggest_gains(replace(pronk, gait=GAITS['amble']).changed(fast)) is None


def test_nobody_is_certain_to_stop_legs_that_are_not_coupled_enough() -> None:
    gait, parts = network(coupling_gain=5.0), voters(vote_majority=1)
    p = SuiteParameters(**parts)
    needed = votes_needed(gait, p.inhibition, p.voting,
                          operating_range(gait, p.inhibition, p.reference))
    assert needed.enough[0] == np.inf and needed.clamp.gain == p.inhibition.inhibition_gain
    assert not certificate(parts, coupling_gain=5.0).holds
