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
import sys
from collections.abc import Sequence
from dataclasses import asdict
from multiprocessing import Pool
from typing import Any

from dmp_cpg_ros.commands.ros_arguments import parse_arguments
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.studies import benchmark_tables
from dmp_cpg_ros.studies.output import at_least_one, parser_of, write_results

TABLES = ('speeds', 'pushes', 'rough', 'contacts', 'gaits', 'robots')
"""What can be measured."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark and print its tables; returns the exit status."""
    options, _ = parse_arguments(_parser(), arguments)
    results: dict[str, Any] = {}
    with Pool(options.jobs) as pool:
        for name in options.tables:
            try:
                table = getattr(benchmark_tables, name)(pool, options.seeds, options.phases)
            except DmpCpgError as error:
                print(f'benchmark_walking: {error}', file=sys.stderr)
                return 2
            print(f'{table.title}\n\n{table.text}\n', flush=True)
            results[name] = [asdict(case) | asdict(outcome) for case, outcome in table.results]
    write_results(options.json, results)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = parser_of('benchmark_walking', __doc__, 'every case and outcome')
    parser.add_argument('--tables', nargs='+', choices=TABLES, default=list(TABLES),
                        metavar='TABLE', help=f'which of {", ".join(TABLES)} (default: all)')
    parser.add_argument('--seeds', type=at_least_one, default=50, metavar='N',
                        help='seeds for each rough ground (default: 50)')
    parser.add_argument('--phases', type=at_least_one, default=16, metavar='N',
                        help='phases of the pushes, evenly over a cycle (default: 16)')
    return parser


if __name__ == '__main__':
    sys.exit(main())
