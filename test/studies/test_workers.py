# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cases of a study on several processes and on a cluster: the same results in the same order."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from math import sqrt
from select import select

import pytest

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.studies.workers import Workers

CASES = [0.1 * k for k in range(1, 40)]


@pytest.mark.parametrize('number', [1, 2])
def test_results_come_in_the_order_of_the_cases(number: int) -> None:
    with Workers(number) as workers:
        assert list(workers.map(sqrt, CASES)) == [sqrt(case) for case in CASES]
        assert list(workers.map(abs, CASES)) == CASES


def test_what_a_trial_raises_ends_the_study() -> None:
    with pytest.raises(ValueError, match='math domain|nonnegative'), Workers(2) as workers:
        list(workers.map(sqrt, [1.0, -1.0, 2.0]))


def test_a_process_that_dies_ends_the_study_and_nobody_waits_for_it() -> None:
    with pytest.raises(DmpCpgError, match='ended before its case'), Workers(2) as workers:
        list(workers.map(os._exit, [1, 1, 1]))


def test_a_study_that_is_killed_leaves_nobody_at_work() -> None:
    code = """if True:
        import time
        from dmp_cpg_ros.studies.workers import Workers
        with Workers(1) as workers:
            print(*workers.map(eval, ["__import__('os').getpid()"]), flush=True)
            list(workers.map(time.sleep, [3600.0]))"""
    with subprocess.Popen([sys.executable, '-c', code], stdout=subprocess.PIPE) as study:
        worker = os.pidfd_open(int(study.stdout.readline()))  # type: ignore[union-attr]
        study.kill()
    ended, _, _ = select([worker], [], [], 60.0)
    os.close(worker)
    assert ended


def test_every_process_is_prepared() -> None:
    with Workers(2, prepare=partial(os.putenv, 'PREPARED', 'yes')) as workers:
        assert set(workers.map(os.system, ['test "$PREPARED" = yes'] * 9, batch=2)) == {0}


def test_progress_is_counted_where_it_is_wanted(capfd: pytest.CaptureFixture[str]) -> None:
    for progress in (True, False):
        with Workers(1, progress=progress) as workers:
            list(workers.map(sqrt, CASES))
        assert ('39/39' in capfd.readouterr().err) is progress


def test_without_a_terminal_a_line_now_and_then_counts(
        capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('dmp_cpg_ros.commands.progress.Progress.SILENT_S', 0.0)
    with Workers(1) as workers:
        list(workers.map(sqrt, CASES))
    first, *others = capfd.readouterr().err.splitlines()
    assert first == '1/39' and len(others) < len(CASES) - 1


def test_a_cluster_without_its_library_says_what_to_install(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(DmpCpgError, match='pip install distributed'), Workers(1, 'tcp://host:1'):
        pass


@pytest.mark.parametrize('address', ['tcp://127.0.0.1:1', 'nonsense://'])
def test_a_cluster_that_does_not_answer_is_named(
        monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    pytest.importorskip('distributed')
    monkeypatch.setattr('dmp_cpg_ros.studies.workers.CONNECTED_WITHIN_S', 0.5)
    with pytest.raises(DmpCpgError, match=address), Workers(1, address):
        pass


def test_on_a_cluster_the_results_are_the_same() -> None:
    distributed = pytest.importorskip('distributed')
    with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Workers(
            1, cluster.scheduler_address) as workers:
        assert list(workers.map(sqrt, CASES)) == [sqrt(case) for case in CASES]
