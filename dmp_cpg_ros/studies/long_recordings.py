# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long ``analyze`` takes for long recordings, and how much memory.

A recorded run is repeated, its stamps going on, until the recording is as long as wanted; then
``analyze`` reports it in a process of its own.
"""

from __future__ import annotations

import argparse
import os
import struct
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from rosbags.rosbag2 import StoragePlugin, Writer

from dmp_cpg_ros.analysis.bag import STORE, find_bag, opened, recorded
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import run_command
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of, write_results

SECOND = 1_000_000_000
STAMP = struct.Struct('<iI')
STAMPED = ('header', 'clock')
"""Fields that begin with a stamp, behind the four bytes that say how a message is encoded."""


class Cost(NamedTuple):
    """Length [min], messages, size [MB]; time of ``analyze`` [s] and memory at most [MB]."""

    minutes: int
    messages: int
    size_mb: float
    wall_s: float
    processor_s: float
    memory_mb: float


def repeated(run: Path, folder: Path, minutes: int) -> int:
    """Write a run again and again, until the recording is as long; returns the messages."""
    with opened(find_bag(run)) as reader, Writer(
            folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        source = list(recorded(reader, reader.connections))
        kinds = {of.topic: of.msgtype for of in reader.connections}
        into = {topic: writer.add_connection(topic, kind, typestore=STORE)
                for topic, kind in kinds.items()}
        stamped = {topic for topic, kind in kinds.items()
                   if STORE.fielddefs[kind][1][0][0] in STAMPED}
        first, last = source[0][1], source[-1][1]
        period = last - first + 4_000_000
        count, tell = 0, Progress()
        for offset in range(0, minutes * 60 * SECOND, period):
            tell(f'{offset / SECOND / 60.0:.1f} of {minutes} minutes are written')
            for connection, bag_ns, raw in source:
                if bag_ns - first + offset >= minutes * 60 * SECOND:
                    break
                data = bytearray(raw)
                if connection.topic in stamped:
                    seconds, rest = STAMP.unpack_from(raw, 4)
                    stamp = divmod(seconds * SECOND + rest + offset, SECOND)
                    STAMP.pack_into(data, 4, *stamp)
                writer.write(into[connection.topic], bag_ns + offset, data)
                count += 1
    return count


def cost(run: Path, minutes: int, folder: Path) -> Cost:
    """Write a recording and analyze it."""
    bag = folder / f'bag_{minutes}'
    messages = repeated(run, bag, minutes)
    size = sum(file.stat().st_size for file in bag.iterdir())
    begin = time.monotonic()
    process = subprocess.Popen(
        [sys.executable, '-m', 'dmp_cpg_ros.commands.analyze', str(bag), '--out',
         str(folder / 'out')], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.monotonic() - begin
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, process.args)
    for file in bag.iterdir():
        file.unlink()
    return Cost(minutes, messages, size / 1e6, wall, usage.ru_utime + usage.ru_stime,
                usage.ru_maxrss * 1024 / 1e6)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('long_recordings', __doc__, 'what was measured', jobs=False)
    parser.add_argument('run', type=Path, help='recorded run that is repeated')
    parser.add_argument('--minutes', type=at_least_one, nargs='+', default=[1, 10, 60])
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: Any) -> int:
    with TemporaryDirectory() as folder:
        found = [cost(options.run, minutes, Path(folder)) for minutes in options.minutes]
    print(markdown_table(
        ('minutes', 'messages', 'size [MB]', 'time [s]', 'of processor [s]', 'memory [MB]'),
        [(str(of.minutes), f'{of.messages:,}', f'{of.size_mb:.0f}', f'{of.wall_s:.1f}',
          f'{of.processor_s:.1f}', f'{of.memory_mb:.0f}') for of in found]))
    write_results(options.json, [of._asdict() for of in found])
    return 0


if __name__ == '__main__':
    sys.exit(main())
