# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tubes from where inhibition sets in: what they prove comes to rest, where no norm can say so."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph, graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import capture_set
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.inhibited import NONE, inhibited_contraction, inhibition_rate
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.entry_tube import entry_tube

DT = 0.002


def random_case(rng: np.random.Generator) -> tuple[CanonicalSystem, float, np.ndarray, float]:
    """Weighted network that one or two nodes hold, with its cadence, gains and region."""
    size, name = int(rng.integers(2, 6)), str(rng.choice(['all_to_all', 'path', 'directed_ring']))
    rho, radius, omega = rng.uniform(4.0, 10.0), rng.choice([1.0, 0.6]), rng.uniform(2.0, 12.0)
    edges = topology(name, size)
    weights = 0.4 * omega * size * rng.uniform(0.6, 1.5, len(edges)) / (size - 1) ** (
        name == 'all_to_all')
    phases = rng.uniform(-np.pi, np.pi, size)
    graph = CouplingGraph(size, edges, weights[:, None, None] * np.eye(2), phases)
    held = rng.permutation(size)[:int(rng.integers(1, 3))]
    region = radius * rng.uniform(0.15, 0.4)
    gains = np.where(np.isin(np.arange(size), held), 3.0 * size * omega * radius / region, 0.0)
    return (CanonicalSystem(graph, AndronovHopf(rho / radius**2, radius),
                            radius * state_at(phases)), omega, gains, region)


def entered(system: CanonicalSystem, gains: np.ndarray, region: float,
            rng: np.random.Generator) -> np.ndarray:
    """A state in which inhibition sets in, most often at an edge of what is allowed."""
    radius, held = float(system.radius[0]), gains > 0.0
    while True:
        off = rng.choice([-1.0, 1.0]) * region / radius * rng.choice([1.0, rng.uniform()])
        lead = (1.0 + 0.02 * rng.choice([-1.0, 0.0, 1.0])) * state_at(off + system.graph.phases)
        away = rng.normal(size=lead.shape)
        away *= 0.01 / np.linalg.norm(away, axis=1, keepdims=True)
        away[gains.argmax()] = 0.0
        x = radius * (lead + away)
        if np.linalg.norm(x - system.target, axis=1)[held].max() <= region:
            return x


def test_what_tubes_prove_comes_to_rest_where_no_constant_norm_contracts() -> None:
    rng, proved = np.random.default_rng(1), 0
    for _ in range(50):
        system, omega, gains, region = random_case(rng)
        capture = capture_set(system, omega, gains, region)
        if not capture.holds or inhibited_contraction(system, capture).reach != NONE:
            continue
        tube = entry_tube(system, omega, gains, region, longest=2.0)
        if not tube.holds:
            continue
        proved += 1
        rest = inhibited_equilibrium(system, omega, gains)
        for _ in range(3):
            x = entered(system, gains, region, rng)
            for k in range(round(8.0 / DT)):
                x = system.step(x, omega, gains, DT)
                if k == round(tube.time / DT):
                    assert np.linalg.norm(x - rest.state, axis=1).max() < system.radius[0]
                if k > tube.time / DT and k % 250 == 0 and np.linalg.norm(
                        system.field(x, omega, gains)) < 1e-3 * omega * system.radius[0]:
                    break  # it rests, and stays so
            assert np.linalg.norm(system.field(x, omega, gains)) < 0.05 * omega * system.radius[0]
    assert proved > 10


@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'path', 'star', 'directed_ring'])
def test_no_constant_norm_contracts_at_the_origin_for_less_than_the_global_grade(
        name: str) -> None:
    """There the Jacobian grows at rho r^2 - lambda, and no measure of it is smaller."""
    phases = -2.0 * np.pi * np.array([0.0, 0.5, 0.75, 0.25])
    for coupling in (5.0, 20.0):
        graph = graph_from_edges(4, topology(name, 4), coupling, phases)
        system = CanonicalSystem(graph, AndronovHopf(8.0), state_at(phases))
        gains = np.array([300.0, 0.0, 0.0, 0.0])
        fastest = np.linalg.eigvals(system.jacobian(0.0 * system.target, 12.0, gains)).real.max()
        assert fastest == pytest.approx(8.0 - inhibition_rate(graph, gains), abs=1e-6)


def test_nothing_is_proved_of_a_network_that_breaks_free_and_of_what_is_not_known() -> None:
    graph = graph_from_edges(4, topology('path', 4), 8.0)
    gains = np.array([300.0, 0.0, 0.0, 0.0])
    assert not entry_tube(CanonicalSystem(graph, AndronovHopf(8.0)), 12.0, gains, 0.3).holds
    for oscillators, acting in ((AndronovHopf(8.0, np.array([1.0, 1.0, 1.0, 0.9])), gains),
                                (AndronovHopf(8.0), 0.0 * gains)):
        with pytest.raises(ParameterError, match='alike'):
            entry_tube(CanonicalSystem(graph, oscillators), 12.0, acting, 0.3)
