# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Smallest values that work, by simulation and bisection; certificates are compared with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.graph import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation_complement
from dmp_cpg_ros.core.gait.gait import BodyScale
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.gait.running import RunningGait
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor, predict
from dmp_cpg_ros.core.reference.filter import ReferenceSystem
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.suite import load_gait

Array = NDArray[np.float64]

SIZE = 4
STEP = 0.005  # [s]


def network(graph: str, coupling: float, rho: float) -> CanonicalSystem:
    """Four oscillators of radius 1 on a named graph, with the places of an amble."""
    phases = -2.0 * np.pi * np.array([0.0, 0.5, 0.75, 0.25])
    edges = topology(graph, SIZE)
    return CanonicalSystem(graph_from_edges(SIZE, edges, coupling, phases), AndronovHopf(rho),
                           state_at(phases))


def threshold(works: Callable[[float], bool], failing: float, working: float,
              precision: float = 0.01) -> float:
    """Value at which something begins to work, by bisection between two positive ones.

    Parameters
    ----------
    works : callable
        float → bool.
    failing, working : float
        Values on either side, in either order; they are moved apart until they are.
    precision : float
        Relative precision.

    Returns
    -------
    float
        The last value that worked.
    """
    factor = 2.0 if working > failing else 0.5
    for _ in range(12):
        if works(working):
            break
        failing, working = working, working * factor
    for _ in range(12):
        if not works(failing):
            break
        failing /= factor
    while abs(np.log(working / failing)) > precision:
        middle = float(np.sqrt(working * failing))
        failing, working = (failing, middle) if works(middle) else (middle, working)
    return working


def _in_phase(system: CanonicalSystem, x: Array) -> NDArray[np.complex128]:
    """States (4, 2) as complex numbers that are equal when every leg is in its place."""
    return np.asarray((x[:, 0] - 1j * x[:, 1]) * np.exp(-1j * system.graph.phases))


def synchronises(graph: str, coupling: float, rho: float, omega: float) -> bool:
    """Whether disagreement dies out from the state in which coupling is weakest.

    Near the origin, where the oscillators grow apart fastest, in the eigenvector of the smallest
    eigenvalue that counts.
    """
    system = network(graph, coupling, rho)
    L, V = system.graph.block_laplacian(), synchronisation_complement(SIZE)
    weakest = V.T @ np.linalg.eigh(V @ (L + L.T) @ V.T)[1][:, 0]
    z = 1e-6 * (weakest[0::2] - 1j * weakest[1::2]) * np.exp(1j * system.graph.phases)
    x = np.stack([z.real, -z.imag], axis=1)
    for _ in range(600):
        x = system.step(x, omega, np.zeros(SIZE), 0.5 * STEP)
    z = _in_phase(system, x)
    return bool(np.linalg.norm(z - z.mean()) < 1e-6)


def stops(system: CanonicalSystem, omega: float, gains: Array, region_radius: float,
          seconds: float = 4.0, phases: int = 3) -> bool:
    """Whether switched inhibition brings the locked gait to rest, from several phases."""
    vote = Inhibition(True, gains, region_radius)
    for phi in np.linspace(1.0, 1.0 + 2.0 * np.pi, phases, endpoint=False):
        x = state_at(phi + system.graph.phases)
        for _ in range(round(seconds / STEP)):
            x = system.step(x, omega, vote.acting_gains(x, system.target), STEP)
        acting = vote.acting_gains(x, system.target)
        moving = np.abs(system.field(x, omega, acting)).max()
        if not np.array_equal(acting, gains) or moving > 1e-2 * omega:
            return False
    return True


def stays_together(system: CanonicalSystem, omega: float, mismatch: float,
                   phase_spread: float) -> bool:
    """Whether phases stay within a spread for every choice of signs of the mismatch."""
    for signs in product((1.0, -1.0), repeat=SIZE - 1):
        omegas = omega + mismatch * np.array([1.0, *signs])
        x = state_at(system.graph.phases)
        for _ in range(300):
            x = system.step(x, omegas, np.zeros(SIZE), STEP)
        z = _in_phase(system, x)
        if np.ptp(np.angle(z / z[0])) > phase_spread:
            return False
    return True


def stop_times(graph: str, phases: int = 12) -> tuple[float, float]:
    """Bound on the time to rest of the default amble, and its slowest stop at the highest speed.

    Returns
    -------
    bound, slowest : float
        [s]
    """
    p, tick = SuiteParameters(), 0.004
    gait, coupled = load_gait('amble'), CanonicalParameters(coupling_graph=graph)
    canonical = RunningGait(coupled, BodyScale(0.28, 0.22), KnownGaits({gait.name: gait}))
    network = canonical.network(gait)
    bound = certify(network, p.inhibition, p.reference, p.leg, p.posture, tick).time_to_rest
    supervisor = GaitSupervisor(p.inhibition, p.voting, p.leg.activity_rate)
    fastest = np.array([p.reference.max_speed, p.reference.max_lateral_speed,
                        p.reference.max_turn_rate])
    walking = replace(supervisor.initial_state(), state='walking', requested=False, armed=False,
                      automatic=False, activity=np.ones(SIZE))
    published = supervisor.inhibition(walking)
    start = canonical.initial_state(gait, replace(p.inhibition, start_inhibited=False))
    slowest = max(
        predict(supervisor, ReferenceSystem(p.reference), canonical,
                supervisor.request(walking, True), published,
                replace(start, x=network.locked_state(float(phi))), fastest, (0.0, 0.0, 0.0), tick)
        for phi in np.linspace(0.0, 2.0 * np.pi, phases, endpoint=False))
    return bound, slowest


def keeps_walking(system: CanonicalSystem, omega: float, step: float) -> bool:
    """Whether a perturbed network still comes to its limit cycle with this time step."""
    rng = np.random.default_rng(0)
    x = state_at(system.graph.phases) + 0.3 * rng.normal(size=(SIZE, 2))
    with np.errstate(over='ignore', invalid='ignore'):
        for _ in range(600):
            x = system.step(x, omega, np.zeros(SIZE), step)
        z = _in_phase(system, x)
        return bool(np.abs(z - z[0]).max() < 1e-6 and np.all(np.abs(np.abs(z) - 1.0) < 0.2))
