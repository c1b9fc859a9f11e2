# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the running suite measures beside floors; how long anything takes is not
tested.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import ros_processes

pytest.importorskip('mujoco')
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.framework.health import BINS, Durations, RobotTiming
from dmp_cpg_ros.nodes.messages import interfaces
from dmp_cpg_ros.studies import bench_ros, bench_rows, relays
from dmp_cpg_ros.studies.process_usage import between, usage
from dmp_cpg_ros.suite_table import RECORDED_WALK

ros_domain = ros_processes.ros_domain

DOCUMENT = Path(__file__).resolve().parents[2] / 'doc' / 'performance.md'


def test_every_row_is_documented_and_the_table_has_its_place(tmp_path: Path) -> None:
    text = DOCUMENT.read_text(encoding='utf-8')
    for row in bench_rows.ROWS:
        assert f'| `{row}` |' in text and getattr(bench_rows.Bench, row).__doc__
    copy = tmp_path / 'copy.md'
    copy.write_text(text, encoding='utf-8')
    bench_ros.update(copy, 'new')
    bench_ros.update(copy, 'newer')
    before, after = text.split(bench_ros.BEGIN)[0], text.split(bench_ros.END)[1]
    assert copy.read_text(encoding='utf-8') == (
        f'{before}{bench_ros.BEGIN}\nnewer\n{bench_ros.END}{after}')
    copy.write_text('nothing', encoding='utf-8')
    with pytest.raises(DataError, match='has no lines'):
        bench_ros.update(copy, 'new')


def test_it_measures_the_suite_beside_relays(
        ros_domain: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / 'bench.json'
    named = ('startup', 'latency', 'cpu', 'wakeups', 'memory')
    assert bench_ros.main(['--rows', *named, '--ways', 'composed', '--seconds', '3',
                           '--json', str(file)]) == 0
    rows, printed = json.loads(file.read_text(encoding='utf-8'))['rows'], capsys.readouterr().out
    assert list(dict.fromkeys(row['row'] for row in rows)) == list(named)
    for row in rows:
        assert row['what'] in printed and row['floor_is'] in ('relays', 'relays connected')
        # A thread may not run at all, and nobody may have to wait. The robot reports once in a
        # second of its own, of which a loaded machine makes less than one of the wall clock.
        if not any(word in row['what'] for word in ('growth', 'preempted', 'waiting', 'threads')):
            assert row['measured'] > 0.0 and row['floor'] > 0.0 and row['ratio'] > 0.0, row


def test_what_was_measured_stays_when_a_row_fails_or_is_interrupted(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def measured(error: BaseException) -> Callable[[object], Iterator[bench_rows.Figure]]:
        def row(self: object) -> Iterator[bench_rows.Figure]:
            yield bench_rows.Figure('one', 's', 2.0, 0.0 if isinstance(error, DataError) else 4.0)
            raise error

        return row

    monkeypatch.setattr(bench_rows.Bench, 'latency', measured(DataError('it fell')))
    monkeypatch.setattr(bench_rows.Bench, 'cpu', measured(KeyboardInterrupt()))
    file = tmp_path / 'bench.json'
    assert bench_ros.main(['--rows', 'latency', 'cpu', 'memory', '--json', str(file)]) == 130
    rows = json.loads(file.read_text(encoding='utf-8'))['rows']
    assert [(row['row'], row['ratio']) for row in rows] == [('latency', None), ('cpu', 0.5)]


def test_durations_are_counted_in_narrow_bins() -> None:
    seconds = np.random.default_rng(0).lognormal(-6.0, 1.0, 5000)
    counted, early = Durations(), Durations()
    for k, each in enumerate(seconds.tolist()):
        counted.note(each)
        if k < 1000:
            early.note(each)
    wide = 10.0 ** (0.5 / BINS)
    for percent in (50.0, 99.0):
        exact = np.percentile(seconds, percent, method='inverted_cdf')
        assert exact / wide <= counted.percentile(percent) <= exact * wide
    assert Durations.parse(str(counted)) == counted
    later = Durations(counted - early)
    assert later.total() == 4000 and np.isnan(Durations().percentile(50.0))
    assert len(counted) < 5.0 * BINS


def test_a_robot_that_has_not_ticked_reports_no_times() -> None:
    values = RobotTiming().values()
    assert values['timed_ticks'] == 0 and values['latencies'] == values['periods'] == ''
    assert np.isnan(values['latency_ms_p50']) and np.isnan(values['rate_hz'])


def test_relays_pass_on_what_the_nodes_of_a_tick_read() -> None:
    known = {topic.name: relays.Sample(b'', 1.0) for topic in interfaces.RECORDED}
    for name in ('reference', 'canonical_state', 'posture_feedback', 'joint_targets'):
        topic = interfaces.interface(name)
        for kind in topic.publishers:
            assert relays.messages_per_tick(known, kind)[0] >= 1.0
        for kind in (set(topic.subscribers) - set(topic.sometimes)) & set(RECORDED_WALK):
            assert relays.reads(kind, topic)
    sent = sum(relays.messages_per_tick(known, kind)[0] for kind in RECORDED_WALK)
    taken = relays.messages_per_tick(known, RECORDED_WALK[-1])[1]
    assert 0.0 < sent < taken  # the recorder takes them all, those of four legs each


def test_what_a_process_uses_grows() -> None:
    first = usage(os.getpid())
    sum(k * k for k in range(200_000))
    used = between(first, usage(os.getpid()))
    assert used.cpu_s > 0.0 and used.memory_mb > 1.0 and used.threads['main'] > 0.0
