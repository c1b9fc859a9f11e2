# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on the theory: many random networks at once, barely certified, each under requests,
releases and accepted changes at random times and from the edges of what is certified.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import TOPOLOGIES, CouplingGraph, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.step import cycle_radius_error, longest_step
from dmp_cpg_ros.core.contraction.capture import capture_set, radius_tolerance
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.contraction.inhibited import GLOBAL, NONE, inhibited_contraction
from dmp_cpg_ros.core.contraction.synchronisation import (
    Synchronisation,
    comparison_laplacian,
    synchronisation,
)
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.studies.adversary_runs import EVENTS, TICKS, Certified, Network, Runs
from dmp_cpg_ros.studies.draws import Case, both_ways, log_uniform, random_edges
from dmp_cpg_ros.studies.network_batch import Setting

WEAKENED = ('synchronisation', 'contraction', 'capture', 'time_step', 'cycle_radius',
            'region_per_tick', 'places', 'holding')
"""Inequalities and conditions that can be left out here to see whether the search notices."""

STARTS = 2
"""Sequences of events that each network is run through."""
KINDS = (*TOPOLOGIES, 'sparse', 'directed', 'unbalanced')


def certified(case: Case, entry: Case, system: CanonicalSystem, free: Synchronisation,
              weaken: str = '') -> Certified | None:
    """Certificate of one setting of a network; None where it has none.

    Parameters
    ----------
    case, entry : dict
        The network, and one of its ``settings``.
    system : CanonicalSystem
        What they describe.
    free : Synchronisation
        Of the couplings at gain 1.
    weaken : str
        One of ``WEAKENED``, or empty.
    """
    radius, rho, k, size = system.radius, case['rho'], entry['coupling'], system.graph.size
    free_rate = k * free.connectivity - rho * float(radius.max()) ** 2
    held = np.isin(np.arange(size), entry['held']).astype(float)
    if free_rate <= 0.0 and weaken != 'synchronisation' or not held.any():
        return None
    gains = held * entry['inhibition'] * (0.8 if weaken == 'capture' else 1.0)
    capture = capture_set(system, entry['omega'], gains, entry['region_radius'])
    found = inhibited_contraction(system, capture)
    if not (capture.holds or weaken == 'capture') or capture.tolerance <= 0.0 or (
            found.reach == NONE and weaken not in ('contraction', 'capture')):
        return None
    inner, rate = capture.smallest_radius, found.rate
    shape: Array | None = None
    from_box = bool(np.all(inner <= np.maximum(0.0, case['target_radius'] - capture.distance)))
    M = comparison_laplacian(system.graph) + np.diag(gains) - np.diag(growth(rho, radius, inner))
    if capture.rate > 0.0:
        rate = 0.99 * capture.rate
        shape = np.asarray(np.linalg.solve(M - rate * np.eye(size), np.ones(size)))
    if weaken == 'contraction':
        rate, shape = found.inhibition_rate, None
    if weaken == 'synchronisation':
        free_rate = k * free.connectivity
    r0 = entry['region_radius']
    return Certified(Setting(system, np.full(size, entry['omega']), gains, r0), capture,
                     radius_tolerance(float(radius.min()), r0), rate, shape,
                     from_box or found.reach == GLOBAL and capture.rate <= 0.0, free_rate,
                     free.weights if np.ptp(radius) == 0.0 else None)


def network(case: Case, weaken: str = '') -> Network | None:
    """Network with the certificates of all its settings; None where one has none."""
    try:
        free = synchronisation(_graph_of(case), 0.0)
        found = [certified(case, entry, _system(case, entry), free, weaken)
                 for entry in case['settings']]
    except DmpCpgError:
        return None
    settings = [one for one in found if one is not None]
    good = len(settings) == len(found) > 0 and _bears(case, settings, weaken)
    return Network(case, settings) if good else None


def _longest(case: Case, settings: list[Certified], weaken: str) -> float:
    """Longest tick that the settings bear and in which none steps over C [s]."""
    radius, fastest = max(case['radius']), max(float(one.setting.omega[0]) for one in settings)
    crossing = min(4.0 * math.asin(min(1.0, one.setting.region_radius / (2.0 * radius)))
                   / float(one.setting.omega[0]) for one in settings)
    return min(longest_step(case['rho'], radius, fastest, min(one.lasting for one in settings)),
               math.inf if weaken == 'region_per_tick' else crossing)


def _bears(case: Case, settings: list[Certified], weaken: str) -> bool:
    """Whether the tick of a case keeps what decays, the region and the cycle."""
    if weaken == 'time_step':
        return True
    if not 1e-4 < case['tick_s'] <= _longest(case, settings, weaken):
        return False
    fastest = max(float(one.setting.omega[0]) for one in settings)
    return weaken == 'cycle_radius' or len(set(case['radius'])) > 1 or cycle_radius_error(
        case['rho'], case['radius'][0], fastest, case['tick_s']) < min(
            one.radii for one in settings) / case['radius'][0]


def attack(rng: np.random.Generator, size: int, count: int, weaken: str = '',
           near: list[tuple[float, Case]] | None = None, counts: Counter[str] | None = None
           ) -> tuple[int, list[Case]]:
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
    near : list of (float, dict), optional
        Cases that came closest to a bound, of which some are varied; kept up to date.
    counts : Counter, optional
        Where networks, settings, requests, releases and changes are counted.

    Returns
    -------
    certified : int
        How many were run.
    failures : list of dict
        What happened, with the network.
    """
    near, counts = [] if near is None else near, Counter() if counts is None else counts
    alike = [case for _, case in near if len(case['phases']) == size]
    draws = [_varied(rng, alike[rng.integers(len(alike))], weaken) if alike and rng.random() < 0.3
             else _draw(rng, size, weaken) for _ in range(count)]
    networks = [one for one in draws if one is not None]
    counts.update(networks=len(networks), settings=sum(len(one.settings) for one in networks))
    runs = networks + [Network({**one.case, 'events': _events(rng)}, one.settings)
                       for one in networks for _ in range(1, STARTS)]
    told, closest = _run(runs, weaken, counts) if runs else ({}, np.zeros(0))
    near[:] = sorted([*near, *((float(closest[k]), one.case) for k, one in enumerate(networks))],
                     key=lambda one: -one[0])[:200]
    return len(networks), [{'attack': 'network', 'happened': what, **runs[k].case}
                           for k, what in sorted(told.items())]


def happened(case: Case, weaken: str = '') -> str:
    """What goes wrong with a case; empty when nothing does, or when it is not certified."""
    one = network(case, weaken)
    return '' if one is None else _run([one], weaken, Counter())[0].get(0, '')


def simpler(case: Case) -> Iterator[Case]:
    """Cases with fewer nodes, edges, settings and events, or rounder numbers."""
    for node in reversed(range(len(case['phases']) if len(case['phases']) > 1 else 0)):
        yield _without(case, node)
    for name in ('events', 'settings', 'edges'):
        for k in reversed(range(len(case[name]))):
            rest: Case = {name: case[name][:k] + case[name][k + 1:]}
            if name == 'edges':
                rest['gains'] = case['gains'][:k] + case['gains'][k + 1:]
            yield {**case, **rest}
    for digits in (1, 2, 3):
        rounded = [{**case, name: _rounded(case[name], digits)}
                   for name in ('rho', 'tick_s', 'phases', 'gains')]
        for k, entry in enumerate(case['settings']):
            for name in ('coupling', 'inhibition', 'region_radius', 'omega'):
                short = {**entry, name: _rounded(entry[name], digits)}
                settings = [*case['settings'][:k], short, *case['settings'][k + 1:]]
                rounded.append({**case, 'settings': settings})
        yield from (trial for trial in rounded if trial != case)


def _rounded(value: Any, digits: int) -> Any:
    if isinstance(value, list):
        return [_rounded(one, digits) for one in value]
    short = float(f'{value:.{digits - 1}e}')
    return value if len(repr(value)) <= len(repr(short)) else short


def _without(case: Case, node: int) -> Case:
    """The case without a node and its edges."""
    def left(i: int) -> int:
        return i - (i > node)

    kept = [k for k, edge in enumerate(case['edges']) if node not in edge]
    return {**case, 'edges': [[left(i) for i in case['edges'][k]] for k in kept],
            'gains': [case['gains'][k] for k in kept],
            **{name: case[name][:node] + case[name][node + 1:] for name in ('phases', 'radius')},
            'settings': [{**entry, 'held': [left(i) for i in entry['held'] if i != node]}
                         for entry in case['settings']]}


def _graph_of(case: Case) -> CouplingGraph:
    return CouplingGraph(len(case['phases']), tuple((i, j) for i, j in case['edges']),
                         np.reshape(case['gains'], (-1, 2, 2)), np.array(case['phases']))


def _graph(rng: np.random.Generator, size: int) -> CouplingGraph:
    """Random edges, weights and kinds of gains."""
    kind = KINDS[rng.integers(len(KINDS))]
    if kind in KINDS[:5]:
        edges = topology(kind, size)
    else:
        edges = random_edges(size, rng)
        edges = edges if kind == 'directed' else both_ways(edges)
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


def _draw(rng: np.random.Generator, size: int, weaken: str) -> Network | None:
    """A network whose settings are just inside of their inequalities; None when none is."""
    graph, radius = _graph(rng, size), rng.uniform(0.5, 2.0)
    radii, D = [radius] * size, radius
    if rng.random() < 0.1:
        radii, D = list(radius * rng.uniform(0.9, 1.1, size)), radius * rng.uniform(0.9, 1.1)
    coarse = rng.random() < 0.15                             # fast cycles that hardly attract
    rate = log_uniform(rng, 0.5, 4.0 if coarse else 30.0)
    case = {'edges': [list(edge) for edge in graph.edges], 'gains': graph.gains.tolist(),
            'phases': graph.phases.tolist(), 'rho': rate / radius**2, 'radius': radii,
            'target_radius': D, 'tick_s': 0.0, 'settings': [], 'events': []}
    connectivity = synchronisation(graph, 0.0).connectivity
    if not connectivity > 0.0:
        return None
    least, entries = case['rho'] * max(radii) ** 2 / connectivity, []
    for _ in range(rng.integers(4, 10)):
        k = least * (1.0 + 10.0 ** (
            rng.uniform(-4.0, 0.0) if rng.random() < 0.35 else rng.uniform(0.0, 1.5)))
        held = {0 if rng.random() < 0.5 else int(rng.integers(size))}
        if rng.random() < 0.3:
            held.add(int(rng.integers(size)))
        entries.append({
            'coupling': k * (0.7 if weaken == 'synchronisation' else 1.0), 'held': sorted(held),
            'inhibition': 1.0,
            'omega': log_uniform(rng, *((15.0, 60.0) if coarse else (0.5, 30.0))),
            'region_radius': radius * log_uniform(rng, 0.05, 0.3 if coarse else 1.2)})
    return _just_certified(rng, case, entries, weaken)


def _system(case: Case, entry: Case) -> CanonicalSystem:
    unit = _graph_of(case)
    graph = CouplingGraph(unit.size, unit.edges, entry['coupling'] * unit.gains, unit.phases)
    return CanonicalSystem(graph, AndronovHopf(case['rho'], np.array(case['radius'])),
                           state_at(graph.phases, case['target_radius']))


def _just_certified(rng: np.random.Generator, case: Case, entries: list[Case], weaken: str
                    ) -> Network | None:
    """Network with those settings that are certified, inhibited by hardly more than capture needs,
    a tick that they bear, and events.
    """
    free, found = synchronisation(_graph_of(case), 0.0), []
    for entry in entries:
        system = _system(case, entry)
        held = np.isin(np.arange(system.graph.size), entry['held']).astype(float)
        needed = float(np.nanmax(capture_set(
            system, entry['omega'], held, entry['region_radius']).needed_gain))
        entry['inhibition'] = max(needed, 1e-6) * (1.0 + 10.0 ** rng.uniform(
            -6.0, math.log10(0.05) if rng.random() < 0.7 else 1.0))
        found.append(certified(case, entry, system, free, weaken))
    settings = [one for one in found if one is not None]
    if not settings:
        return None
    case['settings'] = [entry for entry, one in zip(entries, found, strict=True) if one]
    longest = min(0.01, _longest(case, settings, weaken)) * rng.uniform(0.5, 1.0)
    if weaken == 'time_step':
        longest = rng.uniform(0.02, 0.12)
    for share in (1.0, 0.5, 0.25):
        case = {**case, 'tick_s': share * longest, 'events': _events(rng)}
        if _bears(case, settings, weaken):
            return Network(case, settings)
    return None


def _events(rng: np.random.Generator) -> list[list[Any]]:
    """Ticks to wait, what happens then, and a number that says how."""
    kinds = rng.choice(list(EVENTS), 30, p=list(EVENTS.values()))
    waits = np.exp(rng.uniform(0.0, math.log(200.0), 30)).astype(int)
    kinds[0], waits[0] = rng.choice(['scatter', 'gather', 'edge']), 0
    last = int(np.searchsorted(np.cumsum(waits), TICKS))
    return [[int(wait), str(kind), int(value)] for wait, kind, value in zip(
        waits[:last], kinds, rng.integers(1 << 30, size=30), strict=False)]


def _varied(rng: np.random.Generator, case: Case, weaken: str) -> Network | None:
    """A network with other numbers and events than one that came close to a bound."""
    def near(value: float) -> float:
        return value * math.exp(0.1 * rng.normal())

    entries = [{**entry, **{name: near(entry[name])
                            for name in ('coupling', 'omega', 'region_radius')}}
               for entry in case['settings']]
    return _just_certified(rng, {**case, 'rho': near(case['rho'])}, entries, weaken)


def _run(networks: list[Network], weaken: str, counts: Counter[str]
         ) -> tuple[dict[int, str], Array]:
    """Run all at once; which of them fail and how, and how close each came to a bound."""
    run = Runs(networks, weaken, counts)
    with np.errstate(all='ignore'):
        run.run()
    return run.told, run.closest
