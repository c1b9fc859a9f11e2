# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Normalised basis functions of the forcing terms: Gaussian (discrete) and von Mises (rhythmic).

Both return Φ_i/Σ_j Φ_j. The largest exponent is subtracted before the exponential is
taken, so the quotient stays defined where every Φ_i underflows.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array, check_positive


@dataclass(frozen=True, eq=False)
class Bases(ABC):
    """Normalised basis functions with a centre and a width each.

    Attributes
    ----------
    centres : ndarray (n,)
        Phases at which the bases are largest.
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
        centres, widths = (np.array(values, dtype=float) for values in (self.centres, self.widths))
        if centres.ndim != 1 or centres.shape != widths.shape or not centres.size:
            raise ParameterError(
                f'centres and widths must be two lists of the same length, at least 1; they have '
                f'shapes {centres.shape} and {widths.shape}')
        check_positive(widths=widths)
        if not np.isfinite(centres).all():
            raise ParameterError('centres must be finite')
        object.__setattr__(self, 'centres', centres)
        object.__setattr__(self, 'widths', widths)

    @property
    def count(self) -> int:
        """Number of bases."""
        return len(self.centres)

    def activations(self, phase: ArrayLike) -> Array:
        """Normalised bases Φ_i/Σ_j Φ_j.

        Parameters
        ----------
        phase : array_like (...)
            Of the canonical system.

        Returns
        -------
        ndarray (..., n)
            Each row sums to 1.
        """
        exponents = self._exponents(np.asarray(phase, dtype=float)[..., None])
        values = np.exp(exponents - exponents.max(axis=-1, keepdims=True))
        return np.asarray(values / values.sum(axis=-1, keepdims=True))

    @abstractmethod
    def _exponents(self, phase: Array) -> Array:
        """Logarithms of Φ_i (..., n) at phases (..., 1)."""


class GaussianBases(Bases):
    """Φ_i(x) = exp(−(x − c_i)²/(2σ_i²)) of the discrete forcing function, c_i in (0, 1].

    The paper prints σ₁ for every basis; x falls exponentially, so with one width either the first
    bases leave gaps or the last ones coincide. One width per basis is what Ijspeert et al. (2013)
    use, and what is used here; equal entries in ``widths`` give the printed form.
    """

    @classmethod
    def evenly_in_time(cls, count: int, decay: float, duration: float, overlap: float = 0.6
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

    def _exponents(self, phase: Array) -> Array:
        return np.asarray(-0.5 * ((phase - self.centres) / self.widths) ** 2)


class VonMisesBases(Bases):
    """Φ_i(φ) = exp((cos(φ − φ_i) − 1)/(2σ_i²)) of the rhythmic forcing function, in radians.

    The paper prints σ₁ for every basis and uses the clockwise angle θ = −φ; since the cosine is
    even, bases at φ_i here are bases at θ_i = −φ_i there.
    """

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

    def _exponents(self, phase: Array) -> Array:
        return np.asarray((np.cos(phase - self.centres) - 1.0) / (2.0 * self.widths**2))


def _check_count(count: int, overlap: float) -> None:
    if not (isinstance(count, (int, np.integer)) and count >= 1):
        raise ParameterError(f'number of bases = {count!r} must be a whole number of at least 1')
    if not 0.0 < overlap < 1.0:
        raise ParameterError(f'overlap = {overlap!r} must lie between 0 and 1')
