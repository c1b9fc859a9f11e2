# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is proved of the step that runs holds for the program's own step."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from core_examples import TICK, network, suite_parameters

from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.inequality import STEP_ROWS, Certificate
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.contraction.hopf_bounds import largest_radial, largest_shifted
from dmp_cpg_ros.core.maths.exponential import ExponentialStep
from dmp_cpg_ros.core.maths.step_comparison import StepComparison
from dmp_cpg_ros.core.voting.parameters import VotingParameters
from dmp_cpg_ros.studies.adversary_steps import (
    Analysed,
    Complex,
    analysed,
    as_states,
    disagreement,
    in_box,
    locked_step,
)
from dmp_cpg_ros.studies.certificate_settings import random_setting


def settings() -> list[Analysed]:
    """The suite's defaults on every graph, and random settings whose step is proved."""
    p = suite_parameters()
    found = [analysed(Setting.of(network('amble', coupling_graph=graph, **changes), p, tick))
             for graph in ('all_to_all', 'ring', 'path', 'star', 'directed_ring')
             for changes, tick in (({}, TICK), ({'coupling_gain': 60.0}, 0.01))]
    rng = np.random.default_rng(0)
    while len(found) < 40:
        setting = random_setting(rng)
        if certify(setting, required_only=True).holds:
            found.append(analysed(setting))
    assert sum(one.proved for _, _, one in found) >= 36
    return [one for one in found if one[2].proved]


SETTINGS = settings()


def test_the_polynomials_are_the_steps_matrices() -> None:
    rng = np.random.default_rng(1)
    for _ in range(40):
        L = -rng.random((3, 3)) * 100.0
        np.fill_diagonal(L, 0.0)
        M = L - np.diag(L.sum(axis=1)) + np.diag(rng.uniform(0.0, 300.0, 3))
        kappa, omega, h = rng.uniform(0.0, 30.0), rng.uniform(0.0, 40.0), rng.uniform(1e-3, 8e-3)
        at = omega * rng.uniform(-1.0, 1.0)
        block = -np.kron(M, np.eye(2))
        q = np.kron(np.eye(3), np.array([[-kappa, at], [-at, -kappa]]))
        step = ExponentialStep(block, np.zeros(6), h)
        whole = np.stack([step(e, lambda y, q=q: q @ y) for e in np.eye(6)], axis=1)
        pieces = whole.reshape(3, 2, 3, 2)
        modulus = np.hypot(pieces[:, 0, :, 0], pieces[:, 0, :, 1])
        compared = StepComparison(M, h)
        bound = compared.moduli(kappa, omega)
        assert np.all(modulus <= bound.T * (1.0 + 1e-12))
        assert np.all(modulus >= 0.95 * bound.T)
        norm = compared.norms(kappa, omega).T[0, 0]
        assert 0.95 * norm <= np.linalg.norm(whole, 2) <= norm * (1.0 + 1e-12)


def test_bounds_of_the_oscillator_are_attained() -> None:
    rng = np.random.default_rng(2)
    rho, r = 3.0, 1.4
    for u in r * np.array([0.02, 0.3, 0.9, 1.3, 2.0]):
        e = u * np.sqrt(rng.random(200_000)) * np.exp(2j * np.pi * rng.random(200_000))
        y = r + e
        kept = np.abs(y) <= 1.1 * r
        shifted = np.abs(2.0 * rho * r**2 * e + rho * (r**2 - np.abs(y)**2) * y)[kept].max()
        bound = float(largest_shifted(rho, r, np.array(u), 1.1 * r))
        assert (0.9 if u < 1.4 * r else 0.8) * bound <= shifted <= bound
    size = np.linspace(0.0, 1.3 * r, 10_000)
    for farthest in (r, 1.3 * r):
        s = size[size <= farthest]
        largest = np.abs(rho * (r**2 - s**2) * s).max()
        assert largest == pytest.approx(largest_radial(rho, r, farthest), rel=1e-3)


@pytest.mark.parametrize('k', range(len(SETTINGS)))
def test_no_step_leaves_the_box_and_the_disc(k: int) -> None:
    s, analysis, found = SETTINGS[k]
    rng, gains = np.random.default_rng(k), analysis.capture.gains
    r = s.network.parameters.radius
    y, omega = in_box(s, found, rng, 120), s.span.omega[1] * rng.choice([1.0, rng.random()])
    assert np.all(found.distance >= analysis.capture.distance - 1e-12)
    for _ in range(4):
        y = locked_step(s, y, omega, gains, found.step_s)
        far = np.abs(y - r)
        assert np.all(far <= found.distance * (1.0 + 1e-9))
        assert far[:, gains > 0.0].max() <= (
            found.farthest * s.parameters.inhibition.region_radius * (1.0 + 1e-9))
        assert np.abs(y).max() <= found.disc * (1.0 + 1e-9)
    free = found.disc * np.exp(2j * np.pi * rng.random((60, 4))) * np.sqrt(rng.random((60, 4)))
    assert np.abs(locked_step(s, free, 2.5 * omega, 0.0 * gains, found.step_s)).max() <= (
        found.disc * (1.0 + 1e-9))


@pytest.mark.parametrize('k', range(len(SETTINGS)))
def test_steps_take_states_of_the_box_together_and_to_rest(k: int) -> None:
    s, analysis, found = SETTINGS[k]
    rng, gains, h = np.random.default_rng(k), analysis.capture.gains, found.step_s
    omega, system = float(s.span.omega[1] * rng.random()), s.network.system

    def rates(y: Complex) -> np.ndarray:
        return np.array([np.linalg.norm(system.field(as_states(s, one), omega, gains), axis=1)
                         for one in y])

    y, z = in_box(s, found, rng, 60), in_box(s, found, rng, 60)
    z[::2] = y[::2] + 1e-3 * (z - y)[::2]
    y_1, z_1 = (locked_step(s, one, omega, gains, h) for one in (y, z))
    assert np.all(np.abs(y_1 - z_1) <= np.abs(y - z) @ found.differences.T + 1e-12)
    moved, still = found.rates
    assert np.all(np.abs(y_1 - y) <= rates(y) @ found.moved.T + 1e-12)
    assert np.all(rates(y_1) <= np.abs(y_1 - y) @ moved.T + rates(y) @ still.T + 1e-9)
    slower = locked_step(s, y, 0.9 * omega, gains, h)
    off = 0.1 * omega * s.network.parameters.radius
    assert np.all(np.abs(slower - y_1) <= off * found.forced + 1e-12)


@pytest.mark.parametrize('k', [k for k, (_, analysis, _) in enumerate(SETTINGS)
                               if analysis.found.weights is not None])
def test_steps_of_free_legs_shrink_their_disagreement(k: int) -> None:
    s, analysis, found = SETTINGS[k]
    rng, xi = np.random.default_rng(k), analysis.found.weights
    size = found.disc * rng.random((60, 4)) ** rng.choice([0.3, 8.0], (60, 1))
    y = size * np.exp(1j * (rng.normal(size=(60, 4)) * rng.choice([0.1, 3.0], (60, 1))))

    after = locked_step(s, y, float(s.span.omega[1]), np.zeros(4), found.step_s)
    assert np.all(disagreement(after, xi) <= disagreement(y, xi) * math.exp(
        -found.locking * found.step_s) * (1.0 + 1e-9))


def test_a_vanishing_tick_gives_the_rates_of_the_equation() -> None:
    p = suite_parameters()
    _, analysis, fine = analysed(Setting.of(network(), p, 2e-5))
    _, _, coarse = analysed(Setting.of(network(), p, TICK))
    np.testing.assert_allclose(fine.distance, analysis.capture.distance, rtol=1e-3)
    needed = analysis.capture.needed_gain[0] / analysis.capture.gains[0]
    # a node at the edge of C moves inwards at (1 - needed) of what inhibition alone does
    assert (1.0 - fine.farthest) / (2e-5 * analysis.capture.gains[0]) == pytest.approx(
        1.0 - needed, rel=0.05)
    assert fine.locking == pytest.approx(analysis.found.rate, rel=1e-3)
    assert coarse.approach < fine.approach and coarse.locking < fine.locking


def test_votes_and_unequal_frequencies_still_rest_on_what_is_sampled() -> None:
    p = suite_parameters()

    def certificate(voting: bool, **canonical: object) -> Certificate:
        return certify(Setting.of(network('amble', **canonical), replace(
            p, voting=VotingParameters(voting=voting)), TICK))

    plain = certificate(False)
    assert plain.sampled == () and not plain['time_step'].required
    assert plain['capture'].proved and all(plain[row].required for row in STEP_ROWS)
    for other in (certificate(True), certificate(False, contact_feedback=True)):
        assert 'time_step' in other.sampled and not any(other[row].required for row in STEP_ROWS)
        assert other['capture'].grade == 'continuous' and other['capture'].required


def test_a_step_that_is_not_proved_is_not_required_to_be() -> None:
    p = suite_parameters()
    coarse = certify(Setting.of(
        network('amble', rho=60.0, coupling_gain=400.0, coupling_graph='path'),
        replace(p, inhibition=replace(p.inhibition, inhibition_gain=2000.0)), TICK))
    assert not all(coarse[row].holds for row in STEP_ROWS)
    assert coarse['time_step'].required and not any(coarse[row].required for row in STEP_ROWS)
    assert 'time_step' in coarse.sampled and coarse['capture'].grade == 'continuous'
