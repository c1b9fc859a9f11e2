# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The certificate of a suite: what fails is named, and values that work are found."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from core_examples import GAITS, TICK, network

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.certificates.certify import certify, spring_damper_contraction
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.certificates.inequality import Certificate, Inequality, Look
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.suggest import nearest_values, suggest_gains
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.paper.matrix_measure import matrix_measure

GRAPHS = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')


def certificate(gait: str = 'amble', tick: float = TICK, suite: SuiteParameters | None = None,
                **canonical: object) -> Certificate:
    return certify(Setting.of(network(gait, **canonical), suite or SuiteParameters(), tick))


def with_inhibition(**changes: object) -> SuiteParameters:
    return SuiteParameters(inhibition=InhibitionParameters(**changes))  # type: ignore[arg-type]


@pytest.mark.parametrize('graph', GRAPHS)
@pytest.mark.parametrize('gait', GAITS)
def test_the_defaults_hold_for_every_gait_and_graph(gait: str, graph: str) -> None:
    found = certificate(gait, coupling_graph=graph)
    assert found.holds, found.explained()
    assert found.contraction_grade == 'global'
    assert found.time_to_rest < 4.0 and found.time_to_walking < 1.0


def test_the_defaults_bear_a_tick_and_a_lost_message_late_held_or_carried_on() -> None:
    found = certificate()
    for name in ('late_inhibition', 'held_coupling', 'carried_coupling'):
        assert found[name].left == pytest.approx(3.0 * TICK) and found[name].holds


@pytest.mark.parametrize('leg', ['fl', 'fr', 'rl', 'rr'])
def test_any_one_of_the_legs_can_hold_the_others(leg: str) -> None:
    assert certificate(suite=with_inhibition(inhibited_legs=(leg,))).holds


@pytest.mark.parametrize(('name', 'suite', 'canonical'), [
    ('synchronisation', SuiteParameters(), {'coupling_gain': 1.5}),
    ('synchronisation', SuiteParameters(), {'coupling_gain': 12.0, 'coupling_graph': 'path'}),
    ('contraction', SuiteParameters(), {'coupling_gain': 5.0}),
    ('capture', with_inhibition(inhibition_gain=150.0), {}),
    ('capture', with_inhibition(inhibition_gain=0.0), {}),
    ('capture', with_inhibition(region_radius=0.1), {}),
    ('rest_in_region', with_inhibition(inhibition_gain=120.0), {}),
    ('time_to_rest', with_inhibition(capture_speed=0.0), {}),
    ('time_to_rest', SuiteParameters(reference=ReferenceParameters(alpha_r=0.1)), {}),
    ('rest_posture', SuiteParameters(leg=LegParameters(clearance=0.6)),
     {'coupling_graph': 'path', 'coupling_gain': 60.0}),
])
def test_what_fails_is_named(name: str, suite: SuiteParameters, canonical: dict[str, object]
                             ) -> None:
    found = certificate('pace', suite=suite, **canonical)
    assert name in [entry.name for entry in found.failing]
    assert not found.holds
    assert name in found.explained() and 'is not <' in found.explained()


def test_a_tick_that_is_too_long_fails() -> None:
    coarse = {'rho': 60.0, 'coupling_gain': 400.0}
    assert 'time_step' in [entry.name for entry in certificate(tick=0.08, **coarse).failing]
    assert 'region_per_tick' in [
        entry.name for entry in certificate(
            tick=0.01, suite=with_inhibition(region_radius=0.05, inhibition_gain=5e3)).failing]


def test_a_higher_cadence_needs_more_gain() -> None:
    needed = [certificate(suite=SuiteParameters(reference=ReferenceParameters(
        max_speed=speed, max_lateral_speed=0.0, max_turn_rate=0.0)))['capture'].left
        for speed in (0.2, 0.6, 0.9)]
    assert needed[0] < needed[1] < needed[2]


def test_the_highest_cadence_is_that_of_the_fastest_command() -> None:
    gait, reference = network('amble'), ReferenceParameters()
    span = operating_range(gait, InhibitionParameters(), reference)
    rng = np.random.default_rng(0)
    limits = np.array([reference.max_speed, reference.max_lateral_speed, reference.max_turn_rate])
    for _ in range(300):
        omega = gait.omega(rng.uniform(-1.0, 1.0, 3) * limits)
        assert span.omega[0] - 1e-9 <= omega <= span.omega[1] + 1e-9
    assert gait.omega(limits) == pytest.approx(span.omega[1])
    assert gait.omega(np.zeros(3)) == pytest.approx(span.omega_at_rest)


def test_margins_are_right_minus_left_and_rounding_is_not_enough() -> None:
    def inequality(left: float, right: float) -> Inequality:
        return Inequality('x', left, right, '1/s', 'a', 'b', 'proved', 'so')

    assert inequality(1.0, 3.0).margin == 2.0 and inequality(1.0, 3.0).holds
    assert not inequality(1.0, 1.0 + 1e-12).holds
    assert not inequality(float('nan'), 1.0).holds and not inequality(0.0, float('nan')).holds
    assert not inequality(float('inf'), float('inf')).holds
    assert inequality(1.0, float('inf')).holds
    assert 'x: a = 3 1/s is not < b = 1 1/s' in inequality(3.0, 1.0).explained()
    with pytest.raises(ParameterError, match='proved, continuous, sampled'):
        Inequality('x', 0.0, 1.0, '', 'a', 'b', 'hoped', 'so')


def test_the_mapping_is_strict_json_with_both_sides_and_margins() -> None:
    for found in (certificate(), certificate(coupling_gain=1.0)):
        mapping = json.loads(json.dumps(found.as_mapping(), allow_nan=False))
        assert mapping['holds'] is found.holds
        assert set(mapping['inequalities']) == {entry.name for entry in found.inequalities}
        for entry in mapping['inequalities'].values():
            assert {'left', 'right', 'margin', 'unit', 'grade', 'sentence', 'holds'} <= set(entry)


def test_grades_say_what_is_not_proved() -> None:
    found = certificate()
    assert found.sampled == () and found.continuous == ('hierarchy',)
    assert found.grade == 'continuous' and found['capture'].proved
    coarse = certificate(rho=60.0, coupling_gain=400.0, coupling_graph='path', suite=(
        with_inhibition(inhibition_gain=2000.0)))
    assert coarse.holds and coarse.sampled == ('time_step',) and coarse.grade == 'sampled'
    assert not coarse['capture'].proved
    with pytest.raises(ParameterError, match='valid are synchronisation'):
        found['courage']


def test_impossible_ticks_are_refused() -> None:
    for tick in (0.0, -1.0, float('nan'), float('inf')):
        with pytest.raises(ParameterError, match='positive and finite'):
            certificate(tick=tick)


@pytest.mark.parametrize(('stiffness', 'damping'), [(6400.0, 160.0), (400.0, 10.0), (100.0, 60.0)])
def test_joints_contract_at_their_slowest_eigenvalue(stiffness: float, damping: float) -> None:
    rate, Theta = spring_damper_contraction(stiffness, damping)
    A = np.array([[0.0, 1.0], [-stiffness, -damping]])
    assert matrix_measure(A, 2, Theta) == pytest.approx(-rate, rel=1e-9)
    assert rate == pytest.approx(-np.linalg.eigvals(A).real.max(), rel=2e-3)


@pytest.mark.parametrize(('graph', 'gain', 'inhibition_gain'), [
    ('all_to_all', 100.0, 100.0), ('path', 10.0, 400.0), ('ring', 5.0, 50.0), ('star', 8.0, 10.0)])
def test_suggested_gains_hold(graph: str, gain: float, inhibition_gain: float) -> None:
    p = with_inhibition(inhibition_gain=inhibition_gain)
    found = suggest_gains(Running(p, GAITS['amble'], network().scale, TICK).changed(
        {'coupling_graph': graph, 'coupling_gain': gain}))
    assert found is not None and found.changed and found.certificate.holds
    again = certificate(
        suite=with_inhibition(inhibition_gain=found.inhibition_gain), coupling_graph=graph,
        coupling_gain=found.coupling_gain)
    assert again.holds and again.as_mapping() == found.certificate.as_mapping()


def test_gains_that_hold_are_kept_and_what_gains_cannot_mend_is_not_promised() -> None:
    running = Running(SuiteParameters(), GAITS['amble'], network().scale, TICK)
    kept = suggest_gains(running)
    assert kept is not None and not kept.changed
    assert suggest_gains(running.changed({'capture_speed': 0.0})) is None


def test_gains_are_suggested_for_all_gaits_that_are_walked() -> None:
    running = Running(SuiteParameters(), GAITS['walk'], network().scale, TICK).changed(
        {'inhibition_gain': 210.0})
    assert running.certificate().holds
    both = replace(running, others=(GAITS['bound'],))
    found = suggest_gains(both)
    assert found is not None and found.changed and both.changed(
        {'coupling_gain': found.coupling_gain, 'inhibition_gain': found.inhibition_gain}).holds()


def test_the_nearest_value_that_works_works_and_a_little_further_does_not() -> None:
    def look(values: dict[str, float], among: str = '') -> Look:
        rows = certificate(suite=with_inhibition(**values)).inequalities
        return Look.at(row for row in rows if among in ('', row.name))

    ends = look({'inhibition_gain': 100.0}), look({})
    for among in ('capture', ''):
        found = nearest_values({'inhibition_gain': (400.0, 100.0)}, look, 'capture', ends,
                               lambda _, at=among: (at, 9))
        assert not look(found).lost
        assert look({'inhibition_gain': found['inhibition_gain'] - 300.0 * 0.04}).lost
    assert PostureParameters() == SuiteParameters().posture
