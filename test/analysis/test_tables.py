# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording as named columns, as files, in a notebook; runs side by side."""

from __future__ import annotations

import csv
import dataclasses
import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from checkout import ROOT
from synthetic_bag import write_bag
from synthetic_walk import SyntheticWalk

from dmp_cpg_ros.analysis import Recording
from dmp_cpg_ros.analysis.recording import Series
from dmp_cpg_ros.commands.analyze import PARTLY, Progress, main
from dmp_cpg_ros.commands.ros_arguments import BAD_INPUT
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    walk = SyntheticWalk(rate_hz=50.0, stop_s=2.0, release_s=4.0, end_s=6.0)
    return write_bag(walk.recording(), tmp_path_factory.mktemp('walk') / 'bag')


def test_every_array_is_in_the_tables_under_its_name(bag: Path) -> None:
    recording = Recording.load(bag)
    tables = recording.tables()
    for field in dataclasses.fields(recording):
        series = getattr(recording, field.name)
        if isinstance(series, Series) and len(series.time):
            numbers = [getattr(series, of.name) for of in dataclasses.fields(series)
                       if of.name != 'gaits']
            columns = [of for of in tables[field.name].values() if isinstance(of, np.ndarray)]
            assert sum(of[0].size for of in numbers) == len(columns)
            np.testing.assert_array_equal(
                np.concatenate([of.reshape(len(of), -1) for of in numbers], axis=1),
                np.stack(columns, axis=1))
    knee = JOINT_NAMES.index('rr_knee')
    assert tables['joints']['effort_rr_knee_n_m'] is not None
    np.testing.assert_array_equal(
        tables['joints']['velocity_rr_knee_rad_s'], recording.joints.velocity[:, knee])
    np.testing.assert_array_equal(
        tables['canonical']['x_dot_rl_2_per_s'], recording.canonical.x_dot[:, LEGS.index('rl'), 1])
    np.testing.assert_array_equal(
        tables['odometry']['velocity_in_base_y_m_s'], recording.odometry.velocity_in_base[:, 1])
    np.testing.assert_array_equal(
        tables['reference']['gamma_rad_s'], recording.reference.value[:, 2])
    assert tables['inhibition']['message'] == [of.message for of in recording.inhibition]


def test_tables_are_written_as_csv(bag: Path, tmp_path: Path) -> None:
    folder = tmp_path / 'tables'
    assert main([str(bag), '--no-pictures', '--out', str(tmp_path / 'out'), '--csv',
                 str(folder)]) == 0
    tables = Recording.load(bag).tables()
    assert {path.stem for path in folder.iterdir()} == set(tables)
    for name, columns in tables.items():
        with (folder / f'{name}.csv').open(encoding='utf-8', newline='') as file:
            head, *rows = csv.reader(file)
        assert head == list(columns)
        for column, of in zip(columns.values(), zip(*rows, strict=True), strict=True):
            if isinstance(column, list):
                assert list(of) == column
            else:
                np.testing.assert_array_equal(np.array(of, dtype=float), column)


def test_tables_are_written_as_parquet(bag: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip('pyarrow.parquet')
    folder = tmp_path / 'tables'
    assert main([str(bag), '--no-pictures', '--out', str(tmp_path / 'out'), '--parquet',
                 str(folder)]) == 0
    for name, columns in Recording.load(bag).tables().items():
        read = parquet.read_table(folder / f'{name}.parquet')
        assert read.column_names == list(columns)
        for column, of in columns.items():
            np.testing.assert_array_equal(read[column].to_pylist(), list(of))


def test_what_parquet_needs_is_said(bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(sys.modules, 'pyarrow', None)
    assert main([str(bag), '--parquet', str(tmp_path / 'tables')]) == BAD_INPUT
    assert 'pip install' in capsys.readouterr().err
    assert not (bag.parent / 'bag_analysis').exists()


def test_runs_stand_side_by_side(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                 ) -> None:
    slow = write_bag(SyntheticWalk(rate_hz=50.0, stop_s=2.0, release_s=4.0, end_s=6.0,
                                   speed=0.2).recording(), tmp_path / 'slow')
    odom = write_bag(dataclasses.replace(Recording(), odometry=Recording.load(bag).odometry),
                     tmp_path / 'odom')
    assert main([str(bag), str(slow), str(odom), '--out', str(tmp_path / 'both')]) == 0
    text = capsys.readouterr().out
    assert (tmp_path / 'both' / 'comparison.md').read_text(encoding='utf-8') == text
    head, _, *rows = ([cell.strip() for cell in line.strip('|').split('|')]
                      for line in text.splitlines())
    runs = json.loads((tmp_path / 'both' / 'comparison.json').read_text(encoding='utf-8'))
    assert head[:2] == ['metric', 'unit'] and head[2:5] == list(runs)
    assert head[5:] == [f'Δ {name}' for name in list(runs)[1:]]
    row = next(row for row in rows if row[0] == 'robot.distance_m')
    walked = [of['robot']['distance_m'] for of in runs.values()]
    assert row[1:5] == ['m', *(f'{of:.4g}' for of in walked)]
    assert row[5:] == [f'{of - walked[0]:.4g}' for of in walked[1:]]
    counts = next(row for row in rows if row[0] == 'stop.completed')
    assert counts[2:5] == ['1', '1', '0']
    assert main([str(bag), str(slow), '--csv', str(tmp_path / 'tables')]) == BAD_INPUT


def test_a_run_that_cannot_be_used_is_named_and_the_others_are_compared(
        bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = tmp_path / 'broken'
    broken.mkdir()
    (broken / 'bag.mcap').write_bytes(b'nothing of a bag')
    assert main([str(bag), str(broken), str(bag)]) == PARTLY
    said = capsys.readouterr()
    head, _, *rows = ([cell.strip() for cell in line.strip('|').split('|')]
                      for line in said.out.splitlines())
    first = head[2]
    assert head[2:] == [first, f'{first} (2)', f'Δ {first} (2)']
    walked = next(row for row in rows if row[0] == 'robot.distance_m')
    assert walked[2] == walked[3] and walked[4] == '0'
    (line,) = said.err.splitlines()
    assert line.startswith('analyze: left out: ') and str(broken) in line
    assert main([str(broken), str(tmp_path / 'nowhere')]) == BAD_INPUT
    said = capsys.readouterr()
    assert not said.out and len(said.err.splitlines()) == 2


def test_progress_is_told_on_stderr(capsys: pytest.CaptureFixture[str],
                                    monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr('dmp_cpg_ros.commands.analyze.time.monotonic', lambda: now[0])
    tell = Progress('monday: ')
    for now[0] in (1.0, 4.0, 8.5, 9.0):
        tell(f'reading {now[0]:g}')
    said = capsys.readouterr()
    assert said.err.splitlines() == ['monday: reading 4', 'monday: reading 9']
    assert not said.out


def test_the_notebook_runs(bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                           capsys: pytest.CaptureFixture[str]) -> None:
    text = (ROOT / 'doc' / 'notebooks' / 'recording.ipynb').read_text(encoding='utf-8')
    cells = [cell for cell in json.loads(text)['cells'] if cell['cell_type'] == 'code']
    assert cells and not any(cell['outputs'] for cell in cells)
    (tmp_path / 'runs').mkdir()
    os.symlink(bag, tmp_path / 'runs' / 'latest')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('MPLBACKEND', 'Agg')
    names: dict[str, object] = {}
    for cell in cells:
        exec(''.join(cell['source']), names)
    assert 'Distance walked' in capsys.readouterr().out
