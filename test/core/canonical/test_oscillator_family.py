# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A family of oscillators from outside of the package, coupled and inhibited like the paper's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from core_examples import GAITS, differences, quadruped

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import phase, phase_generator, state_at, wrapped
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.gait.running import RunningGait
from dmp_cpg_ros.core.transformation.leg import body_scale

PHASES, OMEGA, TICK = -2.0 * np.pi * np.array([0.0, 0.5, 0.75, 0.25]), 9.0, 0.004


@dataclass(frozen=True)
class Conical:
    """ẋ = ω S x + σ (1 − |x|/r) x: a radius that recovers evenly, at the rate σ."""

    sigma: float = 6.0
    radius: float = 1.3

    def field(self, x: np.ndarray, omega: float | np.ndarray) -> np.ndarray:
        growth = self.sigma * (1.0 - np.linalg.norm(x, axis=-1) / self.radius)
        return (np.broadcast_to(omega, len(x))[:, None] * (x @ phase_generator().T)
                + growth[:, None] * x)

    def jacobian(self, x: np.ndarray, omega: float | np.ndarray) -> np.ndarray:
        size = np.linalg.norm(x, axis=-1)[:, None, None]
        return (np.broadcast_to(omega, len(x))[:, None, None] * phase_generator()
                + self.sigma * (1.0 - size / self.radius) * np.eye(2)
                - self.sigma / (self.radius * size) * x[:, :, None] * x[:, None, :])


@dataclass(frozen=True)
class VanDerPol:
    """ẋ₁ = ω x₂, ẋ₂ = −ω x₁ + μ (1 − x₁²) x₂: no circle, and no symmetry under rotations."""

    mu: float = 1.0
    radius: float = 2.0

    def field(self, x: np.ndarray, omega: float | np.ndarray) -> np.ndarray:
        x1, x2 = x.T
        return np.stack([omega * x2, self.mu * (1.0 - x1**2) * x2 - omega * x1], axis=-1)

    def jacobian(self, x: np.ndarray, omega: float | np.ndarray) -> np.ndarray:
        x1, x2 = x.T
        zero, frequency = np.zeros(len(x)), np.broadcast_to(omega, len(x))
        return np.array([[zero, frequency], [-frequency - 2.0 * self.mu * x1 * x2,
                                             self.mu * (1.0 - x1**2)]]).transpose(2, 0, 1)


def system(family: Conical | VanDerPol) -> CanonicalSystem:
    phases = PHASES if isinstance(family, Conical) else np.zeros(4)
    return CanonicalSystem(graph_from_edges(4, topology('ring', 4), 60.0, phases), family,
                           state_at(phases, family.radius))


def run(of: CanonicalSystem, x: np.ndarray, gains: np.ndarray, seconds: float) -> np.ndarray:
    for _ in range(round(seconds / TICK)):
        x = of.step(x, OMEGA, gains, TICK)
    return x


@pytest.mark.parametrize('family', [Conical(), VanDerPol()])
def test_field_and_jacobian_of_the_network_belong_together(family: Conical | VanDerPol) -> None:
    rng, of = np.random.default_rng(0), system(family)
    x, gains = rng.normal(size=(4, 2)), rng.uniform(0.0, 50.0, 4)
    numeric = differences(lambda at: of.field(at.reshape(4, 2), OMEGA, gains).ravel(), x.ravel())
    assert np.allclose(of.jacobian(x, OMEGA, gains), numeric, atol=1e-5)


def test_coupling_brings_it_to_its_places_on_its_own_cycle() -> None:
    of = system(Conical())
    x = run(of, np.random.default_rng(1).normal(size=(4, 2)), np.zeros(4), 4.0)
    assert np.allclose(np.linalg.norm(x, axis=1), 1.3, atol=1e-3)
    assert np.allclose(wrapped(phase(x) - phase(x)[0] - PHASES), 0.0, atol=1e-6)


def test_van_der_pol_oscillators_agree_and_go_round() -> None:
    x = run(system(VanDerPol()), np.random.default_rng(2).normal(size=(4, 2)), np.zeros(4), 6.0)
    assert np.allclose(x, x[0], atol=1e-6)
    turns = [float(run(system(VanDerPol()), x, np.zeros(4), t)[0, 0]) for t in
             np.linspace(0.0, 2.0 * np.pi / OMEGA, 8)]
    assert max(turns) > 1.0 and min(turns) < -1.0


@pytest.mark.parametrize('family', [Conical(), VanDerPol()])
def test_inhibition_of_one_brings_all_to_rest(family: Conical | VanDerPol) -> None:
    of = system(family)
    inhibition = Inhibition(True, np.array([800.0, 0.0, 0.0, 0.0]), 0.3 * family.radius)
    x = run(of, np.random.default_rng(3).normal(size=(4, 2)), np.zeros(4), 2.0)
    for _ in range(1500):
        x = of.step(x, OMEGA, inhibition.acting_gains(x, of.target), TICK)
    gains = inhibition.acting_gains(x, of.target)
    assert gains[0] > 0.0 and np.abs(of.field(x, OMEGA, gains)).max() < 1e-6


def test_a_certificate_says_that_it_knows_no_bound() -> None:
    with pytest.raises(ParameterError, match='no bounds are known of Conical'):
        _ = system(Conical()).rho


@dataclass(frozen=True)
class ConicalParameters(CanonicalParameters):
    """Canonical parameters of a robot that walks on the family above."""

    @property
    def oscillators(self) -> Conical:
        return Conical(self.rho, self.radius)


def test_a_gait_runs_changes_and_stops_on_it() -> None:
    block = RunningGait(ConicalParameters(), body_scale(quadruped()), KnownGaits(GAITS))
    state = block.initial_state(GAITS['amble'], InhibitionParameters(start_inhibited=False))
    free, r = Inhibition(False, np.zeros(4), 0.3), np.array([0.4, 0.0, 0.0])
    state = block.want(state, 'trot')
    for _ in range(1500):
        state = block.step(state, r, free, TICK)
    assert state.gait is GAITS['trot']
    assert np.abs(block.network(state.gait).phase_errors(state.x)).max() < 1e-6
    held = Inhibition(True, InhibitionParameters().armed_gains, 0.3)
    for _ in range(1500):
        state = block.step(state, np.zeros(3), held, TICK)
    assert np.abs(state.x_dot).max() < 1e-6
