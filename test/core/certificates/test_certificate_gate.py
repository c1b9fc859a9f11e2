# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes at run time: what is refused and why, the nearest value, and what goes on unchanged."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from core_examples import GAITS, TICK, TICK_NS, network, quadruped, standing_state

from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.certificates import network as of_network
from dmp_cpg_ros.core.certificates.certify import BEFORE_VOTES, QUICK_ROWS
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.certificates.inequality import Look
from dmp_cpg_ros.core.certificates.verdict import MOST_EFFORT, Change
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.known_gaits import GaitShares, KnownGaits, shares_of
from dmp_cpg_ros.core.gait.network import CanonicalParameters, network_system
from dmp_cpg_ros.core.gait.running import CADENCE_RATE, RunningGait
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters
from dmp_cpg_ros.core.loop import Tick, WalkingLoop
from dmp_cpg_ros.core.suite_parameters import CHANGEABLE, OWNER, SuiteParameters
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.core.voting.thresholds import certified_threshold, rest_threshold

RUNNING = Running(SuiteParameters(), GAITS['amble'], body_scale(quadruped()), TICK)
WEAK = RUNNING.changed({'coupling_gain': 30.0})
"""All-to-all couplings that are strong enough, and would not be on a path."""

SLOW = RUNNING.changed({'max_speed': 0.2, 'max_lateral_speed': 0.0, 'max_turn_rate': 0.0,
                        'inhibition_gain': 160.0})
"""An inhibition that is strong enough at the cadence of small speeds."""


def judge(values: dict[str, object], running: Running = RUNNING):
    return Change(running, running.certificate(), running.changed(values)).verdict()


@pytest.mark.parametrize(('name', 'value', 'inequality'), [
    ('inhibition_gain', 100.0, 'capture'),
    ('cadence_scale', 4.0, 'capture'),
    ('region_radius', 0.05, 'capture'),
    ('max_speed', 2.0, 'capture'),
    ('alpha_r', 0.05, 'time_to_rest'),
    ('rho', 900.0, 'synchronisation'),
    ('coupling_gain', 1.0, 'synchronisation'),
    ('capture_speed', 0.0, 'time_to_rest'),
])
def test_a_refusal_names_inequality_sides_and_a_nearest_value_that_works(
    name: str, value: float, inequality: str
) -> None:
    running = SLOW if name == 'max_speed' else RUNNING
    present = running.values[name]
    verdict = judge({name: value}, running)
    assert not verdict.accepted
    failing = running.changed({name: value}).certificate()[inequality]
    assert not failing.holds
    assert failing.explained() in verdict.reason
    assert f'{failing.left:.4g}' in verdict.reason
    assert f'{failing.right:.4g}' in verdict.reason
    found = re.search(rf'nearest value that works: {name} = (\S+)$', verdict.reason)
    assert found, verdict.reason
    nearest = float(found[1])
    assert min(present, value) <= nearest <= max(present, value)
    assert judge({name: nearest}, running).accepted
    further = float(np.clip(nearest + 0.06 * (value - present), min(present, value),
                            max(present, value)))
    assert not judge({name: further}, running).accepted


def test_words_are_answered_with_the_words_that_work() -> None:
    verdict = judge({'coupling_graph': 'path'}, WEAK)
    assert not verdict.accepted
    offered = re.search(r'coupling_graph = (.*)$', verdict.reason)[1].split(' or ')
    for graph in ('all_to_all', 'ring', 'path', 'star', 'directed_ring'):
        holds = WEAK.changed({'coupling_graph': graph}).certificate().holds
        assert (graph in offered) == holds


def test_several_changes_are_judged_together() -> None:
    both = {'cadence_scale': 3.0, 'inhibition_gain': 1500.0}
    assert not judge({'cadence_scale': 3.0}).accepted
    assert judge(both).accepted
    verdict = judge({'cadence_scale': 3.0, 'inhibition_gain': 410.0})
    found = re.search(r'nearest values that work: cadence_scale = (\S+), inhibition_gain = (\S+)$',
                      verdict.reason) or re.search(
        r'nearest values that work: inhibition_gain = (\S+), cadence_scale = (\S+)$',
        verdict.reason)
    assert found, verdict.reason


def test_what_is_known_early_not_to_hold_is_what_does_not_hold() -> None:
    rng, seen = np.random.default_rng(5), set[bool]()
    for number in range(40):
        others = (GAITS['trot'],) if number % 4 == 0 else ()
        running = replace(RUNNING, others=others, acting_cadence=rng.choice([0.7, 1.0])).changed({
            'coupling_gain': 10.0 ** rng.uniform(1.0, 2.5), 'rho': rng.uniform(1.0, 30.0),
            'coupling_graph': str(rng.choice(['all_to_all', 'ring', 'path', 'directed_ring'])),
            'inhibition_gain': 10.0 ** rng.uniform(2.0, 3.3), 'voting': number % 5 == 0,
            'inhibited_legs': ('auto',) if number % 3 == 0 else ('rr',),
            'alpha_r': 6.0 * 10.0 ** rng.uniform(-1.5, 0.0)})
        seen.add(running.holds())
        assert running.holds() == running.certificate().holds
    assert seen == {True, False}


def test_a_verdict_covers_the_cadences_between_that_act_and_no_other_change() -> None:
    def change(acting: float, **values: object) -> Change:
        present = replace(RUNNING, acting_cadence=acting)
        return Change(present, RUNNING.certificate(), present.changed(values))

    judged = change(1.5, cadence_scale=0.8)
    for acting, covered in ((0.8, True), (1.0, True), (1.5, True), (0.79, False), (1.51, False)):
        assert judged.covers(change(acting, cadence_scale=0.8)) == covered
    assert not judged.covers(change(1.0, cadence_scale=0.8, rho=7.0))
    assert not judged.covers(replace(judged, gaits=(GAITS['amble'], GAITS['trot'])))
    assert not judged.covers(replace(judged, present=judged.present.changed({'rho': 7.0})))


def test_change_of_gait_is_judged_at_the_cadence_that_acts() -> None:
    """A change of gait begins at the cadence that acts, on its way to the one that is wanted."""
    wanted = RUNNING.changed({'inhibition_gain': 600.0})
    quick = replace(wanted, acting_cadence=1.99)
    gaits = (GAITS['amble'], GAITS['trot'])

    def verdict(present: Running):
        return Change(present, wanted.certificate(), replace(present, gait=gaits[1]),
                      gaits).verdict()

    assert verdict(wanted).accepted
    assert not verdict(quick).accepted
    assert not verdict(wanted.changed({'cadence_scale': 1.99})).accepted
    assert verdict(replace(wanted, acting_cadence=1.0 + 1e-12)).accepted


def test_a_change_on_the_way_to_a_cadence_is_answered_before_where_it_settles_is_known() -> None:
    quick, values = replace(RUNNING, acting_cadence=1.02), {'inhibition_gain': 450.0}
    for running in (RUNNING, quick):
        verdict = Change(running, RUNNING.certificate(), running.changed(values)).verdict()
        assert verdict.accepted and (verdict.settled is None) == running.moving
    still = Change(RUNNING, RUNNING.certificate(), RUNNING.changed(values))
    assert still.verdict().settled == still.proposed.settled.certificate()


def test_a_refusal_on_the_way_to_a_cadence_says_nothing_of_when_it_has_settled() -> None:
    quick = replace(RUNNING, acting_cadence=2.0)
    change = Change(quick, RUNNING.certificate(), quick.changed({'inhibition_gain': 300.0}))
    verdict = change.verdict()
    assert not verdict.accepted and not verdict.certificate.holds
    assert verdict.settled is None and change.proposed.settled.holds()


def test_rounding_is_no_cadence_on_its_way() -> None:
    wanted = RUNNING.changed({'cadence_scale': 0.8})
    assert not replace(wanted, acting_cadence=0.8 * 1.1 / 1.1 * (1.0 + 1e-15)).moving
    assert replace(wanted, acting_cadence=0.8001).moving


def test_without_a_certificate_only_what_makes_it_worse_is_refused() -> None:
    running = RUNNING.changed({'inhibition_gain': 100.0})
    assert judge({'inhibition_gain': 120.0}, running).accepted
    assert judge({'inhibition_gain': 400.0}, running).accepted
    worse = judge({'inhibition_gain': 80.0}, running)
    assert not worse.accepted
    assert 'not certified themselves' in worse.reason


def test_an_impossible_value_is_a_parameter_error() -> None:
    with pytest.raises(ParameterError, match='outside its range'):
        RUNNING.changed({'cadence_scale': float('nan')})


def test_every_changeable_parameter_has_one_owner() -> None:
    names = [name for names in CHANGEABLE.values() for name in names]
    assert len(names) == len(set(names)) == len(OWNER)
    assert set(names) <= {*RUNNING.values, 'gait'}


@pytest.mark.parametrize('gait', sorted(GAITS))
def test_a_scaled_gait_differs_in_its_cadence_only(gait: str) -> None:
    plain, scale = GAITS[gait], RUNNING.scale
    scaled = plain.scaled(1.3)
    for speed in (0.0, 0.2, 0.8, 5.0):
        assert scaled.omega(speed, scale) == pytest.approx(1.3 * plain.omega(speed, scale))
        assert scaled.duty(speed, scale) == plain.duty(speed, scale)
    np.testing.assert_array_equal(scaled.phases, plain.phases)
    assert plain.scaled(1.0) is plain
    assert network(gait, cadence_scale=1.3).omega(np.array([0.3, 0.0, 0.1])) == pytest.approx(
        1.3 * network(gait).omega(np.array([0.3, 0.0, 0.1])))


def test_the_cadence_moves_to_its_factor_at_its_rate() -> None:
    free, r, seen = Inhibition(False, np.zeros(4), 0.3), np.array([0.3, 0.0, 0.0]), []
    before = RunningGait(CanonicalParameters(), RUNNING.scale, KnownGaits(GAITS))
    state = before.initial_state(GAITS['amble'], InhibitionParameters())
    plain = before.network(state.gait).omega(r)
    others = GaitChangeParameters(), GaitChoiceParameters()
    running = before.with_parameters(CanonicalParameters(cadence_scale=1.2), *others)
    for _ in range(120):
        state = running.step(state, r, free, TICK)
        seen.append(state.cadence_scale)
        assert running.network(state.gait).omega(r) == pytest.approx(plain * state.cadence_scale)
        assert shares_of(state.gait) == GaitShares('amble', cadence_scale=state.cadence_scale)
    assert np.all(np.diff([1.0, *seen]) <= CADENCE_RATE * TICK + 1e-12)
    assert seen[-1] == 1.2 == seen[int(0.2 / CADENCE_RATE / TICK) + 1]
    weaker = CanonicalParameters(cadence_scale=1.2, coupling_gain=50.0)
    running = running.with_parameters(weaker, *others)
    state = running.step(state, r, free, TICK)
    assert running.network(state.gait).parameters.coupling_gain == 50.0
    assert state.cadence_scale == 1.2


def walk(loop: WalkingLoop, ticks: int, start: int = 0) -> list[Tick]:
    state = standing_state(quadruped())
    found = []
    for k in range(start, start + ticks):
        loop.command(0.4)
        found.append(loop.tick(standing_state(quadruped(), k * TICK_NS)))
    assert state is not None
    return found


def new_loop() -> WalkingLoop:
    return WalkingLoop(quadruped(), GAITS['amble'], SuiteParameters(
        inhibition=InhibitionParameters(start_inhibited=False)))


def test_a_refused_change_changes_nothing() -> None:
    plain, asked = new_loop(), new_loop()
    walk(plain, 100)
    walk(asked, 100)
    for values in ({'inhibition_gain': 50.0}, {'cadence_scale': 4.0}, {'coupling_gain': 1.0}):
        assert 'is not <' in asked.change(values)
    for a, b in zip(walk(plain, 50, 100), walk(asked, 50, 100), strict=True):
        np.testing.assert_array_equal(a.x, b.x)
        np.testing.assert_array_equal(a.targets.position, b.targets.position)


@pytest.mark.parametrize('values', [{'cadence_scal': 1.2}, {'stiffness': 40.0}])
def test_what_may_not_change_is_refused_with_what_may(values: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match='valid are .*cadence_scale'):
        new_loop().change(values)


def test_an_accepted_change_does_not_jump() -> None:
    loop, plain = new_loop(), new_loop()
    before = walk(loop, 300)
    usual = max(np.abs(np.diff([tick.targets.position for tick in before[100:]], axis=0)).max(),
                1e-9)
    assert loop.change({'cadence_scale': 1.3, 'rho': 5.0, 'coupling_gain': 60.0,
                        'coupling_graph': 'ring', 'inhibition_gain': 700.0}) == ''
    after = walk(loop, 400, 300)
    steps = np.abs(np.diff([before[-1].targets.position,
                            *(tick.targets.position for tick in after)], axis=0)).max()
    assert steps < 2.0 * usual                      # the cadence alone makes them 1.3 times larger
    walk(plain, 700)
    rates = [np.median(np.linalg.norm(tick.x_dot, axis=1)) for tick in after[-50:]]
    r = after[-1].r
    assert np.median(rates) == pytest.approx(1.3 * plain.network.omega(r), rel=1e-3)
    assert loop.network.parameters.coupling_graph == 'ring'


@pytest.mark.parametrize('seed', range(8))
def test_what_is_nearest_works_and_a_little_further_does_not(
    seed: int
) -> None:
    rng = np.random.default_rng(seed)
    voting: dict[str, object] = {'voting': True, 'coupling_graph': ('path', 'star')[seed % 2],
                                 'coupling_gain': 200.0, 'vote_majority': seed % 3 + 1}
    running = RUNNING.changed(voting if seed > 1 else {})
    names = rng.choice(['coupling_gain', 'inhibition_gain', 'region_radius', 'rho', 'alpha_r',
                        'cadence_scale', 'vote_limit'], 1 + seed % 3, replace=False)
    wanted = {str(name): float(running.values[name]) * rng.choice([0.02, 0.1, 2.0, 50.0])
              for name in names}
    for name, (least, most) in {'cadence_scale': (0.7, 4.0), 'alpha_r': (0.05, 6.0),
                                'region_radius': (0.05, 0.9), 'vote_limit': (0.05, 10.0)}.items():
        if name in wanted:
            wanted[name] = min(max(wanted[name], least), most)
    verdict = judge(wanted, running)
    holds = running.changed(wanted).certificate().holds
    assert verdict.accepted == holds
    if not holds:
        before = {name: running.values[name] for name in wanted}
        told = dict(re.findall(r'(\w+) = ([-\d.e+]+)(?:,|$)', verdict.reason.rpartition(': ')[2]))
        assert told or 'takes too long' in verdict.reason
        if told:
            assert running.changed({name: float(value) for name, value in told.items()}).holds()
        if seed < 2:  # the more effort the certificate itself takes, the less often it looks
            share, = {round((float(told[name]) - before[name]) / (wanted[name] - before[name]), 2)
                      for name in wanted}
            assert not running.changed({
                name: before[name] + min(1.0, share + 0.04) * (wanted[name] - before[name])
                for name in wanted}).holds()


def test_votes_are_judged_alike_in_gaits_of_one_cadence() -> None:
    system = network_system(CanonicalParameters(coupling_graph='path'), GAITS['amble'].phases)
    other = network_system(CanonicalParameters(coupling_graph='path'), GAITS['bound'].phases)
    for voters in ((0, 1), (0, 3), (1, 2)):
        assert certified_threshold(system, 9.0, voters, 0.3) == pytest.approx(
            certified_threshold(other, 9.0, voters, 0.3), rel=2e-4)
        assert rest_threshold(system, 5.0, voters, 0.3) == pytest.approx(
            rest_threshold(other, 5.0, voters, 0.3), rel=2e-4)


@pytest.mark.parametrize('values', [{'region_radius': 0.05}, {'inhibition_gain': 90.0, 'rho': 9.0},
                                    {'coupling_graph': 'path', 'inhibition_gain': 90.0},
                                    {'vote_majority': 4, 'vote_limit': 9.0}], ids=str)
@pytest.mark.parametrize('graph', ['all_to_all', 'ring', 'path', 'star', 'directed_ring'])
@pytest.mark.parametrize('count', [1, 3])
def test_what_looking_for_a_value_that_works_takes_is_bounded_and_what_is_told_works(
    count: int, graph: str, values: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many gaits are walked, whoever may vote."""
    gaits = [GAITS[name] for name in ('amble', 'trot', 'bound')[:count]]
    running = replace(RUNNING.changed({
        'voting': True, 'coupling_graph': graph, 'coupling_gain': 200.0}),
        gait=gaits[0], others=tuple(gaits[1:]))
    looked, look = [0], Running.look

    def counted(of: Running, among: str = '') -> Look:
        seen = look(of, among)
        looked.append(of.effort(seen.lost[0] if {*seen.lost} & {*QUICK_ROWS} else among))
        return seen

    monkeypatch.setattr(Running, 'look', counted)
    asked = running.changed(values)
    verdict = Change(running, running.certificate(), asked).verdict()
    assert not verdict.accepted
    judged = asked.effort(BEFORE_VOTES)
    assert sum(looked) + judged <= max(MOST_EFFORT, judged)
    told = dict(re.findall(r'(\w+) = ([\d.]+)(?:,|$)', verdict.reason.rpartition(': ')[2]))
    if told and 'nearest value' in verdict.reason:
        assert asked.changed({name: float(value) for name, value in told.items()}).holds()
    else:
        assert 'what works' in verdict.reason or 'looked for' in verdict.reason


@pytest.mark.parametrize('values', [
    {}, {'cadence_scale': 4.0}, {'rho': 60.0}, {'alpha_r': 0.05, 'coupling_gain': 1.0},
    {'region_radius': 0.01}, {'inhibited_legs': ('auto',), 'coupling_graph': 'path'}], ids=str)
def test_a_row_that_is_looked_at_by_itself_is_that_of_the_certificate(
        values: dict[str, object]) -> None:
    """Also where rows before it are lost, which then end the look."""
    running = RUNNING.changed(values)
    whole = Look.at(running.certificate().inequalities)
    for name in QUICK_ROWS:
        seen = running.look(name)
        assert name in seen.shares or {*seen.lost} & {*whole.lost}
        for row in seen.shares:
            assert seen.shares[row] == pytest.approx(whole.shares[row], abs=1e-12)
    assert bool(running.look().lost) == bool(whole.lost)


def test_what_costs_least_is_looked_at_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cadence that the integration bears is found without the network's analysis."""
    analysed = list[object]()
    analyse = of_network.analyse_network

    def counted(*of: Any) -> Any:
        analysed.append(of)
        return analyse(*of)

    monkeypatch.setattr(of_network, 'analyse_network', counted)
    running = replace(RUNNING, tick_s=0.02).changed({'inhibition_gain': 500.0})
    verdict = judge({'cadence_scale': 2.0, 'coupling_gain': 30.0, 'rho': 3.0}, running)
    assert not verdict.accepted and verdict.reason.startswith('cycle_radius')
    assert 'nearest values that work' in verdict.reason and len(analysed) <= 3


def test_a_refusal_of_other_gaits_by_speed_says_what_works() -> None:
    """It looked for it with the new borders and the old band, which do not go together."""
    wide = RUNNING.changed({'auto_gait': True, 'auto_hysteresis': 0.2})
    verdict = judge({'auto_gaits': ('walk', 'trot', 'pace'), 'auto_speeds': (0.3, 0.4),
                     'auto_hysteresis': 0.05, 'coupling_gain': 0.01}, wide)
    assert not verdict.accepted and 'nearest' in verdict.reason


def test_where_only_some_of_the_legs_hold_the_certificate_says_what_fails() -> None:
    """Votes are looked at for the legs that hold alone."""
    running = RUNNING.changed({'coupling_graph': 'star', 'coupling_gain': 36.0, 'voting': True,
                               'inhibition_gain': 3125.0, 'inhibited_legs': ('auto',)})
    failing = [row.name for row in running.certificate().failing]
    assert failing and not running.holds() and failing == [
        row.name for row in running.certificate(whole=True).failing]
