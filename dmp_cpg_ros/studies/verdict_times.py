# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long verdicts on random changes of parameters take, of random certified settings.

Settings have any graph, any inhibited legs, votes or none and one to three gaits; a change is of
one to three parameters or of the gait, some of it while the cadence is on its way to another. What
is told is the time of a processor, for another process may judge beside the ticks, and looks for
garbage after its answers.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.certificates.verdict import Change
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.process import collect_seldom
from dmp_cpg_ros.studies import adversary_draws
from dmp_cpg_ros.studies.certificate_settings import SCALE
from dmp_cpg_ros.studies.oscillator_loop import gaits_of
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of, write_results

LIMIT_S = 0.05
"""Time within which a change is to be judged [s]."""

_CHANGEABLE = ('coupling_gain', 'rho', 'inhibition_gain', 'region_radius', 'cadence_scale',
               'alpha_r', 'max_speed', 'braking', 'radius', 'inhibited_legs', 'coupling_graph')


@dataclass(frozen=True)
class Judged:
    """One verdict.

    Attributes
    ----------
    seconds : float
        Time of a processor that it took [s].
    accepted : bool
        Whether the change may be made.
    gaits : int
        Gaits that may be changed between.
    parameters, change : dict
        What ran, as far as it was not the default, and what was asked for.
    """

    seconds: float
    accepted: bool
    gaits: int
    parameters: dict[str, Any]
    change: dict[str, Any]


def main(arguments: Sequence[str] | None = None) -> int:
    """Judge, and tell the times; returns the exit status, 1 where one took longer than asked."""
    parser = parser_of('verdict_times', __doc__, 'every verdict', jobs=False)
    parser.add_argument('--changes', type=at_least_one, default=500, metavar='N',
                        help='how many (default: 500)')
    parser.add_argument('--seed', type=int, default=0, help='of the draws (default: 0)')
    options = parser.parse_args(arguments)
    rng = np.random.default_rng(options.seed)
    judged, tell = list[Judged](), Progress()
    while len(judged) < options.changes:
        collect_seldom()
        judged += _judged(rng)
        tell(f'{len(judged)}/{options.changes}')
    print(markdown_table(
        ('changes', 'number', 'median [ms]', '99 % [ms]', 'longest [ms]', 'within 50 ms'),
        [_row(name, [each for each in judged if each.accepted == accepted])
         for name, accepted in (('accepted', True), ('refused', False))]))
    slowest = max(judged, key=lambda each: each.seconds)
    print(f'slowest: {asdict(slowest)}')
    write_results(options.json, [asdict(each) for each in judged])
    return int(slowest.seconds > LIMIT_S)


def _row(name: str, judged: Sequence[Judged]) -> tuple[str, ...]:
    times = 1e3 * np.array([each.seconds for each in judged] or [np.nan])
    return (name, f'{len(judged)}', f'{np.median(times):.1f}', f'{np.quantile(times, 0.99):.1f}',
            f'{times.max():.1f}', f'{np.count_nonzero(times <= 1e3 * LIMIT_S)}')


def _judged(rng: np.random.Generator) -> list[Judged]:
    """Some changes of one random setting; none where it is impossible or not certified."""
    case = adversary_draws.setting(rng)
    gaits = gaits_of(case)
    names = [case['gait'], *(name for name in rng.permutation(list(gaits)).tolist()
                             if name != case['gait'])][:rng.integers(1, 4)]
    first, *others = [gaits[name] for name in names]
    try:
        running = Running(SuiteParameters(), first, SCALE, case['tick_s'], tuple(others)
                          ).changed(case['parameters'])
        held = running.certificate()
    except DmpCpgError:
        return []
    if not held.holds:
        return []
    judged = []
    for _ in range(10):
        values, proposed = dict[str, Any](), running
        try:
            if rng.random() < 0.2:
                gait = gaits[str(rng.choice(list(gaits)))]
                values, proposed = {'gait': gait.name}, replace(running, gait=gait)
            for _ in range(rng.integers(0 if values else 1, 4)):
                values |= adversary_draws.random_change(rng, _CHANGEABLE)
            proposed = proposed.changed(
                {name: value for name, value in values.items() if name != 'gait'})
            if rng.random() < 0.3:
                proposed = replace(proposed, acting_cadence=float(rng.uniform(0.7, 2.0)))
        except DmpCpgError:
            continue
        change = Change(running, held, proposed, (first, *others))
        begin = time.process_time()
        try:
            accepted = change.verdict().accepted
        except DmpCpgError:
            accepted = False
        judged.append(Judged(time.process_time() - begin, accepted, len(names),
                             case['parameters'], values))
    return judged


if __name__ == '__main__':
    sys.exit(main())
