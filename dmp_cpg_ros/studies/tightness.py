# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How tight the certificates are: certified values over those that work, by bisection.

``python -m dmp_cpg_ros.studies.tightness`` prints the table for four oscillators of radius 1. A
ratio of 1 is a condition that cannot be improved; each condition that is looser says why.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.certificates.step import longest_step
from dmp_cpg_ros.core.contraction.capture import capture_set
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_margin
from dmp_cpg_ros.core.contraction.inhibited import NONE, inhibited_contraction
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation
from dmp_cpg_ros.core.contraction.voting import certified_threshold, rest_threshold
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.studies.tightness_trials import (
    SIZE,
    keeps_walking,
    network,
    stays_together,
    stop_times,
    stops,
    synchronises,
    threshold,
)

Array = NDArray[np.float64]

GRAPHS = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')
RHO, OMEGA, REGION = 8.0, 12.0, 0.3
COUPLING = {'all_to_all': 100.0, 'ring': 100.0, 'path': 200.0, 'star': 100.0,
            'directed_ring': 100.0}

REASONS = {
    'synchronisation': 'sharp: below the bound the weakest eigenvector grows out of the origin; '
                       'from most other states any coupling synchronises in the end',
    'capture': 'the box bounds the pull of all rotors by omega r; at rest their radius is smaller',
    'contraction': 'sharp for every constant metric on regions with the origin in them: there the '
                   'Jacobian itself has the eigenvalue rho r^2 - lambda_min; real ones keep away '
                   'from it',
    'contraction, slow gait': 'slow rotors lock by phase alone, at k of the order of omega; the '
                              'convex set that holds them comes closer to the origin than they do',
    'frequency mismatch': 'the bound holds for every pattern of frequencies in time',
    'vote of two': 'the box bounds the pull of all rotors by omega r',
    'time to rest': 'every phase of a stop starts from the worst state of the one before',
    'time step': 'the limit covers every stiffness and every phase of w, a network has a few',
}
"""Why theory does not come closer."""


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes
    ----------
    condition, graph, quantity : str
        What is certified, on which graph, and the quantity that is compared.
    certified, works : float
        Certified value and the limit of what works in simulation.
    """

    condition: str
    graph: str
    quantity: str
    certified: float
    works: float

    @property
    def ratio(self) -> float:
        """How much more the certificate asks for than what works; 1 is tight."""
        return max(self.certified / self.works, self.works / self.certified)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; returns the exit status."""
    parser = argparse.ArgumentParser(prog='tightness', description=__doc__.splitlines()[0])
    parser.add_argument('--graphs', nargs='+', choices=GRAPHS, default=GRAPHS,
                        help='graphs to look at (default: all)')
    options = parser.parse_args(arguments)
    print(f'rho = {RHO:g} 1/s, r = 1, omega = {OMEGA:g} rad/s, r0 = {REGION:g} where not said '
          'otherwise\n')
    print('| condition | graph | quantity | certified | works | ratio |')
    print('|---|---|---|---|---|---|')
    seen: dict[str, list[float]] = {}
    for row in rows(options.graphs):
        print(f'| {row.condition} | {row.graph} | {row.quantity} | {row.certified:.4g} | '
              f'{row.works:.4g} | {row.ratio:.2f} |', flush=True)
        seen.setdefault(row.condition, []).append(row.ratio)
    print()
    for condition, ratios in seen.items():
        print(f'- {condition} ({min(ratios):.2f} to {max(ratios):.2f}): {REASONS[condition]}')
    return 0


def rows(graphs: Sequence[str]) -> Iterator[Row]:
    """All lines of the table for some graphs."""
    for make in (synchronisation_row, capture_row, contraction_row, slow_contraction_row,
                 mismatch_row, vote_row, step_row, rest_row):
        yield from map(make, graphs)


def synchronisation_row(graph: str) -> Row:
    """Coupling gain for synchronisation from every state."""
    unit = synchronisation(network(graph, 1.0, RHO).graph, 0.0).connectivity
    certified = RHO / unit
    works = threshold(lambda k: synchronises(graph, k, RHO, OMEGA), 0.5 * certified, certified)
    return Row('synchronisation', graph, 'k [1/s]', certified, works)


def capture_row(graph: str) -> Row:
    """Inhibition gain that holds all rotors in C."""
    system = network(graph, COUPLING[graph], RHO)
    certified = float(capture_set(system, OMEGA, _held(1.0), REGION).needed_gain[0])
    works = threshold(lambda gain: stops(system, OMEGA, _held(gain), REGION, 2.5),
                      0.5 * certified, 1.02 * certified)
    return Row('capture', graph, f'k_inh [1/s] at k = {COUPLING[graph]:g}', certified, works)


def contraction_row(graph: str, omega: float = OMEGA) -> Row:
    """Coupling gain for contraction under an inhibition that is more than strong enough."""
    gains = _held(3.0 * SIZE * omega / REGION)

    def certified(k: float) -> bool:
        system = network(graph, k, RHO)
        capture = capture_set(system, omega, gains, REGION)
        return capture.holds and inhibited_contraction(system, capture).reach != NONE

    needed = threshold(certified, 1.0, 50.0, 1e-3)
    works = threshold(lambda k: stops(network(graph, k, RHO), omega, gains, REGION, 6.0),
                      0.3 * needed, needed)
    return Row('contraction', graph, f'k [1/s] at omega = {omega:g}', needed, works)


def slow_contraction_row(graph: str) -> Row:
    """Return the same of a slow gait."""
    return replace(contraction_row(graph, 3.0), condition='contraction, slow gait')


def mismatch_row(graph: str) -> Row:
    """Mismatch of frequencies that keeps every leg in its place."""
    system = network(graph, COUPLING[graph], RHO)
    certified = mismatch_margin(synchronisation(system.graph, RHO), RHO, 1.0, LOCKED_PHASE_ERROR)
    works = threshold(lambda d: stays_together(system, OMEGA, d, LOCKED_PHASE_ERROR),
                      4.0 * certified, certified, 0.02)
    return Row('frequency mismatch', graph, f'delta [rad/s] at k = {COUPLING[graph]:g}', certified,
               works)


def vote_row(graph: str) -> Row:
    """Weight with which two votes stop the gait, against the equilibrium's own threshold."""
    system = network(graph, COUPLING[graph], RHO)
    certified = certified_threshold(system, OMEGA, (0, 1), REGION)
    return Row('vote of two', graph, 'alpha [1/s]', certified,
               rest_threshold(system, OMEGA, (0, 1), REGION))


def step_row(graph: str) -> Row:
    """Longest time step."""
    system = network(graph, COUPLING[graph], RHO)
    rate = min(synchronisation(system.graph, RHO).rate, 2.0 * RHO)
    certified = longest_step(RHO, 1.0, OMEGA, rate)
    works = threshold(lambda h: keeps_walking(system, OMEGA, h), 6.0 * certified, certified)
    return Row('time step', graph, 'tick [s]', certified, works)


def rest_row(graph: str) -> Row:
    """Bound on the time to rest with the default parameters, against the slowest stop."""
    bound, slowest = stop_times(graph)
    return Row('time to rest', graph, 'time [s], defaults', bound, slowest)


def _held(gain: float) -> Array:
    gains = np.zeros(SIZE)
    gains[0] = gain
    return gains


if __name__ == '__main__':
    sys.exit(main())
