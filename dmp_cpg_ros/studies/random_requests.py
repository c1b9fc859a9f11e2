# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Long random sequences of everything that a user may ask of the running nodes.

The suite walks in one process and lock-step, recorded. Every 0.1 to 2 s, or within the same tick,
comes a command (possible or not), a request to stop, start, lie down, stand up or recover, a gait,
parameters (certified, refused, of a wrong type, of several nodes at once), a node that is taken
through its lifecycle, a push or a failing component; at the end the robot is brought to walk and
to rest. Nobody may raise, leave a request without an answer or refuse it without a reason; stops
and starts have to keep what was said of them, and the robot may not fall but of failing joints.

With ``--again`` each sequence is walked twice, the second time in one process, one for each block
or one for each node, and every byte has to be the same; with ``--beside`` the second time two of
them at once, in two namespaces of a domain. With ``--kills`` nodes, then processes of their own,
are killed within, named, and started again. With ``--smallest`` events are left out of a sequence
that failed as long as it fails.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.commands.suite_domain import alone_in_domain
from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.studies.draws import Case, smallest
from dmp_cpg_ros.studies.output import (
    at_least_one,
    folder_of_logs,
    markdown_table,
    parser_of,
    write_results,
)
from dmp_cpg_ros.studies.request_draws import REST, drawn
from dmp_cpg_ros.studies.request_player import ASKED
from dmp_cpg_ros.studies.request_walks import Walked, walk

LOOKED_AT = ('stops', 'starts', 'risen or lain', 'rests', 'walks', 'deaths', 'in phase')
"""What is counted in the table."""

WAYS = ('composed', 'blocks', 'each')
"""Shares of processes in which a sequence may be walked again."""

NAMESPACES = ('left', 'right')
"""Of two robots beside each other."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status, 1 where something was wrong."""
    parser = parser_of('random_requests', __doc__, 'what came of every sequence', jobs=False,
                       logs=True)
    add = parser.add_argument
    add('--runs', type=at_least_one, default=10, metavar='N', help='sequences (default: 10)')
    add('--seed', type=int, default=0, help='of the first one (default: 0)')
    add('--robots', nargs='+', default=['mini_quadruped'], metavar='FILE',
        help="that walk in turn (default: the suite's own)")
    add('--again', nargs='?', const=WAYS[0], choices=WAYS,
        help='walk each twice, the second time so, and compare')
    add('--beside', action='store_true', help='walk each again beside another, and compare')
    add('--kills', type=int, default=0, metavar='N', help='of nodes in each (default: 0)')
    add('--smallest', action='store_true', help='look for the shortest sequence that fails')
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: RosArguments) -> int:
    results: list[dict[str, Any]] = []
    masses = {name: load_description(find_config(name, ROBOTS)).mass for name in options.robots}
    seeds = range(options.seed, options.seed + options.runs)
    cases = [drawn(seed, robot, masses[robot], options.kills) for seed in seeds
             for robot in [options.robots[seed % len(options.robots)]]]
    if options.again in WAYS[1:]:  # several processes do not end at one tick
        for case in cases:
            case['end'] = [REST, True]
    size = 2 if options.beside else 1
    tell = Progress(every_s=10.0)
    with alone_in_domain(''):
        for pair in (cases[k:k + size] for k in range(0, len(cases), size)):
            outcomes = [_walked(case, options.logs and options.logs / str(case['seed']))
                        for case in pair]
            again = (_beside(pair) if options.beside else
                     [_walked(case, None, options.again) for case in pair] if options.again
                     else outcomes)
            for case, walked, other in zip(pair, outcomes, again, strict=True):
                if other is not walked and not walked.wrong:
                    walked.wrong += [f'again: {text}' for text in other.wrong]
                    if other.digests != walked.digests:
                        walked.wrong.append('another walk than the time before')
                for text in walked.wrong:
                    print(f'{case["robot"]}, seed {case["seed"]}: {text}', flush=True)
                if walked.wrong and options.smallest:
                    least = _smallest(case, walked.wrong[0])
                    print(f'seed {case["seed"]}, smallest: {least}', flush=True)
                results.append(_result(case, walked))
            tell(f'{len(results)} of {len(cases)} sequences')
            write_results(options.json, results)
    print(markdown_table(('robot', 'sequences', 'requests', 'granted', *LOOKED_AT, 'wrong'),
                         list(_rows(results))))
    print(markdown_table(('asked', 'granted', 'refused'), list(_kinds(results))))
    return int(any(result['wrong'] for result in results))


def _walked(case: Case, logs: Path | None, processes: str = WAYS[0]) -> Walked:
    """Walk in a process of its own: what one has left in the graph is not the next one's."""
    with folder_of_logs(logs) as folder, get_context('spawn').Pool(1) as alone:
        return alone.apply(walk, (case, folder, '', processes))


def _beside(pair: Sequence[Case]) -> list[Walked]:
    """Walk two at once, each in a namespace of the same domain."""
    with folder_of_logs(None) as folder, get_context('spawn').Pool(len(pair)) as both:
        walking = []
        for case, name in zip(pair, NAMESPACES, strict=False):
            (folder / name).mkdir()
            walking.append(both.apply_async(walk, (case, folder / name, f'/{name}')))
        return [each.get() for each in walking]


def _smallest(case: Case, wrong: str) -> Case:
    """The sequence without all that the failure does not need."""
    def fails(trial: Case) -> bool:
        return any(_kind(text) == _kind(wrong) for text in _walked(trial, None).wrong)

    return smallest(case, simpler, fails)


def simpler(case: Case) -> Iterator[Case]:
    """Sequences without some of the events, fewer and fewer of them."""
    events = case['events']
    size = len(events) // 2
    while size:
        for begin in range(0, len(events), size):
            yield {**case, 'events': events[:begin] + events[begin + size:]}
        size //= 2


def _kind(wrong: str) -> str:
    return wrong.partition(':')[0] if ':' in wrong else ' '.join(wrong.split()[:1])


def _result(case: Case, walked: Walked) -> dict[str, Any]:
    asked = Counter(answer.kind for answer in walked.answers)
    granted = Counter(answer.kind for answer in walked.answers if answer.accepted)
    return {**{name: case[name] for name in ('seed', 'robot', 'gait', 'control_rate')},
            'events': len(case['events']), 'asked': dict(asked), 'granted': dict(granted),
            'looked_at': dict(walked.checked), 'wrong': walked.wrong}


def _rows(results: Sequence[dict[str, Any]]) -> Iterator[list[str]]:
    for robot in dict.fromkeys(result['robot'] for result in results):
        own = [result for result in results if result['robot'] == robot]
        yield [robot, *map(str, (
            len(own), *(sum(sum(result[what].values()) for result in own)
                        for what in ('asked', 'granted')),
            *(sum(result['looked_at'].get(name, 0) for result in own) for name in LOOKED_AT),
            sum(bool(result['wrong']) for result in own)))]


def _kinds(results: Sequence[dict[str, Any]]) -> Iterator[list[str]]:
    for kind in ASKED:
        asked, granted = (sum(result[what].get(kind, 0) for result in results)
                          for what in ('asked', 'granted'))
        if asked:
            yield [kind, str(granted), str(asked - granted)]


if __name__ == '__main__':
    sys.exit(main())
