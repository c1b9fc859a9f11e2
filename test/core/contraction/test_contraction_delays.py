# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Delays that capture bears, against simulation of delayed networks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.contraction.delays import Capture, asked_premises, carried_premises
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.studies.delayed_runs import PATTERNS, fails
from dmp_cpg_ros.studies.delays import MARGINS, capture_of, gait_captures, random_captures


def captured(graph: str = 'all_to_all', k: float = 100.0, omega: float = 12.2,
             room: float = 1.5, held: tuple[int, ...] = (0,)) -> Capture:
    found = capture_of(graph_from_edges(4, topology(graph, 4), k), 8.0, 1.0, omega, 0.3, room,
                       held)
    assert found is not None
    return found


@pytest.mark.parametrize('kind', MARGINS)
@pytest.mark.parametrize('graph', ['star', 'directed_ring'])
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


@pytest.mark.parametrize('graph', ['path', 'directed_ring'])
def test_capture_with_carried_states_does_not_depend_on_their_age(graph: str) -> None:
    capture, rng = captured(graph, omega=20.0, room=1.05), np.random.default_rng(1)
    assert MARGINS['carried'](capture) == np.inf
    for pattern in PATTERNS:
        assert not fails(capture, 'carried', np.geomspace(0.01, 0.1, 4), pattern, rng).any()


def test_any_age_of_carried_states_is_certified_where_capture_is() -> None:
    gaits = [MARGINS['carried'](capture) for _, capture in gait_captures()]
    drawn = random_captures(np.random.default_rng(1), 200)
    assert gaits == [np.inf] * 28
    assert [MARGINS['carried'](capture) for _, capture in drawn] == [np.inf] * 200


def test_states_that_are_carried_on_in_the_region_too_lead_out_of_it() -> None:
    capture, rng = captured(room=1.05), np.random.default_rng(1)
    ages = np.array([0.004, 0.012])
    assert not fails(capture, 'carried', ages, 'one age', rng).any()
    assert fails(capture, 'always carried', ages, 'one age', rng).all()


def test_a_region_that_is_hardly_longer_than_places_bears_no_carried_states() -> None:
    capture = captured()
    narrow = replace(capture, places=0.26 * 2.0 * np.arcsin(0.15) * 2.0)
    assert MARGINS['carried'](narrow) == 0.0


@pytest.mark.parametrize(('name', 'changed'), [
    ('length_of_c', {'places': 0.2}), ('not_backwards', {'omega': 4.0, 'places': 0.03}),
    ('older_samples', {'region_radius': 0.02, 'radii': 0.02})])
def test_a_premise_of_carried_states_that_does_not_hold_is_named(
        name: str, changed: dict[str, float]) -> None:
    capture = captured()
    assert all(premise.holds for premise in carried_premises(capture))
    spoiled = replace(capture, **changed)
    failing = {premise.name: premise for premise in carried_premises(spoiled)
               if not premise.holds}
    assert failing[name].value > failing[name].limit
    assert MARGINS['carried'](spoiled) == 0.0


def test_what_no_gate_keeps_grows_with_the_age_of_samples() -> None:
    capture = captured(omega=20.0)
    places, armed = asked_premises(capture, 0.012)
    assert not places.holds and not armed.holds
    assert armed.value == pytest.approx(20.0 * 0.012)
    assert places.limit == pytest.approx(0.5 * capture.places)
    assert asked_premises(capture, 0.0)[1].holds


def test_a_narrower_gate_bears_held_states_of_any_age() -> None:
    drawn = [capture for _, capture in random_captures(np.random.default_rng(1), 100)]
    assert [sum(MARGINS['held'](replace(capture, places=share * capture.places)) == np.inf
                for capture in drawn) for share in (1.0, 0.5, 0.25)] == [15, 57, 79]


def test_nothing_is_borne_where_capture_does_not_hold() -> None:
    capture = captured()
    weak = replace(capture, gains=0.5 * capture.gains)
    assert [margin(weak) for margin in MARGINS.values()] == [0.0] * len(MARGINS)


def test_a_faster_gait_bears_less_and_a_stronger_inhibition_not_less() -> None:
    slow, fast = captured(omega=9.0), captured(omega=18.0)
    assert MARGINS['late'](fast) == pytest.approx(0.5 * MARGINS['late'](slow), rel=0.05)


@pytest.mark.parametrize('graph', ['all_to_all', 'path', 'directed_ring'])
@pytest.mark.parametrize('age', [0.004, 0.05, 0.2])
def test_locked_legs_stay_so_and_come_together_with_carried_states_of_any_age(
        graph: str, age: float) -> None:
    rng, legs, r, rho, half = np.random.default_rng(5), topology(graph, 4), 1.0, 8.0, 0.35
    k = np.zeros((4, 4))
    for i, j in legs:
        k[i, j] = rng.uniform(20.0, 200.0)
    step, count = min(2e-3, 0.25 * age), 12
    length = round(age / step)
    # a lens {|z| <= r, Re z >= r cos(half)}, in the frame that turns with the gait
    z = rng.uniform(r * np.cos(half), r, (length + 1, count, 4)) + 1j * rng.uniform(
        -0.2, 0.2, (length + 1, count, 4))
    z = np.where(np.abs(z) > r, r * np.cos(half) + 1j * z.imag, z)
    degree, each = k.sum(axis=1), np.arange(4)
    kept = np.exp(-degree * step)
    turn, cadence, legs_at = 0.0, rng.uniform(5.0, 25.0, 200), z
    path = np.zeros(len(z))                  # what the cadence has turned by, at each sample
    spread = [np.ptp(np.angle(z))]
    for tick in range(2000):
        omega = cadence[tick // 10]
        ages = rng.integers(0, length + 1, (count, 4, 4))
        samples = legs_at[-1 - ages, np.arange(count)[:, None, None], each]
        carried = samples * np.exp(1j * (turn - path[-1 - ages]))
        y = legs_at[-1]
        pulled = np.einsum('ij,bij->bi', k, carried)
        y = kept * y + np.where(degree > 0.0, (1.0 - kept) / np.maximum(degree, 1e-9), step
                                ) * pulled
        y = y * np.exp(1j * omega * step)
        y = y * r / np.sqrt(np.abs(y)**2 + (r * r - np.abs(y)**2) * np.exp(-2.0 * rho * step))
        turn += omega * step
        legs_at, path = np.append(legs_at[1:], y[None], axis=0), np.append(path[1:], turn)
        seen = legs_at * np.exp(-1j * path)[:, None, None]
        assert np.abs(seen[-1]).max() <= r * (1.0 + 1e-12)
        assert seen[-1].real.min() >= r * np.cos(half) - 1e-12
        spread.append(float(np.max(np.ptp(np.angle(seen), axis=(0, 2)))))
    assert spread[-1] < 0.05 * spread[0]


@pytest.mark.parametrize('omega', [-3.9, 0.0, float('nan'), float('inf')])
def test_oscillators_that_do_not_turn_as_they_are_to_have_no_margin(omega: float) -> None:
    """Backwards, every age was borne by a network of which 0.39 s are."""
    with pytest.raises(ParameterError, match='omega'):
        replace(next(iter(gait_captures()))[1], omega=omega)
