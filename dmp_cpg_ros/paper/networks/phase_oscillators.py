# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plain phase oscillators, φ̇ = ω: what is left of a Hopf oscillator when ρ grows without bound."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.paper.networks.family import one_per_oscillator

Array = NDArray[np.float64]


class PhaseOscillators:
    """N oscillators whose state is their phase [rad], ndarray (N, 1).

    Parameters
    ----------
    count : int
        Number N.
    omega : array_like
        Angular frequencies, one for all or (N,) [rad/s].

    Raises
    ------
    ParameterError
        If ω is not finite or of another length.
    """

    state_size = 1
    rotation_invariant = True

    def __init__(self, count: int, omega: ArrayLike) -> None:
        """Spread the frequencies over the oscillators."""
        self.count = count
        self.omega = one_per_oscillator('omega', omega, count, -np.inf)
        self._rate = self.omega[:, None]

    def field(self, x: Array) -> Array:
        """Rates, ndarray (N, 1), whatever the phases."""
        return self._rate

    def jacobian(self, x: Array) -> Array:
        """Zeros, ndarray (N, 1, 1)."""
        return np.zeros((self.count, 1, 1))

    def stiffness(self, x: Array) -> float:
        """Zero: a phase neither attracts nor repels."""
        return 0.0
