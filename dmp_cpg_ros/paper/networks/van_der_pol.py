# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Van der Pol oscillators, the example of heterogeneous coupling (paper, figure vdp).

    ẋ₁ = x₂,   ẋ₂ = −ω² x₁ + μ (1 − x₁²) x₂

The caption of the figure prints (1 − x₁); the oscillator of van der Pol (*On
relaxation-oscillations*, Phil. Mag. 2 (1926)) has x₁², without which there is no limit cycle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.paper.networks.family import one_per_oscillator

Array = NDArray[np.float64]


class VanDerPolOscillators:
    """N Van der Pol oscillators.

    Parameters
    ----------
    count : int
        Number N.
    omega : array_like
        Angular frequencies ω > 0 for small μ, one for all or (N,) [rad/s].
    mu : array_like
        Nonlinearities μ > 0 [1/s].

    Raises
    ------
    ParameterError
        If a parameter is not finite, out of its range or of another length.
    """

    state_size = 2
    rotation_invariant = False

    def __init__(self, count: int, omega: ArrayLike, mu: ArrayLike) -> None:
        """Spread the parameters over the oscillators."""
        self.count = count
        self.omega = one_per_oscillator('omega', omega, count, 0.0)
        self.mu = one_per_oscillator('mu', mu, count, 0.0)

    def field(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2)."""
        x1, x2 = x[:, 0], x[:, 1]
        rate = np.empty_like(x)
        rate[:, 0] = x2
        rate[:, 1] = self.mu * (1.0 - x1 * x1) * x2 - self.omega * self.omega * x1
        return rate

    def jacobian(self, x: Array) -> Array:
        """Jacobians, ndarray (N, 2) → (N, 2, 2)."""
        x1, x2 = x[:, 0], x[:, 1]
        matrix = np.zeros((self.count, 2, 2))
        matrix[:, 0, 1] = 1.0
        matrix[:, 1, 0] = -self.omega**2 - 2.0 * self.mu * x1 * x2
        matrix[:, 1, 1] = self.mu * (1.0 - x1 * x1)
        return matrix

    def stiffness(self, x: Array) -> float:
        """Largest Frobenius norm of the Jacobians [1/s]."""
        jacobian = self.jacobian(x)
        return float(np.sqrt(np.einsum('nij,nij->n', jacobian, jacobian).max()))
