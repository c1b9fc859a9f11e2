# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How tight the certificates are: certified values over those that work, by bisection.

``python -m dmp_cpg_ros.studies.tightness`` prints the table for four oscillators of radius 1. A
ratio of 1 is a condition that cannot be improved; each condition that is looser says why. What
works is found by simulation.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product
from math import ceil, exp, log, log2

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.core.canonical import coupling as graphs
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates import step
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.contraction import capture, heterogeneity, inhibited, synchronisation
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.gait.running import RunningGait
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.prediction import look_ahead
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR, GaitSupervisor
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import phi_functions
from dmp_cpg_ros.core.maths.roots import last_that_holds
from dmp_cpg_ros.core.reference.filter import ReferenceSystem
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.voting import thresholds
from dmp_cpg_ros.paper.entry_tube import entry_tube
from dmp_cpg_ros.studies.output import markdown_table, parser_of, write_results
from dmp_cpg_ros.suite import load_gait

COUPLING = {**dict.fromkeys(graphs.TOPOLOGIES, 100.0), 'path': 200.0}
"""Coupling gains of the graphs where they are not looked for [1/s]."""

RHO, OMEGA, REGION = 8.0, 12.0, 0.3
SLOW_OMEGA = 3.0
SIZE, STEP, FREE = 4, 0.005, np.zeros(4)
"""Number of oscillators, time step of their simulations [s], and no inhibition."""

REASONS = {
    'synchronisation': 'sharp: below the bound the weakest eigenvector grows out of the origin; '
                       'from most other states any coupling synchronises in the end',
    'capture': 'the box bounds the pull of all rotors by omega r; at rest their radius is smaller',
    'contraction': 'sharp for every constant norm on regions with the origin in them: there the '
                   'Jacobian itself has the eigenvalue rho r^2 - lambda_min; real ones keep away '
                   'from it',
    'contraction, slow gait': 'slow rotors lock by phase alone, at k of the order of omega; the '
                              'convex set that holds them comes closer to the origin than they do',
    'contraction along tubes': 'one ellipse for all nodes, and bounds node by node',
    'contraction along tubes, slow gait': 'one ellipse for all nodes, and bounds node by node',
    'frequency mismatch': 'sharp for phases alone; radii and the sine take the rest',
    'vote of two': 'distances bound the pull of all rotors by omega r; at rest it is smaller',
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
    parser = parser_of('tightness', __doc__.splitlines()[0], 'every row', jobs=False)
    parser.add_argument('--graphs', nargs='+', choices=COUPLING, default=list(COUPLING),
                        help='graphs to look at (default: all)')
    options = parser.parse_args(arguments)
    print(f'rho = {RHO:g} 1/s, r = 1, omega = {OMEGA:g} rad/s, r0 = {REGION:g} where not said '
          'otherwise\n')
    found = list(rows(options.graphs, Progress(every_s=10.0)))
    print(markdown_table(('condition', 'graph', 'quantity', 'certified', 'works', 'ratio'), [
        (row.condition, row.graph, row.quantity, f'{row.certified:.4g}', f'{row.works:.4g}',
         f'{row.ratio:.2f}') for row in found]), end='\n\n')
    for condition in dict.fromkeys(row.condition for row in found):
        ratios = [row.ratio for row in found if row.condition == condition]
        print(f'- {condition} ({min(ratios):.2f} to {max(ratios):.2f}): {REASONS[condition]}')
    write_results(options.json, [vars(row) for row in found])
    return 0


def rows(graphs: Sequence[str], tell: Callable[[str], None] = lambda text: None
         ) -> Iterator[Row]:
    """All lines of the table for some graphs; how far it is is told."""
    makers: tuple[Callable[[str], Row], ...] = (
        synchronisation_row, capture_row, contraction_row,
        partial(contraction_row, omega=SLOW_OMEGA), partial(tube_row, omega=OMEGA),
        partial(tube_row, omega=SLOW_OMEGA), mismatch_row, vote_row, step_row, rest_row)
    for number, (make, graph) in enumerate(product(makers, graphs), 1):
        row = make(graph)
        tell(f'row {number} of {len(makers) * len(graphs)}: {row.condition}, {graph}')
        yield row


def network(graph: str, coupling: float | None = None) -> CanonicalSystem:
    """Four oscillators of radius 1 on a named graph, with the places of an amble."""
    phases = -2.0 * np.pi * np.array([0.0, 0.5, 0.75, 0.25])
    gain = COUPLING[graph] if coupling is None else coupling
    coupled = graphs.graph_from_edges(SIZE, graphs.topology(graph, SIZE), gain, phases)
    return CanonicalSystem(coupled, AndronovHopf(RHO), state_at(phases))


def threshold(works: Callable[[float], bool], failing: float, working: float,
              precision: float = 0.01) -> float:
    """Value at which something begins to work, by bisection between two positive ones.

    Parameters
    ----------
    works : callable
        float → bool.
    failing, working : float
        Values on either side, in either order; they are moved apart until they are.
    precision : float
        Relative precision.

    Returns
    -------
    float
        The last value that worked.
    """
    factor = 2.0 if working > failing else 0.5
    for _ in range(12):
        if works(working):
            break
        failing, working = working, working * factor
    for _ in range(12):
        if not works(failing):
            break
        failing /= factor
    rounds = ceil(log2(max(abs(log(working / failing)) / precision, 1.0)))
    return exp(last_that_holds(lambda u: works(exp(u)), log(working), log(failing), rounds))


def _walked(system: CanonicalSystem, x: Array, omega: float | Array, steps: int,
            dt: float = STEP) -> NDArray[np.complex128]:
    """States (4,) after some free steps, as complex numbers that are equal when all legs are in
    their places.
    """
    for _ in range(steps):
        x = system.step(x, omega, FREE, dt)
    return np.asarray((x[:, 0] - 1j * x[:, 1]) * np.exp(-1j * system.graph.phases))


@cache
def synchronisation_row(graph: str) -> Row:
    """Coupling gain for synchronisation from every state."""
    certified = RHO / synchronisation.synchronisation(network(graph, 1.0).graph, 0.0).connectivity
    works = threshold(partial(_synchronises, graph), 0.5 * certified, certified)
    return Row('synchronisation', graph, 'k [1/s]', certified, works)


def _synchronises(graph: str, coupling: float) -> bool:
    """Whether disagreement dies out from the state in which coupling is weakest.

    Near the origin, where the oscillators grow apart fastest, in the eigenvector of the smallest
    eigenvalue that counts.
    """
    system = network(graph, coupling)
    L, V = system.graph.block_laplacian(), synchronisation.synchronisation_complement(SIZE)
    weakest = V.T @ np.linalg.eigh(V @ (L + L.T) @ V.T)[1][:, 0]
    z = 1e-6 * (weakest[0::2] - 1j * weakest[1::2]) * np.exp(1j * system.graph.phases)
    z = _walked(system, np.stack([z.real, -z.imag], axis=1), OMEGA, 600, 0.5 * STEP)
    return bool(np.linalg.norm(z - z.mean()) < 1e-6)


def _held(gain: float) -> Array:
    return gain * np.eye(SIZE)[0]


def _stops(system: CanonicalSystem, omega: float, gains: Array, seconds: float) -> bool:
    """Whether switched inhibition brings the locked gait to rest, from several phases."""
    vote = Inhibition(True, gains, REGION)
    for phi in np.linspace(1.0, 1.0 + 2.0 * np.pi, 3, endpoint=False):
        x = state_at(phi + system.graph.phases)
        for _ in range(round(seconds / STEP)):
            x = system.step(x, omega, vote.acting_gains(x, system.target), STEP)
        acting = vote.acting_gains(x, system.target)
        moving = np.abs(system.field(x, omega, acting)).max()
        if not np.array_equal(acting, gains) or moving > 1e-2 * omega:
            return False
    return True


@cache
def capture_row(graph: str) -> Row:
    """Inhibition gain that holds all rotors in C."""
    system = network(graph)
    certified = float(capture.capture_set(system, OMEGA, _held(1.0), REGION).needed_gain[0])
    works = threshold(lambda gain: _stops(system, OMEGA, _held(gain), 2.5), 0.5 * certified,
                      1.02 * certified)
    return Row('capture', graph, f'k_inh [1/s] at k = {COUPLING[graph]:g}', certified, works)


def contraction_row(graph: str, omega: float = OMEGA) -> Row:
    """Coupling gain for contraction under an inhibition that is more than strong enough."""
    gains = _strong(omega)

    def certified(k: float) -> bool:
        system = network(graph, k)
        held = capture.capture_set(system, omega, gains, REGION)
        return held.holds and inhibited.inhibited_contraction(system, held).reach != inhibited.NONE

    needed = threshold(certified, 1.0, 50.0, 1e-3)
    return Row('contraction' + _slow(omega), graph, f'k [1/s] at omega = {omega:g}', needed,
               _stopping_coupling(graph, omega))


@cache
def tube_row(graph: str, omega: float) -> Row:
    """The same for tubes from where inhibition sets in, at this cadence."""
    return Row('contraction along tubes' + _slow(omega), graph, f'k [1/s] at omega = {omega:g}',
               _coupling_of_tubes(graph, omega), _stopping_coupling(graph, omega))


@cache
def _coupling_of_tubes(graph: str, omega: float) -> float:
    """Coupling gain with which tubes are certified."""
    gains, works = _strong(omega), _stopping_coupling(graph, omega)

    def certified(k: float) -> bool:
        system = network(graph, k)
        return (capture.capture_set(system, omega, gains, REGION).holds
                and entry_tube(system, omega, gains, REGION).holds)

    return threshold(certified, works, 1.25 * works, 0.02)


def _slow(omega: float) -> str:
    return ', slow gait' if omega == SLOW_OMEGA else ''


def _strong(omega: float) -> Array:
    return _held(3.0 * SIZE * omega / REGION)


@cache
def _stopping_coupling(graph: str, omega: float) -> float:
    """Coupling gain with which that inhibition stops the gait."""
    return threshold(lambda k: _stops(network(graph, k), omega, _strong(omega), 6.0), 0.5 * omega,
                     4.0 * omega)


def mismatch_row(graph: str) -> Row:
    """Mismatch of frequencies that keeps every leg in its place."""
    system = network(graph)
    certified = heterogeneity.mismatch_margin(
        system.graph, synchronisation.synchronisation(system.graph, RHO), RHO, 1.0,
        LOCKED_PHASE_ERROR)
    works = threshold(partial(_stays_together, system), 4.0 * certified, certified, 0.02)
    return Row('frequency mismatch', graph, f'delta [rad/s] at k = {COUPLING[graph]:g}', certified,
               works)


def _stays_together(system: CanonicalSystem, mismatch: float) -> bool:
    """Whether phases stay within their bound for every choice of signs of the mismatch, and for
    those signs in time that part two oscillators farthest.
    """
    steps, L = 300, synchronisation.comparison_laplacian(system.graph)
    gain, decay = heterogeneity.phase_gain(L), phi_functions(-STEP * L, 0)[0]
    patterns = [np.tile([1.0, *signs], (steps, 1)) for signs in product(
        (1.0, -1.0), repeat=SIZE - 1)]
    if gain is not None:
        i, j = np.unravel_index(gain.argmax(), gain.shape)
        parting = [np.eye(SIZE)[i] - np.eye(SIZE)[j]]
        while len(parting) < steps:
            parting.append(parting[-1] @ decay)
        patterns.append(np.sign(parting[::-1]))
    for pattern in patterns:
        x = state_at(system.graph.phases)
        for signs in pattern:
            x = system.step(x, OMEGA + mismatch * signs, FREE, STEP)
        z = _walked(system, x, OMEGA, 0)
        if np.ptp(np.angle(z / z[0])) > LOCKED_PHASE_ERROR:
            return False
    return True


@cache
def vote_row(graph: str) -> Row:
    """Weight with which two votes stop the gait, against the equilibrium's own threshold."""
    system = network(graph)
    certified = thresholds.certified_threshold(system, OMEGA, (0, 1), REGION)
    return Row('vote of two', graph, 'alpha [1/s]', certified,
               thresholds.rest_threshold(system, OMEGA, (0, 1), REGION))


def step_row(graph: str) -> Row:
    """Longest time step."""
    system = network(graph)
    rate = min(synchronisation.synchronisation(system.graph, RHO).rate, 2.0 * RHO)
    certified = step.longest_step(RHO, 1.0, OMEGA, rate)
    works = threshold(partial(_keeps_walking, system), 6.0 * certified, certified)
    return Row('time step', graph, 'tick [s]', certified, works)


def _keeps_walking(system: CanonicalSystem, tick: float) -> bool:
    """Whether a perturbed network still comes to its limit cycle with this time step."""
    rng = np.random.default_rng(0)
    x = state_at(system.graph.phases) + 0.3 * rng.normal(size=(SIZE, 2))
    with np.errstate(over='ignore', invalid='ignore'):
        z = _walked(system, x, OMEGA, 600, tick)
        return bool(np.abs(z - z[0]).max() < 1e-6 and np.all(np.abs(np.abs(z) - 1.0) < 0.2))


def rest_row(graph: str) -> Row:
    """Bound on the time to rest of the default amble, against its slowest stop at the highest
    speed, from a dozen phases.
    """
    p, tick = SuiteParameters(), 0.004
    gait, coupled = load_gait('amble'), CanonicalParameters(coupling_graph=graph)
    canonical = RunningGait(coupled, BodyScale(0.28, 0.22), KnownGaits({gait.name: gait}))
    network = canonical.network(gait)
    bound = certify(Setting.of(network, p, tick)).time_to_rest
    supervisor = GaitSupervisor(
        p.inhibition, p.voting, p.leg.activity_rate, p.reference)
    fastest = np.array([p.reference.max_speed, p.reference.max_lateral_speed,
                        p.reference.max_turn_rate])
    walking = replace(supervisor.initial_state(), state='walking', requested=False, armed=False,
                      automatic=False, activity=(1.0,) * SIZE)
    start = canonical.initial_state(gait, replace(p.inhibition, start_inhibited=False))
    slowest = max(
        look_ahead(supervisor, ReferenceSystem(p.reference), canonical,
                   supervisor.request(walking, True), Announced(supervisor.inhibition(walking)),
                   replace(start, x=network.locked_state(float(phi))), fastest, (0.0, 0.0, 0.0),
                   tick).time_s
        for phi in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False))
    return Row('time to rest', graph, 'time [s], defaults', bound, slowest)


if __name__ == '__main__':
    sys.exit(main())
