# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measures how the robot walks, from fixed seeds, and prints the tables of doc/results.md.

speeds: steady velocities against the commanded ones. pushes: largest speed change survived, in
eight directions at every phase. rough: share of seeds that cross 5 m of rough ground. contacts:
the same with and without the feedback of touchdown and the stumbling reflex. gaits: every ordered
pair of gaits changed while moving. robots: other robots, with their files alone; those of the
extra `robots` are left out where it is not installed.

The robot is the MuJoCo one in the plain loop, which is identical to the nodes in lock-step.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from multiprocessing import Pool
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.strict_json import write_json
from dmp_cpg_ros.commands.ros_arguments import parse_arguments
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.studies import benchmark_contacts, benchmark_tables

TABLES = ('speeds', 'pushes', 'rough', 'contacts', 'gaits', 'robots')
"""What can be measured."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark and print its tables; returns the exit status."""
    options, _ = parse_arguments(_parser(), arguments)
    results: dict[str, Any] = {}
    with Pool(options.jobs) as pool:
        for name in options.tables:
            maker = benchmark_contacts if name == 'contacts' else benchmark_tables
            make: Callable[..., benchmark_tables.Table] = getattr(maker, name)
            try:
                table = make(pool, options.seeds, options.phases)
            except DmpCpgError as error:
                print(f'benchmark_walking: {error}', file=sys.stderr)
                return 2
            print(f'{table.title}\n\n{table.text}\n', flush=True)
            results[name] = [asdict(case) | asdict(outcome) for case, outcome in table.results]
    if options.json:
        write_json(options.json, results)
        print(f'wrote {options.json}')
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog='benchmark_walking', description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--tables', nargs='+', choices=TABLES, default=list(TABLES),
                        metavar='TABLE', help=f'which of {", ".join(TABLES)} (default: all)')
    parser.add_argument('--seeds', type=_at_least_one, default=50, metavar='N',
                        help='seeds for each rough ground (default: 50)')
    parser.add_argument('--phases', type=_at_least_one, default=16, metavar='N',
                        help='phases of the pushes, evenly over a cycle (default: 16)')
    parser.add_argument('--jobs', type=_at_least_one, default=os.cpu_count() or 1, metavar='N',
                        help='processes (default: one per processor)')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write every case and outcome')
    return parser


def _at_least_one(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f'{number} must be at least 1')
    return number


if __name__ == '__main__':
    sys.exit(main())
