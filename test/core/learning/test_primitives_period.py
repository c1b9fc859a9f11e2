# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The period of a recording: whole or broken cycles, weak fundamentals, noise, uneven sampling."""

from __future__ import annotations

import numpy as np
import pytest
from demonstrations import straight_reach, walking_joints
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.learning.period import (
    find_period,
    fourier_series,
    phase_lead,
    spread_between_cycles,
)
from dmp_cpg_ros.core.primitives.demonstration import Demonstration

SHAPES = {
    'sine': lambda u: np.sin(u),
    'weak fundamental': lambda u: 0.1 * np.sin(u) + np.sin(2.0 * u + 1.0),
    'third harmonic': lambda u: 0.2 * np.sin(u) + np.sin(3.0 * u),
    'pulses': lambda u: np.exp(4.0 * np.cos(u)),
    'triangle': lambda u: np.arcsin(np.sin(u)),
}


@settings(max_examples=25)
@given(
    st.sampled_from(sorted(SHAPES)),
    st.floats(1.7, 20.0),
    st.floats(0.05, 30.0),
    st.floats(0.0, 6.0),
)
def test_the_period_is_found(shape, cycles, period, phase):
    times = np.linspace(0.0, cycles * period, max(120, int(40 * cycles)))
    found = find_period(Demonstration(times, SHAPES[shape](2.0 * np.pi * times / period + phase)))
    assert found == pytest.approx(period, rel=2e-3)


@pytest.mark.parametrize('seed', range(4))
def test_noise_blurs_the_period_only_a_little(seed):
    recording = walking_joints(0.5, 8.4, dt=0.004, noise=0.05, seed=seed)
    assert find_period(recording) == pytest.approx(0.5, rel=2e-3)


def test_uneven_sampling_does_not_matter():
    times = np.sort(np.random.default_rng(0).uniform(0.0, 5.0, 400))
    found = find_period(Demonstration(times, SHAPES['pulses'](2.0 * np.pi * times / 0.7)))
    assert found == pytest.approx(0.7, rel=1e-3)


def test_degrees_of_freedom_vote_together():
    times = np.linspace(0.0, 6.0, 600)
    twice = np.sin(4.0 * np.pi * times)
    assert find_period(Demonstration(times, twice)) == pytest.approx(0.5, rel=1e-4)
    both = np.stack([twice, 0.01 * np.sin(2.0 * np.pi * times), np.full(600, 3.0)], axis=1)
    assert find_period(Demonstration(times, both)) == pytest.approx(1.0, rel=1e-4)


def test_what_has_no_period_is_refused():
    times = np.linspace(0.0, 1.0, 100)
    with pytest.raises(DataError, match='nothing moves'):
        find_period(Demonstration(times, np.ones(100)))
    with pytest.raises(DataError, match='explains the movement'):
        find_period(Demonstration(times, np.random.default_rng(0).normal(size=100)))
    with pytest.raises(DataError, match='none to look for'):
        find_period(straight_reach([0.0], [1.0]), shortest=2.0, longest=1.0)


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('noise', [0.0, 0.02])
def test_a_wandering_frequency_is_refused_and_no_multiple_of_the_period_is_made_up(seed, noise):
    rng, times = np.random.default_rng(seed), np.linspace(0.0, 8.0, 1000)
    knots = 1.0 + 0.09 * rng.uniform(-1.0, 1.0, 12)
    rate = np.interp(times, np.linspace(0.0, 8.0, 12), knots) / 0.62
    u = 2.0 * np.pi * np.concatenate([[0.0], np.cumsum(rate[1:] * np.diff(times))])
    values = np.stack([np.sin(u) + 0.3 * np.cos(2.0 * u), np.cos(u) ** 3], axis=1)
    recording = Demonstration(times, values + noise * rng.normal(size=values.shape))
    with pytest.raises(DataError, match=r'1\.5 cycles of one frequency'):
        find_period(recording)


@pytest.mark.parametrize('wandering', [0.005, 0.01, 0.02])
@pytest.mark.parametrize('modulation', [0.05, 0.13, 0.3])
def test_a_period_that_wanders_a_little_is_no_multiple_of_it(wandering, modulation):
    times = np.linspace(0.0, 10.0, 2001)
    turns = times + wandering * np.sin(2.0 * np.pi * modulation * times) / (
        2.0 * np.pi * modulation)
    found = find_period(Demonstration(times, np.sin(2.0 * np.pi * turns)))
    assert found == pytest.approx(1.0, rel=wandering)


def test_a_weak_fundamental_that_wanders_a_little_is_no_half_of_it():
    times = np.linspace(0.0, 10.0, 2001)
    turns = times + 0.003 * np.sin(2.0 * np.pi * 0.13 * times)
    found = find_period(Demonstration(times, SHAPES['weak fundamental'](2.0 * np.pi * turns)))
    assert found == pytest.approx(1.0, rel=0.003)


@pytest.mark.parametrize('part', [0.3, 0.5, 0.7, 1.0])
@pytest.mark.parametrize('shape', ['sine', 'pulses'])
def test_less_than_a_cycle_and_a_half_is_refused(part, shape):
    times = np.linspace(0.0, 2.0 * part, 400)
    with pytest.raises(DataError, match=r'1\.5 cycles'):
        find_period(Demonstration(times, SHAPES[shape](np.pi * times + 0.4)))


@pytest.mark.parametrize('cycles', [1.1, 1.3])
@pytest.mark.parametrize('shape', ['pulses', 'two harmonics'])
@pytest.mark.parametrize('phase', [0.4, 1.5, 2.5])
def test_a_little_more_than_a_cycle_is_refused_or_right(cycles, shape, phase):
    times = np.linspace(0.0, 2.0 * cycles, 400)
    shapes = {**SHAPES, 'two harmonics': lambda u: np.sin(u) + 0.4 * np.cos(2.0 * u)}
    recording = Demonstration(times, shapes[shape](np.pi * times + phase))
    try:
        assert find_period(recording) == pytest.approx(2.0, rel=1e-3)
    except DataError as error:
        assert '1.5 cycles' in str(error)


def test_a_gap_in_uneven_samples_does_not_matter():
    times = np.sort(np.random.default_rng(1).uniform(0.0, 5.0, 500))
    times = times[(times < 2.0) | (times > 2.9)]
    found = find_period(Demonstration(times, SHAPES['pulses'](2.0 * np.pi * times / 0.7)))
    assert found == pytest.approx(0.7, rel=1e-3)


@given(st.floats(-3.1, 3.1), st.integers(0, 99))
def test_phase_lead_is_the_shift(shift, seed):
    rng = np.random.default_rng(seed)
    reference = (rng.normal(size=(6, 2)) + 1j * rng.normal(size=(6, 2))) / np.arange(1, 7)[:, None]
    shifted = reference * np.exp(1j * shift * np.arange(6))[:, None]
    assert np.angle(np.exp(1j * (phase_lead(reference, shifted) - shift))) == pytest.approx(
        0.0, abs=1e-6
    )


def test_fourier_series_needs_no_whole_cycles():
    times = np.linspace(0.0, 1.37, 300)
    values = 2.0 + 3.0 * np.cos(4.0 * times) - np.sin(8.0 * times)
    series = fourier_series(times, values[:, None], 4.0, 3)[:, 0]
    np.testing.assert_allclose(series, [2.0, 3.0, 1j, 0.0], atol=1e-8)


def test_spread_is_that_of_the_cycles_and_nothing_of_their_shape():
    times = np.linspace(0.0, 4.0, 4001)
    sizes = np.array([1.0, 1.2, 0.8, 1.0, 1.0])[(times // 1.0).astype(int)]
    both = np.stack([np.sin(2.0 * np.pi * times), sizes * np.sin(2.0 * np.pi * times)], axis=1)
    spread = spread_between_cycles(Demonstration(times, both), 1.0)
    np.testing.assert_allclose(spread, [0.0, 0.2], atol=1e-3)
    with pytest.raises(DataError, match='fewer than two'):
        spread_between_cycles(Demonstration(times, both), 3.0)
