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
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from checkout import ROOT

from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.inequality import STEP_ROWS
from dmp_cpg_ros.studies import certified_grid
from dmp_cpg_ros.studies.certificate_settings import GRAPHS, TICK, grid
from dmp_cpg_ros.studies.certified_grid import (
    as_certified,
    counted,
    keep_places,
    stopped,
    synchronise,
    synchronised,
    unequal,
)
from dmp_cpg_ros.studies.network_batch import Batch, locked
from dmp_cpg_ros.studies.proofs import accepted, attempt


def test_the_grid_has_every_kind_of_setting_certified_and_not() -> None:
    cases = grid()
    assert len(cases) >= 2000
    certified = Counter(case.setting.name for case in cases if case.certificate.holds)
    failing = Counter(case.setting.name for case in cases if not case.certificate.holds)
    for name in GRAPHS:
        assert certified[name] > 40 and failing[name] > 40, (name, certified, failing)
    assert sum(unequal(case) for case in cases if case.certificate.holds) > 200


def test_what_is_required_is_the_same_without_the_rest() -> None:
    for case in grid()[::64]:
        whole = certify(case.running)
        required = tuple(row for row in whole.inequalities if row.required)
        assert str(required) == str(tuple(
            row for row in case.certificate.inequalities if row.required))
        assert len(case.certificate.inequalities) < len(whole.inequalities)
        assert case.certificate.holds == whole.holds


def test_the_file_of_the_study_counts_the_grid_as_it_is() -> None:
    """Those that a naive check passes are simulated below."""
    file = ROOT / 'doc' / 'results' / 'no-certified-setting-fails.json'
    written = json.loads(file.read_text(encoding='utf-8'))
    for row in written:
        cases = [case for case in grid() if case.setting.name == row['graph']]
        certified = [case for case in cases if case.certificate.holds]
        assert (row['settings'], row['certified'], row['unequal']) == (
            len(cases), len(certified), sum(map(unequal, certified)))
    assert sum(row['settings'] for row in written) == len(grid())
    assert all(map(as_certified, written))


def test_a_certified_setting_that_fails_is_counted() -> None:
    # A network that is refused for its slow capture walks on: were it certified, that would show.
    refused = [case for case in grid() if case.contracts
               and not case.certificate['capture'].holds and case.setting.name == 'ring']
    certified = next(case for case in grid() if case.certificate.holds).certificate
    rows = counted([replace(case, certificate=certified) for case in refused])
    (ring,) = (row for row in rows if row['settings'])
    assert ring['certified'] == len(refused) > ring['stop']
    assert not as_certified(ring)


def test_the_command_writes_the_counts_of_every_graph(
        monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    """Of every sixteenth setting, and of one that it counts as failing."""
    monkeypatch.setattr(certified_grid, 'grid', lambda _: grid()[::16])
    file = tmp_path / 'counts.json'
    assert certified_grid.main(['--json', str(file)]) == 0
    rows = json.loads(file.read_text(encoding='utf-8'))
    assert [row['graph'] for row in rows] == list(GRAPHS)
    assert sum(row['settings'] for row in rows) == len(grid()[::16])
    assert certified_grid.table(rows) in capsys.readouterr().out
    monkeypatch.setattr(certified_grid, 'as_certified', lambda row: row['graph'] != 'ring')
    assert certified_grid.main([]) == 1


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
    assert np.all(synchronise(cases, np.random.default_rng(1)))


def test_every_certified_setting_stays_in_its_places_with_unequal_frequencies() -> None:
    cases = [case for case in grid() if case.certificate.holds and case.free.weights is not None
             and np.ptp(case.setting.omega) > 0.0]
    assert np.all(keep_places(cases))


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
    start, end = synchronised(cases, 0.4, np.random.default_rng(3), worst=True)
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
