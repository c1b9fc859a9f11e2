# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Networks: couplings against their definition, families against differences, common periods."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import differences
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import phase, state_at, wrapped
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.network import EdgeCoupling, MeanFieldCoupling, OscillatorNetwork
from dmp_cpg_ros.paper.oscillators import (
    HopfOscillators,
    MixedOscillators,
    OscillatorFamily,
    VanDerPolOscillators,
)

NAMES = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')
SKEWED = np.array([[2.0, 1.0], [-0.5, 3.0]])  # not symmetric; does not commute with rotations


def families(count: int) -> dict[str, OscillatorFamily]:
    rng = np.random.default_rng(count)
    omega = rng.uniform(1.0, 10.0, count)
    rho, radius = rng.uniform(1.0, 9.0, count), rng.uniform(0.5, 2.0, count)
    hopf = HopfOscillators(count, omega, rho, radius)
    van_der_pol = VanDerPolOscillators(count, omega, rng.uniform(0.1, 3.0, count))
    return {'hopf': hopf, 'van_der_pol': van_der_pol,
            'mixed': MixedOscillators([hopf, van_der_pol])}


def every_edge(name: str, size: int, gain: float | np.ndarray, seed: int,
               turned: bool = True) -> EdgeCoupling:
    phases = np.random.default_rng(seed).uniform(-3.0, 3.0, size) * turned
    return EdgeCoupling(graph_from_edges(size, topology(name, size), gain, phases))


@pytest.mark.parametrize('kind', ['hopf', 'van_der_pol', 'mixed'])
@given(seed=st.integers(0, 1000), count=st.integers(1, 5))
@settings(max_examples=20)
def test_jacobians_against_differences_and_within_their_bound(
        kind: str, seed: int, count: int) -> None:
    of = families(count)[kind]
    x = np.random.default_rng(seed).normal(size=(of.count, of.state_size))
    expected = differences(lambda at: of.field(at.reshape(x.shape)).ravel(), x.ravel())
    jacobian = of.jacobian(x)
    whole = np.zeros_like(expected)
    for i, block in enumerate(jacobian):
        part = slice(i * of.state_size, (i + 1) * of.state_size)
        whole[part, part] = block
    assert np.allclose(whole, expected, atol=1e-5)
    assert np.linalg.norm(whole, 2) <= of.stiffness(x) + 1e-9


def test_hopf_oscillators_are_those_of_the_gait(rng: np.random.Generator) -> None:
    of, x = families(4)['hopf'], rng.normal(size=(4, 2))
    assert isinstance(of, HopfOscillators)
    for i in range(4):
        one = AndronovHopf(of.rho[i], of.radius[i])
        assert np.allclose(of.field(x)[i], one.field(x[i], of.omega[i]))
        assert np.allclose(of.jacobian(x)[i], one.jacobian(x[i], of.omega[i]))


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('gain', [7.0, SKEWED], ids=['scalar', 'matrix'])
@given(seed=st.integers(0, 1000), size=st.integers(2, 7))
@settings(max_examples=10)
def test_edges_do_what_the_coupling_matrix_does(
        name: str, gain: float | np.ndarray, seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    graph = graph_from_edges(size, topology(name, size), gain, rng.uniform(-3.0, 3.0, size))
    of, x = EdgeCoupling(graph), rng.normal(size=(size, 2))
    matrix = graph.coupling_matrix()
    assert np.allclose(of(x).ravel(), matrix @ x.ravel())
    assert np.abs(np.linalg.eigvals(matrix)).max() <= of.bound + 1e-9
    assert of.symmetric == np.allclose(matrix, matrix.T)


def test_nodes_that_nobody_acts_on_feel_nothing(rng: np.random.Generator) -> None:
    of, x = EdgeCoupling(graph_from_edges(4, ((1, 0), (3, 0)), 5.0)), rng.normal(size=(4, 2))
    assert np.allclose(of(x), 5.0 * np.array([0 * x[0], x[0] - x[1], 0 * x[0], x[0] - x[3]]))
    assert not EdgeCoupling(graph_from_edges(3, (), 1.0))(x[:3]).any()


@given(seed=st.integers(0, 1000), size=st.integers(2, 8), gain=st.floats(0.1, 50.0))
def test_the_mean_field_is_the_sum_over_all_edges(seed: int, size: int, gain: float) -> None:
    rng = np.random.default_rng(seed)
    phases, x = rng.uniform(-3.0, 3.0, size), rng.normal(size=(size, 2))
    graph = graph_from_edges(size, topology('all_to_all', size), gain, phases)
    assert np.allclose(MeanFieldCoupling(size, gain, phases)(x), EdgeCoupling(graph)(x))
    whole = np.round(4.0 * x).astype(int)
    assert np.allclose(MeanFieldCoupling(size, gain, phases)(whole), EdgeCoupling(graph)(whole))


def run(of: OscillatorNetwork, x: np.ndarray, seconds: float, dt: float = 0.004,
        gains: np.ndarray | None = None) -> np.ndarray:
    for _ in range(round(seconds / dt)):
        x = of.step(x, dt, gains)
    return x


def test_the_network_moves_as_the_canonical_system_of_the_gait(rng: np.random.Generator) -> None:
    phases = -2.0 * np.pi * np.array([0.0, 0.5, 0.75, 0.25])
    graph = graph_from_edges(4, topology('all_to_all', 4), 40.0, phases)
    gait = CanonicalSystem(graph, AndronovHopf(8.0), state_at(phases))
    of = OscillatorNetwork(HopfOscillators(4, 9.0), EdgeCoupling(graph), state_at(phases))
    x = y = state_at(phases + 0.5) + 0.3 * rng.normal(size=(4, 2))
    gains = np.array([150.0, 0.0, 0.0, 0.0])
    assert np.allclose(of.field(x, gains), gait.field(x, 9.0, gains))
    for _ in range(250):
        x, y = of.step(x, 0.004), gait.step(y, 9.0, np.zeros(4), 0.004)
    assert np.abs(x - y).max() < 5e-3  # after 1.4 turns, of methods of order two and three
    for _ in range(250):
        x, y = of.step(x, 0.004, gains), gait.step(y, 9.0, gains, 0.004)
    assert np.abs(x - y).max() < 1e-9  # at rest both are at the same equilibrium


@pytest.mark.parametrize('name', NAMES)
def test_equal_oscillators_lock_at_their_offsets(name: str, rng: np.random.Generator) -> None:
    phases = np.random.default_rng(2).uniform(-3.0, 3.0, 6)
    coupling = EdgeCoupling(graph_from_edges(6, topology(name, 6), 30.0, phases))
    x = run(OscillatorNetwork(HopfOscillators(6, 5.0), coupling), rng.normal(size=(6, 2)), 3.0)
    places = wrapped(phase(x) - phases)
    assert np.abs(wrapped(places - places[0])).max() < 1e-3


def crossings(x: np.ndarray, dt: float) -> np.ndarray:
    """Mean period of every oscillator from its upward crossings of zero, (N,) [s]."""
    periods = []
    for row in x[:, :, 0].T:
        k = np.flatnonzero((row[:-1] < 0.0) & (row[1:] >= 0.0))
        at = k - row[k] / (row[k + 1] - row[k])
        periods.append(np.diff(at).mean() * dt)
    return np.array(periods)


def recorded(of: OscillatorNetwork, seconds: float, dt: float = 0.01) -> np.ndarray:
    x, rows = np.array([[1.0, 0.0], [-1.0, 0.5], [0.3, -1.0], [2.0, 1.0]]), []
    for _ in range(round(seconds / dt)):
        x = of.step(x, dt)
        rows.append(x)
    return np.array(rows)


def test_coupled_van_der_pol_oscillators_reach_a_common_period_and_uncoupled_do_not() -> None:
    family = VanDerPolOscillators(4, [0.8, 1.0, 1.3, 1.6], [0.5, 1.0, 1.5, 2.0])
    graph = graph_from_edges(4, topology('all_to_all', 4), np.diag([4.0, 4.0]))
    alone = crossings(recorded(OscillatorNetwork(family), 100.0)[3000:], 0.01)
    coupled = OscillatorNetwork(family, EdgeCoupling(graph))
    together = crossings(recorded(coupled, 100.0)[3000:], 0.01)
    assert np.ptp(alone) > 0.5
    assert np.ptp(together) < 1e-4
    assert alone.min() < together.mean() < alone.max()


def test_van_der_pol_limit_cycle_has_the_textbook_amplitude_and_period() -> None:
    """Amplitude 2 and period 2 pi (1 + mu^2 / 16 omega^2) / omega for small mu."""
    of = OscillatorNetwork(VanDerPolOscillators(4, 2.0, 0.4))
    x = recorded(of, 60.0)[3000:]
    assert np.abs(x[:, :, 0]).max() == pytest.approx(2.0, abs=0.02)
    assert crossings(x, 0.01)[0] == pytest.approx(np.pi * (1.0 + 0.04 / 16.0), rel=1e-3)


def test_a_mixed_network_runs_with_one_period() -> None:
    hopf, van_der_pol = HopfOscillators(2, 1.0, 1.0), VanDerPolOscillators(2, 1.2, 0.5)
    graph = graph_from_edges(4, topology('ring', 4), 3.0)
    of = OscillatorNetwork(MixedOscillators([hopf, van_der_pol]), EdgeCoupling(graph))
    # the Van der Pol's state turns clockwise, as the Hopf oscillator's does
    assert np.ptp(crossings(recorded(of, 100.0)[3000:], 0.01)) < 1e-3


@pytest.mark.parametrize('make', [
    lambda: HopfOscillators(3, [1.0, 2.0]),
    lambda: HopfOscillators(3, 1.0, rho=0.0),
    lambda: HopfOscillators(3, np.nan),
    lambda: VanDerPolOscillators(2, 0.0, 1.0),
    lambda: MixedOscillators([]),
    lambda: MeanFieldCoupling(3, 0.0),
    lambda: MeanFieldCoupling(3, 1.0, [0.0, 1.0]),
    lambda: OscillatorNetwork(HopfOscillators(3, 1.0), MeanFieldCoupling(4, 1.0)),
    lambda: OscillatorNetwork(HopfOscillators(3, 1.0), target=np.zeros(2)),
    lambda: OscillatorNetwork(VanDerPolOscillators(2, 1.0, 1.0),
                              MeanFieldCoupling(2, 1.0, [0.0, 1.0])),
])
def test_what_does_not_fit_is_refused(make) -> None:
    with pytest.raises(ParameterError):
        make()
