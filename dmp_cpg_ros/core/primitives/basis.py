# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Normalised basis functions of the forcing terms: Gaussian (discrete) and von Mises (rhythmic).

Both classes return Φ_i/Σ_j Φ_j. The largest exponent is subtracted before the exponential is
taken, so the quotient stays defined where every Φ_i underflows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GaussianBases:
    """Φ_i(x) = exp(−(x − c_i)²/(2σ_i²)) of the discrete forcing function.

    The paper prints σ₁ for every basis; x falls exponentially, so with one width either the first
    bases leave gaps or the last ones coincide. One width per basis is what Ijspeert et al. (2013)
    use, and what is used here; equal entries in ``widths`` give the printed form.

    Attributes
    ----------
    centres : ndarray (n,)
        c_i, phase values in (0, 1].
    widths : ndarray (n,)
        σ_i > 0.

    Raises
    ------
    ParameterError
        If the arrays differ in shape, are empty or hold values out of range.
    """

    centres: Array
    widths: Array

    def __post_init__(self) -> None:
        """Validate."""
        _check(self)

    @classmethod
    def evenly_in_time(
        cls, count: int, decay: float, duration: float, overlap: float = 0.6
    ) -> GaussianBases:
        """Bases whose centres are reached at evenly spaced times.

        Parameters
        ----------
        count : int
            Number of bases, at least 1.
        decay : float
            Phase decay α_x [1/s].
        duration : float
            Time over which the centres are spread [s].
        overlap : float
            Value of a basis at the centre of its later neighbour, in (0, 1).

        Returns
        -------
        GaussianBases

        Raises
        ------
        ParameterError
            If an argument is out of range.
        """
        _check_count(count, overlap)
        centres = np.exp(-decay * np.linspace(0.0, duration, count))
        if count == 1:
            return cls(centres, np.ones(1))
        gaps = -np.diff(centres)
        return cls(centres, np.append(gaps, gaps[-1]) / np.sqrt(-2.0 * np.log(overlap)))

    @property
    def count(self) -> int:
        """Number of bases."""
        return len(self.centres)

    def activations(self, x: ArrayLike) -> Array:
        """Normalised bases.

        Parameters
        ----------
        x : array_like (...)
            Phase of the discrete canonical system.

        Returns
        -------
        ndarray (..., n)
            Φ_i(x)/Σ_j Φ_j(x); each row sums to 1.
        """
        x = np.asarray(x, dtype=float)[..., None]
        return _normalised(-0.5 * ((x - self.centres) / self.widths) ** 2)


@dataclass(frozen=True, eq=False)
class VonMisesBases:
    """Φ_i(φ) = exp((cos(φ − φ_i) − 1)/(2σ_i²)) of the rhythmic forcing function.

    The paper prints σ₁ for every basis and uses the clockwise angle θ = −φ; since the cosine is
    even, bases at φ_i here are bases at θ_i = −φ_i there.

    Attributes
    ----------
    centres : ndarray (n,)
        φ_i [rad].
    widths : ndarray (n,)
        σ_i > 0 [rad].

    Raises
    ------
    ParameterError
        If the arrays differ in shape, are empty or hold values out of range.
    """

    centres: Array
    widths: Array

    def __post_init__(self) -> None:
        """Validate."""
        _check(self)

    @classmethod
    def evenly_around(cls, count: int, overlap: float = 0.2) -> VonMisesBases:
        """Bases evenly spaced around the cycle, all of one width.

        Parameters
        ----------
        count : int
            Number of bases, at least 1.
        overlap : float
            Value of a basis at the centre of its neighbour, in (0, 1).

        Returns
        -------
        VonMisesBases

        Raises
        ------
        ParameterError
            If an argument is out of range.
        """
        _check_count(count, overlap)
        gap = 2.0 * np.pi / max(count, 2)
        width = np.sqrt((np.cos(gap) - 1.0) / (2.0 * np.log(overlap)))
        return cls(2.0 * np.pi * np.arange(count) / count, np.full(count, width))

    @property
    def count(self) -> int:
        """Number of bases."""
        return len(self.centres)

    def activations(self, phi: ArrayLike) -> Array:
        """Normalised bases.

        Parameters
        ----------
        phi : array_like (...)
            Phase [rad].

        Returns
        -------
        ndarray (..., n)
            Φ_i(φ)/Σ_j Φ_j(φ); each row sums to 1.
        """
        phi = np.asarray(phi, dtype=float)[..., None]
        return _normalised((np.cos(phi - self.centres) - 1.0) / (2.0 * self.widths**2))


def _normalised(exponents: Array) -> Array:
    values = np.exp(exponents - exponents.max(axis=-1, keepdims=True))
    return values / values.sum(axis=-1, keepdims=True)


def _check(bases: GaussianBases | VonMisesBases) -> None:
    for name in ('centres', 'widths'):
        object.__setattr__(bases, name, np.array(getattr(bases, name), dtype=float))
    centres, widths = bases.centres, bases.widths
    if centres.ndim != 1 or centres.shape != widths.shape or not centres.size:
        raise ParameterError(
            f'centres and widths must be two lists of the same length, at least 1; they have '
            f'shapes {centres.shape} and {widths.shape}'
        )
    if not (np.all(np.isfinite(centres)) and np.all(np.isfinite(widths)) and np.all(widths > 0.0)):
        raise ParameterError('centres must be finite and widths positive and finite')


def _check_count(count: int, overlap: float) -> None:
    if not (isinstance(count, (int, np.integer)) and count >= 1):
        raise ParameterError(f'number of bases = {count!r} must be a whole number of at least 1')
    if not 0.0 < overlap < 1.0:
        raise ParameterError(f'overlap = {overlap!r} must lie between 0 and 1')
