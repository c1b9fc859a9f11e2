# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of random networks that are stepped at once."""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph, graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.studies.certificate_settings import GRAPHS
from dmp_cpg_ros.studies.draws import random_edges
from dmp_cpg_ros.studies.network_batch import Batch, Setting, locked

__all__ = ['Batch', 'Setting', 'locked', 'random_graph', 'random_setting']


def random_graph(name: str, size: int, gain: float, rng: np.random.Generator) -> CouplingGraph:
    """A named graph with random phase offsets; ``directed`` draws one in which 0 reaches all."""
    phases = rng.uniform(-np.pi, np.pi, size)
    if name != 'directed':
        return graph_from_edges(size, topology(name, size), gain, phases)
    return graph_from_edges(size, random_edges(size, rng), gain, phases)


def random_setting(rng: np.random.Generator, size: int = 4) -> Setting:
    """A network with gains that may or may not do."""
    name = GRAPHS[rng.integers(len(GRAPHS))]
    rho, radius = np.exp(rng.uniform(np.log(1.0), np.log(25.0))), rng.uniform(0.5, 2.0)
    omega = rng.uniform(2.0, 25.0)
    gain = np.exp(rng.uniform(np.log(3.0), np.log(400.0)))
    graph = random_graph(name, size, gain, rng)
    oscillator = AndronovHopf(rho / radius**2, radius)
    system = CanonicalSystem(graph, oscillator, state_at(graph.phases, radius))
    region = rng.uniform(0.1, 0.6) * radius
    gains = np.zeros(size)
    node = 0 if name == 'directed' else int(rng.integers(size))
    gains[node] = size * omega * radius / region * rng.uniform(0.5, 3.0)
    return Setting(system, np.full(size, omega), gains, region, name)

