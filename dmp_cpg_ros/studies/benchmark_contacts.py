# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The table of contact reflexes and contact feedback: the same seeds with and without them."""

from __future__ import annotations

from itertools import product
from multiprocessing.pool import Pool

import numpy as np

from dmp_cpg_ros.studies.benchmark_tables import ROUGH_GAITS, Table
from dmp_cpg_ros.studies.markdown_table import markdown_table
from dmp_cpg_ros.studies.walking_trials import CrossingCase, CrossingOutcome, Values, cross

GROUNDS: tuple[tuple[str, tuple[tuple[str, float], ...]], ...] = (
    ('blocks', (('height', 0.03),)),
    ('blocks', (('height', 0.05),)),
    ('blocks', (('height', 0.07),)),
    ('steps', (('height', 0.05),)),
    ('steps', (('height', 0.08),)),
)
"""Grounds that are crossed."""

FEELING: tuple[tuple[str, Values], ...] = (
    ('nothing', (('contact_feedback', False), ('stumble_lift', 0.0))),
    ('touchdown, in the phase', (('contact_feedback', True), ('stumble_lift', 0.0))),
    ('obstacles, in the swing', (('contact_feedback', False), ('stumble_lift', 0.13))),
    ('both', (('contact_feedback', True), ('stumble_lift', 0.13))),
)
"""What is felt, and the parameters that make it."""


def contacts(pool: Pool, seeds: int, phases: int) -> Table:
    """Crossings of rough ground with each of ``FEELING``."""
    rows_of = list(product(GROUNDS, ROUGH_GAITS, FEELING))
    cases = [CrossingCase(gait, kind, numbers, seed, values=values)
             for ((kind, numbers), gait, (_, values)), seed in product(rows_of, range(seeds))]
    outcomes = pool.map(cross, cases, chunksize=2)
    rows = []
    for i, ((kind, numbers), gait, (feeling, _)) in enumerate(rows_of):
        words = ', '.join(f'{name} {value:g}' for name, value in numbers)
        rows.append((f'{kind}, {words}', gait, feeling, str(seeds),
                     *_cells(outcomes[i * seeds:(i + 1) * seeds])))
    columns = ('ground', 'gait', 'feels', 'seeds', 'crossed 5 m', 'fell', 'mean distance m',
               'mean speed m/s', 'tilt rms deg')
    return Table('Feeling the ground, blind, at 0.5 m/s within a tenth',
                 markdown_table(columns, rows), list(zip(cases, outcomes, strict=True)))


def _cells(outcomes: list[CrossingOutcome]) -> tuple[str, ...]:
    """Crossed, fell, and means over the seeds."""
    speed = np.mean([outcome.distance / outcome.time for outcome in outcomes])
    return (f'{100.0 * np.mean([outcome.crossed for outcome in outcomes]):.0f} %',
            str(sum(outcome.fell for outcome in outcomes)),
            f'{np.mean([outcome.distance for outcome in outcomes]):.2f}', f'{speed:.3f}',
            f'{np.nanmean([outcome.tilt for outcome in outcomes]):.2f}')
