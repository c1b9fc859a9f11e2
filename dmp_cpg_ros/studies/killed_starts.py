# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Starts suites, kills all of their processes at random moments, and looks what they leave behind.

The moments lie between the first process and some seconds of walking. What Fast DDS could leave is
shared memory: a segment of half a megabyte for each participant, its ports and their mutexes; the
profiles of the suite do without. The last suite goes to its end. Exit status 1 when there are more
such files in the end than in the beginning, of whatever process, or when a suite did not start.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of, write_results
from dmp_cpg_ros.studies.process_usage import children
from dmp_cpg_ros.studies.walk_process import WITHIN_S, WalkProcess, ahead

FOLDER = Path('/dev/shm')

LATEST_S = 6.0
"""Latest moment of a kill, from the first process on [s]."""


def files() -> dict[str, int]:
    """Files of Fast DDS in shared memory, with their sizes [bytes]."""
    found = {}
    for path in FOLDER.glob('*fast*_*') if FOLDER.is_dir() else ():
        with suppress(FileNotFoundError):
            found[path.name] = path.stat().st_size
    return found


def killed(rng: random.Random) -> int:
    """Start a suite and kill it; returns how many processes that were."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        walk = WalkProcess.of(Path(folder), 3600.0, ahead())
        deadline = time.monotonic() + WITHIN_S
        while not children(walk.process.pid) and time.monotonic() < deadline:
            if walk.process.poll() is not None:
                return 0
            time.sleep(0.02)
        time.sleep(rng.uniform(0.0, LATEST_S))
        victims = [walk.process.pid, *children(walk.process.pid)]
        rng.shuffle(victims)
        for pid in victims:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        walk.process.wait()
    return len(victims)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('killed_starts', __doc__, 'every start', jobs=False)
    parser.add_argument('--starts', type=at_least_one, default=100, metavar='N',
                        help='of whole suites (default: 100, of 12 processes)')
    parser.add_argument('--seed', type=int, default=0, help='of the moments (default: 0)')
    return run_command(parser, arguments, _main)


def _main(options: argparse.Namespace, ros: RosArguments) -> int:
    rng = random.Random(options.seed)
    before, counts, left = files(), list[int](), list[int]()
    for number in range(options.starts):
        counts.append(killed(rng))
        left.append(sum(files().values()) - sum(before.values()))
        print(f'\r{number + 1}/{options.starts} ', end='', file=sys.stderr, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        walk = WalkProcess.of(Path(folder), 8.0, ahead())
        status = walk.process.wait(WITHIN_S)
    after = files().keys() - before
    print('\n' + markdown_table(
        ('starts', 'processes killed', 'at one time, MB', 'files left in the end', 'last walk'),
        [(str(len(counts)), f'{sum(counts):,}', f'{max(left) / 1e6:.1f}', str(len(after)),
          f'status {status}')]))
    write_results(options.json, [{'processes': processes, 'left_bytes': size}
                                 for processes, size in zip(counts, left, strict=True)])
    return int(bool(after) or status != 0 or not all(counts))


if __name__ == '__main__':
    sys.exit(main())
