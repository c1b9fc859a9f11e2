# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Certified settings in simulation: a grid of 2,304, none of which may fail.

``python -m dmp_cpg_ros.studies.certified_grid`` prints by graph how many settings are certified,
and of those how many synchronise from where they are put at their rate, keep their places with
legs of unequal frequencies, and stop; and how many that a naive check passes do not. Exit status
1 where a certified one fails.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation_complement
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.studies.certificate_settings import GRAPHS, TICK, Case, grid
from dmp_cpg_ros.studies.network_batch import Batch, Setting, locked
from dmp_cpg_ros.studies.output import markdown_table, parser_of, write_results

LONGEST_S = 8.0
"""Simulated time in which a setting has to come to rest [s]."""

SYNCHRONISED_S, STEP_S = 0.4, 0.001
"""Simulated time in which settings synchronise, and its step [s]."""

Mask = NDArray[np.bool_]

COLUMNS = {
    'settings': 'settings', 'certified': 'certified', 'unequal': 'of them with unequal legs',
    'synchronise': 'synchronise at their rate', 'keep': 'keep their places, of',
    'stop': 'stop and stay', 'misread': 'eigenvalue misread: passed, drift apart',
    'loose': 'contraction without capture: passed, walk on'}
"""What is counted, and how a table calls it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('certified_grid', __doc__, 'the counts of every graph', jobs=False)
    return run_command(parser, arguments, _main)


def _main(options: argparse.Namespace, _: RosArguments) -> int:
    rows = counted(grid(Progress()))
    print(table(rows))
    write_results(options.json, rows)
    return int(not all(map(as_certified, rows)))


def counted(cases: Sequence[Case]) -> list[dict[str, Any]]:
    """Counts by graph, as :data:`COLUMNS` names them. Two numbers: of ``keep`` how many do and how
    many were tried, of ``misread`` and ``loose`` how many the check passes and how many then fail.
    """
    certified = [case for case in cases if case.certificate.holds]
    paced = [case for case in certified if case.free.weights is not None and unequal(case)]
    misread = [case for case in cases if case.misread and not case.free.synchronises]
    loose = [case for case in cases
             if case.contracts and not case.certificate['capture'].holds]
    rngs = [np.random.default_rng(seed) for seed in (1, 2, 3, 5)]
    start, end = synchronised(misread, SYNCHRONISED_S, rngs[2], worst=True)
    kept, at_rest = stopped(loose, rngs[3])
    found = (synchronise(certified, rngs[0]), np.logical_and(*stopped(certified, rngs[1])),
             keep_places(paced), end > start, ~(kept & at_rest))

    def of(graph: str, some: Sequence[Case], which: Mask | None = None) -> int:
        named = np.array([case.setting.name == graph for case in some], bool)
        return int(np.count_nonzero(named if which is None else named & which))

    return [{
        'graph': graph, 'settings': of(graph, cases), 'certified': of(graph, certified),
        'unequal': of(graph, [case for case in certified if unequal(case)]),
        'synchronise': of(graph, certified, found[0]), 'stop': of(graph, certified, found[1]),
        'keep': [of(graph, paced, found[2]), of(graph, paced)],
        'misread': [of(graph, misread), of(graph, misread, found[3])],
        'loose': [of(graph, loose), of(graph, loose, found[4])]} for graph in GRAPHS]


def as_certified(row: dict[str, Any]) -> bool:
    """Whether every certified setting of a graph did as its certificate says."""
    return bool(row['certified'] == row['synchronise'] == row['stop']
                and row['keep'][0] == row['keep'][1])


def table(rows: Sequence[dict[str, Any]]) -> str:
    """What was counted, as Markdown."""
    return markdown_table(['graph', *COLUMNS.values()], list(map(cells, rows)))


def cells(row: dict[str, Any]) -> list[str]:
    """A row of the table."""
    return [row['graph'].replace('_', ' '), *(
        ', '.join(map(str, row[name])) if isinstance(row[name], list) else str(row[name])
        for name in COLUMNS)]


def unequal(case: Case) -> bool:
    """Whether legs turn at frequencies of their own that differ by more than 1 %."""
    return bool(np.ptp(case.setting.omega) > 0.01 * case.setting.omega.max())


def disagreement(case: Case, x: Array) -> float:
    """(Σ ξ_i |z_i − z̄|²)^½ of one setting's state."""
    z = (x[:, 0] - 1j * x[:, 1]) * np.exp(-1j * case.setting.system.graph.phases)
    weights = case.free.weights
    weights = np.full(len(z), 0.25) if weights is None else weights
    return float(np.sqrt(weights @ np.abs(z - weights @ z)**2))


def synchronised(cases: Sequence[Case], seconds: float, rng: np.random.Generator, *,
                 worst: bool = False) -> tuple[Array, Array]:
    """Disagreement of alike oscillators at the start and at the end; every second network, or with
    ``worst`` all, start near the origin in the direction that decides, the others anywhere.
    """
    if not cases:
        return np.zeros(0), np.zeros(0)
    settings = [Setting(s.system, np.full(4, s.omega.max()), s.gains, s.region_radius, s.name)
                for s in (case.setting for case in cases)]
    V = synchronisation_complement(4)
    x = []
    for k, setting in enumerate(settings):
        L = setting.system.graph.block_laplacian()
        decides = V.T @ np.linalg.eigh(V @ (L + L.T) @ V.T)[1][:, 0]
        anywhere = rng.uniform(0.1, 2.0) * rng.normal(size=(4, 2))
        x.append((1e-3 * decides.reshape(4, 2) if worst or k % 2 else anywhere)
                 * setting.system.radius[0])
    start = np.array([disagreement(case, state) for case, state in zip(cases, x, strict=True)])
    batch, states = Batch(settings, STEP_S), np.stack(x)
    for _ in range(round(seconds / STEP_S)):
        states = batch.step(states, armed=False)
    return start, np.array([disagreement(case, state)
                            for case, state in zip(cases, states, strict=True)])


def synchronise(cases: Sequence[Case], rng: np.random.Generator) -> Mask:
    """Whether settings synchronise at the rate that is certified."""
    start, end = synchronised(cases, SYNCHRONISED_S, rng)
    rates = np.array([case.certificate['synchronisation'].margin for case in cases])
    weighted = np.array([case.free.weights is not None for case in cases])
    # In a hierarchy the rate shows after those in front have settled: at half of it from here on.
    return np.where(
        weighted, end <= 1.001 * start * np.exp(-rates * SYNCHRONISED_S) + 1e-12,
        end <= 30.0 * start * np.exp(-0.5 * rates * SYNCHRONISED_S) + 1e-12)


def keep_places(cases: Sequence[Case], ticks: int = 250) -> Mask:
    """Whether oscillators of unequal frequencies stay as near to their places as is certified."""
    if not cases:
        return np.zeros(0, bool)
    batch = Batch([case.setting for case in cases], TICK)
    x = np.stack([locked(case.setting, 0.0) for case in cases])
    for _ in range(ticks):
        x = batch.step(x, armed=False)
    return np.array([_apart(case, state) <= mismatch_bound(
        case.free, case.setting.system.rho[0], case.setting.system.radius[0],
        float(np.ptp(case.setting.omega))).distance for case, state in zip(cases, x, strict=True)])


def _apart(case: Case, state: Array) -> float:
    """Largest distance of two oscillators that are turned to one place."""
    z = (state[:, 0] - 1j * state[:, 1]) * np.exp(-1j * case.setting.system.graph.phases)
    return float(np.abs(z[:, None] - z[None, :]).max())


def stopped(cases: Sequence[Case], rng: np.random.Generator) -> tuple[Mask, Mask]:
    """Whether each setting, armed at a random phase, stays in C once there and ends at rest."""
    if not cases:
        return np.zeros(0, bool), np.zeros(0, bool)
    count = len(cases)
    batch = Batch([case.setting for case in cases], TICK)
    x = np.stack([locked(case.setting, rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.99, 1.0))
                  for case in cases])
    kept, entered, at_rest = np.ones(count, bool), np.zeros(count, bool), np.zeros(count, bool)
    left = np.arange(count)
    for tick in range(1, round(LONGEST_S / TICK) + 1):
        x = batch.step(x)
        inside = batch.inside(x)
        kept[left[entered[left] & ~inside]] = False
        entered[left[inside]] = True
        if tick % 50 == 0:
            moving = ~(inside & (batch.speed(x) < 1e-3 * batch.settings[0].system.radius[0]))
            at_rest[left[~moving]] = True
            if not np.any(moving):
                break
            batch.use(batch.rows[moving])
            x, left = x[moving], left[moving]
    return kept & entered, at_rest


if __name__ == '__main__':
    sys.exit(main())
