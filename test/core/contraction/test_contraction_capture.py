# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Capture and contraction under inhibition: certified settings stop, naive checks are caught."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from contraction_batches import Batch, Setting, locked, random_setting
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph, graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.step import longest_step
from dmp_cpg_ros.core.contraction.capture import CaptureSet, capture_set, outward_growth
from dmp_cpg_ros.core.contraction.capture_anywhere import needed_gain_anywhere
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound
from dmp_cpg_ros.core.contraction.inhibited import (
    GLOBAL,
    NONE,
    REGIONAL,
    inhibited_contraction,
    inhibition_rate,
)
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.theorems import critical_scaling

TICK = 0.004
SEEDS = st.integers(0, 10_000)


def network(name: str = 'all_to_all', gain: float = 100.0, rho: float = 8.0) -> CanonicalSystem:
    graph = graph_from_edges(4, topology(name, 4), gain, np.array([0.0, 3.0, 1.5, -1.5]))
    return CanonicalSystem(graph, AndronovHopf(rho), state_at(graph.phases))


def held_by(node: int, gain: float) -> np.ndarray:
    gains = np.zeros(4)
    gains[node] = gain
    return gains


@functools.lru_cache(maxsize=1)
def certified_settings() -> tuple[list[Setting], list[CaptureSet], np.ndarray]:
    """From 2,500 random settings those that are certified, with their contraction rates."""
    rng = np.random.default_rng(20)
    found, captures, rates = [], [], []
    for k in range(2500):
        setting = random_setting(rng)
        if k % 2:                                        # legs whose own frequencies differ
            setting = replace(setting, omega=setting.omega * rng.uniform(0.98, 1.02, 4))
        capture = capture_set(setting.system, setting.omega, setting.gains, setting.region_radius)
        contraction = inhibited_contraction(setting.system, capture)
        oscillator = setting.system.oscillators
        free = synchronisation(setting.system.graph, oscillator.rho * oscillator.radius**2)
        rate = max(contraction.rate, capture.rate)
        apart = mismatch_bound(free, oscillator.rho, oscillator.radius,
                               0.5 * float(np.ptp(setting.omega))).distance
        if np.ptp(setting.omega) > 0.0 and apart > 0.5 * capture.tolerance:
            continue
        if (capture.holds and contraction.reach != NONE and free.synchronises
                and TICK < longest_step(oscillator.rho, oscillator.radius,
                                        float(setting.omega.max()), min(rate, free.rate))):
            found.append(setting)
            captures.append(capture)
            rates.append(rate)
    return found, captures, np.array(rates)


def test_no_certified_inhibition_fails_to_stop() -> None:
    cases, captures, rates = certified_settings()
    assert len(cases) > 1200 and len({case.name for case in cases}) == 6
    rng = np.random.default_rng(3)
    batch = Batch(cases, TICK)
    x = np.stack([locked(case, rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.98, 1.0))
                  for case in cases])
    out_of_place = rng.normal(size=x.shape)
    out_of_place /= np.linalg.norm(out_of_place, axis=2, keepdims=True)
    x += 0.25 * np.array([capture.tolerance for capture in captures])[:, None, None] * out_of_place
    entered, settled = np.zeros(len(cases), dtype=bool), 0
    for tick in range(1, round(8.0 / TICK)):
        x = batch.step(x)
        inside = batch.inside(x)
        assert not np.any(entered & ~inside), 'a captured oscillator left C'
        entered |= inside
        if tick % 50 == 0:                                   # what is at rest stays there
            moving = ~(inside & (batch.speed(x) < 1e-3))
            settled += np.count_nonzero(~moving)
            batch.use(batch.rows[moving])
            x, entered, rates = x[moving], entered[moving], rates[moving]
    assert np.all(entered)
    # What still moves contracts too slowly to have settled in the time that was left.
    period = 2.0 * np.pi / np.array([case.omega.min() for case in batch.settings])
    assert np.all(rates * (8.0 - period) < 16.0)
    assert settled > 0.9 * len(cases)


def test_captured_states_stay_in_the_box_and_above_the_smallest_radius() -> None:
    cases, captures, _ = certified_settings()
    cases, captures = cases[:300], captures[:300]
    rng = np.random.default_rng(5)
    batch = Batch(cases, 0.002)
    half_arcs = [2.0 * np.arcsin(case.region_radius / (2.0 * case.system.radius[0]))
                 for case in cases]
    x = np.stack([locked(case, rng.uniform(-0.99, 0.99) * arc)
                  for case, arc in zip(cases, half_arcs, strict=True)])
    box = np.stack([capture.distance for capture in captures])
    smallest = np.stack([capture.smallest_radius for capture in captures])
    phases = np.stack([case.system.graph.phases for case in cases])
    target = np.stack([case.system.radius for case in cases])
    for _ in range(1000):
        x = batch.step(x)
        place = (x[:, :, 0] - 1j * x[:, :, 1]) * np.exp(-1j * phases)
        assert np.all(np.abs(place - target) <= box * (1.0 + 1e-6))
        assert np.all(np.abs(place) >= smallest * (1.0 - 1e-6))


def test_captured_trajectories_converge_at_the_certified_rate() -> None:
    cases, captures, rates = certified_settings()
    cases, captures, rates = cases[:200], captures[:200], rates[:200]
    batch = Batch(cases, 0.002)
    arcs = np.array([2.0 * np.arcsin(case.region_radius / (2.0 * case.system.radius[0]))
                     for case in cases])
    a = np.stack([locked(case, -0.9 * arc) for case, arc in zip(cases, arcs, strict=True)])
    b = np.stack([locked(case, 0.9 * arc) for case, arc in zip(cases, arcs, strict=True)])
    start = np.linalg.norm(a - b, axis=2).max(axis=1)
    for _ in range(500):
        a, b = batch.step(a), batch.step(b)
    # The certified rate is that of a weighted norm; weights differ by less than the gains.
    left = np.linalg.norm(a - b, axis=2).max(axis=1)
    weights = np.array([1.0 + capture.gains.max() / 10.0 for capture in captures])
    assert np.all(left <= weights * start * np.exp(-rates * 1.0) + 1e-9)


def stops(system: CanonicalSystem, omega: float, gains: np.ndarray, region: float,
          seconds: float = 6.0) -> bool:
    setting = Setting(system, np.full(4, omega), gains, region, '')
    batch = Batch([setting] * 6, TICK)
    phases = np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False)
    x = np.stack([locked(setting, phi) for phi in phases])
    for _ in range(round(seconds / TICK)):
        x = batch.step(x)
    return bool(np.all(batch.inside(x)) and batch.speed(x).max() < 1e-3)


@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'star', 'directed_ring'])
@pytest.mark.parametrize('node', [0, 2])
def test_contraction_without_capture_walks_on(name: str, node: int) -> None:
    # The naive check, contraction alone, passes a gain that cannot hold four rotors in C.
    system, omega, region = network(name), 13.0, 0.3
    weak = held_by(node, 0.65 * 4.0 * omega / region)
    capture = capture_set(system, omega, weak, region)
    assert inhibited_contraction(system, capture).rate > 0.0
    assert not capture.holds
    assert not stops(system, omega, weak, region)
    enough = held_by(node, 1.02 * capture.needed_gain[node])
    assert capture_set(system, omega, enough, region).holds
    assert stops(system, omega, enough, region)


def test_capture_without_contraction_does_not_stop_followers_that_break_free() -> None:
    # The other naive check: the leader is held, but couplings too weak to hold the others.
    system = network('path', 8.0)
    gains = held_by(0, 400.0)
    capture = capture_set(system, 13.0, gains, 0.3)
    assert synchronisation(network('path', 14.0).graph, 8.0).synchronises
    assert capture.holds
    assert inhibited_contraction(system, capture).reach == NONE
    assert not stops(system, 13.0, gains, 0.3)


@pytest.mark.parametrize('name', ['all_to_all', 'ring', 'star'])
@pytest.mark.parametrize('gain', [40.0, 100.0, 250.0])
def test_the_needed_gain_is_close_to_the_smallest_that_works(name: str, gain: float) -> None:
    system, omega, region = network(name, gain), 13.0, 0.3
    needed = float(capture_set(system, omega, held_by(0, 1.0), region).needed_gain[0])
    assert not stops(system, omega, held_by(0, needed / 1.5), region)


def test_the_condition_is_the_rule_of_thumb_made_exact() -> None:
    # N omega r / r0 plus what the radial part can add, whatever the graph.
    for name in ('all_to_all', 'ring', 'star', 'directed_ring'):
        needed = capture_set(network(name, 200.0), 10.0, held_by(0, 500.0), 0.3).needed_gain[0]
        assert 4.0 * 10.0 / 0.3 < needed < 1.05 * 4.0 * 10.0 / 0.3


@given(seed=SEEDS)
def test_the_outward_growth_bounds_the_field_in_every_direction(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rho, radius = rng.uniform(0.5, 20.0), rng.uniform(0.5, 2.0)
    omega, u = rng.uniform(0.0, 20.0), rng.uniform(0.01, 2.5)
    graph = graph_from_edges(1, (), 1.0)
    system = CanonicalSystem(graph, AndronovHopf(rho, radius))
    D = rng.uniform(0.5, 2.0)
    bound = outward_growth(system, np.array([omega]), D, np.array([u]))[0]
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    n = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    x = np.array([D, 0.0]) + u * n
    assert np.all(np.sum(n * system.oscillators.field(x, omega), axis=1) <= bound + 1e-9)


@settings(max_examples=30)
@given(seed=SEEDS)
def test_with_the_gain_for_anyone_the_flow_enters_c_whatever_the_others_do(seed: int) -> None:
    rng = np.random.default_rng(seed)
    setting = random_setting(rng)
    system, node = setting.system, setting.node
    needed = needed_gain_anywhere(system, float(setting.omega[node]), node, setting.region_radius)
    gains = np.zeros(4)
    gains[node] = 1.000001 * needed
    largest, tightest = system.radius[node], np.inf
    for angle in np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False):
        n = np.array([np.cos(angle), np.sin(angle)])
        for _ in range(5):
            x = rng.normal(size=(4, 2))
            x *= largest / np.linalg.norm(x, axis=1, keepdims=True)
            # The worst that neighbours can do is to pull along the outward normal.
            turns = setting.system.graph.phases[node] - setting.system.graph.phases
            x[:, 0], x[:, 1] = (largest * np.cos(np.arctan2(-n[1], n[0]) - turns),
                                -largest * np.sin(np.arctan2(-n[1], n[0]) - turns))
            x[node] = system.target[node] + setting.region_radius * n
            outward = float(system.field(x, setting.omega, gains)[node] @ n)
            assert outward <= 1e-6 * needed
            tightest = min(tightest, -outward)
    assert tightest < 0.02 * needed * setting.region_radius + 1e-9


def test_the_gain_for_anyone_is_several_times_that_for_legs_in_their_places() -> None:
    system = network()
    anywhere = needed_gain_anywhere(system, 13.0, 0, 0.3)
    together = capture_set(system, 13.0, held_by(0, 1.0), 0.3).needed_gain[0]
    assert anywhere > 3.0 * together


def test_inhibiting_a_single_node_makes_f_inh_contract_and_more_gain_never_hurts() -> None:
    for name in ('all_to_all', 'ring', 'path', 'star', 'directed_ring'):
        graph = network(name, 10.0).graph
        assert inhibition_rate(graph, np.zeros(4)) == pytest.approx(0.0, abs=1e-9)
        rates = [inhibition_rate(graph, held_by(1, gain)) for gain in (1.0, 10.0, 1e2, 1e3, 1e6)]
        assert np.all(np.diff(rates) > 0.0)
        voted = [inhibition_rate(graph, np.array([50.0, a, a, 0.0])) for a in (0.0, 5.0, 50.0)]
        assert np.all(np.diff(voted) > 0.0)


def test_grounded_laplacians_saturate_at_their_textbook_values() -> None:
    known = {'all_to_all': 1.0, 'ring': 2.0 - 2.0**0.5, 'path': 0.19806, 'star': 1.0}
    for name, value in known.items():
        rate = inhibition_rate(network(name, 10.0).graph, held_by(0, 1e7))
        assert rate == pytest.approx(10.0 * value, rel=1e-4)


def test_beyond_the_critical_scaling_the_jacobian_is_contracting_everywhere() -> None:
    system = network('ring', 10.0)
    gains = held_by(0, 60.0)
    rate = inhibition_rate(system.graph, gains)
    alpha = 1.001 * critical_scaling(2.0 * 8.0, rate)
    scaled = network('ring', 10.0 * alpha)
    rng = np.random.default_rng(0)
    worst = -np.inf
    for _ in range(200):
        J = scaled.jacobian(0.4 * rng.normal(size=(4, 2)), 9.0, alpha * gains)
        worst = max(worst, np.linalg.eigvalsh(0.5 * (J + J.T))[-1])
    assert worst < 0.0
    J = scaled.jacobian(np.zeros((4, 2)), 9.0, alpha * gains)
    assert np.linalg.eigvalsh(0.5 * (J + J.T))[-1] == pytest.approx(0.0, abs=0.02)
    with pytest.raises(ParameterError, match='not contracting'):
        critical_scaling(16.0, 0.0)


def test_the_regional_grade_certifies_what_the_global_one_does_not() -> None:
    system = network('all_to_all', 9.0, rho=12.0)
    capture = capture_set(system, 3.0, held_by(0, 300.0), 0.3)
    contraction = inhibited_contraction(system, capture)
    assert contraction.inhibition_rate < contraction.global_growth
    assert contraction.reach == REGIONAL and contraction.rate > 0.0
    assert stops(system, 3.0, held_by(0, 300.0), 0.3)
    strong = network('all_to_all', 100.0, rho=12.0)
    assert inhibited_contraction(strong, capture_set(
        strong, 3.0, held_by(0, 300.0), 0.3)).reach == GLOBAL


def test_settings_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ParameterError, match='no node is inhibited'):
        capture_set(network(), 10.0, np.zeros(4), 0.3)
    graph = graph_from_edges(4, topology('ring', 4), 10.0, np.array([0.0, 1.0, 2.0, 3.0]))
    astray = CanonicalSystem(graph, AndronovHopf(8.0))      # all targets at [1, 0]
    with pytest.raises(ParameterError, match='in their places'):
        capture_set(astray, 10.0, np.array([100.0, 100.0, 0.0, 0.0]), 0.3)


def test_a_leader_that_the_others_do_not_hear_captures_itself_and_stops_nobody() -> None:
    graph = graph_from_edges(4, ((0, 1), (1, 2), (2, 3), (3, 2)), 50.0)
    system = CanonicalSystem(graph, AndronovHopf(8.0))
    capture = capture_set(system, 10.0, held_by(0, 2000.0), 0.3)
    assert np.all(capture.distance[1:] >= 2.0)
    assert inhibited_contraction(system, capture).reach == NONE


def test_couplings_that_turn_have_no_half_planes() -> None:
    """They do not average heights: where only the inhibited node feels such ones, a state passed
    the smallest radius that half-planes gave.
    """
    a, b = 35.3008, 12.9288
    K = np.array([a * np.eye(2) + b * np.array([[0.0, 1.0], [-1.0, 0.0]]), 2.0 * a * np.eye(2)])
    system = CanonicalSystem(CouplingGraph(2, ((0, 1), (1, 0)), K, np.zeros(2)),
                             AndronovHopf(5.8177, 1.0))
    gains = np.array([22.4327902506203, 0.0])
    found = capture_set(system, 0.4953, gains, 0.5848694861389775)
    x = np.array([[0.77181, 0.0], [0.72930, -0.525]])
    for _ in range(200):
        x = system.step(x, 0.4953, gains, 1e-4)
        assert np.all(np.hypot(*x.T) >= found.smallest_radius)
    plain = CanonicalSystem(graph_from_edges(2, topology('path', 2), a), AndronovHopf(5.8177))
    rest = capture_set(plain, 0.4953, gains, 0.5848694861389775)
    assert np.all(rest.smallest_radius > 1.0 - rest.distance)


@pytest.mark.parametrize('places', [-1.0, float('nan'), float('inf')])
def test_a_tolerance_that_is_none_is_refused(places: float) -> None:
    network = CanonicalSystem(graph_from_edges(2, topology('path', 2), 60.0), AndronovHopf(8.0))
    with pytest.raises(ParameterError, match='places'):
        capture_set(network, 2.0, np.array([100.0, 0.0]), 0.3, places)
