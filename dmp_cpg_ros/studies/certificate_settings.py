# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of the suite through its certificate: a grid of 2,304, and random ones."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import product

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import (
    TOPOLOGIES,
    CouplingGraph,
    Edges,
    graph_from_edges,
    topology,
)
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.contraction.capture import capture_set
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation, synchronisation
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.studies import network_batch
from dmp_cpg_ros.studies.draws import log_uniform, random_edges
from dmp_cpg_ros.suite import load_gaits

GRAPHS = (*TOPOLOGIES, 'directed')
GAITS = load_gaits()
LARGEST_MISMATCH = 0.05
TICK = 0.004
SCALE = BodyScale(0.28, math.hypot(0.19, 0.11))

@dataclass(frozen=True)
class Case:
    """One setting of the grid, what its certificate requires, and what naive checks would say."""

    running: Setting
    setting: network_batch.Setting
    certificate: Certificate
    free: Synchronisation
    misread: bool
    contracts: bool


@lru_cache(maxsize=1)
def grid(tell: Callable[[str], None] = lambda _: None) -> tuple[Case, ...]:
    """The whole grid; says how far it is."""
    rng, cases = np.random.default_rng(4), list[Case]()
    for values in (every := list(product(
            GRAPHS, ('amble', 'trot', 'bound'), (10.0, 25.0, 60.0, 200.0),
            (0.65, 0.95, 1.15, 2.0), (0.15, 0.35), ('fl', 'rr'), (3.0, 9.0)))):
        cases.append(grid_case(*values, rng))
        tell(f'{len(cases)} of {len(every)} settings')
    return tuple(cases)


def grid_case(graph: str, gait: str, gain: float, share: float, region: float, leg: str,
              rho: float, rng: np.random.Generator) -> Case:
    """Certify a setting of the grid; radius, speed, cadence and frequencies are drawn."""
    radius = float(rng.uniform(0.5, 2.0))
    canonical = CanonicalParameters(
        rho=rho / radius**2, radius=radius, coupling_gain=gain,
        coupling_graph='ring' if graph == 'directed' else graph)
    paced = GAITS[gait].scaled(float(rng.uniform(0.6, 1.6)))
    reference = ReferenceParameters(max_speed=float(rng.uniform(0.2, 1.5)))
    network = GaitNetwork(canonical, paced, SCALE)
    if graph == 'directed':
        rng.random(len(LEGS))                        # once phases; what is drawn next stays so
        _couple(network, graph_from_edges(len(LEGS), random_edges(len(LEGS), rng), gain,
                                          network.gait.phases))
    plain = InhibitionParameters(inhibited_legs=(leg,), region_radius=region * radius)
    omega = operating_range(network, plain, reference).omega[1]
    inhibition = InhibitionParameters(
        inhibited_legs=(leg,), region_radius=region * radius,
        inhibition_gain=share * len(LEGS) * omega * radius / (region * radius))
    running = Setting.of(network, SuiteParameters(
        inhibition=inhibition, reference=reference), TICK)
    certificate = certify(running, required_only=True)
    gains = inhibition.armed_gains
    free = synchronisation(network.system.graph, rho)
    omegas = omega * (1.0 - _own_frequencies(network.system, omega, gains, free, inhibition, rng))
    setting = network_batch.Setting(network.system, omegas, gains, inhibition.region_radius, graph)
    eigenvalues = np.linalg.eigvals(network.system.graph.block_laplacian()).real
    return Case(running, setting, certificate, free,
                bool(np.sort(eigenvalues)[len(LEGS)] > rho),
                certificate['contraction'].right > rho)


def random_setting(rng: np.random.Generator) -> Setting:
    """Draw a setting on any graph, with weights, one to four inhibited legs and a tick of 1 to
    10 ms, whose gains may or may not do.
    """
    some = partial(log_uniform, rng)
    radius, growth = some(0.3, 1.6), some(0.5, 30.0)
    gain, graph = growth * some(1.5, 60.0), str(rng.choice([*GRAPHS, 'directed', 'cascade']))
    canonical = CanonicalParameters(
        rho=growth / radius**2, radius=radius, coupling_gain=gain,
        coupling_graph='ring' if graph in ('directed', 'cascade') else graph)
    paced = some(0.25, 3.0)
    network = GaitNetwork(canonical, GAITS[str(rng.choice(list(GAITS)))].scaled(paced), SCALE)
    edges: Edges = {'directed': random_edges(len(LEGS), rng),
                    'cascade': ((0, 1), (1, 0), (2, int(rng.integers(2))), (2, 3), (3, 2))}.get(
                        graph) or topology(graph, len(LEGS))
    weights = gain * np.exp(rng.uniform(-0.7, 0.7, len(edges)) * rng.integers(2))
    _couple(network, graph_from_edges(len(LEGS), edges, weights, network.gait.phases))
    reference = ReferenceParameters(max_speed=some(0.1, 2.0), alpha_r=some(1.0, 6.0))
    legs = tuple(LEGS[leg] for leg in rng.permutation(len(LEGS))[:rng.integers(1, 5)])
    region = radius * some(0.05, 1.0)
    plain = InhibitionParameters(inhibited_legs=legs, region_radius=region)
    omega = operating_range(network, plain, reference).omega[1]
    inhibition = InhibitionParameters(
        inhibited_legs=legs, region_radius=region, capture_speed=some(0.02, 0.5),
        inhibition_gain=some(0.7, 6.0) * len(LEGS) * omega * radius / region / len(legs))
    leg = LegParameters(stiffness=some(400.0, 2e4), damping=some(20.0, 400.0),
                        activity_rate=some(5.0, 40.0), clearance=float(rng.uniform(0.0, 0.4)))
    return Setting.of(network, SuiteParameters(
        inhibition=inhibition, reference=reference, leg=leg), float(rng.uniform(0.001, 0.01)))


def _couple(network: GaitNetwork, graph: CouplingGraph) -> None:
    """Give the oscillators of a gait another graph."""
    network.system = CanonicalSystem(graph, network.system.oscillators, network.system.target)


def _own_frequencies(system: CanonicalSystem, omega: float, gains: Array, free: Synchronisation,
                     inhibition: InhibitionParameters, rng: np.random.Generator) -> Array:
    """Shares by which legs turn slower than ω, so unequal that they are still in their places
    within what capture allows; none where nothing is known.
    """
    if not free.synchronises or free.weights is None:
        return np.zeros(len(LEGS))
    allowed = 0.5 * capture_set(system, omega, gains, inhibition.region_radius).tolerance
    share = LARGEST_MISMATCH
    while share > 1e-4 and not mismatch_bound(
            free, system.rho[0], system.radius[0], share * omega).distance <= allowed:
        share *= 0.5
    return rng.uniform(0.0, share, len(LEGS)) if share > 1e-4 else np.zeros(len(LEGS))
