# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Theorem 1's metric along orbits: F_s has one zero eigenvalue and the rest below it."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.paper import transverse_metric as transverse_metric_module
from dmp_cpg_ros.paper.jacobians import numerical_jacobian
from dmp_cpg_ros.paper.transverse_metric import Orbit, find_orbit, floquet_rate, transverse_metric

HOPF = AndronovHopf(2.0)


def hopf(x: np.ndarray) -> np.ndarray:
    return HOPF.field(x, 7.0)


def van_der_pol(x: np.ndarray) -> np.ndarray:
    return np.array([x[1], -x[0] + 1.5 * (1.0 - x[0] ** 2) * x[1]])


def skewed(x: np.ndarray) -> np.ndarray:
    """An oscillator in three dimensions whose third state is driven and feeds back."""
    first = HOPF.field(x[:2], 4.0)
    return np.array([first[0] + 0.3 * x[2], first[1], -1.5 * x[2] + 2.0 * x[0] * x[1]])


FIELDS = {'hopf': (hopf, np.array([1.0, 0.1]), 8.0, 0.005),
          'van der pol': (van_der_pol, np.array([2.0, 0.0]), 60.0, 0.01),
          'three states': (skewed, np.array([1.0, 0.0, 0.5]), 30.0, 0.005)}


@pytest.mark.parametrize('name', FIELDS)
def test_the_metric_does_what_the_theorem_says(name: str) -> None:
    field, start, transient, step = FIELDS[name]

    def jacobian(x: np.ndarray) -> np.ndarray:
        return numerical_jacobian(field, x)

    orbit = find_orbit(field, start, transient, step, count=600)
    found = transverse_metric(field, jacobian, orbit)
    assert np.linalg.eigvalsh(found.metric).min() > 0.0
    assert np.abs(found.eigenvalues[:, 0]).max() < 1e-6 * np.abs(found.eigenvalues).max()
    assert found.rate > 0.0
    # Independently: differentiate M along the orbit by its Fourier series.
    count = len(found.points)
    frequencies = 2j * np.pi / orbit.period * np.fft.fftfreq(count, 1.0 / count)
    M_dot = np.real(np.fft.ifft(frequencies[:, None, None] * np.fft.fft(found.metric, axis=0),
                                axis=0))
    for x, M, change, eigenvalues in zip(found.points, found.metric, M_dot, found.eigenvalues,
                                         strict=True):
        A, f = jacobian(x), field(x)
        half = np.linalg.inv(np.linalg.cholesky(M))
        Fs = 0.5 * half @ (change + A.T @ M + M @ A) @ half.T
        scale = np.abs(eigenvalues).max()
        assert np.allclose(np.linalg.eigvalsh(Fs)[::-1], eigenvalues, atol=2e-3 * scale)
        along = np.linalg.solve(half.T, f)              # the flow is the neutral direction
        assert np.linalg.norm(Fs @ along) < 2e-3 * scale * np.linalg.norm(along)


def relaxing(x: np.ndarray) -> np.ndarray:
    return np.array([x[1], -x[0] + 5.0 * (1.0 - x[0] ** 2) * x[1]])


def fitzhugh_nagumo(x: np.ndarray) -> np.ndarray:
    return np.array([x[0] - x[0] ** 3 / 3.0 - x[1] + 0.5, 0.08 * (x[0] + 0.7 - 0.8 * x[1])])


@pytest.mark.parametrize('field', [relaxing, fitzhugh_nagumo])
def test_a_decay_that_rounding_hides_beside_the_flow_is_known_by_liouville(field) -> None:
    def jacobian(x: np.ndarray) -> np.ndarray:
        return numerical_jacobian(field, x)

    orbit = find_orbit(field, [2.0, 0.0], 100.0, 0.02)
    rate = -np.mean([np.trace(jacobian(x)) for x in orbit.states])
    assert rate * orbit.period > 30.0
    assert floquet_rate(jacobian, orbit) == pytest.approx(rate, rel=1e-5)


def test_the_floquet_rate_of_the_hopf_oscillator_is_known() -> None:
    orbit = find_orbit(hopf, np.array([1.0, 0.0]), 8.0, 0.005)
    assert orbit.period == pytest.approx(2.0 * np.pi / 7.0, rel=1e-6)
    rate = floquet_rate(lambda x: HOPF.jacobian(x, 7.0), orbit)
    assert rate == pytest.approx(2.0 * 2.0, rel=1e-4)       # 2 rho r^2


def test_a_larger_share_of_the_rate_is_given_back_as_contraction() -> None:
    orbit = find_orbit(hopf, np.array([1.0, 0.0]), 8.0, 0.005)
    rates = [transverse_metric(hopf, lambda x: HOPF.jacobian(x, 7.0), orbit, share).rate
             for share in (0.2, 0.5, 0.8)]
    assert rates[0] < 4.0 + 1e-6 and all(rate > 0.5 for rate in rates)


def test_orbits_that_do_not_attract_or_do_not_close_are_refused(
        monkeypatch: pytest.MonkeyPatch) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    circle = Orbit(np.stack([np.cos(angles), -np.sin(angles)], axis=1), 2.0 * np.pi)

    def centre(x: np.ndarray) -> np.ndarray:
        return np.array([x[1], -x[0]])

    with pytest.raises(DataError, match='do not decay'):
        transverse_metric(centre, lambda x: np.array([[0.0, 1.0], [-1.0, 0.0]]), circle)
    monkeypatch.setattr(transverse_metric_module, '_MOST_STEPS', 2000)
    with pytest.raises(DataError, match='within 2,000 steps'):
        find_orbit(lambda x: -x, np.array([1.0, 0.0]), 0.1, 0.01)
