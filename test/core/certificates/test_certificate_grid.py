# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A grid of 2,304 settings through the certificate of the suite and its canonical system.

Whatever is certified synchronises from everywhere at its rate, enters C and never leaves it, and
comes to rest, with legs whose own frequencies differ. What a naive check passes and the
certificate does not is simulated too: among it are settings that fail.
"""

from __future__ import annotations

import json
from collections import Counter

import numpy as np
import pytest
from checkout import ROOT
from contraction_batches import Batch, Setting, locked

from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.inequality import STEP_ROWS
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation_complement
from dmp_cpg_ros.studies.certificate_settings import GRAPHS, TICK, Case, grid
from dmp_cpg_ros.studies.proofs import accepted, attempt

SECONDS = 8.0


def disagreement(case: Case, x: np.ndarray) -> float:
    """(Σ ξ_i |z_i − z̄|²)^½ of one setting's state."""
    z = (x[:, 0] - 1j * x[:, 1]) * np.exp(-1j * case.setting.system.graph.phases)
    weights = case.free.weights
    weights = np.full(len(z), 0.25) if weights is None else weights
    return float(np.sqrt(weights @ np.abs(z - weights @ z)**2))


def synchronised(cases: list[Case], seconds: float, rng: np.random.Generator
                 ) -> tuple[np.ndarray, np.ndarray]:
    """Disagreement of alike oscillators at the start and at the end; every second network starts
    near the origin in the direction that decides, the others anywhere.
    """
    settings = [Setting(s.system, np.full(4, s.omega.max()), s.gains, s.region_radius, s.name)
                for s in (case.setting for case in cases)]
    V = synchronisation_complement(4)
    x = []
    for k, setting in enumerate(settings):
        L = setting.system.graph.block_laplacian()
        worst = V.T @ np.linalg.eigh(V @ (L + L.T) @ V.T)[1][:, 0]
        anywhere = rng.uniform(0.1, 2.0) * rng.normal(size=(4, 2))
        x.append((1e-3 * worst.reshape(4, 2) if k % 2 else anywhere)
                 * setting.system.radius[0])
    start = np.array([disagreement(case, state) for case, state in zip(cases, x, strict=True)])
    batch, states = Batch(settings, 0.001), np.stack(x)
    for _ in range(round(seconds / 0.001)):
        states = batch.step(states, armed=False)
    return start, np.array([disagreement(case, state)
                            for case, state in zip(cases, states, strict=True)])


def stopped(cases: list[Case], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Whether each setting, armed at a random phase, stays in C once there and ends at rest."""
    count = len(cases)
    batch = Batch([case.setting for case in cases], TICK)
    x = np.stack([locked(case.setting, rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.99, 1.0))
                  for case in cases])
    kept, entered, at_rest = np.ones(count, bool), np.zeros(count, bool), np.zeros(count, bool)
    left = np.arange(count)
    for tick in range(1, round(SECONDS / TICK) + 1):
        x = batch.step(x)
        inside = batch.inside(x)
        kept[left[entered[left] & ~inside]] = False
        entered[left[inside]] = True
        if tick % 50 == 0:
            moving = ~(inside & (batch.speed(x) < 1e-3 * batch.settings[0].system.radius[0]))
            at_rest[left[~moving]] = True
            if not np.any(moving):
                break
            batch.use(batch.rows[moving])
            x, left = x[moving], left[moving]
    return kept & entered, at_rest


def test_the_grid_has_every_kind_of_setting_certified_and_not() -> None:
    cases = grid()
    assert len(cases) >= 2000
    certified = Counter(case.setting.name for case in cases if case.certificate.holds)
    failing = Counter(case.setting.name for case in cases if not case.certificate.holds)
    for name in GRAPHS:
        assert certified[name] > 40 and failing[name] > 40, (name, certified, failing)
    unequal = sum(np.ptp(case.setting.omega) > 0.01 * case.setting.omega.max()
                  for case in cases if case.certificate.holds)
    assert unequal > 200


def test_what_is_required_is_the_same_without_the_rest() -> None:
    for case in grid()[::64]:
        whole = certify(case.running)
        required = tuple(row for row in whole.inequalities if row.required)
        assert str(required) == str(tuple(
            row for row in case.certificate.inequalities if row.required))
        assert len(case.certificate.inequalities) < len(whole.inequalities)
        assert case.certificate.holds == whole.holds


def test_the_readme_states_how_many_are_certified() -> None:
    cases = grid()
    certified = sum(case.certificate.holds for case in cases)
    stated = f'{certified} of {len(cases):,} settings certified'
    assert stated in (ROOT / 'README.md').read_text(encoding='utf-8')


def test_most_certified_settings_have_a_proved_step() -> None:
    certified = [case.certificate for case in grid() if case.certificate.holds]
    proved = sum(all(one[row].holds for row in STEP_ROWS) for one in certified)
    assert proved > 0.95 * len(certified)
    stated = f'Of the {len(certified)} certified settings of `test_certificate_grid.py` {proved} '
    assert stated in (ROOT / 'doc' / 'certificate.md').read_text(encoding='utf-8')
    for one in certified:
        assert one['time_step'].required is not one['step_capture'].required
        assert ('time_step' in one.sampled) is not one['capture'].proved


def test_steps_that_are_proved_most_closely_have_proofs() -> None:
    """Before the checker had a second bound of a step's last stage three of these had none."""
    proved = [case for case in grid() if case.certificate.holds
              and case.certificate['step_capture'].required]
    closest = sorted(proved, key=lambda case: -case.certificate['step_capture'].left)[:4]
    for case in closest:
        _, text = attempt(case.running)
        assert accepted(text) and all(json.loads(text)[part] for part in ('step', 'rest'))


def test_the_batch_is_the_canonical_system() -> None:
    rng = np.random.default_rng(0)
    cases = [grid()[k] for k in rng.integers(len(grid()), size=40)]
    batch = Batch([case.setting for case in cases], TICK)
    x = np.stack([locked(case.setting, rng.uniform(0.0, 6.0)) for case in cases])
    acting = batch.inside(x)[:, None] * batch.gains
    for k, after in enumerate(batch.step(x)):
        setting = cases[k].setting
        np.testing.assert_allclose(
            after, setting.system.step(x[k], setting.omega, acting[k], TICK), atol=1e-12)


def test_every_certified_setting_synchronises_at_its_rate_from_everywhere() -> None:
    cases = [case for case in grid() if case.certificate.holds]
    start, end = synchronised(cases, 0.4, np.random.default_rng(1))
    rates = np.array([case.certificate['synchronisation'].margin for case in cases])
    weighted = np.array([case.free.weights is not None for case in cases])
    assert np.all((end <= 1.001 * start * np.exp(-rates * 0.4) + 1e-12)[weighted])
    # In a hierarchy the rate shows after those in front have settled: at half of it from here on.
    slower = np.exp(-0.5 * rates * 0.4)
    assert np.all((end <= 30.0 * start * slower + 1e-12)[~weighted])


def test_every_certified_setting_stays_in_its_places_with_unequal_frequencies() -> None:
    cases = [case for case in grid() if case.certificate.holds and case.free.weights is not None
             and np.ptp(case.setting.omega) > 0.0]
    batch = Batch([case.setting for case in cases], TICK)
    x = np.stack([locked(case.setting, 0.0) for case in cases])
    bounds = np.array([mismatch_bound(
        case.free, case.setting.system.rho[0], case.setting.system.radius[0],
        float(np.ptp(case.setting.omega))).distance for case in cases])
    for _ in range(250):
        x = batch.step(x, armed=False)
    for case, state, bound in zip(cases, x, bounds, strict=True):
        z = (state[:, 0] - 1j * state[:, 1]) * np.exp(-1j * case.setting.system.graph.phases)
        assert np.abs(z[:, None] - z[None, :]).max() <= bound


def test_every_certified_setting_stops_with_legs_of_unequal_frequencies() -> None:
    cases = [case for case in grid() if case.certificate.holds]
    kept, at_rest = stopped(cases, np.random.default_rng(2))
    assert np.all(kept), [cases[k].certificate.explained() for k in np.flatnonzero(~kept)[:3]]
    assert np.all(at_rest), f'{np.count_nonzero(~at_rest)} of {len(cases)} still move'


def test_settings_that_the_misread_eigenvalue_passes_are_refused_and_fail() -> None:
    cases = [case for case in grid() if case.misread and not case.free.synchronises]
    assert cases
    assert not any(case.certificate.holds for case in cases)
    assert all('synchronisation' in [entry.name for entry in case.certificate.failing]
               for case in cases)
    start, end = synchronised([case for case in cases for _ in range(2)], 0.4,
                              np.random.default_rng(3))
    assert np.count_nonzero(end > start) >= 0.3 * len(cases)


@pytest.mark.parametrize('graph', ['all_to_all', 'ring', 'star', 'directed_ring', 'path'])
def test_settings_that_contract_without_capture_are_refused_and_some_walk_on(graph: str) -> None:
    cases = [case for case in grid() if case.contracts and case.setting.name == graph
             and not case.certificate['capture'].holds]
    assert cases
    assert not any(case.certificate.holds for case in cases)
    kept, at_rest = stopped(cases, np.random.default_rng(5))
    assert np.any(~(kept & at_rest))


def test_a_setting_has_a_proof_if_and_only_if_it_is_certified() -> None:
    for case in grid()[3::87]:
        certified, text = attempt(case.running)
        assert certified == case.certificate.holds == bool(text) == (bool(text) and accepted(text))
