# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rows of the benchmark of the running suite: what is measured, and beside which floor."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from threading import Barrier
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.analysis.bag import find_bag, opened, recorded
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.studies import bench_runs, long_recordings, relays
from dmp_cpg_ros.studies.bench import parts_of_a_tick, seconds_of, ticks_per_second
from dmp_cpg_ros.studies.bench_runs import Run, shared
from dmp_cpg_ros.studies.judged_changes import judged_changes
from dmp_cpg_ros.suite_table import KIND_OF, RECORDER, namespace_rules

SHARING = {'each': 'ten processes', 'blocks': 'blocks', 'composed': 'composed'}
"""What is said of the processes; the recorder has one of its own in each."""

RATE_HZ, TICK_NS, LEAST_CORES, MUJOCO = 250.0, 4_000_000, 0.005, 'mj_step'

RECORDED_RATES, MOST_ROBOTS, FULL = (1, 4, 16), 16, 0.98
"""Rates of the recorder's row, as multiples; number of robots, and real-time factor, at which no
further robot is tried.
"""

CHANGES, REQUESTS = 50, 24
"""How many changes, and stops and starts, are asked for."""


class Figure(NamedTuple):
    """What it is, its unit, its value, that of its floor, and what the floor is."""

    what: str
    unit: str
    measured: float
    floor: float
    floor_is: str = 'relays'

    @property
    def ratio(self) -> float:
        """Figure over floor; NaN over nothing."""
        return self.measured / self.floor if self.floor else math.nan


def figure(what: str, unit: str, runs: tuple[Run, Run], value: Callable[..., float],
           *of: object) -> Figure:
    """What a function makes of a run of the suite, and of the one of its relays."""
    return Figure(what, unit, value(runs[0], *of), value(runs[1], *of))


class Bench:
    """Runs by what they are, each made once; one method for every row that can be asked for.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command.
    folder : Path
        For what is recorded.
    """

    def __init__(self, options: argparse.Namespace, folder: Path) -> None:
        self._options, self._folder = options, folder
        self._runs: dict[tuple[str, bool, bool], tuple[Run, Run]] = {}
        self._failed: dict[tuple[str, bool, bool], DmpCpgError] = {}
        self.known: dict[str, relays.Sample] = {}

    def runs(self, way: str, lock_step: bool = False, busy: bool = False) -> tuple[Run, Run]:
        """A run of the suite, and one of the relays that send its messages right after it."""
        key = (way, lock_step, busy)
        if key in self._failed:
            raise self._failed[key]
        if key not in self._runs:
            try:
                self._runs[key] = self._made(*key)
            except DmpCpgError as error:
                self._failed[key] = error
                raise
        return self._runs[key]

    def _made(self, way: str, lock_step: bool, busy: bool) -> tuple[Run, Run]:
        timed = self._options.minutes and not lock_step and way == self.ways[0]
        seconds = 60.0 * self._options.minutes if timed else self._options.seconds
        folder = self._folder / self._name(way, lock_step, busy)
        with bench_runs.competitor(busy):
            say(f'{SHARING[way]}, {"lock-step" if lock_step else "real time"}'
                 f'{", with a competitor" * busy}: the suite')
            suite = bench_runs.run_suite(way, folder, seconds, lock_step)
            known = bench_runs.write_samples(folder / 'run', folder / 'samples.json')
            self.known = self.known if lock_step else known
            say('    its relays')
            return suite, bench_runs.run_relays(shared(way), folder / 'samples.json', seconds,
                                                *['--lock-step'] * lock_step)

    def _recorded(self) -> Path:
        """Folder of a run in real time."""
        self.runs(self.ways[0])
        return self._folder / self._name(self.ways[0], False, False) / 'run'

    @staticmethod
    def _name(way: str, lock_step: bool, busy: bool) -> str:
        return f'{way}{"_lock_step" * lock_step}{"_busy" * busy}'

    @property
    def ways(self) -> list[str]:
        """How processes are shared, as was asked for."""
        return [way for way in SHARING if way in self._options.ways]

    @property
    def mujoco_s(self) -> float:
        """Time of ``mj_step`` over one tick, measured now [s]."""
        return seconds_of(relays.physics(TICK_NS), repetitions=20)

    def latency(self) -> Iterator[Figure]:
        """From the robot's state to the last of its targets, in real time."""
        for way in self.ways:
            for percent, word in ((50.0, 'median'), (99.0, '99 %')):
                yield figure(f'{SHARING[way]}, {word}', 'ms', self.runs(way),
                             lambda run, of: 1e3 * run.latency.percentile(of), percent)

    def lockstep(self) -> Iterator[Figure]:
        """Ticks per second in lock-step, and of the plain loop without ROS."""
        for way in self.ways:
            suite, floor = self.runs(way, lock_step=True)
            yield Figure(SHARING[way], '1/s', suite.rate_hz, floor.rate_hz)
            yield Figure(SHARING[way], '1/s', suite.rate_hz, 1.0 / self.mujoco_s, MUJOCO)
        rate_hz = ticks_per_second()
        yield Figure('without ROS', '1/s', rate_hz, 1.0 / self.mujoco_s, MUJOCO)
        yield Figure('without ROS', '1/s', rate_hz, RATE_HZ, 'real time')

    def cpu(self) -> Iterator[Figure]:
        """Cores in real time, in all, and in the first way by process and by thread."""
        for way in self.ways:
            for word, of in (('all', 'cpu_s'), ('waiting for a core', 'waited_s')):
                yield figure(f'{SHARING[way]}, {word}', 'cores', self.runs(way),
                             lambda run, of: run.total(of) / run.seconds, of)
        runs = self.runs(self.ways[0])
        for name in runs[0].used:
            yield figure(name, 'cores', runs,
                         lambda run, of: run.used[of].cpu_s / run.seconds, name)
        for thread in {thread: 0 for used in runs[0].used.values() for thread in used.threads}:
            found = figure(f'threads {thread}', 'cores', runs, lambda run, of: sum(
                used.threads.get(of, 0.0) for used in run.used.values()) / run.seconds, thread)
            if found.measured >= LEAST_CORES:
                yield found

    def wakeups(self) -> Iterator[Figure]:
        """Changes of context in a tick, in real time, by process; messages of its nodes."""
        for way in self.ways:
            for word, of in (('woken', 'wakeups'), ('preempted', 'preempted')):
                yield figure(f'{SHARING[way]}, {word}', '1/tick', self.runs(way),
                             lambda run, of: run.total(of) / run.seconds / run.rate_hz, of)
        for name, nodes in shared(self.ways[0]).items():
            sent, taken = map(sum, zip(*(
                relays.messages_per_tick(self.known, KIND_OF[node]) for node in nodes),
                strict=True))
            yield figure(f'{name}: takes {taken:.3g}, sends {sent:.3g}', '1/tick',
                         self.runs(self.ways[0]), lambda run, of: (
                             run.used[of].wakeups / run.seconds / run.rate_hz), name)

    def jitter(self) -> Iterator[Figure]:
        """Missed ticks and uneven periods, idle and beside one busy loop."""
        for busy in (False, True):
            for what, unit, of in _OF_PACE:
                yield figure(f'{("idle", "busy")[busy]}: {what}', unit,
                             self.runs(self.ways[0], busy=busy), of)

    def startup(self) -> Iterator[Figure]:
        """From ``walk`` to the first tick, and what of it went by until when."""
        for way in self.ways:
            suite, floor = self.runs(way)
            for stage, words in (
                    ('read', 'files read, domain found free'), ('active', 'all nodes active'),
                    ('ticking', 'first tick'), ('walking', 'walking (asked to 0.5 s later)')):
                if way == self.ways[0] or stage == 'ticking':
                    yield Figure(f'{SHARING[way]}: {words}', 's', suite.reached_s[stage],
                                 floor.reached_s['ticking'], 'relays connected')

    def parts(self) -> Iterator[Figure]:
        """One tick of each part of the plain loop, alone."""
        floor_us = 1e6 * self.mujoco_s
        for part in parts_of_a_tick():
            yield Figure(part.what, 'us', 1e6 * part.seconds, floor_us, MUJOCO)

    def memory(self) -> Iterator[Figure]:
        """Memory by process, what is shared counted once, and its growth."""
        runs = self.runs(self.ways[0])
        for name in runs[0].used:
            yield figure(name, 'MB', runs, lambda run, of: run.used[of].memory_mb, name)
        yield figure('growth of all', 'MB/min', runs, lambda run: (
            run.total('memory_mb') - sum(run.first_mb.values())) * 60.0 / run.seconds)

    def recorder(self) -> Iterator[Figure]:
        """What recording costs and loses when one process writes all topics at such a rate."""
        folder, seconds = self._folder / 'recorder', self._options.seconds
        folder.mkdir()
        samples = folder / 'samples.json'
        bench_runs.write_samples(self._recorded(), samples)
        source = {relays.SOURCE: [relays.SOURCE]}
        for times in RECORDED_RATES:
            say(f'recorder at {times} times the rate')
            bag = folder / f'bag_{times}'
            flags = ('--rate', str(RATE_HZ * times), '--seconds', str(seconds))
            bare = bench_runs.run_relays(
                {**source, RECORDER: [RECORDER]}, samples, seconds, *flags)
            run = bench_runs.run_relays(source, samples, seconds, *flags, recorder=[
                RECORDER, '--ros-args', '-p', f'output:={bag}',
                *(word for rule in namespace_rules('/relays')
                  for word in ('-r', ':='.join(rule)))])
            with opened(find_bag(bag)) as reader:
                run.taken[RECORDER] = sum(of.msgcount for of in reader.connections
                                          if not of.topic.endswith('diagnostics'))
            sent = run.taken[relays.SOURCE] / seconds
            yield figure(f'{times}x, {sent:.0f} messages/s: a message', 'us', (run, bare),
                         lambda of: 1e6 * of.used[RECORDER].cpu_s / max(1, of.taken[RECORDER]))
            yield figure(f'{times}x: lost', '%', (run, bare), lambda of: 100.0 * (
                1.0 - of.taken[RECORDER] / of.taken[relays.SOURCE]))

    def analyze(self) -> Iterator[Figure]:
        """A report of long recordings: time and memory."""
        run = self._recorded()
        with opened(find_bag(run)) as reader:
            begin = time.process_time()
            count = sum(1 for _ in recorded(reader, reader.connections))
            reading_s = (time.process_time() - begin) / count
        say('analyze, 1 min')
        least = long_recordings.cost(run, 1, self._folder)
        for minutes in self._options.bags:
            say(f'analyze, {minutes} min')
            cost = long_recordings.cost(run, minutes, self._folder)
            yield Figure(f'{minutes} min: time', 's', cost.wall_s, reading_s * cost.messages,
                         'reading the bytes')
            yield Figure(f'{minutes} min: memory', 'MB', cost.memory_mb, least.memory_mb, '1 min')

    def changes(self) -> Iterator[Figure]:
        """Parameters that change while it walks: answers, and how long no tick comes meanwhile."""
        for way in self.ways:
            say(f'{SHARING[way]}: {CHANGES} changes')
            found = judged_changes(
                bench_runs.FLAGS[way], self._folder / f'changes_{way}', CHANGES)
            for word, of in (('median', np.median), ('longest', np.max)):
                yield Figure(f'{SHARING[way]}: answer, {word}', 'ms',
                             1e3 * float(of(found.answers)), 1e-6 * TICK_NS, 'a tick')
            for percent in (99.0, 100.0):
                busy, quiet = (1e3 * float(np.percentile(of, percent))
                               for of in (found.busy, found.quiet))
                yield Figure(f'{SHARING[way]}: period while one is judged, {percent:g} %', 'ms',
                             busy, quiet, 'else')

    def requests(self) -> Iterator[Figure]:
        """Stops and starts in real time: by how much a prediction is missed."""
        for way in self.ways:
            say(f'{SHARING[way]}: {REQUESTS} requests')
            late = np.abs(bench_runs.kept_predictions(
                way, self._folder / f'requests_{way}', REQUESTS))
            for word, of in (('median', np.median), ('largest', np.max)):
                yield Figure(f'{SHARING[way]}: {len(late)} predictions, error, {word}', 'ms',
                             1e3 * float(of(late)), 1e-6 * TICK_NS, 'a tick')

    def robots(self) -> Iterator[Figure]:
        """Composed suites in namespaces, until one does not keep real time."""
        one: Sequence[Run] = ()
        for count in range(1, MOST_ROBOTS + 1):
            say(f'{count} robots')
            together = Barrier(count, timeout=300.0)
            with ThreadPoolExecutor(count) as pool:
                runs = list(pool.map(lambda k, meet=together.wait, of=count: bench_runs.run_suite(
                    'composed', self._folder / f'robots_{of}' / str(k), self._options.seconds,
                    namespace=f'robot{k}', meet=meet), range(count)))
            one = one or runs
            for what, unit, of in _OF_ROBOTS:
                yield Figure(f'{count} robots: {what}', unit, of(runs), of(one), 'one robot')
            if min(run.rate_hz for run in runs) < FULL * RATE_HZ:
                return


_OF_PACE: tuple[tuple[str, str, Callable[[Run], float]], ...] = (
    ('late targets', '1/1000 ticks', lambda run: 1e3 * run.misses / run.ticks),
    ('real-time factor', '', lambda run: run.rate_hz / RATE_HZ),
    ('period, 99 %', 'ms', lambda run: 1e3 * run.period.percentile(99.0)),
    ('period, 99.9 %', 'ms', lambda run: 1e3 * run.period.percentile(99.9)),
    ('latency, 99 %', 'ms', lambda run: 1e3 * run.latency.percentile(99.0)))

_OF_ROBOTS: tuple[tuple[str, str, Callable[[Sequence[Run]], float]], ...] = (
    ('all', 'cores', lambda runs: sum(run.total('cpu_s') / run.seconds for run in runs)),
    ('lowest real-time factor', '', lambda runs: min(run.rate_hz for run in runs) / RATE_HZ),
    ('highest latency, 99 %', 'ms', lambda runs: 1e3 * max(
        run.latency.percentile(99.0) for run in runs)))

SHORT = ('startup', 'latency', 'cpu', 'wakeups', 'memory', 'jitter', 'lockstep', 'parts',
         'recorder')
"""Rows that are measured where none are named; the first share their runs."""

ROWS = (*SHORT, 'analyze', 'robots', 'changes', 'requests')
"""Rows, each a method of :class:`Bench`."""


def say(text: str) -> None:
    """Tell of progress."""
    print(f'{datetime.now():%H:%M:%S}  {text}', file=sys.stderr, flush=True)
