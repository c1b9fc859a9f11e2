# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documents say of deaths and intruders, made from the files of their studies."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from statistics import median
from typing import Any

from headlines_of_bodies import NUMBERS

from dmp_cpg_ros.studies import intruder, study_faults


def attacks(results: Any) -> list[intruder.Outcome]:
    """Attacks of ``intruder``; who was never named was so after an infinite time."""
    return [intruder.Outcome(**{name: inf if value is None else value
                                for name, value in one.items()})
            for one in results['attacks']]


def hostile(results: Any) -> str:
    """Of ``intruder``: how long, how much, and what came of it."""
    of = real(attacks(results))
    fell, slow = sum(one.fell for one in of), astray(of)
    on = 'it walks on as before after each' if not slow else (
        f'it walks on as before after all but {NUMBERS[slow]}')
    named = sorted(one.named_s for one in of)
    return (f'{results["duration_s"] / 60.0:g} minutes among {results["messages"]:,} hostile '
            f'messages and requests, {len(of)} attacks: {fell or "no"} fall, {on}, and who sends '
            f'them is named within {median(named):.1f} s (median), {named[-1]:.1f} s at worst')


def real(of: Sequence[intruder.Outcome]) -> list[intruder.Outcome]:
    """Attacks but those that do nothing, which are there to compare with."""
    return [one for one in of if one.attack != intruder.NOTHING]


def astray(of: Sequence[intruder.Outcome]) -> int:
    """After how many attacks it stood, or went slower or elsewhere than before."""
    return sum(not one.fell and not one.walked_on for one in of)


def kills(results: Any) -> str:
    """Of ``study_faults``: how many deaths, and how many falls."""
    told = []
    for lock_step, how in ((True, 'in lock-step'), (False, 'in real time')):
        of = [one for one in results if one['lock_step'] == lock_step]
        fell, count = sum(one['fell'] for one in of), sum(len(one['kills']) for one in of)
        told.append(f'{count} nodes killed {how}: {fell or "no"} fall{"s" * (fell > 1)}')
    return ', '.join(told)


def hostile_rows(results: Any) -> list[str]:
    """Row of the table of runs with an intruder."""
    of = attacks(results)
    idle = len(of) - len(real(of))
    return [f'(`--duration {results["duration_s"]:g} --seed {results["seed"]}`) | {len(of)}, '
            f'{idle} of them nothing | '
            f'{sum(one.fell for one in of)} | {astray(of)} |']


def outcome(written: Any) -> study_faults.Outcome:
    """What became of a walk, from a file, which has null for what did not happen."""
    kills_of = [study_faults.Kill(**{name: value for name, value in kill.items()
                                     if value is not None}) for kill in written['kills']]
    return study_faults.Outcome(**{**written, 'kills': kills_of})


def kill_rows(results: Any) -> list[str]:
    """Rows of the table of kills, without what recorders leave."""
    return [' | '.join(('| ' + row[0], *row[1:-1])) + ' |'
            for row in study_faults.rows(list(map(outcome, results)))]
