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
from typing import Any

import numpy as np
import pytest
from checkout import ROOT
from rosbags.rosbag2 import Writer
from synthetic_bag import STORE, make, write_bag
from synthetic_walk import SyntheticWalk

from dmp_cpg_ros.analysis import Recording
from dmp_cpg_ros.analysis.other_tables import OTHER_TABLES, other_tables
from dmp_cpg_ros.analysis.recording import Series, StatusEvent
from dmp_cpg_ros.commands.analyze import PARTLY, main
from dmp_cpg_ros.commands.progress import Progress
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
    assert len(tables['inhibition']['message']) > 1
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


def test_words_have_a_column_for_each_key_and_their_level() -> None:
    said = ({'grade': 'holds, k=3', 'bound_s': '2.5'}, {'bound_s': 'nan', 'cause': 'fl'})
    events = tuple(StatusEvent(float(k), k, 'waiting', of) for k, of in enumerate(said))
    tables = Recording(inhibition=events, statuses={'robot': events, 'quiet': (
        StatusEvent(4.0, 2, 'silent', {}),)}).tables()
    inhibition, rows = tables['inhibition'], tables['statuses']
    assert list(inhibition) == ['time_s', 'level', 'message', 'grade', 'bound_s', 'cause']
    assert inhibition['level'].tolist() == [0, 1]
    assert inhibition['grade'] == ['holds, k=3', ''] and inhibition['cause'] == ['', 'fl']
    np.testing.assert_array_equal(inhibition['bound_s'], [2.5, np.nan])
    assert list(zip(rows['name'], rows['level'].tolist(), rows['key'], rows['value'],
                    strict=True)) == [
        ('robot', 0, 'grade', 'holds, k=3'), ('robot', 0, 'bound_s', '2.5'),
        ('robot', 1, 'bound_s', 'nan'), ('robot', 1, 'cause', 'fl'), ('quiet', 2, '', '')]


def test_topics_that_no_metric_reads_are_tables_too(
        bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def header(time: float = 0.0, frame: str = '') -> Any:
        sec, nanosec = divmod(round(time * 1e9), 10**9)
        return make('std_msgs/msg/Header', frame_id=frame,
                    stamp=make('builtin_interfaces/msg/Time', sec=sec, nanosec=nanosec))

    def rows(time: float, *names: str, **values: Any) -> Any:
        return make('sensor_msgs/msg/JointState', header=header(time), name=list(names), **{
            of: np.array(values.get(of, []), float) for of in ('position', 'velocity', 'effort')})

    def vector(x: float, y: float, z: float) -> Any:
        return make('geometry_msgs/msg/Vector3', x=x, y=y, z=z)

    unknown = np.zeros(9)
    felt = make('sensor_msgs/msg/Imu', header=header(0.02), orientation_covariance=unknown,
                orientation=make('geometry_msgs/msg/Quaternion', x=0.0, y=0.0, z=0.0, w=1.0),
                angular_velocity=vector(1.0, 2.0, 3.0), angular_velocity_covariance=unknown,
                linear_acceleration=vector(4.0, 5.0, 9.8), linear_acceleration_covariance=unknown)
    push = make('geometry_msgs/msg/WrenchStamped', header=header(777.0, 'odom'), wrench=make(
        'geometry_msgs/msg/Wrench', force=vector(0.0, 60.0, 0.0), torque=vector(0.0, 0.0, 1.5)))
    ticks = [(round(at * 1e9), 'joint_states', rows(at, 'fl_hip', position=[0.1]))
             for at in (0.0, 0.02, 0.04)]
    between = 25_000_000                              # after the second tick, by the record time
    folder = tmp_path / 'bag'
    with Writer(folder, version=9) as writer:
        known: dict[str, Any] = {}
        for at, topic, message in (
                *ticks, (between, 'imu', felt), (between, 'push', push),
                (between, 'drive_mode', make('std_msgs/msg/String', data='stand, then lie')),
                (between, 'votes', rows(555.0, 'me/fl', 'me/rr', effort=[40.0, 20.0])),
                (between, 'inhibition_gains', rows(
                    0.02, 'fl', 'share', position=[400.0, 0.0], effort=[0.0, 0.0])),
                (between, 'posture_feedback', rows(
                    0.02, 'fl_hip', 'margin/front', position=[0.3, 0.1], velocity=[0.0, 0.0],
                    effort=[7.0, 0.0]))):
            if topic not in known:
                known[topic] = writer.add_connection(f'/spot/{topic}', message.__msgtype__,
                                                     typestore=STORE)
            writer.write(known[topic], at, STORE.serialize_cdr(message, message.__msgtype__))
    assert main([str(folder), '--no-pictures', '--out', str(tmp_path / 'out'), '--csv',
                 str(tmp_path / 'tables')]) == 0
    capsys.readouterr()
    found = {}
    for name in OTHER_TABLES:
        text = (tmp_path / 'tables' / f'{name}.csv').read_text(encoding='utf-8')
        found[name] = list(csv.DictReader(text.splitlines()))
    assert found == {
        'drive_mode': [{'time_s': '0.02', 'message': 'stand, then lie'}],
        'imu': [{'time_s': '0.02', 'rate_x_rad_s': '1.0', 'rate_y_rad_s': '2.0',
                 'rate_z_rad_s': '3.0', 'specific_force_x_m_s2': '4.0',
                 'specific_force_y_m_s2': '5.0', 'specific_force_z_m_s2': '9.8'}],
        'inhibition_gains': [{'time_s': '0.02', 'position_fl': '400.0', 'position_share': '0.0'}],
        'posture_feedback': [{'time_s': '0.02', 'position_fl_hip': '0.3',
                              'position_margin/front': '0.1', 'effort_fl_hip': '7.0'}],
        'push': [{'time_s': '0.02', 'frame': 'odom', 'force_x_n': '0.0', 'force_y_n': '60.0',
                  'force_z_n': '0.0', 'torque_x_n_m': '0.0', 'torque_y_n_m': '0.0',
                  'torque_z_n_m': '1.5'}],
        'votes': [{'time_s': '0.02', 'name': f'me/{leg}', 'weight_per_s': weight}
                  for leg, weight in (('fl', '40.0'), ('rr', '20.0'))]}
    assert not other_tables(bag, Recording.load(bag))


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
    monkeypatch.setattr('dmp_cpg_ros.commands.progress.time.monotonic', lambda: now[0])
    tell = Progress('monday: ')
    for now[0] in (1.0, 4.0, 8.5, 9.0):
        tell(f'reading {now[0]:g}')
    said = capsys.readouterr()
    assert said.err.splitlines() == ['monday: reading 4', 'monday: reading 9']
    assert not said.out


@pytest.mark.parametrize('place', ['.', 'doc/notebooks'])
def test_the_notebook_runs(bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                           capsys: pytest.CaptureFixture[str], place: str) -> None:
    text = (ROOT / 'doc' / 'notebooks' / 'recording.ipynb').read_text(encoding='utf-8')
    cells = [cell for cell in json.loads(text)['cells'] if cell['cell_type'] == 'code']
    assert cells and not any(cell['outputs'] for cell in cells)
    (tmp_path / 'runs').mkdir()
    os.symlink(bag, tmp_path / 'runs' / 'latest')
    (tmp_path / place).mkdir(parents=True, exist_ok=True)
    monkeypatch.chdir(tmp_path / place)
    monkeypatch.setenv('MPLBACKEND', 'Agg')
    names: dict[str, object] = {}
    for cell in cells:
        exec(''.join(cell['source']), names)
    assert 'Distance walked' in capsys.readouterr().out
