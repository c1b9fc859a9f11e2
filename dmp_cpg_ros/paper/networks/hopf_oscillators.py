# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Andronov-Hopf oscillators of different frequency, radius and attraction."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.canonical.phase import phase_generator
from dmp_cpg_ros.paper.networks.family import one_per_oscillator

Array = NDArray[np.float64]


class HopfOscillators:
    """N oscillators ẋ = ω S x + ρ (r² − |x|²) x (paper eqs. hopf1, hopf2).

    Parameters
    ----------
    count : int
        Number N.
    omega : array_like
        Angular frequencies, one for all or (N,) [rad/s].
    rho : array_like
        Attractions ρ > 0 [1/s].
    radius : array_like
        Radii r > 0 of the limit cycles.

    Raises
    ------
    ParameterError
        If a parameter is not finite, out of its range or of another length.
    """

    state_size = 2
    rotation_invariant = True

    def __init__(self, count: int, omega: ArrayLike, rho: ArrayLike = 8.0,
                 radius: ArrayLike = 1.0) -> None:
        """Spread the parameters over the oscillators."""
        self.count = count
        self.omega = one_per_oscillator('omega', omega, count, -np.inf)
        self.rho = one_per_oscillator('rho', rho, count, 0.0)
        self.radius = one_per_oscillator('radius', radius, count, 0.0)
        self._linear = self.rho * self.radius**2 - 1j * self.omega
        self._fastest = float(np.abs(self._linear).max())

    def field(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2): one product with z = x₁ + i x₂."""
        z = np.ascontiguousarray(x).view(complex)[:, 0]
        rate = (self._linear - self.rho * (z.real * z.real + z.imag * z.imag)) * z
        return rate.view(float).reshape(x.shape)

    def jacobian(self, x: Array) -> Array:
        """Jacobians, ndarray (N, 2) → (N, 2, 2)."""
        growth = self.rho * (self.radius**2 - np.sum(x * x, axis=1))
        outer = x[:, :, None] * x[:, None, :]
        return (self.omega[:, None, None] * phase_generator()
                + growth[:, None, None] * np.eye(2) - 2.0 * self.rho[:, None, None] * outer)

    def stiffness(self, x: Array) -> float:
        """Bound |ω| + ρ r² + 3 ρ |x|² on the norms of the Jacobians [1/s]."""
        squared = np.einsum('ij,ij->i', x, x)
        return self._fastest + 3.0 * float((self.rho * squared).max())
