# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What all tests share: they reproduce, stay on this machine and need no screen."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections import Counter
from itertools import groupby
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import parsed_once  # noqa: F401
import pytest
from hypothesis import settings

# The same examples in every run, and no limit on the time of one: machines differ.
settings.register_profile('suite', deadline=None, derandomize=True, print_blob=True)
settings.load_profile('suite')

os.environ.setdefault('MPLBACKEND', 'Agg')
# What make's commands and an activated shell have.
_shell = subprocess.run(
    ['sh', '-c', '. "$0" && env -0', str(Path(__file__).parent.parent / 'environment.sh')],
    env={**os.environ, 'VIRTUAL_ENV': sys.prefix}, capture_output=True, text=True, check=True)
os.environ.update(line.split('=', 1) for line in _shell.stdout.split('\0') if line)

LONG = ('project', 'suite', 'commands', 'studies', 'nodes')
"""Folders whose tests walk or start processes, those that take longest first."""


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Draws of a test of its own, whatever ran before it."""
    return np.random.default_rng(crc32(request.node.name.encode()))


def pytest_configure(config: pytest.Config) -> None:
    """Name the marker for who has not installed its plugin."""
    config.addinivalue_line('markers', 'flaky(reruns=1): run once more when it fails')


class Folder(pytest.Dir):
    """A folder of tests from which every worker reads another part first.

    Whoever comes first compiles a file, and the others find it compiled; side by side they would
    all compile all of them.
    """

    def collect(self) -> list[pytest.Item | pytest.Collector]:
        """What is in it."""
        found, worker = list(super().collect()), getattr(self.config, 'workerinput', None)
        begin = 0 if worker is None else (
            int(worker['workerid'].removeprefix('gw')) * len(found) // worker['workercount'])
        return [*found[begin:], *found[:begin]]


def pytest_collect_directory(path: Path, parent: pytest.Collector) -> pytest.Collector:
    """Read a folder."""
    return Folder.from_parent(parent, path=path)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin with what takes long, in every worker: they then end at the same time.

    Each gets an equal part of the list, from its begin to its end, and takes over the last ones of
    another who has more left. So every part begins with files that take long and ends with others.
    What starts processes in real time is run once more when it fails, for the machine may have had
    no time for it; the summary tells of it.
    """
    def rank(item: pytest.Item) -> int:
        folder = item.path.relative_to(Path(__file__).parent).parts[0]
        return LONG.index(folder) if folder in LONG else len(LONG)

    items.sort(key=lambda item: item.path)  # which every worker has read in an order of its own

    workers = getattr(config, 'workerinput', {}).get('workercount', 1)
    parts: list[list[pytest.Item]] = [[] for _ in range(workers)]
    for number, (_, tests) in enumerate(groupby(sorted(items, key=rank), lambda of: of.path)):
        together = list(tests)
        takes_long = rank(together[0]) < len(LONG)
        part = parts[number % workers] if takes_long else min(parts, key=len)
        part.extend(together)
    items[:] = [item for part in parts for item in part]
    for item in items:
        if 'ros_processes' in {getattr(value, '__module__', '') for value in vars(
                getattr(item, 'module', object)).values()}:
            item.add_marker(pytest.mark.flaky(reruns=1))


def pytest_collection_finish() -> None:
    """Spare what has been imported from the garbage collector."""
    gc.collect()
    gc.freeze()


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say why tests were skipped, a line for every reason, where ``-rs`` has one for every place;
    and how those had failed that were run once more.
    """
    again = terminalreporter.stats.get('rerun', [])
    if again:
        terminalreporter.section('run once more')
    for report in again:
        terminalreporter.line(f'{report.nodeid}\n{report.longreprtext}')
    skipped = terminalreporter.stats.get('skipped', [])
    if skipped:
        terminalreporter.section('skipped')
    for reason, count in Counter(report.longrepr[2] for report in skipped).most_common():
        terminalreporter.line(f'{count} x {reason.removeprefix("Skipped: ")}')


_crashed: set[str] = set()


def _run_again_anyway(config: Any, crashitem: str) -> bool:
    """Whether pytest-rerunfailures runs a test once more."""
    known = getattr(config, 'failures_db', None)
    return known is not None and known.get_test_reruns(crashitem) > 0


@pytest.hookimpl(optionalhook=True)
def pytest_handlecrashitem(crashitem: str, report: Any, sched: Any) -> None:
    """Run a test once more whose process has crashed, and count it as ``rerun``.

    Fast DDS sometimes does where a node of the test itself is destroyed among others that end;
    a test that hangs ends in the same way. Whoever does so twice has failed.
    """
    if crashitem not in _crashed and not _run_again_anyway(sched.config, crashitem):
        _crashed.add(crashitem)
        sched.mark_test_pending(crashitem)
        report.outcome = 'rerun'
