# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the commands of the studies share: tables, options, files of results."""

from __future__ import annotations

import argparse
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dmp_cpg_ros.analysis.strict_json import write_json
from dmp_cpg_ros.analysis.tables import markdown_table as markdown_table


def percent(part: float, whole: float) -> str:
    """Share as a cell; of nothing it is 0 %."""
    return f'{100.0 * part / max(whole, 1):.0f} %'


def at_least_one(text: str) -> int:
    """Type of an option that is a positive number."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f'{number} must be at least 1')
    return number


def parser_of(name: str, description: str | None, written: str, *, jobs: bool = True,
              logs: bool = False) -> argparse.ArgumentParser:
    """Parser with the options ``--json``, for what is written, those of
    :class:`~dmp_cpg_ros.studies.workers.Workers`, and that of :func:`folder_of_logs`.
    """
    parser = argparse.ArgumentParser(prog=name, description=(description or '').replace('``', ''),
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    if jobs:
        parser.add_argument('--workers', '--jobs', type=at_least_one,
                            default=os.cpu_count() or 1, metavar='N',
                            help='processes (default: one per processor)')
        parser.add_argument(
            '--cluster', default='', metavar='ADDRESS',
            help='of the scheduler of a dask.distributed cluster, such as tcp://HOST:8786, whose '
            'workers have this package; needs pip install distributed')
    if logs:
        parser.add_argument('--logs', type=Path, metavar='FOLDER',
                            help='where to keep what the processes say')
    parser.add_argument('--json', type=Path, metavar='FILE', help=f'write {written}')
    return parser


@contextmanager
def folder_of_logs(kept: Path | None) -> Iterator[Path]:
    """A folder for processes, which keeps what they say where that is wanted."""
    with TemporaryDirectory() as folder:
        try:
            yield Path(folder)
        finally:
            if kept is not None:
                kept.mkdir(parents=True, exist_ok=True)
                for log in (*Path(folder).rglob('*.log'), *Path(folder).glob('said.txt')):
                    shutil.copy(log, kept)


def write_results(file: Path | None, results: Any) -> None:
    """Write results as JSON, where a file was asked for."""
    if file:
        write_json(file, results)
        print(f'\nwrote {file}')
