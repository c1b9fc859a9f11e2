# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Runs of the suite and of its relays that are measured alike."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.bag import STORE, find_bag, opened, recorded
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.nodes.framework.health import Durations
from dmp_cpg_ros.studies import relays
from dmp_cpg_ros.studies.process_usage import Usage, between, usage
from dmp_cpg_ros.studies.walk_process import WITHIN_S, WalkProcess, ahead
from dmp_cpg_ros.suite_table import PROCESSES, RECORDER, ROBOT

SETTLE_S = 1.0
"""What follows the first ticks and is not measured [s]."""

FLAGS = {'each': (), 'blocks': ('--processes', 'blocks'), 'composed': ('--composed',)}
"""Arguments of ``walk`` by how processes are shared."""

APART_S = 2.31
"""Time between two requests [s]."""

COMPETITOR = 'import os\nparent = os.getppid()\nwhile os.getppid() == parent: pass'
"""A busy loop that ends with its parent."""

Reports = list[tuple[float, Mapping[str, Any]]]


@dataclass
class Run:
    """What one run was like, within its window.

    Attributes
    ----------
    seconds : float
        Length of the window [s].
    used : dict of str to Usage
        By the name of the process.
    first_mb : dict of str to float
        Memory at the begin of the window [MB].
    reached_s : dict of str to float
        When which stage of the start was reached, from the command on [s].
    rate_hz : float
        Ticks per second of wall time.
    ticks, misses : int
        Ticks, and those whose targets came after the next state.
    latency, period : Durations
        From a state to the last of its targets; between states.
    taken : dict of str to int
        Messages that relays have taken; what a source has sent.
    """

    seconds: float = 0.0
    used: dict[str, Usage] = field(default_factory=dict)
    first_mb: dict[str, float] = field(default_factory=dict)
    reached_s: dict[str, float] = field(default_factory=dict)
    rate_hz: float = 0.0
    ticks: int = 0
    misses: int = 0
    latency: Durations = field(default_factory=Durations)
    period: Durations = field(default_factory=Durations)
    taken: dict[str, int] = field(default_factory=dict)

    def total(self, of: str) -> float:
        """Sum of a field of :class:`Usage` over the processes."""
        return float(sum(getattr(used, of) for used in self.used.values()))

    def watch(self, pids: Mapping[str, int], seconds: float) -> None:
        """Let the window pass."""
        first, begin = {name: usage(pid) for name, pid in pids.items()}, time.monotonic()
        time.sleep(seconds)
        self.seconds = time.monotonic() - begin
        self.used = {name: between(first[name], usage(pid)) for name, pid in pids.items()}
        self.first_mb = {name: used.memory_mb for name, used in first.items()}

    def read(self, reports: Reports, begin_s: float) -> None:
        """Take what the robot reported from a time on its clock on [s]."""
        last = reports[-1][1]
        none: Mapping[str, Any] = {
            'timed_ticks': 1, 'rate_hz': 1.0, 'deadline_misses': 0, 'latencies': '',
            'periods': ''}
        first = next((values for time_s, values in reports[:-1] if time_s >= begin_s), none)

        def grown(key: str) -> int:
            return int(last[key]) - int(first[key])

        wall_s, before_s = ((int(of['timed_ticks']) - 1) / float(of['rate_hz'])
                            for of in (last, first))
        self.ticks, self.misses = grown('timed_ticks'), grown('deadline_misses')
        self.rate_hz = self.ticks / (wall_s - before_s)
        self.latency, self.period = (
            Durations(Durations.parse(last[key]) - Durations.parse(first[key]))
            for key in ('latencies', 'periods'))


def shared(way: str) -> dict[str, tuple[str, ...]]:
    """Names of the nodes by process, the recorder's first."""
    return {RECORDER: (RECORDER,), **PROCESSES[way]}


@contextmanager
def competitor(busy: bool) -> Iterator[None]:
    """Let something else compute, or nothing."""
    loop = subprocess.Popen([sys.executable, '-c', COMPETITOR]) if busy else None
    try:
        yield
    finally:
        if loop:
            loop.kill()
            loop.wait()


def run_suite(way: str, folder: Path, seconds: float, lock_step: bool = False,
              namespace: str = '', meet: Callable[[], object] = lambda: None) -> Run:
    """Walk, recorded into the folder ``run``, and measure; ``meet`` is called before the window.

    Raises
    ------
    DmpCpgError
        If the suite does not come to walk.
    """
    run, begin, begin_s = Run(), time.monotonic(), time.time()
    walk = WalkProcess.of(  # ends by itself where nobody ends it
        folder, 60.0 + 10.0 * seconds, ahead(), '--namespace', namespace, *FLAGS[way],
        *['--lock-step'] * lock_step)
    try:
        walking_s = walk.said('walking')
        pids = {name: walk.pid_of(nodes) for name, nodes in shared(way).items()}
        if not all(pids.values()):
            raise walk.failure()
        time.sleep(SETTLE_S)
        meet()
        run.watch(pids, seconds)
    finally:
        walk.end()
    said = {what: next((when, line) for when, line in zip(walk.times, walk.lines, strict=False)
                       if pattern in line)
            for what, pattern in (('read', 'certificate:'), ('ticking', 's  > v ='),
                                  ('walking', 's  walking'))}
    run.reached_s = {what: when - begin for what, (when, _) in said.items()}
    run.reached_s['ticking'] -= float(said['ticking'][1].split()[0])  # the tick of the command
    active = [float(found) for log in (folder / 'run' / 'logs').glob('*.log')
              for found in re.findall(r'\[([\d.]+)\] \[.*\]: active', log.read_text())]
    run.reached_s['active'] = max(active, default=begin_s) - begin_s
    run.read(_reports(folder / 'run'), walking_s + SETTLE_S)
    return run


def kept_predictions(way: str, folder: Path, requests: int) -> list[float]:
    """Stop and start a walk in turn at other phases each time; how much longer than predicted it
    took to rest or to walk [s].

    Raises
    ------
    DmpCpgError
        If the suite does not do what it is asked for.
    """
    times = [3.0 + k * APART_S for k in range(requests)]
    walk = WalkProcess.of(
        folder, times[-1] + APART_S,
        [*ahead(), *({'at': at, 'inhibit': k % 2 == 0} for k, at in enumerate(times))],
        *FLAGS[way])
    try:
        walk.process.wait(WITHIN_S + 3.0 * times[-1])
        metrics = json.loads((folder / 'run' / 'metrics.json').read_text(encoding='utf-8'))
    except (subprocess.TimeoutExpired, OSError):
        raise walk.failure() from None
    finally:
        walk.end()
    return [one['measured_s'] - one['predicted_s'] for what in ('stop', 'start')
            for one in metrics[what]['all'] if one['measured_s'] is not None]


def _reports(run: Path) -> Reports:
    """What the robot said in its diagnostics."""
    found: Reports = []
    with opened(find_bag(run)) as reader:
        topics = [of for of in reader.connections if of.topic.endswith('diagnostics')]
        for connection, _, raw in recorded(reader, topics):
            message: Any = STORE.deserialize_cdr(raw, connection.msgtype)
            stamp = message.header.stamp
            found += [(stamp.sec + 1e-9 * stamp.nanosec, values) for of in message.status
                      if of.name.endswith(ROBOT) and 'periods' in (
                          values := {entry.key: entry.value for entry in of.values})]
    return found


def write_samples(run: Path, file: Path) -> dict[str, relays.Sample]:
    """Write what relays are to send: what a recorded run sent."""
    known = relays.samples(run)
    file.write_text(json.dumps(
        {name: [sample.data.hex(), sample.per_tick] for name, sample in known.items()}))
    return known


def run_relays(shared_by: Mapping[str, Sequence[str]], samples: Path, seconds: float,
               *flags: str, recorder: Sequence[str] = ()) -> Run:
    """Let relays pass messages on, and measure.

    Parameters
    ----------
    shared_by : mapping of str to sequence of str
        Names of relays by process.
    samples : Path
        What is sent.
    seconds : float
        Window [s].
    *flags : str
        Of the relays.
    recorder : sequence of str
        Command of a recorder beside them; Ctrl-C ends it.

    Raises
    ------
    DmpCpgError
        If they do not find each other.
    """
    run, folder, begin = Run(), samples.parent, time.monotonic()
    commands = {name: ['dmp_cpg_ros.studies.relays', *names, '--samples', str(samples), *flags]
                for name, names in shared_by.items()}
    commands.update({RECORDER: ['dmp_cpg_ros', *recorder]} if recorder else {})
    processes = {}
    try:
        for name, command in commands.items():
            with (folder / f'{name}.txt').open('w') as file:
                processes[name] = subprocess.Popen(
                    [sys.executable, '-m', *command], stdin=subprocess.PIPE, stdout=file,
                    start_new_session=True)
        while not all('connected' in (folder / f'{name}.txt').read_text() for name in shared_by):
            if time.monotonic() > begin + WITHIN_S or any(
                    of.poll() is not None for of in processes.values()):
                raise DmpCpgError('the relays do not find each other')
            time.sleep(relays.LOOK_S)
        run.reached_s = {'ticking': time.monotonic() - begin}
        for name in shared_by:
            _input(processes[name]).write(b'\n')
            _input(processes[name]).flush()
        time.sleep(SETTLE_S if relays.SOURCE not in shared_by else 0.0)
        run.watch({name: process.pid for name, process in processes.items()}, seconds)
        time.sleep(SETTLE_S if relays.SOURCE in shared_by else 0.0)  # what is under way arrives
    finally:
        for name, process in processes.items():
            if name not in shared_by:
                process.send_signal(signal.SIGINT)
            _input(process).close()
        for process in processes.values():
            process.wait()
    said: dict[str, Reports] = {
        name: [json.loads(line) for line in (folder / f'{name}.txt').read_text().splitlines()
               if line.startswith('[')] for name in shared_by}
    run.taken = {name: int(lines.pop()[1]['taken']) for name, lines in said.items()}
    for lines in filter(None, said.values()):
        run.read(lines, SETTLE_S)
    return run


def _input(process: subprocess.Popen[bytes]) -> Any:
    assert process.stdin is not None
    return process.stdin
