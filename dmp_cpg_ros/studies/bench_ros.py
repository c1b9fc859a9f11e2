# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measures the running suite, each figure beside a floor that was measured in the same run.

The floor is mostly a chain of bare relays (studies/relays.py), which is measured right after the
suite. Ctrl-C leaves what was measured; doc/performance.md says how each row is.
"""

from __future__ import annotations

import argparse
import math
import os
import platform
import sys
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dmp_cpg_ros.analysis.manifest import host_facts
from dmp_cpg_ros.analysis.strict_json import write_json
from dmp_cpg_ros.commands.ros_arguments import run_command
from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.files import readable
from dmp_cpg_ros.studies.bench_rows import ROWS, SHARING, SHORT, Bench, Figure, say
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of

BEGIN, END = '<!-- make bench-ros: begin -->', '<!-- make bench-ros: end -->'
"""Where the document has the table."""

COLUMNS = ('row', 'what', 'unit', 'measured', 'floor', 'ratio', 'floor is')


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('bench_ros', __doc__, 'the table as JSON (default: bench_ros.json)',
                       jobs=False)
    parser.set_defaults(json=Path('bench_ros.json'))
    add = parser.add_argument
    add('--rows', nargs='+', choices=ROWS, default=SHORT, metavar='ROW',
        help=f'rows to measure: {", ".join(ROWS)} (default: all but the last four)')
    add('--ways', nargs='+', choices=SHARING, default=list(SHARING), metavar='WAY',
        help=f'how processes are shared: {", ".join(SHARING)} (default: all)')
    add('--seconds', type=float, default=10.0, help='length of every window (default: 10)')
    add('--minutes', type=float, metavar='M',
        help='length of those in real time in the first way, idle and busy')
    add('--bags', type=at_least_one, nargs='+', default=[10, 60], metavar='M',
        help='lengths of the recordings of row analyze [min] (default: 10 60)')
    add('--update-doc', type=Path, metavar='FILE',
        help='write the table into its place in doc/performance.md')
    return run_command(parser, arguments, _bench)


def _bench(options: argparse.Namespace, _: Any) -> int:
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    rows, about, status = list[tuple[str, Figure]](), machine(), 0
    with TemporaryDirectory() as folder:
        bench = Bench(options, Path(folder))
        try:
            for name in options.rows:
                say(name)
                try:
                    for found in getattr(bench, name)():
                        rows.append((name, found))
                except DmpCpgError as error:
                    say(f'no {name}: {error}')
                    status = 1
                finally:
                    write_json(options.json, {'machine': about, 'options': vars(options), 'rows': [
                        {'row': row, **of._asdict(), 'ratio': of.ratio} for row, of in rows]})
        except KeyboardInterrupt:
            status = 130
    text = f'{about}\n\n{table(rows)}'
    print(f'\n{text}\n\n{len(rows)} figures, also in {options.json}')
    if options.update_doc and rows:
        update(options.update_doc, text)
    return status


def table(rows: Sequence[tuple[str, Figure]]) -> str:
    """Markdown table of all figures."""
    return markdown_table(COLUMNS, [
        (row, of.what, of.unit, *map(_cell, (of.measured, of.floor, of.ratio)), of.floor_is)
        for row, of in rows])


def update(document: Path, text: str) -> None:
    """Write a text between the marks of a document; raises DataError where there are none."""
    before, begin, rest = readable(document).read_text(encoding='utf-8').partition(BEGIN)
    _, end, after = rest.partition(END)
    if not end:
        raise DataError(f"'{document}' has no lines {BEGIN} and {END}")
    document.write_text(f'{before}{begin}\n{text}\n{end}{after}', encoding='utf-8')


def machine() -> str:
    """What was measured on, and how busy it was before."""
    host = host_facts()
    return (f'{datetime.now(timezone.utc):%Y-%m-%d}, {host["cores"]} processors '
            f'({host["processor"]}), {platform.platform(terse=True)}, Python '
            f'{platform.python_version()}, load before the run {host["load_average"][0]:.1f}')


def _cell(value: float) -> str:
    return f'{value:.3g}' if math.isfinite(value) and abs(value) < 1e3 else (
        f'{value:,.0f}' if math.isfinite(value) else '–')


if __name__ == '__main__':
    sys.exit(main())
