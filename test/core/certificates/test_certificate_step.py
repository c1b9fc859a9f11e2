# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The longest step: what decays in the equations decays in the integration, whatever the gains."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.step import (
    LARGEST_MILD_STEP,
    STEP_ERROR,
    cycle_radius_error,
    longest_step,
)
from dmp_cpg_ros.core.contraction.capture import capture_set
from dmp_cpg_ros.core.contraction.hopf_bounds import mild_rate
from dmp_cpg_ros.core.contraction.inhibited import inhibited_contraction
from dmp_cpg_ros.core.maths.exponential import ExponentialStep


def amplification(z: float, w: complex) -> float:
    """|x(h)| for ẋ = (z + w) x / h from |x| = 1 by the program's own step, z exact and w mild."""
    step = ExponentialStep(z * np.eye(2), np.zeros(2), 1.0)
    turn = np.array([[w.real, -w.imag], [w.imag, w.real]])
    return float(np.linalg.norm(step(np.array([1.0, 0.0]), lambda x: turn @ x)))


def test_decay_by_more_than_the_steps_error_is_decay_of_the_step() -> None:
    stiff = -np.concatenate([[0.0], np.logspace(-4.0, 4.0, 60)])
    worst = 0.0
    for s in (0.05, 0.2, 0.5, 1.0, LARGEST_MILD_STEP):
        for angle in np.linspace(0.0, np.pi, 37):
            w = s * np.exp(1j * angle)
            # Exactly at the promised decay, where the exact part makes up for the mild one.
            edge = -w.real - 1.001 * STEP_ERROR * s**4
            for z in [edge, *stiff[stiff < edge]] if edge <= 0.0 else stiff:
                worst = max(worst, amplification(float(z), w))
    assert worst <= 1.0


@pytest.mark.parametrize(('rho', 'radius', 'omega'), [(8.0, 1.0, 13.0), (2.0, 2.0, 25.0)])
def test_the_mild_rate_bounds_the_jacobian_of_the_mild_part(rho: float, radius: float,
                                                            omega: float) -> None:
    oscillator, bound = AndronovHopf(rho, radius), mild_rate(rho, radius, omega)
    rng = np.random.default_rng(0)
    largest = 0.0
    for _ in range(500):
        x = rng.normal(size=2)
        x *= radius * rng.random() ** 0.2 / np.linalg.norm(x)
        largest = max(largest, np.linalg.norm(oscillator.jacobian(x, omega), 2))
    assert 0.95 * bound < largest <= bound


@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'path', 'star', 'directed_ring'])
@pytest.mark.parametrize('gain', [60.0, 2000.0])
def test_at_the_longest_step_stiff_networks_still_synchronise_and_stop(name: str,
                                                                        gain: float) -> None:
    rho, omega, region = 8.0, 13.0, 0.3
    graph = graph_from_edges(4, topology(name, 4), gain, np.array([0.0, 3.0, 1.5, -1.5]))
    system = CanonicalSystem(graph, AndronovHopf(rho), state_at(graph.phases))
    gains = np.array([0.0, 20.0 * gain + 400.0, 0.0, 0.0])
    capture = capture_set(system, omega, gains, region)
    assert capture.holds
    h = longest_step(rho, 1.0, omega, max(inhibited_contraction(system, capture).rate,
                                          capture.rate))
    rng = np.random.default_rng(1)
    x = rng.normal(size=(4, 2))
    for _ in range(400):
        x = system.step(x, omega, np.zeros(4), h)
    z = (x[:, 0] - 1j * x[:, 1]) * np.exp(-1j * graph.phases)
    assert np.abs(z - z[0]).max() < 1e-6 and np.abs(z[0]) == pytest.approx(1.0, abs=0.1)
    for _ in range(2000):
        inside = np.linalg.norm(x[1] - system.target[1]) <= region
        x = system.step(x, omega, gains * inside, h)
    assert inside and np.abs(system.field(x, omega, gains)).max() < 1e-3


@pytest.mark.parametrize(('rho', 'omega', 'h'), [(1.0, 25.0, 0.02), (8.0, 13.0, 0.04),
                                                 (20.0, 5.0, 0.03)])
def test_the_radius_of_the_integrated_cycle_is_known(rho: float, omega: float, h: float) -> None:
    system = CanonicalSystem(graph_from_edges(4, topology('ring', 4), 100.0), AndronovHopf(rho))
    x = state_at(np.zeros(4))
    for _ in range(round(12.0 / (rho * h))):
        x = system.step(x, omega, np.zeros(4), h)
    error = cycle_radius_error(rho, 1.0, omega, h)
    assert np.abs(np.linalg.norm(x, axis=1) - 1.0) == pytest.approx(error, rel=1e-6)
    assert cycle_radius_error(rho, 1.0, omega, 0.5 * h) < 0.3 * error    # the order shows
    assert cycle_radius_error(rho, 1.0, omega, 1.0) == np.inf


def test_far_beyond_the_longest_step_the_radius_is_lost() -> None:
    limit = longest_step(8.0, 1.0, 13.0, 5.0)
    system = CanonicalSystem(graph_from_edges(4, topology('ring', 4), 100.0), AndronovHopf(8.0))
    x = state_at(np.zeros(4))
    with np.errstate(over='ignore', invalid='ignore'):
        for _ in range(300):
            x = system.step(x, 13.0, np.zeros(4), 5.0 * limit)
    assert not np.all(np.abs(np.linalg.norm(x, axis=1) - 1.0) < 0.2)
    assert longest_step(8.0, 1.0, 13.0, 0.0) == 0.0
