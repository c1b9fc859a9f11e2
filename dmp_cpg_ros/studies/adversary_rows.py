# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on single rows of the certificate: each says something that a short run can refute.

Per row one function draws a case and another judges it: nothing where the case has no certificate,
else what is wrong and the share of the row's promise that was needed. A row is left out by running
cases in which it alone need not hold, or, where it is a rate, by taking it for a larger one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.studies import adversary_filters as filters
from dmp_cpg_ros.studies import adversary_oscillators as oscillators
from dmp_cpg_ros.studies import adversary_steps as steps
from dmp_cpg_ros.studies import adversary_stops as stops
from dmp_cpg_ros.studies.draws import Case, Judged, smallest


class Attack(NamedTuple):
    """How a row is attacked.

    Attributes
    ----------
    draw : callable
        Random numbers, and whether the row is left out, to a case.
    judge : callable
        The robot, a case, and whether the row is left out, to what is wrong.
    """

    draw: Callable[[np.random.Generator, bool], Case]
    judge: Callable[[RobotDescription, Case, bool], Judged]


def attack(rng: np.random.Generator, description: RobotDescription, row: str, weaken: bool
           ) -> tuple[int, list[Case]]:
    """Draw one case of a row and judge it.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    description : RobotDescription
        The robot.
    row : str
        One of ``ROWS``.
    weaken : bool
        Whether the row is left out.

    Returns
    -------
    certified : int
        Whether the case was run, 0 or 1.
    failures : list of dict
        What happened, with the case.
    """
    case = ROWS[row].draw(rng, weaken)
    found = judged(description, row, case, weaken)
    failures = [{'attack': row, 'happened': found[0], **case}] if found and found[0] else []
    return int(found is not None), failures


def judged(description: RobotDescription, row: str, case: Case, weaken: bool) -> Judged:
    """What is wrong with a case of a row; None where it is impossible or not certified."""
    try:
        with np.errstate(all='ignore'):
            return ROWS[row].judge(description, case, weaken)
    except DmpCpgError:
        return None


def smaller(description: RobotDescription, failure: Case, weaken: bool) -> Case:
    """The same failure with rounder numbers and without the parameters that it does not need."""
    row, what = failure['attack'], failure['happened']

    def told(case: Case) -> str:
        found = judged(description, row, case, weaken)
        return found[0] if found else ''

    case = {name: value for name, value in failure.items() if name not in ('attack', 'happened')}
    case = smallest(case, _simpler, lambda trial: told(trial)[:9] == what[:9])
    return {'attack': row, 'happened': told(case), **case}


def _simpler(case: Case) -> Iterator[Case]:
    for name, value in case.items():
        if isinstance(value, dict):
            for key in value:
                yield {**case, name: {one: of for one, of in value.items() if one != key}}
            for key, of in value.items():
                if isinstance(of, float) and of != (short := float(f'{of:.1e}')):
                    yield {**case, name: {**value, key: short}}
        elif isinstance(value, float) and value != (short := float(f'{value:.1e}')):
            yield {**case, name: short}


def _delay(kind: str) -> Attack:
    return Attack(partial(oscillators.draw_delay, kind=kind),
                  partial(oscillators.judge_delay, kind=kind))


ROWS = {
    'capture_anywhere': Attack(oscillators.draw_anywhere, oscillators.judge_anywhere),
    'step_capture': Attack(steps.draw, steps.judge_capture),
    'step_contraction': Attack(steps.draw, steps.judge_contraction),
    'step_synchronisation': Attack(steps.draw, steps.judge_synchronisation),
    'reference': Attack(filters.draw_reference, filters.judge_reference),
    'transformation': Attack(filters.draw_joints, filters.judge_joints),
    'hierarchy': Attack(filters.draw_hierarchy, filters.judge_hierarchy),
    'rest_posture': Attack(stops.draw_posture, stops.judge_posture),
    'rest_radius': Attack(stops.draw_radius, stops.judge_radius),
    'frequency_mismatch': Attack(oscillators.draw_frequencies, oscillators.judge_frequencies),
    'contact_feedback': Attack(oscillators.draw_frequencies, oscillators.judge_contacts),
    'late_inhibition': _delay('late'),
    'held_coupling': _delay('held'),
    'carried_coupling': _delay('carried'),
    'time_to_rest': Attack(stops.draw_slow_stop, stops.judge_slow_stop),
    'time_to_walking': Attack(stops.draw_start, stops.judge_start),
    'votes_contraction': Attack(
        oscillators.draw_votes_contraction, oscillators.judge_votes_contraction),
    'votes_suffice': Attack(
        stops.draw_votes_suffice, partial(stops.judge_votes, row='votes_suffice')),
    'votes_needed': Attack(
        stops.draw_votes_needed, partial(stops.judge_votes, row='votes_needed', fewer=1)),
    'votes_time_to_rest': Attack(
        stops.draw_votes_time, partial(stops.judge_votes, row='votes_time_to_rest'))}
"""Rows that are attacked; each can be left out."""
