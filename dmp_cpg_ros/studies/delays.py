# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Delays that capture bears: what is certified against what fails in simulation.

``python -m dmp_cpg_ros.studies.delays`` prints the table of doc/certificate.md: the gaits of the
suite at slow and fast cadences with weak and strong gains, and random networks. Samples are of one
age, of other ages on each edge, kept until they are that old, on all edges or those from the
inhibited nodes, or chosen at each moment on each edge as those that pull farthest away; the states
before the capture turn as fast as such samples let them. Where a leg turned backwards within that
age before the entry nothing is certified. Ages of samples, held or carried on, reach to a
turn, or to 0.3 s.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import (
    TOPOLOGIES,
    CouplingGraph,
    graph_from_edges,
    topology,
)
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction import delays
from dmp_cpg_ros.core.contraction.capture import capture_set, place_tolerance, radius_tolerance
from dmp_cpg_ros.core.contraction.delays import Capture
from dmp_cpg_ros.core.contraction.inhibited import NONE, inhibited_contraction
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.studies.delayed_runs import PATTERNS, fails
from dmp_cpg_ros.studies.draws import both_ways, random_edges
from dmp_cpg_ros.studies.output import markdown_table, parser_of, write_results
from dmp_cpg_ros.studies.workers import Workers

MARGINS: dict[str, Callable[[Capture], float]] = {
    'late': delays.late_margin, 'held': delays.held_margin, 'carried': delays.carried_margin}
"""Kinds of delay, and what is certified."""

AGES = 0.999 * 1.2 ** np.arange(-1, 15)
"""Ages that are tried, in units of the certified one."""

COLUMNS = ('delay', 'networks', 'none certified', 'nothing fails', 'share of what fails: least',
           'median', 'most')

MOST_AGE = 0.3
"""Largest age of samples that is tried where any is certified, if a turn takes longer [s]."""

_BETWEEN = 8  # ages from the last that works to the first that fails


@dataclass(frozen=True)
class Row:
    """One network under one kind of delay.

    Attributes
    ----------
    kind, network : str
        Kind of delay, and what was captured.
    certified, fails : float
        Age that is certified, and the smallest that fails [s]; infinite where none does.
    tried : float
        Largest age that was tried [s].
    """

    kind: str
    network: str
    certified: float
    fails: float
    tried: float

    @property
    def share(self) -> float:
        """Share of what works that is certified; 1 is tight, more would be wrong."""
        return 1.0 if self.certified == self.fails else self.certified / self.fails


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; returns 1 where something fails that is certified."""
    parser = parser_of('delays', __doc__.splitlines()[0], 'every row')
    parser.add_argument('--networks', type=int, default=100, metavar='N',
                        help='random networks beside the gaits (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=1, help='of the random networks')
    parser.add_argument('--kinds', nargs='+', choices=MARGINS, default=list(MARGINS))
    options = parser.parse_args(arguments)
    cases = [(options.seed, number, name, capture) for number, (name, capture) in enumerate(
        [*gait_captures(), *random_captures(np.random.default_rng(options.seed),
                                            options.networks)])]
    with Workers(options.workers, options.cluster) as workers:
        rows = [row for of in workers.map(partial(measured, tuple(options.kinds)), cases)
                for row in of]
    table = []
    for kind, group in product(options.kinds, ('gait', 'random')):
        of = [row for row in rows if row.kind == kind and row.network.startswith(group)]
        shares = [row.share for row in of if row.certified > 0.0 and np.isfinite(row.fails)]
        told = [f'{share:.2f}' for share in np.quantile(shares, (0.0, 0.5, 1.0))
                ] if shares else ['---'] * 3
        table.append((kind, f'{len(of)} {group}s', str(sum(row.certified == 0.0 for row in of)),
                      str(sum(np.isinf(row.fails) for row in of)), *told))
    print(markdown_table(COLUMNS, table))
    write_results(options.json, [vars(row) for row in rows])
    return int(any(row.share > 1.0 for row in rows))


def measured(kinds: Sequence[str], case: tuple[int, int, str, Capture]) -> list[Row]:
    """Rows of one network, drawn with a seed and its number."""
    seed, number, name, capture = case
    rng, rows = np.random.default_rng((seed, number)), []
    for kind in kinds:
        certified = MARGINS[kind](capture)
        tried = ages_of(capture, kind, certified)
        rows.append(Row(kind, name, certified, failing_age(capture, kind, tried, rng)
                        if certified > 0.0 else np.inf, float(tried[-1])))
    return rows


def gait_captures() -> Iterator[tuple[str, Capture]]:
    """Four legs on every graph, at cadences from a slow walk to a fast trot."""
    for graph, omega, (k, room) in product(
            TOPOLOGIES, (9.0, 20.0), ((40.0, 1.2), (100.0, 1.2), (100.0, 2.0))):
        legs = graph_from_edges(4, topology(graph, 4), k)
        found = capture_of(legs, 8.0, 1.0, omega, 0.3, room, (0,))
        if found is not None:
            yield f'gait {graph} {omega:g} rad/s, k {k:g} 1/s, {room:g} k_inh', found


def random_captures(rng: np.random.Generator, count: int, most: int = 8
                    ) -> Iterator[tuple[str, Capture]]:
    """Certified captures of random weighted networks of 2 to 8 oscillators, or fewer."""
    made = 0
    while made < count:
        size = int(rng.integers(2, most + 1))
        edges = both_ways(random_edges(size, rng))
        weights = np.exp(rng.uniform(np.log(20.0), np.log(200.0), len(edges)))
        graph = graph_from_edges(size, edges, weights)
        rho, omega = np.exp(rng.uniform(np.log([0.5, 2.0]), np.log([20.0, 20.0])))
        region, room = rng.uniform(0.15, 0.8), 1.0 + 10.0 ** rng.uniform(-2.0, 0.5)
        held = tuple(rng.choice(size, 1 + int(size > 2 and rng.random() < 0.3), replace=False))
        found = capture_of(graph, rho, 1.0, omega, region, room, held)
        if found is not None:
            made += 1
            yield f'random {made}', found


def capture_of(graph: CouplingGraph, rho: float, radius: float, omega: float, region: float,
               room: float, held: tuple[int, ...]) -> Capture | None:
    """Capture with some room over the gain that is needed; None where it is not certified."""
    system = CanonicalSystem(graph, AndronovHopf(rho, radius), state_at(graph.phases, radius))
    gains = np.zeros(graph.size)
    gains[list(held)] = 1.0
    gains *= room * float(np.nanmax(capture_set(system, omega, gains, region).needed_gain))
    found = capture_set(system, omega, gains, region)
    if not found.holds or inhibited_contraction(system, found).reach == NONE:
        return None
    degree = max(-float(graph.coupling_matrix()[2 * i, 2 * i]) for i in range(graph.size))
    return Capture(system, omega, gains, region, place_tolerance(omega, degree, radius),
                   radius_tolerance(radius, region))


def ages_of(capture: Capture, kind: str, certified: float) -> Array:
    """Ages to try: ``AGES`` times the certified one; of samples up to a turn or ``MOST_AGE``, from
    4 ms on where any is certified, ndarray [s].
    """
    if kind == 'late':
        return np.asarray(certified * AGES)
    first, turn = 0.999 * certified if np.isfinite(certified) else 4e-3, 2.0 * np.pi
    return np.geomspace(first, max(2.0 * first, min(turn / capture.omega, MOST_AGE)), 8)


def failing_age(capture: Capture, kind: str, ages: Array, rng: np.random.Generator) -> float:
    """Smallest of some ages at which a pattern fails, and then of some between [s]."""
    patterns = ('one age', 'kept') if kind == 'late' else PATTERNS
    failed = {pattern: fails(capture, kind, ages, pattern, rng) for pattern in patterns}
    first = int(np.argmax(np.any(list(failed.values()), axis=0)))
    worst = [pattern for pattern, at in failed.items() if at[first]]
    if not worst or first == 0:
        return float(ages[0]) if worst else np.inf
    between = np.geomspace(ages[first - 1], ages[first], _BETWEEN)[1:-1]
    also = np.any([fails(capture, kind, between, pattern, rng) for pattern in worst], axis=0)
    return float(between[also.argmax()] if also.any() else ages[first])


if __name__ == '__main__':
    sys.exit(main())
