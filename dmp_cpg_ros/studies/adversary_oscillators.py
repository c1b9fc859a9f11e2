# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on the rows of oscillators that differ, vote, are anywhere, or hear others late."""

from __future__ import annotations

import math

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture_anywhere import needed_gain_anywhere
from dmp_cpg_ros.core.contraction.synchronisation import comparison_laplacian
from dmp_cpg_ros.core.inhibition.entry import entry_tolerances
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.studies import adversary_networks, delays
from dmp_cpg_ros.studies.adversary_stops import suite_case
from dmp_cpg_ros.studies.delayed_runs import PATTERNS, fails
from dmp_cpg_ros.studies.draws import Case, Judged, log_uniform
from dmp_cpg_ros.studies.network_batch import Batch, Setting
from dmp_cpg_ros.studies.oscillator_loop import Oscillators


def draw_frequencies(rng: np.random.Generator, weaken: bool) -> Case:
    """Legs whose frequencies differ by a share of what is certified."""
    share = float(rng.uniform(1.0, 4.0) if weaken else rng.uniform(0.3, 0.99))
    return suite_case(rng, {
        'coupling_gain': log_uniform(rng, 6.0, 60.0), 'rho': log_uniform(rng, 0.5, 20.0),
        'coupling_graph': str(rng.choice(list(adversary_networks.KINDS[:5])))},
        share=share, seed=int(rng.integers(1 << 30)))


def _frequencies(loop: Oscillators, difference: float, rng: np.random.Generator
                 ) -> tuple[Array, Array, Array]:
    """Largest error of phase [rad], distance and |r − |x|| that legs come to whose frequencies
    differ by so much from ω: for ever, or for a while each [rad/s].
    """
    system, p = loop.network.system, loop.parameters.canonical
    signs = 1.0 - 2.0 * ((np.arange(16)[:, None] >> np.arange(4)) & 1)
    omega, tick = float(loop.in_force().certificate().omega_max), loop.tick_ns * 1e-9
    batch = Batch([Setting(system, np.full(4, omega), np.zeros(4), 0.1)] * len(signs), tick)
    lag = np.exp(1j * loop.network.gait.phases)
    x = np.broadcast_to(np.conj(p.radius * lag)[:, None].view(float), (16, 4, 2))
    x, turns = np.array(x), rng.integers(20, 400, 16)
    worst: Array = np.zeros((3, 16))
    for now in range(1500):
        turned = np.where((np.arange(16) < 8) | (now // turns % 2 == 0), 1.0, -1.0)
        batch.omega = np.asarray(omega + difference * signs * turned[:, None], dtype=float)
        x = batch.step(x, False)
        y = np.conj(np.ascontiguousarray(x).reshape(16, -1).view(complex)) / lag
        pair = y[:, :, None] / y[:, None, :]
        np.maximum(worst, [np.abs(np.angle(pair)).max(axis=(1, 2)), np.abs(
            y[:, :, None] - y[:, None, :]).max(axis=(1, 2)), np.abs(p.radius - np.abs(y)).max(1)],
                   out=worst)
    return worst[0], worst[1], worst[2]


def judge_frequencies(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Legs whose frequencies differ by less than the margin stay near their places; those that
    differ by what is expected are let through where the row is left out.
    """
    loop = Oscillators(description, case)
    found = loop.in_force().certificate(whole=True)
    row = found['frequency_mismatch']
    if not found['synchronisation'].holds or not (row.right > 0.0 or weaken):
        return None
    spread, *_ = _frequencies(loop, row.left if weaken and not row.holds else
                              row.right * min(case['share'], 0.999),
                              np.random.default_rng(case['seed']))
    needed = float(spread.max()) / LOCKED_PHASE_ERROR
    return (f'phases differ by {spread.max():.3g} rad' if needed > 1.0 else ''), needed


def judge_contacts(description: RobotDescription, case: Case, weaken: bool) -> Judged:
    """However the feet touch down, places and radii are those that capture takes for granted."""
    case = {**case, 'parameters': {**case['parameters'], 'contact_feedback': True}}
    loop = Oscillators(description, case)
    found = loop.in_force().certificate(whole=True)
    if not found['synchronisation'].holds or not found['contact_feedback'].right > 0.0:
        return None
    share = 3.0 * case['share'] if weaken else min(case['share'], 0.999)
    _, apart, off = _frequencies(loop, found['contact_feedback'].right * share,
                                 np.random.default_rng(case['seed']))
    places, radii = entry_tolerances(loop.network, loop.parameters.inhibition.region_radius)
    needed = max(float(apart.max()) / places, float(off.max()) / radii)
    return (f'legs are {needed:.3g} times as far from their places as capture allows'
            if needed > 1.0 else ''), needed


def draw_votes_contraction(rng: np.random.Generator, _: bool) -> Case:
    """Some legs that vote, in a network of equals."""
    edges = topology(str(rng.choice(['all_to_all', 'ring', 'path', 'star'])), 4)
    rho = log_uniform(rng, 0.5, 20.0)
    voters = rng.permutation(4)[:rng.integers(2, 5)]
    return {'edges': [list(edge) for edge in edges],
            'gains': [np.eye(2).tolist() for _ in edges], 'phases': [0.0] * 4, 'rho': rho,
            'radius': [1.0] * 4, 'target_radius': 1.0, 'tick_s': 0.002, 'settings': [{
                'coupling': rho * log_uniform(rng, 2.0, 10.0), 'held': sorted(voters.tolist()),
                'inhibition': 100.0 * log_uniform(rng, 0.3, 10.0),
                'omega': log_uniform(rng, 2.0, 20.0),
                'region_radius': log_uniform(rng, 0.1, 0.8)}],
            'events': [[100, str(rng.choice(['edge', 'gather'])), int(rng.integers(1 << 30))],
                       *([int(rng.integers(1, 150)), 'request', 0] for _ in range(3)),
                       *([int(rng.integers(1, 20)), 'cadence', 1] for _ in range(10))]}


def judge_votes_contraction(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Under all votes |ẋ| shrinks at the certified rate; growth is left out of it."""
    left_out = 'contraction' if weaken else ''
    if adversary_networks.network(case, left_out) is None:
        return None
    return adversary_networks.happened(case, left_out), 0.0


def draw_anywhere(rng: np.random.Generator, weaken: bool) -> Case:
    """One inhibited node, with little room in its gain."""
    size = int(rng.integers(2, 7))
    return {'size': size, 'graph': str(rng.choice(list(adversary_networks.KINDS[:5]))),
            'coupling': log_uniform(rng, 2.0, 200.0), 'rho': log_uniform(rng, 0.5, 20.0),
            'omega': log_uniform(rng, 0.5, 30.0), 'region_radius': log_uniform(rng, 0.05, 1.0),
            'room': float(rng.uniform(0.7, 0.95)) if weaken else log_uniform(rng, 1.000001, 1.2),
            'seed': int(rng.integers(1 << 30))}


def judge_anywhere(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """C is not left while the other nodes are anywhere; the gain is taken for less than is
    needed.
    """
    size, r0, rng = case['size'], case['region_radius'], np.random.default_rng(case['seed'])
    edges = topology(case['graph'], size)
    graph = graph_from_edges(size, edges, case['coupling'])
    system = CanonicalSystem(graph, AndronovHopf(case['rho'], 1.0), state_at(np.zeros(size), 1.0))
    gains = np.zeros(size)
    gains[0] = case['room'] * needed_gain_anywhere(system, case['omega'], 0, r0)
    if not gains[0] > 0.0 or gains[0] > 1e5:
        return None
    angles = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    x = np.exp(2j * np.pi * rng.random((64, size))) * np.sqrt(rng.random((64, size)))
    x[:, 1:][::2] = np.exp(1j * angles)[::2, None]       # all others pull outwards
    x[:, 0] = 1.0 + (1.0 - 1e-9) * r0 * np.exp(1j * angles)
    step = 0.02 / (float(np.diag(comparison_laplacian(graph)).max()) + float(gains[0])
                   + case['omega'] + 4.0 * case['rho'])
    batch = Batch([Setting(system, np.full(size, case['omega']), gains, math.inf)] * 64, step)
    states, most = np.ascontiguousarray(x)[..., None].view(float), 0.0
    for _tick in range(200):
        states = batch.step(states)
        most = max(most, float(np.hypot(states[:, 0, 0] - 1.0, states[:, 0, 1]).max()) / r0)
    return (f'leaves C, to {most:.4g} r0' if most > 1.0 + 1e-6 else ''), most


_TIMES = {'late': (1.2, 1.6), 'held': (1.0, 20.0), 'carried': (0.1, 1.0)}
"""How many times as old as certified samples are where the row is left out. What makes up for
older ones is then left out, too: that a walk with states that are held is slower, and that those
that are carried on are so outside of C alone.
"""
_WITHOUT = {'late': 'late', 'held': 'held at once', 'carried': 'always carried'}


def draw_delay(rng: np.random.Generator, weaken: bool, kind: str) -> Case:
    """A kind of delay: of what a few legs bear, most of all for states held."""
    patterns = ['one age', 'kept'] if kind == 'late' else list(PATTERNS)
    return {'size': int(rng.integers(2, 5)), 'seed': int(rng.integers(1 << 30)),
            'pattern': str(rng.choice(patterns)),
            'times': log_uniform(rng, *_TIMES[kind]) if weaken else float(rng.uniform(0.3, 0.999))}


def judge_delay(_: RobotDescription, case: Case, weaken: bool, kind: str) -> Judged:
    """Capture bears samples, or a switch, of the certified age; it is exceeded where the row is
    left out.
    """
    rng = np.random.default_rng(case['seed'])
    capture = next(delays.random_captures(rng, 1, case['size']))[1]
    certified = delays.MARGINS[kind](capture)
    if not certified > 2e-4:
        return None
    age = min(certified, 0.1) * case['times']
    failed = fails(capture, _WITHOUT[kind] if weaken else kind, np.array([age]),
                   case['pattern'], rng)[0]
    return (f'fails with samples of {age:.3g} s, {case["pattern"]}' if failed else ''), (
        case['times'])
