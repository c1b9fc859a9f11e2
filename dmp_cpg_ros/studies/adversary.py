# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Search for a certificate that is wrong, as long as one lets it.

Three attacks: on the theory, many barely certified networks at once
(:mod:`~dmp_cpg_ros.studies.adversary_networks`); on single rows of the certificate, what each of
them says by itself (:mod:`~dmp_cpg_ros.studies.adversary_rows`); and on the suite, its loop
without legs in random settings under random sequences of requests, commands, accepted changes and
votes, of which those that came closest to a bound are varied. What is found is made smaller and
written down.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.canonical.inhibition import AUTO
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.files import readable
from dmp_cpg_ros.studies import adversary_networks, adversary_rows
from dmp_cpg_ros.studies.adversary_draws import random_events, setting, varied
from dmp_cpg_ros.studies.adversary_suite import play, smaller
from dmp_cpg_ros.studies.draws import Case, smallest
from dmp_cpg_ros.studies.oscillator_loop import CONDITIONS, Oscillators
from dmp_cpg_ros.studies.workers import SPARSE_S, Workers
from dmp_cpg_ros.suite import load_suite

WEAKENED = tuple(dict.fromkeys((*adversary_networks.WEAKENED, *CONDITIONS, *adversary_rows.ROWS)))
"""Inequalities and conditions that can be left out, to see whether the search notices."""

SHRINK_S = 10.0
"""How long a network that fails is made smaller [s]."""

ALONE = ('suite', 'auto')
"""What can be attacked alone: the suite in any setting, or with a leg chosen at each stop."""

FOLLOWING = ('rest_in_region',)
"""Rows that follow from others, as doc/certificate.md proves, so that nothing can be left out."""


def search(seed: int, seconds: float, weaken: str = '', most: int = 3, only: str = ''
           ) -> tuple[Counter[str], list[Case]]:
    """Attack until the time is over or enough was found.

    Parameters
    ----------
    seed : int
        Of the random numbers.
    seconds : float
        How long.
    weaken : str
        What is left out; empty for an honest search.
    most : int
        Failures that are enough.
    only : str
        What alone is attacked, one of ``ALONE``; empty for all.

    Returns
    -------
    counts : Counter
        What was tried.
    failures : list of dict
        The smallest cases that fail in the same way as those that were met.
    """
    from dmp_cpg_ros.robot.model_reader import load_description

    rng, end = np.random.default_rng(seed), time.monotonic() + seconds
    description, sizes = load_description(load_suite().robot_file), np.arange(2, 13)
    guided: list[tuple[float, Case]] = []
    close: list[tuple[float, Case]] = []
    counts, failures, sparse = Counter[str](), list[Case](), Progress(f'search {seed}: ', SPARSE_S)
    while time.monotonic() < end and len(failures) < most:
        if weaken in ('', *adversary_networks.WEAKENED) and not only:
            size = int(rng.choice(sizes, p=1.0 / sizes / np.sum(1.0 / sizes)))
            _, met = adversary_networks.attack(rng, size, 250, weaken, close, counts)
            failures += [_smallest(one, weaken) for one in met[:1]] + met[1:]
        rows = [weaken] if weaken in adversary_rows.ROWS else (
            [] if weaken or only else [str(rng.choice(list(adversary_rows.ROWS)))])
        for row in rows:
            ran, met = adversary_rows.attack(rng, description, row, bool(weaken))
            counts['rows'] += ran
            failures += [adversary_rows.smaller(description, one, bool(weaken)) for one in met]
        if weaken in ('', *CONDITIONS) and time.monotonic() < end:
            case = varied(rng, guided[rng.integers(len(guided))][1]) if (
                guided and rng.random() < 0.5) else setting(rng, weaken)
            if not case['events']:
                if only == 'auto':
                    case['parameters']['inhibited_legs'] = (AUTO,)
                if not _is_certified(description, case):
                    continue
                counts['suites'] += 1
                case['events'] = random_events(rng, case, weaken)
            case['parameters']['push_recovery'] = not any(
                kind == 'push' for _, kind, _ in case['events'])  # which would begin a stop anew
            what, closest = play(description, case, weaken, counts)
            guided = sorted([*guided, (closest, case)], key=lambda one: -one[0])[:16]
            if what:
                failures.append(_smallest_suite(description, case, what, weaken))
        told = (f"{counts['networks']} networks, {counts['suites']} suites, {len(failures)} "
                'failures')
        if sys.stderr.isatty():
            print(told, end='\r', file=sys.stderr)
        else:
            sparse(told)
    return counts, failures


def _is_certified(description: RobotDescription, case: Case) -> bool:
    try:
        return Oscillators(description, case).certified()
    except DmpCpgError:
        return False


def _smallest(failure: Case, weaken: str) -> Case:
    """The smallest network that fails in the same way."""
    case, happened = dict(failure), adversary_networks.happened
    what = case.pop('happened')
    del case['attack']
    case = smallest(case, adversary_networks.simpler,
                    lambda one: happened(one, weaken)[:9] == what[:9], SHRINK_S)
    return {'attack': 'network', 'happened': happened(case, weaken), **case}


def _smallest_suite(description: RobotDescription, case: Case, what: str, weaken: str) -> Case:
    case = smaller(case, lambda one: _is_certified(description, one)
                   and play(description, one, weaken)[0][:9] == what[:9])
    return {'attack': 'suite', 'happened': play(description, case, weaken)[0], **case}


def _searched(job: tuple[int, float, str, int, str]) -> tuple[Counter[str], list[Case]]:
    return search(*job)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the search; returns 1 when it found something."""
    parser = argparse.ArgumentParser(description='Search for a certificate that is wrong.')
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--workers', type=int, default=1, help='searches at once (default: 1)')
    parser.add_argument('--cluster', default='', metavar='ADDRESS',
                        help='run them on a dask.distributed cluster')
    parser.add_argument('--weaken', choices=WEAKENED, default='', help='leave this out')
    parser.add_argument('--failures', type=int, default=3, help='stop after this many')
    parser.add_argument('--record', type=Path, help='Markdown file to add the counts to, that is '
                        'there')
    parser.add_argument('--only', choices=ALONE, default='',
                        help='attack the suite alone, in any setting or with a leg that is chosen')
    return run_command(parser, arguments, _attack)


def _attack(options: argparse.Namespace, _: RosArguments) -> int:
    jobs = [(1000 * options.seed + k, options.seconds, options.weaken, options.failures,
             options.only)
            for k in range(options.workers)]
    if options.record is not None:
        readable(options.record).read_text(encoding='utf-8')  # fails before minutes of search
    if options.workers == 1 and not options.cluster:
        results = [search(*jobs[0])]
    else:
        with Workers(options.workers, options.cluster) as workers:
            results = list(workers.map(_searched, jobs))
    total = sum((counts for counts, _ in results), Counter())
    failures = [case for _, found in results for case in found]
    row = _row(total, options, len(failures))
    print(row)
    if failures:
        plain = json.loads(json.dumps(failures, default=float))  # no tuples, no types of NumPy
        print(yaml.safe_dump(plain, sort_keys=False, allow_unicode=True))
    if options.record is not None:
        text = readable(options.record).read_text(encoding='utf-8').rstrip('\n')
        options.record.write_text(f'{text}\n{row}\n', encoding='utf-8')
    return 1 if failures else 0


def _row(total: Counter[str], options: argparse.Namespace, failures: int) -> str:
    """Row of the table in ``doc/certificate.md``."""
    requests = sum(total[name] for name in ('stop', 'start', 'request', 'release', 'edge', 'box'))
    changes = sum(total[name] for name in ('set', 'gait', 'change', 'cadence'))
    return (f'| {options.seed} | {options.workers} x {options.seconds:g} s '
            f'| {", ".join(filter(None, (options.weaken or "nothing", options.only)))} '
            f'| {total["networks"]} ({total["settings"]}) '
            f'| {total["networks"] * adversary_networks.STARTS} | {total["suites"]} '
            f'| {requests} | {changes} ({total["accepted"]}) | {failures} |')


if __name__ == '__main__':
    sys.exit(main())
