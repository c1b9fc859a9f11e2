# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The canonical system: N coupled Andronov-Hopf oscillators with sparse inhibition (paper,
Sections 4.2 and 5).

    ẋ_i = f_x(x_i; ω_i) + Σ_j K_ij (R(φ_ij) x_j − x_i) + α_i (x_{i,d} − x_i)

with α_i = 0 except where inhibition is switched on.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.graph import CouplingGraph
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths.exponential import ExponentialStep

Array = NDArray[np.float64]

MOST_KEPT = 64
"""Sets of gains for which matrices are kept."""


class CanonicalSystem:
    """Coupled oscillators: vector field, Jacobian and time step; the state stays with the caller.

    The coupling and the inhibition, the stiff and constant part of the field, are integrated
    exactly; rotation and radial attraction are the mild part
    (:class:`~dmp_cpg_ros.core.maths.exponential.ExponentialStep`).

    Parameters
    ----------
    graph : CouplingGraph
        Couplings of the N oscillators.
    oscillators : AndronovHopf or sequence of AndronovHopf
        One for all, or one per node.
    target : ndarray (N, 2), optional
        x_{i,d}, where inhibition pulls each node; the paper's [1, 0] scaled to the radius without.
    """

    def __init__(
        self,
        graph: CouplingGraph,
        oscillators: AndronovHopf | tuple[AndronovHopf, ...],
        target: Array | None = None,
    ) -> None:
        """Collect the constant matrices."""
        self.graph = graph
        self.oscillators = (
            (oscillators,) * graph.size
            if isinstance(oscillators, AndronovHopf)
            else tuple(oscillators)
        )
        if len(self.oscillators) != graph.size:
            raise ParameterError(
                f'{graph.size} nodes need {graph.size} oscillators, not {len(self.oscillators)}'
            )
        self.rho = np.array([oscillator.rho for oscillator in self.oscillators])
        self.radius = np.array([oscillator.radius for oscillator in self.oscillators])
        self.target = (
            np.stack([self.radius, np.zeros(graph.size)], axis=1)
            if target is None
            else np.asarray(target, dtype=float)
        )
        self._growth_at_origin = self.rho * self.radius**2
        self._coupling = graph.coupling_matrix()
        self._steps: dict[tuple[bytes, float], ExponentialStep] = {}
        self._linear: dict[bytes, tuple[Array, Array]] = {}

    def linear_part(self, gains: Array) -> tuple[Array, Array]:
        """Matrix and constant of −L x + α (x_d − x).

        Parameters
        ----------
        gains : ndarray (N,)
            Inhibition gains α_i ≥ 0 that act now [1/s].

        Returns
        -------
        M : ndarray (2N, 2N)
        c : ndarray (2N,)
        """
        alpha = np.repeat(gains, 2)
        return self._coupling - np.diag(alpha), alpha * self.target.ravel()

    def field(self, x: Array, omega: float | Array, gains: Array) -> Array:
        """Vector field ẋ.

        Parameters
        ----------
        x : ndarray (N, 2)
            States.
        omega : float or ndarray (N,)
            Angular frequencies [rad/s].
        gains : ndarray (N,)
            Inhibition gains that act now [1/s].

        Returns
        -------
        ndarray (N, 2)
            [1/s]
        """
        key = gains.tobytes()
        linear = self._linear.get(key)
        if linear is None:
            if len(self._linear) > MOST_KEPT:
                self._linear.clear()
            linear = self._linear[key] = self.linear_part(gains)
        (M, c), state = linear, x.ravel()
        return (M.dot(state) + c + self._nonlinear(omega)(state)).reshape(x.shape)

    def jacobian(self, x: Array, omega: float | Array, gains: Array) -> Array:
        """Jacobian of :meth:`field`.

        Returns
        -------
        ndarray (2N, 2N)
        """
        matrix, _ = self.linear_part(gains)
        omega = np.broadcast_to(omega, (self.graph.size,))
        for i, oscillator in enumerate(self.oscillators):
            matrix[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] += oscillator.jacobian(x[i], omega[i])
        return matrix

    def step(self, x: Array, omega: float | Array, gains: Array, dt: float) -> Array:
        """Advance by one time step with ω and the gains held.

        Parameters
        ----------
        x : ndarray (N, 2)
            States.
        omega : float or ndarray (N,)
            Angular frequencies [rad/s].
        gains : ndarray (N,)
            Inhibition gains that act during the step [1/s].
        dt : float
            Length of the step [s].

        Returns
        -------
        ndarray (N, 2)
        """
        key = (gains.tobytes(), dt)
        step = self._steps.get(key)
        if step is None:
            if len(self._steps) > MOST_KEPT:
                self._steps.clear()
            step = self._steps[key] = ExponentialStep(*self.linear_part(gains), dt)
        return step(x.ravel(), self._nonlinear(omega)).reshape(x.shape)

    def _nonlinear(self, omega: float | Array) -> Callable[[Array], Array]:
        """N(x) = ω S x + ρ(r² − |x|²) x as one product with the complex number x₁ + i x₂."""
        rho, linear = self.rho, self._growth_at_origin - 1j * omega

        def nonlinear(x: Array) -> Array:
            z = x.view(complex)
            return ((linear - rho * (z.real * z.real + z.imag * z.imag)) * z).view(float)

        return nonlinear
