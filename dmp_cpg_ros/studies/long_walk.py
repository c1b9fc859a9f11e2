# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Walks for long, in ten processes and recorded, and looks whether their memory grows.

Every minute has a command of its own, one of three gaits, a curve, a step aside, a stop by
inhibition and a start. Memory is what a process shares with no other. The growth is the slope of
the least squares through all readings of the second half, for an hour of the robot's clock. Exit
status 1 when the robot did not walk to the end.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from dmp_cpg_ros.commands.ros_arguments import RosArguments, positive, run_command
from dmp_cpg_ros.studies.bench_runs import shared
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of, write_results
from dmp_cpg_ros.studies.process_usage import private_mb
from dmp_cpg_ros.studies.walk_process import WITHIN_S, WalkProcess

MINUTE = 60.0
"""Of the robot's clock [s]."""

LAST_LINES = 10

GAITS = ('amble', 'trot', 'walk')


def events(minutes: int) -> Iterator[dict[str, object]]:
    """Events of a scenario of some minutes."""
    for minute in range(minutes):
        begin = MINUTE * minute
        if minute:
            yield {'at': begin, 'gait': GAITS[minute % len(GAITS)]}
        for after_s, velocity in ((2.0, {'v_x': 0.5}), (20.0, {'v_x': 0.4, 'gamma': 0.3}),
                                  (30.0, {'v_x': 0.3, 'v_y': -0.1}), (40.0, {'v_x': 0.6})):
            yield {'at': begin + after_s, 'command': velocity}
        yield {'at': begin + 50.0, 'inhibit': True}
        yield {'at': begin + 55.0, 'inhibit': False}


def growth(memory_mb: Sequence[float], hours: float) -> float:
    """Slope of the second half of readings that are evenly over some hours [MB/h]."""
    half = memory_mb[len(memory_mb) // 2:]
    if len(half) < 2:
        return 0.0
    return len(memory_mb) / hours * float(np.polyfit(np.arange(len(half)), half, 1)[0])


def measure(walk: WalkProcess, every_s: float) -> dict[str, list[float]]:
    """Memory of every process [MB], read as often until the walk ends.

    Raises
    ------
    DmpCpgError
        If the suite does not come to walk.
    """
    walk.must_walk()
    pids = {name: walk.pid_of(nodes) for name, nodes in shared('each').items()}
    pids['walk'] = walk.process.pid
    read, begin = {name: list[float]() for name in pids}, time.monotonic()
    while walk.process.poll() is None:
        try:
            found = {name: private_mb(pid) for name, pid in pids.items()}
        except OSError:  # one has ended, and so will the walk
            with suppress(subprocess.TimeoutExpired):
                walk.process.wait(WITHIN_S)
            break
        for name, memory_mb in found.items():
            read[name].append(memory_mb)
        print(f'\rmemory read for {(time.monotonic() - begin) / MINUTE:.1f} min ', end='',
              file=sys.stderr, flush=True)
        with suppress(subprocess.TimeoutExpired):
            walk.process.wait(every_s)
    return read


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('long_walk', __doc__, 'every reading', jobs=False)
    parser.add_argument('--minutes', type=at_least_one, default=60, metavar='M')
    parser.add_argument('--rate', type=positive, default=250.0, metavar='HZ',
                        help='ticks a second (default: 250)')
    parser.add_argument('--lock-step', action='store_true', help='as fast as the machine does')
    parser.add_argument('--every', type=positive, default=30.0, metavar='S',
                        help='time between two readings [s] (default: 30)')
    return run_command(parser, arguments, _main)


def _main(options: argparse.Namespace, _: RosArguments) -> int:
    with tempfile.TemporaryDirectory() as folder:
        walk = WalkProcess.of(
            Path(folder), MINUTE * options.minutes, events(options.minutes), '--rate',
            str(options.rate), *['--lock-step'] * options.lock_step)
        try:
            read = measure(walk, options.every)
        finally:
            status = walk.end()
        said = ''.join(walk.lines[-LAST_LINES:])
    print('\n' + table(read, options.minutes / 60.0))
    write_results(options.json, read)
    if status != 0:
        print(f'the walk ended with status {status}:\n{said}', file=sys.stderr)
    return int(status != 0)


def table(read: dict[str, list[float]], hours: float) -> str:
    """Memory at the first reading, in the middle and at the last, and its growth, by process."""
    def row(name: str, memory: Sequence[float]) -> tuple[str, ...]:
        if not memory:  # it ended before the first
            return name, *'----'
        return (name, *(f'{memory[k]:.1f}' for k in (0, len(memory) // 2, -1)),
                f'{growth(memory, hours):+.2f}')

    return markdown_table(
        ('process', 'MB at first', 'in the middle', 'in the end', 'growth, MB/h'),
        [row(name, memory) for name, memory in read.items()])


if __name__ == '__main__':
    sys.exit(main())
