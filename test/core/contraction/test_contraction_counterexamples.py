# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings for which the library's bounds were once wrong."""

from __future__ import annotations

import numpy as np
import pytest
from contraction_batches import Batch, Setting

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph, graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import (
    capture_set,
    outward_growth,
    outward_growth_within,
    place_tolerance,
)
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound
from dmp_cpg_ros.core.contraction.synchronisation import comparison_laplacian, synchronisation
from dmp_cpg_ros.core.errors import ParameterError

TICK = 0.002
PAIR = ((0, 1), (1, 0))


def pair(gain: float, radii: tuple[float, float], target: float, rho: float) -> CanonicalSystem:
    """Two coupled oscillators of their own radii, pulled to one place."""
    graph = graph_from_edges(2, PAIR, gain)
    return CanonicalSystem(graph, AndronovHopf(rho, np.array(radii)),
                           state_at(np.zeros(2), target))


def held_settings() -> list[tuple[Setting, np.ndarray]]:
    """Pairs whose gain is the smallest for which the box is said to be invariant."""
    rng, found = np.random.default_rng(7), []
    while len(found) < 120:
        radii = (rng.uniform(0.6, 1.4), rng.uniform(0.6, 1.4))
        omega = rng.uniform(0.5, 6.0)
        system = pair(rng.uniform(5.0, 60.0), radii, rng.uniform(0.6, 1.4), rng.uniform(1.0, 20.0))
        region = rng.uniform(0.05, 0.6)
        needed = float(capture_set(system, omega, np.array([1.0, 0.0]), region).needed_gain[0])
        if needed > 0.0:
            gains = np.array([1.000001 * needed, 0.0])
            capture = capture_set(system, omega, gains, region)
            assert capture.holds
            found.append((Setting(system, np.full(2, omega), gains, region, 'pair'),
                          capture.distance))
    return found


def test_a_box_is_not_left_by_oscillators_of_unequal_radii_or_another_target() -> None:
    cases = held_settings()
    batch = Batch([case for case, _ in cases], TICK)
    box = np.stack([distance for _, distance in cases])
    rng = np.random.default_rng(8)
    angle = rng.uniform(-np.pi, np.pi, (12, len(cases), 2))
    for turn in angle:
        direction = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        x = batch.target + 0.999 * box[..., None] * direction
        size = np.linalg.norm(x, axis=2, keepdims=True)
        largest = np.stack([max(case.system.radius.max(), np.hypot(*case.system.target[0]))
                            for case, _ in cases])[:, None, None]
        x *= np.minimum(1.0, largest / size)
        x = np.where(np.linalg.norm(x - batch.target, axis=2, keepdims=True) <= box[..., None],
                     x, batch.target)
        for _ in range(800):
            x = batch.step(x)
            assert np.all(np.linalg.norm(x - batch.target, axis=2) <= box * (1.0 + 1e-5))


def test_the_smallest_pair_that_left_its_region_is_refused() -> None:
    system = pair(15.0, (1.0, 1.1), 1.0, 2.0)
    assert not capture_set(system, 1.0, np.array([6.76, 0.0]), 0.3).holds


@pytest.mark.parametrize('radius', [0.5, 0.9, 1.0, 1.1, 2.0])
@pytest.mark.parametrize('D', [0.7, 1.0, 1.6])
def test_the_growth_within_a_distance_is_the_largest_up_to_it(radius: float, D: float) -> None:
    system = pair(1.0, (radius, radius), D, 3.0)
    distances = np.linspace(1e-6, radius + 2.0 * D, 4000)
    growth = np.array([outward_growth(system, np.zeros(2), D, np.full(2, u))[0]
                       for u in distances])
    within = np.array([outward_growth_within(system, np.zeros(2), D, np.full(2, u))[0]
                       for u in distances])
    assert np.all(within >= np.maximum.accumulate(growth) - 1e-12)
    assert np.all(within <= np.maximum.accumulate(growth) + 1e-2 * (1.0 + growth.max()))


@pytest.mark.parametrize('name', ['all_to_all', 'path', 'star', 'directed_ring'])
def test_the_box_solves_its_own_inequality(name: str) -> None:
    # Iterations from above once stopped short of the fixed point: g vanishes far away.
    graph = graph_from_edges(4, topology(name, 4), 60.0)
    system = CanonicalSystem(graph, AndronovHopf(8.0), state_at(np.zeros(4), 1.0))
    capture = capture_set(system, 6.0, np.array([500.0, 0.0, 0.0, 0.0]), 0.3)
    u = capture.distance
    left = outward_growth(system, np.full(4, 6.0), 1.0, u) - comparison_laplacian(graph) @ u
    assert np.all(left[1:] <= 1e-9)


@pytest.mark.parametrize(('omega', 'gains', 'region', 'told'), [
    (1.0, (5.0, 0.0), -0.3, 'region_radius = -0.3'), (1.0, (5.0, 0.0), 0.0, 'region_radius'),
    (1.0, (5.0, 0.0), np.nan, 'region_radius'), (np.nan, (5.0, 0.0), 0.3, 'frequencies'),
    (1.0, (np.nan, 0.0), 0.3, 'gains'), (1.0, (-5.0, 1.0), 0.3, 'gains')])
def test_numbers_that_cannot_be_used_are_refused_by_name(
        omega: float, gains: tuple[float, float], region: float, told: str) -> None:
    with pytest.raises(ParameterError, match=told):
        capture_set(pair(15.0, (1.0, 1.0), 1.0, 2.0), omega, np.array(gains), region)


def test_a_negative_mismatch_is_refused() -> None:
    found = synchronisation(graph_from_edges(2, PAIR, 10.0), 1.0)
    with pytest.raises(ParameterError, match='mismatch = -1'):
        mismatch_bound(found, 1.0, 1.0, -1.0)


def test_unequal_frequencies_stay_within_the_bound_whatever_the_gains() -> None:
    rng, tight = np.random.default_rng(11), 0.0
    for k in range(30):
        size = int(rng.integers(2, 5))
        edges = topology('all_to_all', size)
        gains = np.empty((len(edges), 2, 2))
        for e in range(len(edges)):
            turn = rng.uniform(0.0, np.pi)
            V = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
            if k % 3 == 0:                                    # anisotropic
                gains[e] = V @ np.diag(np.exp(rng.uniform(np.log(3.0), np.log(80.0), 2))) @ V.T
            elif k % 3 == 1:                                  # a I + b S, not balanced
                a, b = rng.uniform(10.0, 60.0), rng.uniform(-20.0, 20.0)
                gains[e] = [[a, b], [-b, a]]
            else:
                gains[e] = np.exp(rng.uniform(np.log(10.0), np.log(60.0))) * np.eye(2)
        graph = CouplingGraph(size, edges, gains, rng.uniform(-np.pi, np.pi, size))
        rho, delta = rng.uniform(0.5, 3.0), rng.uniform(0.5, 4.0)
        found = synchronisation(graph, rho)
        bound = mismatch_bound(found, rho, 1.0, delta)
        if not np.isfinite(bound.distance):
            continue
        system = CanonicalSystem(graph, AndronovHopf(rho), state_at(graph.phases))
        omega = 2.0 + delta * rng.choice([-1.0, 1.0], size)
        x, farthest, spread = system.target.copy(), 0.0, 0.0
        for _ in range(1500):
            x = system.step(x, omega, np.zeros(size), 0.003)
            y = (x[:, 0] - 1j * x[:, 1]) * np.exp(-1j * graph.phases)
            apart = np.abs(y[:, None] - y[None])
            farthest = max(farthest, float(apart.max()))
            spread = max(spread, float(np.abs(np.angle(y[:, None] * np.conj(y[None]))).max()))
        assert farthest <= bound.distance * (1.0 + 1e-6)
        assert spread <= bound.phase_spread + 1e-6
        tight = max(tight, farthest / bound.distance)
    assert tight > 0.3


def test_the_smallest_pair_that_exceeded_its_bound_does_so_no_more() -> None:
    gains = np.array([np.diag([60.0, 3.0])] * 2)
    graph = CouplingGraph(2, PAIR, gains, np.array([0.0, np.pi / 2.0]))
    bound = mismatch_bound(synchronisation(graph, 1.0), 1.0, 1.0, 3.0)
    assert bound.distance > 0.157


def random_network(rng: np.random.Generator) -> CanonicalSystem:
    """A named graph of four, in its places."""
    name = str(rng.choice(['all_to_all', 'ring', 'path', 'star', 'directed_ring']))
    graph = graph_from_edges(4, topology(name, 4), float(np.exp(rng.uniform(2.0, 8.0))),
                             rng.uniform(-np.pi, np.pi, 4))
    radius = rng.uniform(0.5, 2.0)
    return CanonicalSystem(graph, AndronovHopf(rng.uniform(0.5, 20.0), radius),
                           state_at(graph.phases, radius))


def test_the_gate_is_never_wider_than_the_box() -> None:
    rng = np.random.default_rng(4)
    for _ in range(200):
        system, omega = random_network(rng), rng.uniform(0.5, 25.0)
        region = rng.uniform(0.02, 0.8) * system.radius[0]
        held = (rng.permutation(4) < rng.integers(1, 4)).astype(float)
        capture = capture_set(system, omega, held, region)
        degree = float(np.diag(comparison_laplacian(system.graph)).max())
        for share in (1.0, 0.3):                             # a lower cadence is no danger
            gate = place_tolerance(share * omega, degree, float(system.radius[0]))
            assert np.all(region + gate <= capture.distance[held == 0.0] + 1e-12)


def test_a_union_of_certified_sets_is_certified() -> None:
    rng = np.random.default_rng(5)
    for _ in range(100):
        system, omega = random_network(rng), rng.uniform(0.5, 25.0)
        region = rng.uniform(0.05, 0.6) * system.radius[0]
        gains = []
        for _ in range(2):
            held = (rng.permutation(4) < rng.integers(1, 4)).astype(float)
            needed = np.nanmax(capture_set(system, omega, held, region).needed_gain)
            gains.append(held * 1.000001 * max(needed, 1e-9))
        assert capture_set(system, omega, np.maximum(*gains), region).holds


def test_couplings_that_turn_drive_states_out_of_the_disc_but_not_out_of_the_box() -> None:
    # Found by the search: a ring of gains a I + b S, of which one node is held.
    edges = topology('directed_ring', 7)
    gains = np.broadcast_to(np.array([[9.0, 1.8], [-1.8, 9.0]]), (7, 2, 2)).copy()
    system = CanonicalSystem(CouplingGraph(7, edges, gains, np.zeros(7)), AndronovHopf(2.0),
                             state_at(np.zeros(7), 1.0))
    held = np.array([237.0] + 6 * [0.0])
    capture = capture_set(system, 25.0, held, 0.16)
    x = system.target.copy()
    farthest = 0.0
    for _ in range(800):
        x = system.step(x, 25.0, held, 0.003)
        assert np.all(np.linalg.norm(x - system.target, axis=1)[1:] <= capture.distance[1:])
        farthest = max(farthest, float(np.linalg.norm(x, axis=1).max()))
    assert farthest > 1.0
