# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Coupled oscillators: field, Jacobian, time step, locking and stopping."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import GAITS, TICK, differences, network
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import phase, state_at, wrapped
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.parameters import range_of

FREE = Inhibition(False, np.zeros(4), 0.3)
NAMES = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')


def system(name: str = 'all_to_all', size: int = 4, k: float = 50.0, seed: int = 0,
           rho: float = 8.0) -> CanonicalSystem:
    rng = np.random.default_rng(seed)
    phases = rng.uniform(-np.pi, np.pi, size)
    graph = graph_from_edges(size, topology(name, size), k, phases)
    oscillators = AndronovHopf(rho, rng.uniform(0.8, 1.2, size))
    return CanonicalSystem(graph, oscillators, state_at(phases))


def classical(of: CanonicalSystem, x: np.ndarray, omega: float, gains: np.ndarray,
              duration: float, steps: int) -> np.ndarray:
    """The classical Runge-Kutta method, to compare with."""
    h = duration / steps
    for _ in range(steps):
        a = of.field(x, omega, gains)
        b = of.field(x + 0.5 * h * a, omega, gains)
        c = of.field(x + 0.5 * h * b, omega, gains)
        x = x + h / 6.0 * (a + 2.0 * b + 2.0 * c + of.field(x + h * c, omega, gains))
    return x


@pytest.mark.parametrize('name', NAMES)
@given(seed=st.integers(0, 1000), size=st.integers(2, 6))
@settings(max_examples=25)
def test_field_is_the_sum_that_the_paper_prints(name: str, seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    of, x = system(name, size, seed=seed), rng.normal(size=(size, 2))
    omega, gains = rng.normal(size=size), rng.uniform(0.0, 100.0, size)
    expected = np.array([
        AndronovHopf(8.0, float(of.radius[i])).field(x[i], omega[i])
        + gains[i] * (of.target[i] - x[i]) for i in range(size)])
    for (i, j), K in zip(of.graph.edges, of.graph.gains, strict=True):
        seen = state_at(phase(x[j]) + of.graph.phases[i] - of.graph.phases[j], np.hypot(*x[j]))
        expected[i] += K @ (seen - x[i])
    assert np.allclose(of.field(x, omega, gains), expected)


@pytest.mark.parametrize('name', NAMES)
@given(seed=st.integers(0, 1000))
@settings(max_examples=25)
def test_jacobian_against_differences(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    of, x = system(name, seed=seed), rng.normal(size=(4, 2))
    omega, gains = rng.normal(size=4), rng.uniform(0.0, 100.0, 4)
    expected = differences(
        lambda at: of.field(at.reshape(4, 2), omega, gains).ravel(), x.ravel())
    assert np.allclose(of.jacobian(x, omega, gains), expected, atol=1e-5)


def test_the_step_converges_with_order_three() -> None:
    of, x0 = system(k=20.0), np.random.default_rng(3).normal(size=(4, 2))
    gains = np.array([100.0, 0.0, 0.0, 0.0])
    exact = classical(of, x0, 9.0, gains, 0.256, 4096)

    def error(steps: int) -> float:
        x = x0
        for _ in range(steps):
            x = of.step(x, 9.0, gains, 0.256 / steps)
        return float(np.abs(x - exact).max())

    assert error(64) < 1e-4  # at ticks of 4 ms
    errors = [error(steps) for steps in (512, 1024, 2048)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((orders > 2.8) & (orders < 3.2)), orders


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('gain', [3e2, 1e3, 1e4])
def test_the_step_is_stable_at_stiff_gains(name: str, gain: float) -> None:
    of = system(name, k=gain)
    x = np.random.default_rng(1).normal(size=(4, 2))
    x *= np.minimum(1.0, 2.0 / np.hypot(*x.T))[:, None]
    gains = np.array([gain, 0.0, 0.0, 0.0])
    for _ in range(2000):
        x = of.step(x, 15.0, gains, TICK)
        assert np.all(np.hypot(*x.T) < 3.0)
    assert np.abs(of.field(x, 15.0, gains)).max() < 1e-6 * gain
    assert np.abs(of.step(x, 15.0, gains, TICK) - x).max() < 1e-11


@pytest.mark.parametrize('gait', GAITS)
@given(seed=st.integers(0, 1000))
@settings(max_examples=5)
def test_legs_lock_in_the_places_of_their_gait(gait: str, seed: int) -> None:
    of, r = network(gait), np.array([0.5, 0.0, 0.0])
    x = np.random.default_rng(seed).normal(size=(4, 2))
    for _ in range(400):
        x = of.step(x, r, FREE, TICK)
    assert np.abs(of.phase_errors(x)).max() < 1e-3
    assert np.allclose(np.hypot(*x.T), 1.0, atol=1e-3)
    turned = wrapped(phase(of.step(x, r, FREE, TICK)) - phase(x))
    assert np.allclose(turned, of.omega(r) * TICK, rtol=1e-3)


@pytest.mark.parametrize('leg', range(4))
@pytest.mark.parametrize('gait', ['amble', 'trot'])
def test_inhibition_of_any_one_oscillator_stops_all(gait: str, leg: int) -> None:
    of, gains = network(gait), np.where(np.arange(4) == leg, 400.0, 0.0)
    inhibition, x, r = Inhibition(True, gains, 0.3), of.locked_state(1.0), np.zeros(3)
    for _ in range(1000):
        x = of.step(x, r, inhibition, TICK)
    assert np.abs(of.rate(x, r, inhibition)).max() < 1e-9
    held = np.hypot(*(x - of.system.target)[leg])
    assert held < 0.3
    # a follower rests about atan(omega / 4k) ahead of its place, the held one less
    lag = wrapped(phase(x) - of.gait.phases)
    followers = np.delete(lag, leg)
    assert np.allclose(followers, followers[0], atol=1e-6) and followers[0] > lag[leg] > 0.0


def test_without_enough_gain_the_state_leaks_out_of_the_region() -> None:
    """Contraction is not capture: with k_inh well below N omega r / r0 the gait goes on."""
    of, r = network('amble'), np.zeros(3)
    weak = 0.4 * 4.0 * of.omega(r) / 0.3
    inhibition, x = Inhibition(True, np.array([weak, 0.0, 0.0, 0.0]), 0.3), of.locked_state(1.0)
    turned = 0.0
    for _ in range(2000):
        following = of.step(x, r, inhibition, TICK)
        turned += float(wrapped(phase(following[1]) - phase(x[1])))
        x = following
    assert turned > 4.0 * np.pi


def test_rest_state_is_an_equilibrium_inside_the_region() -> None:
    of, inhibition = network('amble'), Inhibition(True, np.array([400.0, 0, 0, 0]), 0.3)
    x = of.rest_state(inhibition)
    assert np.abs(of.rate(x, np.zeros(3), inhibition)).max() < 1e-9
    assert np.any(inhibition.acting_gains(x, of.system.target))


@pytest.mark.parametrize('gain', [400.0, 20.0])
def test_rest_state_is_where_all_steps_lead(gain: float) -> None:
    """To the last digit, which in a trot goes back and forth, and without rest where it breaks
    free.
    """
    of, inhibition = network('trot'), Inhibition(True, np.array([gain, 0, 0, 0]), 0.3)
    x = of.locked_state()
    for number in range(2000):
        if number in (1000, 1001):
            duration = number * TICK
            assert np.array_equal(of.rest_state(inhibition, TICK, duration), x)
        x = of.step(x, np.zeros(3), inhibition, TICK)
    assert np.array_equal(of.rest_state(inhibition, TICK, 2000 * TICK), x)


def test_phase_errors_do_not_see_a_common_phase() -> None:
    of = network('walk')
    for phi in (-3.0, 0.1, 2.5):
        assert np.abs(of.phase_errors(of.locked_state(phi))).max() < 1e-12


def test_as_many_oscillators_as_nodes() -> None:
    graph = graph_from_edges(3, topology('ring', 3), 1.0)
    with pytest.raises(ParameterError, match='3 nodes need one radius or 3, not 2'):
        CanonicalSystem(graph, AndronovHopf(1.0, np.ones(2)))


def test_every_coupling_gain_that_is_allowed_couples() -> None:
    weakest = range_of(CanonicalParameters, 'coupling_gain')[0]
    assert network(coupling_gain=weakest).system.graph.gains.any()
    with pytest.raises(ParameterError, match='coupling_gain.*outside its range'):
        network(coupling_gain=0.0)
