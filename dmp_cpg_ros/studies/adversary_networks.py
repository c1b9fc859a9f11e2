# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on the theory: many random networks at once, barely certified, stepped from the edges of
the set that they are said to stay in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.graph import CouplingGraph, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.step import longest_step
from dmp_cpg_ros.core.contraction.capture import CaptureSet, capture_set
from dmp_cpg_ros.core.contraction.inhibited import NONE, inhibited_contraction
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import ExponentialStep

WEAKENED = ('capture', 'contraction', 'time_step')
"""Inequalities that can be weakened here to see whether the search notices."""

STARTS = 4
TICKS = 1200
KINDS = ('all_to_all', 'ring', 'path', 'star', 'directed_ring', 'sparse', 'directed', 'unbalanced')


@dataclass(frozen=True)
class Drawn:
    """A network that is certified, by what was left of the inequalities."""

    system: CanonicalSystem
    omega: Array
    gains: Array
    region_radius: float
    tick_s: float
    capture: CaptureSet
    rate: float

    def as_mapping(self) -> dict[str, Any]:
        """Everything that is needed to build it again."""
        graph = self.system.graph
        return {'edges': [list(edge) for edge in graph.edges], 'gains': graph.gains.tolist(),
                'phases': graph.phases.tolist(), 'rho': self.system.rho.tolist(),
                'radius': self.system.radius.tolist(), 'target': self.system.target.tolist(),
                'omega': self.omega.tolist(), 'inhibition': self.gains.tolist(),
                'region_radius': self.region_radius, 'tick_s': self.tick_s}


def drawn(mapping: dict[str, Any]) -> Drawn:
    """Network that a mapping describes."""
    phases = np.array(mapping['phases'])
    graph = CouplingGraph(len(phases), tuple((i, j) for i, j in mapping['edges']),
                          np.array(mapping['gains']), phases)
    oscillators = AndronovHopf(np.array(mapping['rho']), np.array(mapping['radius']))
    system = CanonicalSystem(graph, oscillators, np.array(mapping['target']))
    omega, gains = np.array(mapping['omega']), np.array(mapping['inhibition'])
    capture = capture_set(system, omega, gains, mapping['region_radius'])
    return Drawn(system, omega, gains, mapping['region_radius'], mapping['tick_s'], capture,
                 max(capture.rate, inhibited_contraction(system, capture).rate))


def attack(rng: np.random.Generator, size: int, count: int, weaken: str = ''
           ) -> tuple[int, list[dict[str, Any]]]:
    """Draw networks of N nodes, run those that are certified, and report those that fail.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    size : int
        N.
    count : int
        How many to draw.
    weaken : str
        One of ``WEAKENED``, or empty.

    Returns
    -------
    certified : int
        How many were run, each from ``STARTS`` states.
    failures : list of dict
        What happened, with the network.
    """
    draws = (_draw(rng, size, weaken) for _ in range(count))
    certified = [one for one in draws if one is not None]
    if not certified:
        return 0, []
    told = _run(rng, [one for one in certified for _ in range(STARTS)])
    return len(certified), [{'attack': 'network', 'happened': what, **certified[k].as_mapping()}
                            for k, what in {k // STARTS: what for k, what in told}.items()]


def _graph(rng: np.random.Generator, size: int) -> CouplingGraph:
    """Random edges, weights and kinds of gains."""
    kind = KINDS[rng.integers(len(KINDS))]
    if kind in KINDS[:5]:
        edges = topology(kind, size)
    else:
        pairs = {(i, int(rng.integers(i))) for i in range(1, size)}
        more = rng.integers(size, size=(size, 2))
        pairs |= {(int(i), int(j)) for i, j in more if i != j}
        edges = tuple(sorted(pairs if kind == 'directed' else pairs | {(j, i) for i, j in pairs}))
    weight = {(i, j): float(np.exp(rng.uniform(-1.0, 1.0))) for i, j in edges}
    if kind != 'directed':
        slip = 0.02 if kind == 'unbalanced' else 0.0
        weight = {(i, j): weight.get((min(i, j), max(i, j)), w) * (1.0 + slip * rng.normal())
                  for (i, j), w in weight.items()}
    matrix, phases = np.eye(2), rng.uniform(-np.pi, np.pi, size)
    if rng.random() < 0.25:
        matrix = np.array([[1.0, b := rng.uniform(-0.4, 0.4)], [-b, 1.0]])
    gains = np.array([weight[edge] * matrix for edge in edges])
    if rng.random() < 0.15:
        turn = rng.normal(size=(len(edges), 2, 2)) * 0.2
        gains = gains + turn @ np.swapaxes(turn, 1, 2) * 2.0
    return CouplingGraph(size, edges, gains, phases)


def _draw(rng: np.random.Generator, size: int, weaken: str) -> Drawn | None:
    """A network just inside of its inequalities; None when it is outside."""
    graph, radius = _graph(rng, size), rng.uniform(0.5, 2.0)
    growth, speed = np.exp(rng.uniform(np.log([0.5, 0.5]), np.log([30.0, 30.0])))
    radii, D = np.full(size, radius), radius
    if rng.random() < 0.15:
        radii, D = radius * rng.uniform(0.9, 1.1, size), radius * rng.uniform(0.9, 1.1)
    oscillators = AndronovHopf(growth / radius**2, radii)
    region = radius * np.exp(rng.uniform(np.log(0.05), np.log(1.2)))
    held = np.zeros(size)
    held[0 if rng.random() < 0.5 else rng.integers(size)] = 1.0
    if rng.random() < 0.3:
        held[rng.integers(size)] = 1.0
    edge = 1.0 + 10.0 ** rng.uniform(-6.0, math.log10(0.05))
    omega = np.full(size, speed)

    def at(k: float) -> tuple[Drawn, bool]:
        scaled = CouplingGraph(size, graph.edges, k * graph.gains, graph.phases)
        system = CanonicalSystem(scaled, oscillators, state_at(graph.phases, D))
        needed = capture_set(system, omega, held, region).needed_gain
        gain = max(float(np.nanmax(needed)), 1e-6) * edge * (0.8 if weaken == 'capture' else 1.0)
        capture = capture_set(system, omega, held * gain, region)
        found = inhibited_contraction(system, capture)
        contracts = weaken == 'contraction' or found.reach != NONE
        free = synchronisation(scaled, growth)
        rate = max(found.rate, capture.rate)
        longest = longest_step(growth / radius**2, radius, speed,
                               min(rate, free.rate) if rate > 0.0 else free.rate)
        tick = min(0.01, longest) * rng.uniform(0.5, 1.0)
        if weaken == 'time_step':
            tick = rng.uniform(0.02, 0.12)
        good = (contracts and (capture.holds or weaken == 'capture') and free.synchronises
                and tick > 1e-4 and speed * tick < 2.0 * region / radius)
        return Drawn(system, omega, held * gain, region, tick, capture,
                     math.inf if weaken == 'contraction' else rate), good

    low, high = 0.5, float(np.exp(rng.uniform(np.log(5.0), np.log(300.0))))
    best, good = at(high)
    if weaken == 'contraction':
        return best if good else None
    if good and rng.random() < 0.5:                          # the weakest couplings that do
        for _ in range(8):
            middle = math.sqrt(low * high)
            trial, works = at(middle)
            low, high, best = (low, middle, trial) if works else (middle, high, best)
    return best if good else None


def _run(rng: np.random.Generator, cases: list[Drawn]) -> list[tuple[int, str]]:
    """Step all at once; which of them fail, and how."""
    count, size = len(cases), cases[0].system.graph.size
    gains = np.stack([case.gains for case in cases])
    phases = np.stack([case.system.graph.phases for case in cases])
    D = np.array([float(np.hypot(*case.system.target[0])) for case in cases])[:, None]
    box = np.stack([case.capture.distance for case in cases])
    region = np.array([case.region_radius for case in cases])[:, None]
    near = np.array([0.5 * max(0.0, case.capture.tolerance) for case in cases])[:, None]
    edge = np.arccos(np.clip(1.0 - (region * 0.999 / D) ** 2 / 2.0, -1.0, 1.0))
    ahead = rng.choice([-1.0, 1.0], (count, 1)) * edge
    place = D * np.exp(1j * ahead) + near * 0.9 * np.exp(1j * rng.uniform(0.0, 6.3, (count, size)))
    held = gains > 0.0
    place = np.where(held, D * np.exp(1j * ahead), place * np.minimum(1.0, D / np.abs(place)))
    stacks = [np.stack(parts) for parts in zip(*(_matrices(case) for case in cases), strict=True)]
    rho = np.stack([case.system.rho for case in cases])
    linear = rho * np.stack([case.system.radius for case in cases]) ** 2 + 1j * np.stack(
        [case.omega for case in cases])                      # conjugate: y turns anticlockwise
    turn, start = np.exp(1j * phases), np.angle(place)
    told: dict[int, str] = {}
    turned, before = np.zeros((count, size)), start
    settled = 2 * TICKS // 3
    lasting = np.array([settled * case.tick_s * case.rate for case in cases]) > 20.0
    for tick in range(TICKS):
        if tick == settled:
            turned[:] = 0.0
        flat = np.conj(place * turn).view(float).reshape(count, -1)
        place = np.conj(_step(stacks, flat, np.conj(linear), rho).view(complex)) / turn
        distance = np.abs(place - D)
        if tick % 3 == 0:
            angle = np.angle(place)
            turned += np.angle(np.exp(1j * (angle - before)))
            before = angle
        wrong = np.any(held & (distance > region * (1.0 + 1e-5)), axis=1)
        outside = np.any(distance > box * (1.0 + 1e-5) + 1e-9, axis=1)
        round_again = lasting & np.any(np.abs(turned) > 2.0 * np.pi, axis=1) & (tick > settled)
        broken = ~np.all(np.isfinite(distance), axis=1)
        for mask, what in ((wrong, 'leaves C'), (outside, 'leaves the invariant box'),
                           (round_again, 'goes round'), (broken, 'diverges')):
            for k in np.flatnonzero(mask):
                told.setdefault(int(k), f'{what} at tick {tick}')
    return sorted(told.items())


def _matrices(case: Drawn) -> tuple[Array, ...]:
    step = ExponentialStep(*case.system.linear_part(case.gains), case.tick_s)
    return step._to_half, step._to_end, step._final, step._c_half, step._c


def _step(stacks: list[Array], flat: Array, linear: Array, rho: Array) -> Array:
    """The canonical system's own step, stacked over networks."""
    half, end, final, c_half, c = stacks

    def nonlinear(x: Array) -> Array:
        z = np.ascontiguousarray(x).view(complex)
        return np.asarray(((linear - rho * (z.real**2 + z.imag**2)) * z).view(float))

    def times(matrix: Array, *parts: Array) -> Array:
        return np.asarray(np.matmul(matrix, np.concatenate(parts, axis=1)[:, :, None])[:, :, 0])

    n0 = nonlinear(flat)
    n_half = nonlinear(times(half, flat, n0) + c_half)
    n_end = nonlinear(times(end, flat, n0, n_half) + c)
    return times(final, flat, n0, n_half, n_end) + c
