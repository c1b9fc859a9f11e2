# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Delays that capture bears, against simulation of delayed networks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.contraction.delays import Capture, carried_margin, longest_carried
from dmp_cpg_ros.paper.carried_slowly import Undelayed, slowly_carried_margin
from dmp_cpg_ros.studies.delayed_runs import PATTERNS, fails
from dmp_cpg_ros.studies.delays import MARGINS, capture_of, random_captures


def captured(graph: str = 'all_to_all', k: float = 100.0, omega: float = 12.2,
             room: float = 1.5, held: tuple[int, ...] = (0,)) -> Capture:
    found = capture_of(graph_from_edges(4, topology(graph, 4), k), 8.0, 1.0, omega, 0.3, room,
                       held)
    assert found is not None
    return found


@pytest.mark.parametrize('kind', MARGINS)
@pytest.mark.parametrize('graph', ['all_to_all', 'star', 'directed_ring'])
def test_no_certified_delay_fails(kind: str, graph: str) -> None:
    capture, rng = captured(graph, omega=20.0), np.random.default_rng(1)
    certified = MARGINS[kind](capture)
    assert certified > 0.0
    ages = np.array([0.5, 0.999]) * min(certified, 0.08)
    for pattern in PATTERNS:
        assert not fails(capture, kind, ages, pattern, rng).any(), pattern


@pytest.mark.parametrize('kind', MARGINS)
def test_no_certified_delay_of_a_random_network_fails(kind: str) -> None:
    rng = np.random.default_rng(2)
    for name, capture in random_captures(rng, 3):
        certified = min(MARGINS[kind](capture), 0.05)
        if certified > 2e-4:
            ages = np.array([0.5, 0.999]) * certified
            assert not fails(capture, kind, ages, 'one age', rng).any(), name


@pytest.mark.parametrize('held', [(0,), (0, 3)])
def test_inhibition_that_acts_after_the_certified_time_acts_outside_of_the_region(
        held: tuple[int, ...]) -> None:
    capture = captured(held=held)
    certified = MARGINS['late'](capture)
    ages = certified * np.array([0.999, 1.25])
    assert fails(capture, 'late', ages, 'one age', np.random.default_rng(1)).tolist() == [
        False, True]


def test_capture_with_held_states_does_not_depend_on_their_age() -> None:
    capture, rng = captured(room=1.05), np.random.default_rng(1)
    assert MARGINS['held'](capture) == np.inf
    for pattern in PATTERNS:
        assert not fails(capture, 'held', np.geomspace(0.01, 0.1, 4), pattern, rng).any()


def test_states_that_are_carried_on_are_unstable_from_one_over_the_coupling_on() -> None:
    capture = captured(room=2.0)
    limit = longest_carried(capture.system)
    assert limit == pytest.approx(1.0 / 300.0)
    certified = MARGINS['carried'](capture)
    assert 0.5 * limit < certified < limit
    ages = limit * np.array([0.9, 1.5])
    assert fails(capture, 'carried', ages, 'one age', np.random.default_rng(1)).tolist() == [
        False, True]


def test_nothing_is_borne_where_capture_does_not_hold() -> None:
    capture = captured()
    weak = replace(capture, gains=0.5 * capture.gains)
    assert [margin(weak) for margin in MARGINS.values()] == [0.0] * len(MARGINS)


def test_a_faster_gait_bears_less_and_a_stronger_inhibition_not_less() -> None:
    slow, fast = captured(omega=9.0), captured(omega=18.0)
    assert MARGINS['late'](fast) == pytest.approx(0.5 * MARGINS['late'](slow), rel=0.05)
    strong = replace(captured(room=1.05), gains=1.5 * captured(room=1.05).gains)
    assert MARGINS['carried'](strong) > MARGINS['carried'](captured(room=1.05))


def entered(capture: Capture, rng: np.random.Generator, count: int) -> np.ndarray:
    """States (count, N) in which C is entered, with legs as far out of place as they may be."""
    r, shape = capture.radius, (count, len(capture.gains))
    ahead = 2.0 * np.arcsin(0.49 * capture.region_radius / r) * rng.choice((-1.0, 1.0), (count, 1))
    aside = 0.25 * capture.places * np.exp(2j * np.pi * rng.random(shape))
    off = 0.25 * capture.radii * rng.choice((-1.0, 1.0), (count, 1))
    return (r + off) * np.exp(1j * ahead) + np.where(capture.held, 0.0, aside)


@pytest.mark.parametrize('graph', ['all_to_all', 'path', 'directed_ring'])
@pytest.mark.parametrize('rate', [0.0, 30.0])
def test_distance_and_second_derivative_without_delay_are_within_their_bounds(
        graph: str, rate: float) -> None:
    capture = captured(graph, omega=15.0, room=1.2)
    k, r, rho = capture.coupling, capture.radius, float(capture.system.rho.max())
    step, parts = 1e-3, 50
    path, y = Undelayed(capture, step, rate), entered(capture, np.random.default_rng(3), 40)
    h = step / parts

    def field(y: np.ndarray, omega: float) -> np.ndarray:
        return np.asarray((rho * (r * r - np.abs(y) ** 2) + 1j * omega) * y + y @ k.T
                          - (k.sum(axis=1) + capture.gains) * y + capture.gains * r)

    onwards = field(y, capture.omega) - capture.gains * (r - y)     # had inhibition not set in
    first, time, closest, speed, moved = y, 0.0, np.zeros(2), 0.0, 0.0
    for _ in range(60):
        far, bend, rest = path.advance()
        for _ in range(parts):
            omega = capture.omega - rate * min(time, 0.2)
            before, time = field(y, omega), time + h
            y = y + h * field(y + 0.5 * h * before, omega - 0.5 * h * rate)
            change = (field(y, capture.omega - rate * min(time, 0.2)) - before) / h
            needed = (np.abs(y - r).max(axis=0) / far, np.abs(change).max(axis=0) / bend)
            closest = np.maximum(closest, [share.max() for share in needed])
        moved, speed = moved + step * speed + 0.5 * step**2 * rest, speed + step * rest
        assert np.all(np.abs(y - first - time * onwards).max(axis=0) <= moved + path.moved)
    assert closest[0] <= 1.0 and closest[1] <= 1.01
    assert closest.min() > 0.3
    far, bend = path.ever()
    assert np.all(np.abs(y - r).max(axis=0) <= far)


def test_a_cadence_that_stands_still_bears_more_than_one_that_jumps() -> None:
    steady = {}
    for graph in ('path', 'directed_ring', 'all_to_all'):
        jumping = captured(graph, k=100.0, omega=20.0, room=2.0)
        margins = [carried_margin(jumping),
                   *(slowly_carried_margin(jumping, rate) for rate in (50.0, 0.0))]
        assert margins == sorted(margins)
        assert margins[-1] < longest_carried(jumping.system)
        steady[graph] = margins[-1] / margins[0]
    assert max(steady.values()) > 1.3
