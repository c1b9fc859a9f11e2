# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The explicit steps of large networks: order, region of stability, equilibria, stiff gains."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.paper.network import (
    EdgeCoupling,
    MeanFieldCoupling,
    OscillatorNetwork,
    chebyshev_stages,
    chebyshev_step,
    contractive_stages,
    contractive_step,
)
from dmp_cpg_ros.paper.oscillators import HopfOscillators, VanDerPolOscillators

METHODS = {'chebyshev': chebyshev_step, 'contractive': contractive_step}


def growth(method: str, z: complex, stages: int) -> float:
    """Factor by which a step changes the solution of x' = z x."""
    matrix = np.array([[z.real, -z.imag], [z.imag, z.real]])
    return float(np.linalg.norm(METHODS[method](lambda x: x @ matrix.T, np.array([1.0, 0.0]), 1.0,
                                                stages)))


@given(z=st.floats(0.0, 1e5))
def test_chebyshev_stages_are_stable_along_the_negative_axis(z: float) -> None:
    assert growth('chebyshev', complex(-z, 0.0), chebyshev_stages(1.0, z)) <= 1.0 + 1e-9


@given(radius=st.floats(0.0, 300.0), part=st.floats(0.0, 1.0), angle=st.floats(0.0, 6.3))
def test_contractive_stages_are_stable_in_the_whole_disc(
        radius: float, part: float, angle: float) -> None:
    """The disc of centre -d and radius d, where Gershgorin puts a directed coupling."""
    d = 0.5 * radius
    z = complex(-d + part * d * np.cos(angle), part * d * np.sin(angle))
    assert growth('contractive', z, contractive_stages(1.0, radius)) <= 1.0 + 1e-9


@pytest.mark.parametrize('stages', [2, 3, 5, 20, 100])
@pytest.mark.parametrize('method', METHODS)
def test_the_linear_part_of_the_expansion_is_that_of_the_exponential(
        method: str, stages: int) -> None:
    """1 + z + z^2/2: what remains is of third order."""
    errors = []
    for z in (0.02, 0.01):
        after = METHODS[method](lambda x: -x, np.ones(1), z, stages)[0]
        errors.append(abs(after - np.exp(-z)))
    assert errors[0] / errors[1] == pytest.approx(8.0, rel=0.1)


def network(name: str, gain: float, size: int = 6) -> tuple[OscillatorNetwork, np.ndarray]:
    rng = np.random.default_rng(5)
    phases = rng.uniform(-3.0, 3.0, size)
    coupling = EdgeCoupling(graph_from_edges(size, topology(name, size), gain, phases))
    family = HopfOscillators(size, rng.uniform(4.0, 9.0, size), rng.uniform(2.0, 9.0, size),
                             rng.uniform(0.8, 1.2, size))
    return (OscillatorNetwork(family, coupling, state_at(phases)),
            0.7 * rng.normal(size=(size, 2)))


def after(of: OscillatorNetwork, x: np.ndarray, steps: int, seconds: float) -> np.ndarray:
    for _ in range(steps):
        x = of.step(x, seconds / steps)
    return x


@pytest.mark.parametrize('name', ['ring', 'star', 'directed_ring'])
def test_networks_converge_with_order_two(name: str) -> None:
    of, x = network(name, 10.0)
    exact = after(of, x, 8192, 0.5)
    errors = [np.abs(after(of, x, steps, 0.5) - exact).max() for steps in (128, 256, 512)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((orders > 1.8) & (orders < 2.3)), orders
    assert errors[0] < 1e-3


def test_van_der_pol_networks_converge_with_order_two() -> None:
    graph = graph_from_edges(3, topology('path', 3), np.diag([4.0, 4.0]))
    of = OscillatorNetwork(VanDerPolOscillators(3, [1.0, 1.5, 2.0], 1.0), EdgeCoupling(graph))
    x = np.array([[1.0, 0.0], [0.0, 2.0], [-1.0, 0.5]])
    exact = after(of, x, 8192, 2.0)
    errors = [np.abs(after(of, x, steps, 2.0) - exact).max() for steps in (128, 256, 512)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((orders > 1.8) & (orders < 2.3)), orders


@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'path', 'star', 'directed_ring'])
@pytest.mark.parametrize('gain', [3e2, 1e3, 1e4])
def test_stiff_gains_at_4_ms_are_stable(name: str, gain: float) -> None:
    of, x = network(name, gain)
    gains = np.zeros(6)
    gains[0] = gain
    for _ in range(500):
        x = of.step(x, 0.004, gains)
        assert np.hypot(*x.T).max() < 3.0
    assert np.abs(of.field(x, gains)).max() < 1e-6 * gain  # it came to rest


@pytest.mark.parametrize('name', ['ring', 'directed_ring'])
def test_an_equilibrium_of_the_field_is_one_of_the_step(name: str) -> None:
    of, x = network(name, 50.0)
    gains = np.where(np.arange(6) == 2, 400.0, 0.0)
    for _ in range(3000):
        x = of.step(x, 0.01, gains)
    assert np.abs(of.field(x, gains)).max() < 1e-9
    for dt in (0.001, 0.02):
        assert np.abs(of.step(x, dt, gains) - x).max() < 1e-11


def test_thousands_of_oscillators_lock() -> None:
    size = 2000
    rng = np.random.default_rng(1)
    family = HopfOscillators(size, rng.uniform(6.0, 6.5, size))
    of = OscillatorNetwork(family, MeanFieldCoupling(size, 20.0 / size))
    x = state_at(rng.uniform(-3.0, 3.0, size))
    for _ in range(500):
        x = of.step(x, 0.004)
    z = x.view(complex)[:, 0]
    assert abs(np.mean(z / np.abs(z))) > 0.99
