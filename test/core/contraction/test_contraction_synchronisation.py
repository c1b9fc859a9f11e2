# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Theorem 4 on all kinds of graphs: the eigenvalue, certified rates against simulation, norms."""

from __future__ import annotations

import numpy as np
import pytest
from contraction_batches import Batch, Setting, locked, random_setting
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph, graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.synchronisation import (
    cascade_weights,
    components,
    connectivity,
    grounded_connectivity,
    synchronisation,
    synchronisation_complement,
)
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.matrix_measure import coupling_measure, disagreement_measure, matrix_measure
from dmp_cpg_ros.studies.draws import random_edges

SEEDS = st.integers(0, 10_000)


def test_the_connectivity_is_the_smallest_eigenvalue_that_is_not_one_of_the_zeros() -> None:
    known = {'all_to_all': 4.0, 'ring': 2.0, 'path': 2.0 - 2.0**0.5, 'star': 1.0,
             'directed_ring': 1.0}
    for name, value in known.items():
        graph = graph_from_edges(4, topology(name, 4), 7.0)
        assert connectivity(graph.block_laplacian(), 4) == pytest.approx(7.0 * value)
        assert synchronisation(graph, 0.0).connectivity == pytest.approx(7.0 * value)


@pytest.mark.parametrize('size', [3, 4, 6, 9])  # of two one bound is as good as the other
def test_in_its_cascade_weights_a_graph_is_as_connected_as_its_components(size: int) -> None:
    rng, seen = np.random.default_rng(size), 0
    for _ in range(60):
        edges = random_edges(size, rng)
        gains = rng.uniform(5.0, 50.0, len(edges)) if rng.random() < 0.5 else np.full(
            len(edges), 20.0)
        graph = CouplingGraph(size, edges, gains[:, None, None] * np.eye(2),
                              rng.uniform(-np.pi, np.pi, size))
        found = synchronisation(graph, 1.0)
        if found.method == 'hierarchical':
            weights = cascade_weights(graph, 2.0**-30)
            assert weights.min() > 0.0 and weights.sum() == pytest.approx(1.0)
            assert connectivity(graph.block_laplacian(), size, weights) == pytest.approx(
                found.connectivity, rel=1e-3)
            seen += 1
    assert seen > 10


def unsynchronised(name: str, gain: float, seconds: float = 2.0) -> float:
    """Disagreement left when a network starts in the eigenvector that decides, near the origin."""
    graph = graph_from_edges(4, topology(name, 4), gain)
    L = graph.block_laplacian()
    V = synchronisation_complement(4)
    direction = V.T @ np.linalg.eigh(V @ (L + L.T) @ V.T)[1][:, 0]
    x = 1e-3 * direction.reshape(4, 2)
    system = CanonicalSystem(graph, AndronovHopf(8.0))
    for _ in range(int(seconds / 0.002)):
        x = system.step(x, 9.0, np.zeros(4), 0.002)
    return float(np.linalg.norm(V @ x.ravel())) / 1e-3


@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'path', 'star', 'directed_ring'])
def test_the_condition_is_sharp_on_every_graph(name: str) -> None:
    unit = synchronisation(graph_from_edges(4, topology(name, 4), 1.0), 0.0).connectivity
    assert unsynchronised(name, 1.1 * 8.0 / unit) < 1.0
    assert unsynchronised(name, 0.9 * 8.0 / unit) > 3.0


def test_the_misread_eigenvalue_would_pass_a_path_that_does_not_synchronise() -> None:
    # Counted from below, the (N + 1)th of the 8 eigenvalues is 2 k on a path, the connectivity
    # 0.586 k.
    gain = 8.0
    graph = graph_from_edges(4, topology('path', 4), gain)
    assert np.linalg.eigvalsh(graph.block_laplacian())[4] > 8.0
    assert not synchronisation(graph, 8.0).synchronises
    assert unsynchronised('path', gain) > 3.0


def test_synchronising_is_not_enough_for_contraction_under_inhibition() -> None:
    graph = graph_from_edges(4, topology('all_to_all', 4), 5.0)
    assert synchronisation(graph, 8.0).synchronises
    for gain in (1e2, 1e4, 1e6):
        assert grounded_connectivity(graph, np.array([gain, 0.0, 0.0, 0.0])) < 5.0


def certified(count: int, seed: int) -> list[tuple[Setting, float, np.ndarray]]:
    """Random networks that are certified to synchronise, with their rates and weights."""
    rng = np.random.default_rng(seed)
    cases: list[tuple[Setting, float, np.ndarray]] = []
    while len(cases) < count:
        setting = random_setting(rng)
        oscillator = setting.system.oscillators
        found = synchronisation(setting.system.graph, oscillator.rho * oscillator.radius**2)
        if found.synchronises and found.weights is not None:
            cases.append((setting, found.rate, found.weights))
    return cases


def disagreement(setting: Setting, x: np.ndarray, weights: np.ndarray) -> float:
    """(Σ ξ_i |x_i − x̄|²)^½ in locked coordinates."""
    z = (x[:, 0] - 1j * x[:, 1]) * np.exp(-1j * setting.system.graph.phases)
    return float(np.sqrt(weights @ np.abs(z - weights @ z)**2))


def test_no_certified_network_fails_to_synchronise_at_its_rate_from_anywhere() -> None:
    cases = certified(300, 10)
    rng = np.random.default_rng(1)
    batch = Batch([setting for setting, _, _ in cases], 0.001)
    x = np.stack([rng.uniform(-2.0, 2.0) * rng.normal(size=(4, 2)) for _ in cases])
    start = np.array([disagreement(s, x[k], w) for k, (s, _, w) in enumerate(cases)])
    for step in range(1, 401):
        x = batch.step(x, armed=False)
        if step in (20, 100, 400):
            left = np.array([disagreement(s, x[k], w) for k, (s, _, w) in enumerate(cases)])
            promised = start * np.exp(-step * 0.001 * np.array([rate for _, rate, _ in cases]))
            assert np.all(left <= 1.001 * promised + 1e-12)


@settings(max_examples=15)
@given(seed=SEEDS)
def test_a_network_that_follows_a_root_synchronises_through_its_hierarchy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(3, 6))
    edges = tuple((i, int(rng.integers(i))) for i in range(1, size))
    graph = graph_from_edges(size, edges, 20.0, rng.uniform(-3.0, 3.0, size))
    found = synchronisation(graph, 8.0)
    assert found.rate >= 12.0 - 1e-9
    system = CanonicalSystem(graph, AndronovHopf(8.0))
    x = locked(Setting(system, np.full(size, 9.0), np.zeros(size), 1.0, ''), 0.3)
    x = x + 0.3 * rng.normal(size=x.shape)
    for _ in range(1500):
        x = system.step(x, 9.0, np.zeros(size), 0.002)
    z = (x[:, 0] - 1j * x[:, 1]) * np.exp(-1j * graph.phases)
    assert np.abs(z - z[0]).max() < 1e-6


@given(seed=SEEDS)
def test_graphs_that_nobody_leads_are_not_certified(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gain = float(rng.uniform(10.0, 1000.0))
    two_roots = graph_from_edges(4, ((1, 0), (1, 3), (2, 3)), gain)
    assert not synchronisation(two_roots, 1.0).synchronises
    apart = graph_from_edges(4, ((0, 1), (1, 0), (2, 3), (3, 2)), gain)
    assert not synchronisation(apart, 1.0).synchronises
    assert not synchronisation(CouplingGraph(3, (), np.zeros((0, 2, 2)), np.zeros(3)),
                               1.0).synchronises


def test_components_come_before_those_that_they_act_on() -> None:
    edges = ((1, 0), (0, 1), (2, 1), (3, 2), (2, 3), (4, 3))
    assert components(graph_from_edges(5, edges, 1.0)) == [[0, 1], [2, 3], [4]]


@given(seed=SEEDS)
def test_every_weighting_gives_a_true_bound(seed: int) -> None:
    # The decay of the weighted disagreement under the coupling alone is never below the bound.
    rng = np.random.default_rng(seed)
    gains = rng.normal(size=(6, 2, 2)) + 4.0 * np.eye(2)
    graph = CouplingGraph(4, ((0, 1), (1, 2), (2, 0), (2, 3), (3, 1), (0, 3)), gains,
                          rng.uniform(-3.0, 3.0, 4))
    L, xi = graph.block_laplacian(), rng.uniform(0.1, 1.0, 4)
    xi /= xi.sum()
    bound = connectivity(L, 4, xi)
    for _ in range(20):
        e = rng.normal(size=(4, 2))
        e -= xi @ e
        fall = np.einsum('i,ij,ij->', xi, e, (L @ e.ravel()).reshape(4, 2))
        assert fall >= bound * np.einsum('i,ij,ij->', xi, e, e) - 1e-9


def test_the_remark_holds_in_the_2_norm_and_not_in_the_maximum_norm() -> None:
    V = synchronisation_complement(3, 1)
    rng = np.random.default_rng(0)
    in_2, in_max = [], []
    for _ in range(300):
        A = np.diag(rng.uniform(-1.0, 1.0, 3))
        projected = V @ A @ V.T
        in_2.append(matrix_measure(projected, 2) - A.max())
        in_max.append(matrix_measure(projected, np.inf) - A.max())
    assert max(in_2) <= 1e-12
    assert max(in_max) > 0.01


def hopf_jacobian_vertices(rho: float, radius: float, omega: float, directions: int = 8
                           ) -> list[np.ndarray]:
    """Matrices whose hull contains the Andronov-Hopf Jacobian for every |x| ≤ radius.

    A = ωS + ρr²I − ρ|x|²(2I + P), with P = 2uuᵀ − I a reflection. The reflections form a circle in
    the symmetric traceless matrices; a regular polygon around it encloses them.
    """
    S = np.array([[0.0, 1.0], [-1.0, 0.0]])
    at_origin = omega * S + rho * radius**2 * np.eye(2)
    angles = 2.0 * np.pi * np.arange(directions) / directions
    stretch = 1.0 / np.cos(np.pi / directions)
    on_cycle = [at_origin - rho * radius**2 * (2.0 * np.eye(2) + stretch * np.array(
        [[np.cos(a), np.sin(a)], [np.sin(a), -np.cos(a)]])) for a in angles]
    return [at_origin, *on_cycle]


@pytest.mark.parametrize('norm', [1, 2, np.inf])
@settings(max_examples=15)
@given(seed=SEEDS)
def test_the_measure_of_the_whole_bounds_every_mixture(norm: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    oscillator, omega = AndronovHopf(8.0), 9.0
    L = graph_from_edges(3, topology('all_to_all', 3), 30.0).block_laplacian()
    bound = disagreement_measure(L, 3, hopf_jacobian_vertices(8.0, 1.0, omega, 5), norm)
    V = synchronisation_complement(3)
    for _ in range(10):
        states = rng.normal(size=(3, 2))
        states /= np.maximum(1.0, np.linalg.norm(states, axis=1))[:, None]
        A = np.zeros((6, 6))
        for i in range(3):
            A[2 * i:2 * i + 2, 2 * i:2 * i + 2] = oscillator.jacobian(states[i], omega)
        assert matrix_measure(V @ (A - L) @ V.T, norm) <= bound + 1e-9
    if norm == 2:
        assert bound == pytest.approx(8.0 - 90.0)
        assert coupling_measure(L, 3) == pytest.approx(-90.0)


def test_too_many_vertices_are_refused() -> None:
    with pytest.raises(ParameterError, match='fewer vertices'):
        disagreement_measure(np.zeros((16, 16)), 8, hopf_jacobian_vertices(1.0, 1.0, 1.0))
