# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gaits that change: the spectrum does not see the offsets, nor does the phase error."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from core_examples import GAITS, TICK, quadruped
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import phase, phase_rate, turned, wrapped
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.known_gaits import GaitShares, KnownGaits, shares_of
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork, network_system
from dmp_cpg_ros.core.gait.running import RunningGait
from dmp_cpg_ros.core.gait.transition import (
    BlendedGait,
    GaitChangeParameters,
    GaitTransition,
    arcs_between,
    crowding,
)
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.layouts import canonical_rows, gait_rows, read_gait_rows

ODD = Gait('odd', np.array([0.1, 0.33, 0.9, 0.61]), np.array([0.0, 0.5]), np.array([0.3, 0.5]),
           np.array([0.7, 0.6]))
"""A user's gait without any symmetry."""

ALL = {**GAITS, 'odd': ODD}
PAIRS = [*permutations(GAITS, 2), ('odd', 'trot'), ('amble', 'odd')]
SCALE = body_scale(quadruped())
FREE = Inhibition(False, np.zeros(4), 0.3)
R = np.array([0.5, 0.0, 0.0])
TOPOLOGIES = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')


def networks(**changes: object) -> RunningGait:
    return RunningGait(CanonicalParameters(**changes), SCALE, KnownGaits(ALL))  # type: ignore[arg-type]


def changed(known: RunningGait, before: str, after: str, x: np.ndarray, ticks: int = 1500,
            ) -> list[tuple[GaitNetwork, np.ndarray]]:
    """Networks and states of a change, tick by tick."""
    free, course = InhibitionParameters(start_inhibited=False), []
    state = replace(known.initial_state(ALL[before], free), x=x, wanted=ALL[after])
    for _ in range(ticks):
        state = known.step(state, R, FREE, TICK)
        course.append((known.network(state.gait), state.x))
        if state.gait is ALL[after]:
            break
    return course


@pytest.mark.parametrize('name', TOPOLOGIES)
def test_the_spectrum_does_not_depend_on_the_offsets(name: str) -> None:
    def spectra(phases: np.ndarray) -> list[np.ndarray]:
        L = -graph_from_edges(4, topology(name, 4), 30.0, phases).coupling_matrix()
        held = L + np.diag(np.repeat([70.0, 0.0, 5.0, 0.0], 2))
        return [np.sort_complex(np.round(np.linalg.eigvals(L), 5)), np.linalg.eigvalsh(L + L.T),
                np.linalg.eigvalsh(held + held.T)]

    draw, still = np.random.default_rng(1), spectra(np.zeros(4))
    for _ in range(20):
        for one, other in zip(spectra(draw.uniform(-9.0, 9.0, 4)), still, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-5)     # zeros of multiplicity 2


@pytest.mark.parametrize(('before', 'after'), PAIRS)
def test_the_phase_error_keeps_its_bound_in_every_transition(before: str, after: str) -> None:
    known = networks()
    found = synchronisation(known.network(ALL[before]).system.graph, 8.0)
    x = known.network(ALL[before]).locked_state(0.7)
    course = changed(known, before, after, x)
    assert course[-1][0].gait is ALL[after] and len(course) < 1000
    assert max(np.abs(network.phase_errors(state)).max() for network, state in course) < 1e-9

    draw = np.random.default_rng(2)
    x = x + draw.normal(0.0, 0.2, x.shape)
    y = turned(x, -ALL[before].phases)
    disagreement = np.linalg.norm(y - y.mean(axis=0))
    for k, (network, state) in enumerate(changed(known, before, after, x)):
        y = turned(state, -network.gait.phases)
        bound = disagreement * np.exp(-found.rate * (k + 1) * TICK)
        assert np.linalg.norm(y - y.mean(axis=0)) <= 1.001 * bound + 1e-9


@pytest.mark.parametrize('graph', TOPOLOGIES)
def test_in_the_locked_coordinates_nothing_changes(graph: str) -> None:
    known = networks(coupling_graph=graph, coupling_gain=30.0)
    draw = np.random.default_rng(3)
    transition = known.gaits.transition(GAITS['amble'], GAITS['bound'])
    gait = transition.at(0.4, 0.5)
    x = draw.normal(0.0, 0.7, (4, 2))
    network = known.network(gait)
    following, moved = network.advance(x, R, FREE, TICK)
    omega = network.omega(R) + 2.0 * np.pi * transition.common_arc * (
        following.gait.weight - gait.weight) / TICK               # type: ignore[union-attr]
    alone = network_system(known.parameters, np.zeros(4)).step(
        turned(x, -gait.phases), omega, np.zeros(4), TICK)
    np.testing.assert_allclose(turned(moved, -following.gait.phases), alone, atol=1e-13)


@pytest.mark.parametrize(('before', 'after'), PAIRS)
def test_offsets_that_are_not_fed_forward_act_as_unequal_frequencies(
        before: str, after: str) -> None:
    known = networks()
    found = synchronisation(known.network(ALL[before]).system.graph, 8.0)
    x, worst, fastest = known.network(ALL[before]).locked_state(), 0.0, 0.0
    for network, _ in changed(known, before, after, x)[:-1]:
        gait = network.gait
        assert isinstance(gait, BlendedGait)
        held = network_system(known.parameters, gait.phases)       # knows of no moving offsets
        x = held.step(x, network.omega(R), np.zeros(4), TICK)
        worst = max(worst, float(np.ptp(wrapped(phase(x) - gait.phases - phase(x[0])
                                                + gait.phases[0]))))
        fastest = max(fastest, gait.turning * float(np.ptp(gait.transition.arcs)) / 2.0)
    bound = mismatch_bound(found, 8.0, 1.0, fastest).phase_spread
    assert worst <= bound + 1e-9
    if np.ptp(GaitTransition(ALL[before], ALL[after]).arcs) > 0.1:
        assert worst > 0.1 * bound                                 # the bound says something


@pytest.mark.parametrize(('before', 'after'), PAIRS)
def test_frequencies_stay_within_their_share_and_positions_do_not_jump(
        before: str, after: str) -> None:
    known, rate = networks(), GaitChangeParameters().gait_change_rate
    course = changed(known, before, after, known.network(ALL[before]).locked_state(2.0))
    last = None
    for network, x in course:
        gait, omega = network.gait, network.omega(R)
        own = np.broadcast_to(gait.own_omegas(omega), (4,))
        assert np.all(np.abs(own - omega) <= (rate + 0.02) * omega)   # the cadence blends too
        turning = phase_rate(x, network.rate(x, R, FREE)) + gait.rest_rate
        np.testing.assert_allclose(turning, own, rtol=1e-6)
        position = gait.cycle_position(phase(x))
        if last is not None:
            moved = wrapped(2.0 * np.pi * (position - last)) / TICK
            np.testing.assert_allclose(moved, own, rtol=0.05)
        last = position


def test_a_change_there_and_back_ends_where_it_began() -> None:
    known = networks()
    x = known.network(GAITS['pace']).locked_state()
    _, x = changed(known, 'pace', 'bound', x)[-1]
    _, x = changed(known, 'bound', 'pace', x)[-1]
    assert np.abs(known.network(GAITS['pace']).phase_errors(x)).max() < 1e-9


@pytest.mark.parametrize(('before', 'after'), PAIRS)
def test_the_arcs_are_those_of_least_spread(before: str, after: str) -> None:
    one, other = ALL[before], ALL[after]
    places, new = one.rest - one.lag, other.rest - other.lag
    arcs = GaitTransition(one, other).arcs
    np.testing.assert_allclose(np.exp(2j * np.pi * ((new - places) - arcs)),
                               np.exp(2j * np.pi * (new[0] - places[0] - arcs[0])), atol=1e-9)
    assert arcs.max() == pytest.approx(-arcs.min(), abs=1e-12)
    draw = np.random.default_rng(4)
    for _ in range(200):
        others = arcs + draw.integers(-2, 3, 4)
        assert np.ptp(arcs) <= np.ptp(others) + 1e-9


def test_ties_keep_more_feet_down_and_legs_go_forward() -> None:
    trot, pace = GAITS['trot'], GAITS['pace']
    places, new = trot.rest - trot.lag, pace.rest - pace.lag
    arcs = arcs_between(places, new, 0.6, 0.6)
    assert arcs.tolist() == arcs_between(places, new, 0.6, 0.6).tolist()
    mirrored = -arcs                       # half a cycle either way: equal spread and movement
    least = crowding(places, arcs, 0.6, 0.6)
    assert least <= crowding(places, mirrored, 0.6, 0.6) + 1e-9
    opposing = np.array([0.0, 0.0, 0.5, -0.5])
    assert least < crowding(places, opposing, 0.6, 0.6)


@given(st.floats(0.0, 1.0), st.floats(0.0, 50.0), st.sampled_from([1.0, 1.25, 0.3]))
def test_the_shares_of_a_blend_read_back_to_the_same_floats(
        share: float, rate: float, cadence: float) -> None:
    known = KnownGaits(ALL)
    gait = known.transition(GAITS['walk'], ODD).at(share, rate).scaled(cadence)
    back = KnownGaits(ALL).in_force(shares_of(gait))
    assert isinstance(back, BlendedGait)
    assert (back.share, back.rate, back.cadence_scale) == (share, rate, cadence)
    assert back.phases.tobytes() == gait.phases.tobytes()
    assert known.in_force(shares_of(gait)) is known.in_force(shares_of(gait))


@given(st.floats(0.0, 1.0), st.sampled_from([0.0, 1e-300, 0.7]), st.sampled_from([1.0, 1.25]),
       st.permutations(sorted(ALL)))
def test_the_rows_of_a_change_tell_its_direction_also_while_it_pauses(
        share: float, rate: float, cadence: float, names: list[str]) -> None:
    one, other, *_ = names
    for shares in (GaitShares(one, other, share, rate, cadence),
                   GaitShares(other, one, share, rate, cadence)):
        position, velocity = gait_rows(shares, 0.0, names)
        assert sum(position[:-1]) == pytest.approx(1.0) and sum(velocity) == 0.0
        read = read_gait_rows(canonical_rows(names)[8:], position, velocity)
        if 0.0 < share < 1.0:
            assert read == shares
        else:  # of a change that has not begun, or is over, one gait is in force
            assert read == GaitShares(
                shares.after if share else shares.before, cadence_scale=cadence)


@pytest.mark.parametrize(('shares', 'text'), [
    (GaitShares('gallop'), 'valid are amble'),
    (GaitShares('amble', 'gallop', 0.1, 0.1), 'valid are amble'),
    (GaitShares('amble', 'trot', 1.5, 0.1), r'share in \[0, 1\]'),
    (GaitShares('amble', 'trot', float('nan'), 0.1), r'share in \[0, 1\]'),
    (GaitShares('amble', 'trot', 0.5, -1.0), 'not negative'),
    (GaitShares('amble', cadence_scale=0.0), 'must be positive'),
    (GaitShares('amble', cadence_scale=float('nan')), 'must be positive'),
])
def test_impossible_shares_are_refused_with_what_is_valid(shares: GaitShares, text: str) -> None:
    with pytest.raises(DataError, match=text):
        KnownGaits(ALL).in_force(shares)


@pytest.mark.parametrize(('position', 'velocity'), [
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]), ([1.0, 1.0, 0.0], [0.0, 0.0, 0.0]),
    ([0.4, 0.6, 0.0], [0.1, 0.1, 0.0]), ([0.4, 0.5, 0.0], [-0.1, 0.1, 0.0]),
    ([0.2, 0.3, 0.5], [-0.1, 0.1, 0.0]), ([float('nan'), 1.0, 0.0], [0.0, 0.0, 0.0]),
])
def test_rows_that_are_no_gait_are_refused(position: list[float], velocity: list[float]) -> None:
    with pytest.raises(DataError, match='must be 1 of one gait'):
        read_gait_rows(['gait/a', 'gait/b', 'gait/c', 'cadence_scale'], [*position, 1.0],
                       [*velocity, 0.0])


def test_a_gait_whose_name_would_not_read_back_is_refused() -> None:
    for name in ('a>b', 'my gait', ''):
        with pytest.raises(ParameterError, match='one word'):
            Gait(name, ODD.lag, ODD.speed, ODD.cadence, ODD.duty_factor)
