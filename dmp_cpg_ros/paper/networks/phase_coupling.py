# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Couplings of phase oscillators: Σ_j k_ij sin(φ_j + φ_ij − φ_i) (Kuramoto 1984).

Along the unit circle it is what the coupling k (R(φ_ij) x_j − x_i) of two states on it amounts to.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.canonical.graph import CouplingGraph
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.networks.coupling import EdgeCoupling, MeanFieldCoupling

Array = NDArray[np.float64]


class PhaseEdgeCoupling:
    """Sine coupling over a list of edges.

    Parameters
    ----------
    graph : CouplingGraph
        Couplings with gains K = k I.

    Raises
    ------
    ParameterError
        If a gain is not a multiple of the identity.
    """

    state_size = 1

    def __init__(self, graph: CouplingGraph) -> None:
        """Take the edges as they act on points of the unit circle."""
        scalars = graph.gains[:, 0, 0]
        if not np.array_equal(graph.gains, scalars[:, None, None] * np.eye(2)):
            raise ParameterError('phase oscillators need gains K = k I')
        self._on_circle = EdgeCoupling(graph)
        self.count, self.bound = graph.size, self._on_circle.bound
        self.symmetric, self.turned = self._on_circle.symmetric, self._on_circle.turned

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 1) → (N, 1) [rad/s]."""
        return _along_the_circle(self._on_circle, x)


class PhaseMeanFieldCoupling:
    """All-to-all sine coupling with one gain; parameters as of MeanFieldCoupling."""

    state_size = 1
    symmetric = True

    def __init__(self, count: int, gain: float, phases: ArrayLike | None = None) -> None:
        """Take the mean field of points of the unit circle."""
        self._on_circle = MeanFieldCoupling(count, gain, phases)
        # of Σ k sin(θ_j − θ_i) the Jacobian's norm is at most twice the largest row sum
        self.count, self.bound = count, 2.0 * self._on_circle.bound
        self.turned = self._on_circle.turned

    def __call__(self, x: Array) -> Array:
        """Rates, ndarray (N, 1) → (N, 1) [rad/s]."""
        return _along_the_circle(self._on_circle, x)


def _along_the_circle(coupling: EdgeCoupling | MeanFieldCoupling, x: Array) -> Array:
    z = np.exp(-1j * x[:, 0])
    rate = coupling(z.view(float).reshape(-1, 2)).view(complex)[:, 0]
    return -(z.conj() * rate).imag[:, None]
