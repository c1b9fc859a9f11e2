# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Delays that capture bears, against simulation of delayed networks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.contraction.delays import Capture, longest_carried
from dmp_cpg_ros.studies.delays import (
    MARGINS,
    PATTERNS,
    capture_of,
    fails,
    random_captures,
)


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
    ages = np.array([0.3, 0.999]) * min(certified, 0.08)
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
        assert not fails(capture, 'held', np.geomspace(4e-3, 0.1, 5), pattern, rng).any()


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
    assert [margin(weak) for margin in MARGINS.values()] == [0.0, 0.0, 0.0]


def test_a_faster_gait_bears_less_and_a_stronger_inhibition_not_less() -> None:
    slow, fast = captured(omega=9.0), captured(omega=18.0)
    assert MARGINS['late'](fast) == pytest.approx(0.5 * MARGINS['late'](slow), rel=0.05)
    strong = replace(captured(room=1.05), gains=1.5 * captured(room=1.05).gains)
    assert MARGINS['carried'](strong) > MARGINS['carried'](captured(room=1.05))
