# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Unequal frequencies: bounds on disagreement, the margin, and the tube, against simulation."""

from __future__ import annotations

import numpy as np
import pytest
from contraction_batches import Batch, Setting, locked
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph, graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.heterogeneity import (
    disagreement_bound,
    mismatch_bound,
    mismatch_margin,
    phase_gain,
)
from dmp_cpg_ros.core.contraction.synchronisation import comparison_laplacian, synchronisation
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.transverse_metric import hopf_tube, metric_condition, tube_radius
from dmp_cpg_ros.studies.draws import random_edges

GRAPHS = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')


def spreads(name: str, gain: float, mismatches: np.ndarray, rho: float = 8.0,
            omega: float = 10.0) -> tuple[np.ndarray, np.ndarray]:
    """Largest phase difference and distance of oscillators, after a transient; per mismatch."""
    graph = graph_from_edges(4, topology(name, 4), gain)
    system = CanonicalSystem(graph, AndronovHopf(rho))
    cases = [Setting(system, omega + row, np.array([1.0, 0, 0, 0]), 1.0, name)
             for row in mismatches]
    batch = Batch(cases, 0.005)
    x = np.stack([locked(case, 0.0) for case in cases])
    for _ in range(800):
        x = batch.step(x, armed=False)
    z = x[:, :, 0] - 1j * x[:, :, 1]
    angle = np.angle(z / z[:, :1])
    return np.ptp(angle, axis=1), np.abs(z[:, :, None] - z[:, None, :]).max(axis=(1, 2))


@pytest.mark.parametrize('name', GRAPHS)
def test_disagreement_stays_below_its_bound_for_every_mismatch(name: str) -> None:
    rng = np.random.default_rng(4)
    found = synchronisation(graph_from_edges(4, topology(name, 4), 60.0), 8.0)
    signs = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1], [1, 1, 1, -1]])
    for mismatch in (0.1, 0.6):
        rows = mismatch * np.concatenate([signs, rng.uniform(-1.0, 1.0, (12, 4))])
        phases, distances = spreads(name, 60.0, rows)
        bound = mismatch_bound(found, 8.0, 1.0, mismatch)
        assert distances.max() <= bound.distance
        assert phases.max() <= bound.phase_spread


@pytest.mark.parametrize('name', GRAPHS)
def test_within_the_margin_phases_stay_together_and_far_beyond_they_do_not(name: str) -> None:
    graph = graph_from_edges(4, topology(name, 4), 60.0)
    margin = mismatch_margin(graph, synchronisation(graph, 8.0), 8.0, 1.0, 0.05)
    signs = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1], [1, 1, 1, -1]])
    assert margin > 0.0
    assert spreads(name, 60.0, margin * signs)[0].max() <= 0.05
    assert spreads(name, 60.0, 3.0 * margin * signs)[0].max() > 0.05


@pytest.mark.parametrize('size', [2, 3, 5])
def test_the_gain_of_phases_is_what_the_worst_signs_in_time_reach(size: int) -> None:
    rng = np.random.default_rng(size)
    edges = random_edges(size, rng)
    L = comparison_laplacian(graph_from_edges(size, edges, 30.0))
    gain, h = phase_gain(L), 2e-4
    assert gain is not None
    i, j = np.unravel_index(gain.argmax(), gain.shape)
    z, reached = np.eye(size)[i] - np.eye(size)[j], 0.0
    decay = np.eye(size) - h * L + 0.5 * h * h * L @ L
    for _ in range(20_000):
        reached += h * np.abs(0.5 * (z + z @ decay)).sum()
        z = z @ decay
    assert reached <= gain[i, j] * (1.0 + 1e-6) <= 1.01 * reached


def test_phases_stay_within_the_margin_on_random_weighted_graphs() -> None:
    rng, seen = np.random.default_rng(8), 0
    for _ in range(12):
        edges = {(int(i), int(j)) for i, j in rng.integers(4, size=(4, 2)) if i != j}
        edges = tuple(sorted({*edges, *((j, i) for i, j in edges), *topology('path', 4)}))
        graph = CouplingGraph(4, edges, rng.uniform(30.0, 120.0, len(edges))[:, None, None]
                              * np.eye(2), np.zeros(4))
        margin = mismatch_margin(graph, synchronisation(graph, 8.0), 8.0, 1.0, 0.05)
        system = CanonicalSystem(graph, AndronovHopf(8.0))
        signs = rng.choice([-1.0, 1.0], (40, 4))
        batch = Batch([Setting(system, 10.0 + margin * row, np.array([1.0, 0, 0, 0]), 1.0)
                       for row in signs], 0.004)
        x = np.stack([locked(case, 0.0) for case in batch.settings])
        for step in range(500):
            if step % 20 == 0:
                batch.omega = 10.0 + margin * rng.choice([-1.0, 1.0], (40, 4))
            x = batch.step(x, armed=False)
            z = x[:, :, 0] - 1j * x[:, :, 1]
            assert np.ptp(np.angle(z / z[:, :1]), axis=1).max() <= 0.05
        seen += margin > 0.0
    assert seen > 6


def test_stronger_coupling_makes_the_disagreement_as_small_as_one_likes() -> None:
    bounds = [mismatch_bound(synchronisation(graph_from_edges(4, topology('ring', 4), gain), 8.0),
                             8.0, 1.0, 0.5).distance for gain in (50.0, 500.0, 5000.0)]
    assert bounds[0] > 8.0 * bounds[1] > 64.0 * bounds[2]


def test_one_oscillator_agrees_with_itself() -> None:
    graph = graph_from_edges(1, (), 20.0)
    bound = mismatch_bound(synchronisation(graph, 8.0), 8.0, 0.7, 1.0)
    assert (bound.disagreement, bound.distance, bound.phase_spread) == (0.0, 0.0, 0.0)
    assert 0.69 < bound.smallest_radius <= 0.7


def test_nothing_is_promised_for_networks_that_are_not_certified() -> None:
    graph = graph_from_edges(4, topology('path', 4), 5.0)
    weak = synchronisation(graph, 8.0)
    assert mismatch_margin(graph, weak, 8.0, 1.0, 0.05) == 0.0
    assert mismatch_bound(weak, 8.0, 1.0, 0.1).distance == np.inf
    with pytest.raises(ParameterError, match='must be positive'):
        disagreement_bound(0.0, 1.0, np.full(4, 0.25))


@settings(max_examples=15)
@given(rho=st.floats(2.0, 20.0), omega=st.floats(2.0, 20.0), share=st.floats(0.01, 0.8),
       seed=st.integers(0, 1000))
def test_a_disturbed_oscillator_stays_in_its_tube(rho: float, omega: float, share: float,
                                                  seed: int) -> None:
    oscillator = AndronovHopf(rho)
    disturbance = share * rho * 2.0 / (3.0 * 3.0**0.5)
    found = hopf_tube(oscillator, omega, disturbance)
    assert found is not None
    radius, annulus = found
    rng, h = np.random.default_rng(seed), 0.002
    x = np.array([1.0, 0.0])
    w = disturbance * np.array([np.cos(seed), np.sin(seed)])
    for k in range(2000):
        if k % 100 == 0:
            # Now and then against the radius, which is the worst, now and then anywhere.
            push = -x if rng.random() < 0.5 else rng.normal(size=2)
            w = disturbance * push / np.linalg.norm(push)
        # From [1, 0] the undisturbed orbit is the cycle: the distance to it is | |x| - 1 |.
        half = x + 0.5 * h * (oscillator.field(x, omega) + w)
        x = x + h * (oscillator.field(half, omega) + w)
        assert abs(np.linalg.norm(x) - 1.0) <= radius
        assert annulus.inner - 1e-4 <= np.linalg.norm(x) <= annulus.outer + 1e-4


@pytest.mark.parametrize('disturbance', [-1.0, np.nan])
def test_a_disturbance_is_no_less_than_none(disturbance: float) -> None:
    with pytest.raises(ParameterError, match='must not be negative'):
        hopf_tube(AndronovHopf(3.0), 5.0, disturbance)


def test_a_disturbance_that_reaches_the_origin_has_no_tube() -> None:
    assert hopf_tube(AndronovHopf(8.0), 10.0, 8.0) is None
    with pytest.raises(ParameterError, match='positive'):
        tube_radius(0.0, 1.0, 1.0)


def test_the_tube_scales_with_the_condition_of_the_metric() -> None:
    M = np.array([[4.0, 0.0], [0.0, 1.0]])
    assert metric_condition(M) == pytest.approx(2.0)
    assert metric_condition(np.stack([M, 9.0 * np.eye(2)])) == pytest.approx(3.0)
    assert tube_radius(2.0, metric_condition(M), 0.1) == pytest.approx(0.1)
    with pytest.raises(ParameterError, match='positive definite'):
        metric_condition(np.diag([1.0, 0.0]))
