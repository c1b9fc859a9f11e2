# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark runs and writes what it prints; how long anything takes is not tested."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import NoReturn

import pytest

pytest.importorskip('mujoco')
from dmp_cpg_ros.studies import bench
from dmp_cpg_ros.studies.bench import main, seconds_of


def test_it_prints_and_writes_its_tables(
        tmp_path: Path, capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, 'seconds_of', partial(seconds_of, repetitions=1, least=1e-6))
    file = tmp_path / 'bench.json'
    assert main(['--sizes', '10', '20', '--json', str(file)]) == 0
    tables = json.loads(file.read_text(encoding='utf-8'))
    printed = capsys.readouterr().out
    assert len(tables) == 5
    for title, rows in tables.items():
        assert title in printed
        for row in rows:
            assert row['what'] in printed and row['seconds'] > 0.0 and row['ratio'] > 0.0
    assert [row['what'] for row in list(tables.values())[1]][:2] == ['ring, 10', 'ring, 20']


def test_a_table_is_told_before_the_next_is_measured(
        capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(_: object) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr(bench, 'seconds_of', partial(seconds_of, repetitions=1, least=1e-6))
    monkeypatch.setattr(bench, 'steps_of_many', interrupted)
    with pytest.raises(KeyboardInterrupt):
        main([])
    assert 'exponential step' in capsys.readouterr().out


def test_a_time_is_that_of_one_call() -> None:
    calls = []
    assert seconds_of(lambda: calls.append(1), repetitions=2, least=1e-4) > 0.0
    assert len(calls) > 2
