# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The inhibited network's rest: where the field vanishes and the simulation ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction import equilibrium
from dmp_cpg_ros.core.contraction.equilibrium import (
    equilibrium_near,
    equilibrium_up_to,
    inhibited_equilibrium,
)


def system(name: str, gain: float, size: int = 4, rho: float = 8.0) -> CanonicalSystem:
    phases = np.linspace(0.0, 2.0, size)
    graph = graph_from_edges(size, topology(name, size), gain, phases)
    return CanonicalSystem(graph, AndronovHopf(rho), state_at(phases))


@settings(max_examples=40)
@given(name=st.sampled_from(['all_to_all', 'ring', 'path', 'star', 'directed_ring']),
       gain=st.floats(40.0, 300.0), omega=st.floats(0.0, 15.0), node=st.integers(0, 3))
def test_it_is_where_the_field_vanishes_and_the_simulation_ends(
        name: str, gain: float, omega: float, node: int) -> None:
    network, gains = system(name, gain), np.zeros(4)
    gains[node] = 600.0
    rest = inhibited_equilibrium(network, omega, gains)
    assert rest is not None and rest.slowest_rate > 0.0
    assert np.abs(network.field(rest.state, omega, gains)).max() < 1e-6
    x = network.target.copy()
    for _ in range(round(min(25.0 / rest.slowest_rate, 6.0) / 0.004)):
        x = network.step(x, omega, gains, 0.004)
    assert np.abs(x - rest.state).max() < 1e-6
    assert np.allclose(rest.radius, np.linalg.norm(x, axis=1), atol=1e-6)


@settings(max_examples=60)
@given(name=st.sampled_from(['all_to_all', 'ring', 'path', 'star', 'directed_ring']),
       gain=st.floats(10.0, 300.0), omega=st.floats(0.0, 30.0), voters=st.sets(
           st.integers(0, 3), min_size=1), alpha=st.floats(20.0, 600.0))
def test_what_is_found_at_once_is_what_grows_out_of_the_targets(
        name: str, gain: float, omega: float, voters: set[int], alpha: float) -> None:
    network, gains = system(name, gain), np.zeros(4)
    gains[list(voters)] = alpha
    at_once = inhibited_equilibrium(network, omega, gains)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(equilibrium, '_ahead', lambda *_: None)
        grown = inhibited_equilibrium(network, omega, gains)
    assert (at_once is None) == (grown is None)
    assert grown is None or np.abs(at_once.state - grown.state).max() < 1e-7


@settings(max_examples=60)
@given(name=st.sampled_from(['all_to_all', 'ring', 'path', 'star', 'directed_ring']),
       gain=st.floats(10.0, 300.0), omega=st.floats(0.0, 30.0), node=st.integers(0, 3),
       other=st.floats(0.3, 3.0))
def test_from_a_rest_nearby_it_is_the_one_that_grows_out_of_the_targets(
        name: str, gain: float, omega: float, node: int, other: float) -> None:
    network, gains = system(name, gain), np.zeros(4)
    gains[node] = 600.0
    nearby = inhibited_equilibrium(network, omega, other * gains)
    assume(nearby is not None and nearby.slowest_rate > 0.0)
    near = equilibrium_near(network, omega, gains, nearby.state)
    grown = inhibited_equilibrium(network, omega, gains)
    assert near is None or np.abs(near.state - grown.state).max() < 1e-8


@pytest.mark.parametrize('omega', [15.0, 30.0])
def test_a_rest_is_followed_through_where_a_pair_of_its_eigenvalues_passes_zero(
        omega: float) -> None:
    network = system('all_to_all', 100.0)
    gains = np.array([95.0, 95.0, 0.0, 0.0])
    rest = inhibited_equilibrium(network, omega, gains)
    for share in 0.8 ** np.arange(1, 13):
        found = equilibrium_near(network, omega, share * gains, rest.state)
        grown = inhibited_equilibrium(network, omega, share * gains)
        assert np.abs(found.state - grown.state).max() < 1e-8
        rest = found
    assert rest.slowest_rate < 0.0


@pytest.mark.parametrize('omega', [2.0, 5.0, 10.0, 20.0])
@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'path'])
def test_a_rest_ceases_at_one_frequency_whatever_share_of_another_that_is(
        name: str, omega: float) -> None:
    network, gains = system(name, 100.0), np.array([0.0, 5.0, 0.0, 0.0])
    none, share = equilibrium_up_to(network, omega, gains)
    assert none is None and 0.0 < share < 1.0
    assert inhibited_equilibrium(network, omega * share, gains) is not None
    _, other = equilibrium_up_to(network, 1.4, gains)
    assert share * omega == pytest.approx(1.4 * other, abs=0.003 * omega)


@pytest.mark.parametrize(('gain', 'omega'), [(10.0, 8.8), (30.0, 8.8), (100.0, 8.8)])
def test_a_follower_of_a_held_leader_rests_by_the_arctangent_ahead(gain: float,
                                                                   omega: float) -> None:
    # f(y) + k (x_d - y) = 0 with the leader at x_d: tan(angle) = omega/(k - rho(1 - R^2)).
    network = CanonicalSystem(graph_from_edges(2, ((1, 0),), gain), AndronovHopf(8.0))
    rest = inhibited_equilibrium(network, omega, np.array([1e6, 0.0]))
    assert rest is not None
    R = rest.radius[1]
    expected = np.arctan2(omega, gain - 8.0 * (1.0 - R * R))
    assert rest.phase_ahead[1] == pytest.approx(expected, abs=1e-3)
    assert R < 1.0 and rest.phase_ahead[0] == pytest.approx(0.0, abs=1e-3)


def test_the_leader_holds_all_rotors() -> None:
    network, gains = system('all_to_all', 200.0), np.array([800.0, 0.0, 0.0, 0.0])
    rest = inhibited_equilibrium(network, 10.0, gains)
    assert rest is not None
    assert rest.distance[0] == pytest.approx(4.0 * 10.0 / 800.0, rel=0.05)


def test_without_enough_coupling_there_is_none() -> None:
    assert inhibited_equilibrium(system('path', 5.0), 13.0, np.array([400.0, 0, 0, 0])) is None


def test_at_zero_frequency_everyone_rests_in_place() -> None:
    rest = inhibited_equilibrium(system('ring', 50.0), 0.0, np.array([0.0, 300.0, 0.0, 0.0]))
    assert rest is not None
    assert np.allclose(rest.phase_ahead, 0.0) and np.allclose(rest.radius, 1.0)


def test_targets_of_nodes_that_are_not_inhibited_decide_nothing() -> None:
    """None of them acts; without targets of its own every oscillator has that of phase 0, from
    which nothing was found for a gait.
    """
    phases, gains = -2.0 * np.pi * np.array((0.0, 0.5, 0.75, 0.25)), np.array((400.0, 0, 0, 0))
    graph = graph_from_edges(4, topology('ring', 4), 60.0, phases)
    plain, placed = (inhibited_equilibrium(CanonicalSystem(graph, AndronovHopf(8.0), *target),
                                           9.0, gains) for target in ((), (state_at(phases),)))
    assert plain is not None and placed is not None and plain.slowest_rate > 0.0
    np.testing.assert_allclose(plain.state, placed.state, atol=1e-9)
