# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Period of a recorded rhythm, and the phase by which one recording leads another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.demonstration import Demonstration

WANDERING = 0.03
"""Share of the variance above which what no period explains must be noise, that is, must not be
correlated from sample to sample.
"""

_BENDING = 4.0
"""How many times less a multiple of a period must leave to be a period of its own, where that
frequency wanders: a longer series bends to it, and leaves somewhat less.
"""

_HARMONICS = 8
_COARSE_SAMPLES = 500


def find_period(demonstration: Demonstration, shortest: float | None = None,
                longest: float | None = None) -> float:
    """Period that explains all degrees of freedom best.

    Peaks of the summed Lomb-Scargle periodogram and their subharmonics are candidates. Each is
    refined by the least-squares fit of a Fourier series, which needs neither a whole number of
    cycles nor even sampling. Of the periods that fit about as well as the best, the shortest is
    taken: multiples of a period fit as well as it does, and better where its frequency wanders.

    Parameters
    ----------
    demonstration : Demonstration
        At least about one and a half cycles.
    shortest, longest : float, optional
        Limits of the period [s]; four samples and two thirds of the recording without.

    Returns
    -------
    float
        [s]

    Raises
    ------
    DataError
        If nothing moves, the limits leave nothing, or no single period explains the movement:
        it is not periodic, its frequency wanders, or it is shorter than one and a half cycles.
    """
    times, values = demonstration.times - demonstration.times[0], demonstration.positions
    spread = values.std(axis=0)
    moving = spread > 1e-9 * max(float(spread.max()), np.finfo(float).tiny)
    if not np.any(moving) or not float(spread.max()) > 1e-12 * (1.0 + float(np.abs(values).max())):
        raise DataError('the demonstration has no period: nothing moves')
    values = (values[:, moving] - values[:, moving].mean(axis=0)) / spread[moving]
    span = float(times[-1])
    low = 1.0 / (longest or span / 1.5)
    high = 1.0 / (shortest or 4.0 * span / (len(times) - 1))
    if not 0.0 < low < high:
        raise DataError(f'no period from {1.0 / high:g} s to {1.0 / low:g} s: none to look for')
    whole = _Fit(times, values, 0.45 * (len(times) - 1) / span)
    # so few samples that the search is quick, drawn at random lest frequencies fold
    drawn = np.sort(np.random.default_rng(0).choice(
        len(times), min(len(times), _COARSE_SAMPLES), replace=False))
    some = _Fit(times[drawn], values[drawn], whole.highest)
    coarse = [some.best_nearby(f, 0.6 / span, low, high)
              for f in _candidates(times, values, low, high)]
    least, reach = min(error for _, error in coarse), 0.06 / span
    refined = [whole.refined(f, reach)
               for f, error in coarse if error < _BENDING * least + 0.01]
    left, best = min((error, f) for f, error in refined)
    # What a period leaves is noise, or a frequency that wanders: its multiples bend to that.
    spare = 1.1 if whole.residual_correlation(best) <= 0.5 else _BENDING
    highest = max(f for f, error in refined if error <= spare * left + 1e-6)
    left, frequency = min((error, f) for f, error in refined if f > 0.9 * highest)
    longer = frequency < low - 0.98 * reach  # no minimum: longer periods would fit even better
    wanders = left > WANDERING and whole.residual_correlation(frequency) > 0.5
    if longer or left > 0.5 or wanders:
        raise DataError(
            f'no period between {1.0 / high:g} s and {1.0 / low:g} s explains the movement; the '
            f'best, {1.0 / frequency:.4g} s, leaves {100.0 * left:.0f} % of the variance. Valid '
            'are at least 1.5 cycles of one frequency: take a steadier or longer part, or give '
            'the period')
    return float(1.0 / frequency)


def fourier_series(times: ArrayLike, values: ArrayLike, omega: float, harmonics: int) -> Array:
    """Least-squares Fourier coefficients: values(t) ≈ Re Σ_m c_m e^{i m ω t}.

    Parameters
    ----------
    times : array_like (m,)
        [s]
    values : array_like (m, n)
    omega : float
        [rad/s]
    harmonics : int
        Highest harmonic; reduced when there are too few samples for it.

    Returns
    -------
    ndarray (harmonics + 1, n) of complex
        c_0 is the mean of the cycle.
    """
    times, values = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    used = max(1, min(harmonics, (len(times) - 1) // 3))
    design = _design(times, omega / (2.0 * np.pi), used)
    solved = np.linalg.lstsq(design, values, rcond=1e-10)[0]
    coefficients = np.zeros((harmonics + 1, values.shape[1]), complex)
    coefficients[0] = solved[0]
    coefficients[1 : used + 1] = solved[1 : used + 1] - 1j * solved[used + 1 :]
    return coefficients


CYCLE_SAMPLES = 200
"""Samples of one cycle where cycles are compared."""


def spread_between_cycles(demonstration: Demonstration, period: float) -> Array:
    """Largest departure of a cycle from the mean cycle; no periodic movement comes much closer.

    Parameters
    ----------
    demonstration : Demonstration
        At least two cycles.
    period : float
        [s]

    Returns
    -------
    ndarray (n,)
        In the unit of the positions.

    Raises
    ------
    DataError
        If there are fewer than two cycles.
    """
    cycles = _cycles(demonstration, period)
    departure = np.abs(cycles - cycles.mean(axis=1, keepdims=True))
    return np.asarray(departure.max(axis=(1, 2)))


def _cycles(demonstration: Demonstration, period: float) -> Array:
    """Whole cycles of a recording, ndarray (n, cycles, CYCLE_SAMPLES)."""
    since = demonstration.times - demonstration.times[0]
    count = int(since[-1] / period + 1e-9)
    if count < 2:
        raise DataError(f'{since[-1]:g} s hold fewer than two cycles of {period:g} s')
    fraction = np.linspace(0.0, 1.0, CYCLE_SAMPLES, endpoint=False)
    at = (np.arange(count)[:, None] + fraction).ravel() * period
    cycles = np.stack([np.interp(at, since, column) for column in demonstration.positions.T])
    return cycles.reshape(demonstration.dofs, count, -1)


def phase_lead(reference: Array, other: Array) -> float:
    """Phase by which one cycle leads another, from the maximum of their correlation.

    Parameters
    ----------
    reference, other : ndarray (harmonics + 1, n) of complex
        Fourier coefficients of the two cycles.

    Returns
    -------
    float
        δ in [−π, π) with other(φ) ≈ reference(φ + δ) [rad].
    """
    product = np.sum(np.conj(reference[1:]) * other[1:], axis=1)
    orders = np.arange(1, len(product) + 1)
    grid = np.linspace(-np.pi, np.pi, 32 * len(product) + 32, endpoint=False)
    delta = grid[np.argmax((np.exp(-1j * np.outer(grid, orders)) @ product).real)]
    for _ in range(20):  # Newton on the correlation
        wave = np.exp(-1j * delta * orders) * product
        slope, curvature = np.sum(orders * wave.imag), -np.sum(orders**2 * wave.real)
        if not curvature < 0.0:
            break
        delta -= slope / curvature
    return float((delta + np.pi) % (2.0 * np.pi) - np.pi)


def _candidates(times: Array, values: Array, low: float, high: float) -> list[float]:
    """Frequencies of spectral peaks and their fractions, within the limits [1/s]."""
    from scipy.signal import find_peaks, lombscargle

    frequency = np.arange(0.5 * low, high, 0.125 / times[-1])
    power = np.sum([lombscargle(times, column, 2.0 * np.pi * frequency) for column in values.T],
                   axis=0)
    peaks, _ = find_peaks(np.concatenate([[0.0], power, [0.0]]), height=1e-4 * power.max())
    strongest = peaks[np.argsort(power[peaks - 1])[::-1][:5]] - 1
    found: list[float] = [low]
    for f in (float(frequency[p] / m) for m in range(1, 5) for p in strongest):
        if low <= f <= high and all(abs(f - other) > 0.05 / times[-1] for other in found):
            found.append(f)
    return found


def _design(times: Array, frequency: float, harmonics: int) -> Array:
    """Columns 1, cos(m ω t), sin(m ω t), (samples, 2 harmonics + 1)."""
    turn = np.exp(2j * np.pi * frequency * times)[:, None]
    waves = np.cumprod(np.broadcast_to(turn, (len(times), harmonics)), axis=1)
    return np.hstack([np.ones((len(times), 1)), waves.real, waves.imag])


@dataclass(frozen=True, eq=False)
class _Fit:
    """Samples to which Fourier series are fitted, and the highest frequency that they show."""

    times: Array
    values: Array
    highest: float

    def residual(self, frequency: float) -> Array:
        """What a Fourier series of this frequency leaves (m, n)."""
        most = (len(self.times) - 1) // 4
        harmonics = int(max(1, min(_HARMONICS, self.highest // frequency, most)))
        design = _design(self.times, frequency, harmonics)
        gram = design.T @ design + 1e-10 * len(design) * np.eye(design.shape[1])
        return np.asarray(
            self.values - design @ np.linalg.solve(gram, design.T @ self.values))

    def unexplained(self, frequency: float) -> float:
        """Share of the variance that a Fourier series of this frequency leaves."""
        return float(np.sum(self.residual(frequency) ** 2) / np.sum(self.values**2))

    def residual_correlation(self, frequency: float) -> float:
        """Correlation of what is left from sample to sample: 0 for noise."""
        rest = self.residual(frequency)
        return float(np.sum(rest[1:] * rest[:-1]) / np.sum(rest**2))

    def best_nearby(self, frequency: float, reach: float, low: float, high: float
                    ) -> tuple[float, float]:
        """Best of a grid of frequencies, and what it leaves unexplained."""
        grid = np.linspace(max(low, frequency - reach), min(high, frequency + reach), 21)
        errors = [self.unexplained(float(f)) for f in grid]
        best = int(np.argmin(errors))
        return float(grid[best]), errors[best]

    def refined(self, frequency: float, reach: float) -> tuple[float, float]:
        """Frequency of the best fit nearby, and what it leaves unexplained."""
        from scipy.optimize import minimize_scalar

        best = minimize_scalar(self.unexplained, bounds=(frequency - reach, frequency + reach),
                               method='bounded', options={'xatol': 1e-7 * frequency})
        return float(best.x), float(best.fun)
