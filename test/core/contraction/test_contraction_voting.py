# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Votes: a majority stops the gait, fewer do not, and thresholds are those of simulation."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import capture_set
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.inhibited import NONE, inhibited_contraction
from dmp_cpg_ros.core.contraction.voting import different_voters, shared_capture
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.voting.thresholds import certified_threshold, majority_clamp, rest_threshold

OMEGA, REGION = 10.0, 0.3


def network(name: str, gain: float, size: int = 4) -> CanonicalSystem:
    phases = (np.array([0.0, np.pi, 1.5 * np.pi, 0.5 * np.pi]) if size == 4
              else -2.0 * np.pi * np.arange(size) / size)
    return CanonicalSystem(graph_from_edges(size, topology(name, size), gain, phases),
                           AndronovHopf(8.0), state_at(phases))


def stopped(system: CanonicalSystem, alpha: float, voters: tuple[int, ...]) -> bool:
    """Whether the vote stops the gait from its locked state; each vote acts in its own region."""
    gains = np.zeros(system.graph.size)
    gains[list(voters)] = alpha
    vote = Inhibition(True, gains, REGION)
    x = state_at(1.0 + system.graph.phases)
    for _ in range(700):
        x = system.step(x, OMEGA, vote.acting_gains(x, system.target), 0.005)
    acting = vote.acting_gains(x, system.target)
    still = np.abs(system.field(x, OMEGA, acting)).max() < 1e-2
    return bool(still and np.array_equal(acting, gains))


@pytest.mark.parametrize('voters', [(0,), (0, 2)])
def test_nothing_rests_at_the_threshold_itself(voters: tuple[int, ...]) -> None:
    system = network('ring', 100.0)
    threshold = rest_threshold(system, OMEGA, voters, REGION)

    def rests(alpha: float) -> bool:
        gains = np.zeros(4)
        gains[list(voters)] = alpha
        rest = inhibited_equilibrium(system, OMEGA, gains)
        return bool(rest is not None and np.all(rest.distance[list(voters)] <= REGION))

    assert not rests(threshold) and rests(1.001 * threshold)


@pytest.mark.parametrize('name', ['all_to_all', 'ring'])
@pytest.mark.parametrize('voters', [(0,), (0, 1), (1, 2, 3)])
def test_the_threshold_of_simulation_is_within_a_tenth_of_the_computed_one(
        name: str, voters: tuple[int, ...]) -> None:
    system = network(name, 100.0)
    computed = rest_threshold(system, OMEGA, voters, REGION)
    assert not stopped(system, 0.9 * computed, voters)
    assert stopped(system, 1.1 * computed, voters)


@pytest.mark.parametrize('name', ['all_to_all', 'ring'])
@pytest.mark.parametrize('voters', [(0,), (0, 1), (0, 2, 3, 5, 7), tuple(range(8))])
def test_the_threshold_is_as_close_in_a_larger_network(
        name: str, voters: tuple[int, ...]) -> None:
    system = network(name, 100.0, 8)
    computed = rest_threshold(system, OMEGA, voters, REGION)
    assert not stopped(system, 0.9 * computed, voters)
    assert stopped(system, 1.1 * computed, voters)


@pytest.mark.parametrize(('name', 'gain'), [('all_to_all', 5.0), ('ring', 6.0)])
@pytest.mark.parametrize('voters', [(0, 1, 2), (0, 2, 3), (0, 1, 2, 3)])
def test_the_threshold_of_a_majority_is_as_close_with_couplings_too_weak_for_one(
        name: str, gain: float, voters: tuple[int, ...]) -> None:
    system = network(name, gain)
    computed = rest_threshold(system, OMEGA, voters, REGION)
    assert not stopped(system, 0.9 * computed, voters)
    assert stopped(system, 1.1 * computed, voters)
    assert not stopped(system, 1000.0, (0,))


@pytest.mark.parametrize(('name', 'sizes'), [
    ('all_to_all', [1, 1, 1, 1]), ('ring', [1, 2, 1, 1]), ('path', [2, 4, 2, 1])])
def test_voters_that_a_symmetry_exchanges_count_once(name: str, sizes: list[int]) -> None:
    system = network(name, 50.0)
    assert [len(different_voters(system, count)) for count in (1, 2, 3, 4)] == sizes
    assert different_voters(system, 0) == ()
    for count in (1, 2, 3):
        chosen = different_voters(system, count)
        of_chosen = {round(rest_threshold(system, OMEGA, v, REGION), 3) for v in chosen}
        of_all = {round(rest_threshold(system, OMEGA, v, REGION), 3)
                  for v in combinations(range(4), count)}
        assert of_chosen == of_all


@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'star'])
def test_what_is_certified_is_never_below_the_threshold_and_stops(name: str) -> None:
    system = network(name, 60.0)
    for voters in ((0,), (1, 3), (0, 1, 2)):
        certified = certified_threshold(system, OMEGA, voters, REGION)
        assert certified >= rest_threshold(system, OMEGA, voters, REGION)
        assert stopped(system, 1.01 * certified, voters)


@pytest.mark.parametrize('majority', [2, 3])
def test_a_majority_stops_the_gait_and_a_smaller_vote_does_not(majority: int) -> None:
    system = network('all_to_all', 60.0)
    clamp = majority_clamp(system, OMEGA, REGION, majority)
    assert clamp.possible and clamp.majority == majority
    alpha = 0.5 * (clamp.lowest + clamp.highest)
    for voters in combinations(range(4), majority):
        assert stopped(system, alpha, voters)
    for voters in combinations(range(4), majority - 1):
        assert not stopped(system, alpha, voters)


@pytest.mark.parametrize('name', ['ring', 'path', 'star', 'directed_ring'])
@pytest.mark.parametrize('majority', [1, 2, 3, 4])
def test_the_clamp_is_for_every_set_of_voters(name: str, majority: int) -> None:
    """Also for those of which no threshold of their own is looked for."""
    system, sets = network(name, 60.0), [list(combinations(range(4), count))
                                         for count in (majority, majority - 1)]
    clamp = majority_clamp(system, OMEGA, REGION, majority)
    enough = max(certified_threshold(system, OMEGA, voters, REGION) for voters in sets[0])
    weak = min((rest_threshold(system, OMEGA, voters, REGION) for voters in sets[1] if voters),
               default=np.inf)
    assert clamp.lowest == enough or abs(clamp.lowest / enough - 1.0) <= 2.1e-4
    assert clamp.highest == weak or abs(clamp.highest / weak - 1.0) <= 2.1e-4


def test_a_majority_stops_a_network_whose_couplings_are_too_weak_for_one_leg() -> None:
    system = network('ring', 4.0)
    assert certified_threshold(system, OMEGA, (0,), REGION) == np.inf
    assert rest_threshold(system, OMEGA, (0,), REGION) == np.inf
    clamp = majority_clamp(system, OMEGA, REGION, 4)
    assert clamp.lowest < np.inf
    assert stopped(system, 1.01 * clamp.lowest, (0, 1, 2, 3))
    assert not stopped(system, 1.01 * clamp.lowest, (0,))


def test_a_majority_of_none_or_of_more_than_there_are_is_refused() -> None:
    for majority in (0, 5):
        with pytest.raises(ParameterError, match='between 1 and 4'):
            majority_clamp(network('ring', 50.0), OMEGA, REGION, majority)


@pytest.mark.parametrize('name', ['ring', 'path', 'star', 'directed_ring'])
def test_voters_that_relieve_each_other_keep_their_regions(name: str) -> None:
    """From wherever they enter, however the cadence varies, with hardly more than is certified."""
    rng, relieved = np.random.default_rng(4), 0
    for voters in [(0, 1), (0, 2), (0, 1, 2), (1, 2, 3)]:
        system = network(name, 100.0)
        alpha = 1.001 * certified_threshold(system, OMEGA, voters, REGION)
        gains = np.where(np.isin(range(4), voters), alpha, 0.0)
        box = capture_set(system, OMEGA, gains, REGION)
        if box.holds:
            continue
        relieved += 1
        capture = shared_capture(system, OMEGA, box, REGION)
        assert capture.holds and inhibited_contraction(system, capture).reach != NONE
        assert np.nanmax(capture.needed_gain) >= rest_threshold(system, OMEGA, voters, REGION)
        for _ in range(6):
            edge = rng.choice([-1.0, 1.0]) * 2.0 * np.arcsin(0.5 * REGION) * rng.choice([1.0, 0.9])
            x = state_at(edge + system.graph.phases)
            away = rng.normal(size=(4, 2))
            away *= 0.5 * capture.tolerance / np.linalg.norm(away, axis=1, keepdims=True)
            away[list(voters)] = 0.0
            x = x + away
            for k in range(600):
                cadence = OMEGA if k % 200 < 100 else rng.uniform(0.0, OMEGA)
                x = system.step(x, cadence, gains, 0.001)
                distance = np.linalg.norm(x - system.target, axis=1)
                assert np.all(distance[list(voters)] <= REGION * (1.0 + 1e-9))
                assert np.all(distance <= box.distance * (1.0 + 1e-9))
    assert relieved >= (1 if name == 'ring' else 2)


@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'path', 'star', 'directed_ring'])
def test_no_vote_needs_a_fifth_more_than_its_rest(name: str) -> None:
    system = network(name, 200.0 if name == 'path' else 100.0)
    for count in (1, 2, 3, 4):
        for voters in different_voters(system, count):
            certified = certified_threshold(system, OMEGA, voters, REGION)
            needed = rest_threshold(system, OMEGA, voters, REGION)
            assert needed <= certified <= 1.2 * needed
    for one, other in [((0, 1), (2, 3)), ((0, 2), (1, 2)), ((0, 1), (0, 3))]:
        both = certified_threshold(system, OMEGA, sorted({*one, *other}), REGION)
        assert both <= 1.001 * max(certified_threshold(system, OMEGA, voters, REGION)
                                   for voters in (one, other))
