# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Basis functions: partition of unity, placement, behaviour far away."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.primitives.primitive import GaussianBases, VonMisesBases

COUNTS = st.integers(1, 60)
OVERLAPS = st.floats(0.02, 0.9)


@given(COUNTS, OVERLAPS, st.floats(0.0, 1.0))
def test_gaussian_bases_are_a_partition_of_unity(count, overlap, x):
    psi = GaussianBases.evenly_in_time(count, 4.6, 1.0, overlap).activations(x)
    assert np.all(psi >= 0.0)
    np.testing.assert_allclose(psi.sum(), 1.0, rtol=1e-12)


@given(COUNTS, OVERLAPS, st.floats(-10.0, 10.0))
def test_von_mises_bases_are_a_periodic_partition_of_unity(count, overlap, phi):
    bases = VonMisesBases.evenly_around(count, overlap)
    psi = bases.activations(phi)
    np.testing.assert_allclose(psi.sum(), 1.0, rtol=1e-12)
    np.testing.assert_allclose(psi, bases.activations(phi + 2.0 * np.pi), atol=1e-9)


def test_activations_stay_defined_where_every_basis_underflows():
    bases = GaussianBases(np.array([0.2, 0.8]), np.array([1e-3, 1e-3]))
    np.testing.assert_allclose(
        bases.activations([0.0, 0.45, 1.0]), [[1, 0], [1, 0], [0, 1]], atol=1e-12
    )


@given(st.integers(2, 40), OVERLAPS)
def test_gaussian_overlap_and_timing_are_as_asked(count, overlap):
    decay, duration = 3.0, 2.0
    bases = GaussianBases.evenly_in_time(count, decay, duration, overlap)
    np.testing.assert_allclose(
        -np.log(bases.centres) / decay, np.linspace(0.0, duration, count), atol=1e-12
    )
    value = np.exp(-0.5 * ((bases.centres[1:] - bases.centres[:-1]) / bases.widths[:-1]) ** 2)
    np.testing.assert_allclose(value, overlap, rtol=1e-9)


@given(st.integers(2, 40), OVERLAPS)
def test_von_mises_overlap_is_as_asked(count, overlap):
    bases = VonMisesBases.evenly_around(count, overlap)
    gap = bases.centres[1] - bases.centres[0]
    np.testing.assert_allclose(
        np.exp((np.cos(gap) - 1.0) / (2.0 * bases.widths[0] ** 2)), overlap, rtol=1e-9
    )


def test_equal_widths_are_the_printed_form():
    centres, sigma, x = np.array([0.9, 0.5, 0.1]), 0.2, 0.37
    printed = np.exp(-((x - centres) ** 2) / (2.0 * sigma**2))
    np.testing.assert_allclose(
        GaussianBases(centres, np.full(3, sigma)).activations(x), printed / printed.sum()
    )


@pytest.mark.parametrize(
    ('centres', 'widths'), [([0.1, 0.2], [0.1]), ([], []), ([0.1], [0.0]), ([np.nan], [1.0])]
)
def test_bad_bases_are_refused(centres, widths):
    with pytest.raises(ParameterError):
        GaussianBases(np.array(centres), np.array(widths))


@pytest.mark.parametrize('overlap', [0.0, 1.0])
def test_overlaps_of_nothing_and_everything_are_refused(overlap):
    with pytest.raises(ParameterError, match='overlap'):
        VonMisesBases.evenly_around(5, overlap)
    with pytest.raises(ParameterError, match='at least 1'):
        GaussianBases.evenly_in_time(0, 1.0, 1.0)
