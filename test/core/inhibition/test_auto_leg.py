# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``inhibited_legs: [auto]``: the leg that comes to its place first is taken, and kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from core_examples import GAITS, quadruped
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.inhibition import AUTO, InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import phase, state_at, wrapped
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.inhibition.entry import half_arc, next_leg
from dmp_cpg_ros.core.inhibition.handover import adopted
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.studies.oscillator_loop import Oscillators

ROBOT, TICK = quadruped(), 0.004
GRAPHS = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')


def oscillators(gait: str = 'amble', legs: tuple[str, ...] = (AUTO,), **parameters: Any
                ) -> Oscillators:
    return Oscillators(ROBOT, {
        'gait': gait, 'tick_s': TICK,
        'parameters': {'auto_inhibit': False, 'inhibited_legs': legs, **parameters}})


def walking(loop: Oscillators, speed: float, seconds: float) -> Oscillators:
    loop.request(False)
    loop.command(speed)
    return go(loop, seconds)


def go(loop: Oscillators, seconds: float) -> Oscillators:
    for _ in range(round(seconds / TICK)):
        loop.advance()
    return loop


def stopped(loop: Oscillators) -> tuple[float, float]:
    """Stop as it is predicted and bounded, with a leg that is certified and kept; time until the
    leg is caught and to rest [s].
    """
    certificate, bound = loop.in_force().certificate(), loop.time_to_rest()
    predicted, caught, ticks = loop.request(True), 0.0, 0
    held: list[tuple[int, float]] = []
    while loop.stop.state != 'at_rest':
        loop.advance()
        ticks += 1
        assert ticks * TICK <= bound
        if loop.stop.state in ('captured', 'at_rest'):
            caught = caught or ticks * TICK
            held.append((loop.stop.leg, loop.stop.rest_phase))
    assert ticks * TICK == pytest.approx(predicted, abs=1e-9)
    assert len(set(held)) == 1
    if loop.parameters.inhibition.auto:
        (leg, rest_phase), gains = held[0], loop.inhibition.gains
        assert LEGS[leg] in certificate.legs
        assert np.flatnonzero(gains).tolist() == [leg]
        if loop.canon.gait.moving_phases is None:    # its own [1, 0]
            place = loop.network.target_at(rest_phase)[leg]
            assert place == pytest.approx([loop.parameters.canonical.radius, 0.0], abs=1e-9)
    return caught, ticks * TICK


@given(gait=st.sampled_from(list(GAITS)), graph=st.sampled_from(GRAPHS),
       speed=st.floats(0.0, 1.5), seconds=st.floats(1.0, 1.8))
@settings(max_examples=15)
def test_auto_is_never_later_than_the_leg_that_is_named(
        gait: str, graph: str, speed: float, seconds: float) -> None:
    first = (oscillators(coupling_graph=graph).parameters.canonical.first_leg)
    either = [walking(oscillators(gait, legs, coupling_graph=graph), speed, seconds)
              for legs in ((AUTO,), (LEGS[first],))]
    assert np.array_equal(either[0].x, either[1].x)
    (caught, rest), (caught_named, rest_named) = map(stopped, either)
    assert caught <= caught_named
    if graph not in ('path', 'star'):                # where all legs are as well connected
        assert rest <= rest_named + TICK


def test_in_a_gait_of_four_beats_some_leg_comes_within_a_quarter_of_a_turn() -> None:
    found = set()
    for k in range(8):
        loop = walking(oscillators(capture_speed=10.0), 0.5, 2.0 + 0.08 * k)
        quarter = 0.5 * np.pi / loop.network.omega(np.zeros(3))
        assert stopped(loop)[0] <= quarter + 3 * TICK
        found.add(loop.stop.leg)
    assert found == {0, 1, 2, 3}


def test_the_bound_is_shorter_by_the_way_that_is_saved() -> None:
    named, any_leg = (oscillators(legs=legs).in_force().certificate()
                      for legs in (('fl',), (AUTO,)))
    assert any_leg.holds and any_leg.legs == LEGS
    assert any_leg.time_to_rest < named.time_to_rest


@pytest.mark.parametrize(('graph', 'able'), [('star', ('fl',)), ('path', ('fr', 'rl'))])
def test_legs_that_cannot_hold_the_others_are_not_taken(graph: str, able: tuple[str, ...]
                                                        ) -> None:
    settings = {'coupling_graph': graph, 'coupling_gain': 30.0}
    for leg in LEGS:
        assert oscillators(legs=(leg,), **settings).certified() == (leg in able)
    certificate = oscillators(**settings).in_force().certificate()
    assert certificate.holds and certificate.legs == able
    for k in range(4):
        loop = walking(oscillators(**settings), 0.4, 2.0 + 0.1 * k)
        stopped(loop)
        assert LEGS[loop.stop.leg] in able


@given(waits=st.lists(st.floats(0.004, 0.6), min_size=2, max_size=6),
       gait=st.sampled_from(list(GAITS)), braking=st.sampled_from([0.0, 0.5, 3.0, 6.0]))
@settings(max_examples=8)
def test_stops_within_starts_and_changes_of_gait_are_kept(
        waits: list[float], gait: str, braking: float) -> None:
    loop = walking(oscillators(braking=braking), 0.4, 1.5)
    for k, wait in enumerate(waits):
        if k == 1 and gait != loop.canon.wanted.name:
            loop.change({'gait': gait})
        go(loop, wait)
        stopped(loop)
        loop.request(False)


def test_a_leg_that_is_caught_is_kept_when_another_one_takes_over_the_stop() -> None:
    loop = walking(oscillators(), 0.5, 2.2)
    stopped(loop)
    assert loop.stop.rest_phase > 0.0
    taken = adopted(loop.inhibition, loop.now_ns, loop.supervisor.parameters)
    assert (taken.leg, taken.rest_phase) == (loop.stop.leg, loop.stop.rest_phase)
    before = loop.x.copy()
    loop.stop, loop.inhibition = taken, loop.supervisor.inhibition(taken)
    go(loop, 1.0)
    assert loop.stop.state == 'at_rest' and np.abs(loop.x - before).max() < 0.02


def test_at_rest_auto_takes_over_and_hands_over_the_leg_that_holds() -> None:
    loop = walking(oscillators(), 0.5, 2.2)
    stopped(loop)
    leg, before = LEGS[loop.stop.leg], loop.x.copy()
    other = LEGS[(loop.stop.leg + 1) % 4]
    assert loop.change({'inhibited_legs': (leg,)}) == ''
    assert loop.change({'inhibited_legs': (AUTO,)}) == ''
    go(loop, 1.0)
    assert loop.stop.state == 'at_rest' and np.abs(loop.x - before).max() < 0.02
    # a graph in which the leg that holds could not: refused in this rest
    if loop.stop.leg != 0:
        assert AUTO in loop.change({'coupling_graph': 'star', 'coupling_gain': 30.0})
    for legs in ((other,), (AUTO,)):
        assert loop.change({'inhibited_legs': legs}) == ''
        go(loop, 1.0)
        assert loop.stop.state == 'at_rest'
        assert np.flatnonzero(loop.inhibition.gains).tolist() == [LEGS.index(other)]
    assert loop.change({'inhibited_legs': LEGS}) == ''
    go(loop, 1.0)
    assert AUTO in loop.change({'inhibited_legs': (AUTO,)})       # one of four that hold


def test_auto_stands_alone() -> None:
    with pytest.raises(ParameterError, match=r'or be \[auto\]'):
        InhibitionParameters(inhibited_legs=('fl', AUTO))


@pytest.mark.parametrize('gait', ['walk', 'amble', 'trot', 'bound'])
@pytest.mark.parametrize('cadence', [1.0, 3.0])
@pytest.mark.parametrize('lead', [0.05, 0.1, 0.15, 0.2])
def test_the_leg_is_caught_that_comes_to_its_place_once_what_was_told_ahead_acts(
        lead: float, cadence: float, gait: str) -> None:
    """For leads that are longer than the oscillators need from one leg's place to the next, too,
    where the one that comes first is always past it by then.
    """
    for wait, speed in ((0.0, 0.0), (0.1, 0.0), (0.8, 0.5)):
        loop = Oscillators(ROBOT, {'gait': gait, 'tick_s': TICK, 'lead_s': lead, 'parameters': {
            'auto_inhibit': False, 'inhibited_legs': (AUTO,), 'cadence_scale': cadence,
            'inhibition_gain': 1200.0}})
        walking(go(loop, 0.1), speed, wait)
        predicted, bound, ticks = loop.request(True), loop.time_to_rest(), 0
        while loop.stop.state != 'at_rest':
            loop.advance()
            ticks += 1
            assert ticks * TICK <= bound
        assert ticks * TICK == pytest.approx(predicted, abs=1e-9)


@pytest.mark.parametrize('lead', [0.024, 0.0675, 0.1])
def test_a_stop_that_takes_back_a_start_keeps_the_legs_that_votes_hold(lead: float) -> None:
    """They do not go on until what is told acts, so that the leg is chosen that is in its C."""
    loop = Oscillators(ROBOT, {'gait': 'pace', 'tick_s': TICK, 'lead_s': lead, 'parameters': {
        'auto_inhibit': False, 'inhibited_legs': (AUTO,), 'voting': True, 'silence_weight': 0.0}})
    go(walking(go(loop, 0.1), 0.0, 2.0), 0.0)
    loop.vote(dict.fromkeys(LEGS, 1.0))
    go(loop, 3.0)
    assert loop.stop.state == 'at_rest'
    at = phase(loop.x)
    loop.request(False)
    loop.request(True)
    for _ in range(200):
        loop.advance()
        assert np.abs(wrapped(phase(loop.x) - at)).max() < 0.5
    assert loop.stop.state == 'at_rest'


@settings(max_examples=60)
@given(fl=st.floats(-np.pi, np.pi), ahead=st.floats(0.01, 3.0), count=st.integers(1, 60))
def test_the_leg_that_is_aimed_at_is_kept_until_it_has_been_at_its_place(
        fl: float, ahead: float, count: int) -> None:
    loop = oscillators('walk')
    network, inhibition = loop.network, loop.parameters.inhibition
    half, places = half_arc(inhibition.region_radius, 1.0), network.gait.phases

    def aimed(turned: float, kept: int | None) -> int:
        x = state_at(fl + turned - places)
        return next_leg(network, inhibition, x, ahead, kept)[0]

    leg = aimed(0.0, None)
    way = (half - (fl - places[leg])) % (2.0 * np.pi)  # to where it is past its place
    assert way >= min(ahead, 2.0 * np.pi - 0.01) - 1e-6
    kept = leg
    for turned in np.linspace(0.0, way - 1e-6, count):
        kept = aimed(turned, kept)
    assert kept == leg
