# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The canonical system: N oscillators coupled over a graph, with sparse inhibition (paper,
Sections 4.2 and 5).

    ẋ_i = f_x(x_i; ω_i) + Σ_j K_ij (R(φ_ij) x_j − x_i) + α_i (x_{i,d} − x_i)

with α_i = 0 except where inhibition is switched on.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import CouplingGraph
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf, Oscillators
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import ExponentialStep

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
    oscillators : Oscillators
        The uncoupled oscillators: any family with a field, a Jacobian and a radius.
    target : ndarray (N, 2), optional
        x_{i,d}, where inhibition pulls each node; the paper's [1, 0] scaled to the radius without.
    """

    def __init__(self, graph: CouplingGraph, oscillators: Oscillators,
                 target: Array | None = None) -> None:
        """Collect the constant matrices."""
        self.graph, self.oscillators = graph, oscillators
        self.radius = self._one_per_node('radius')
        self.target = (
            np.stack([self.radius, np.zeros(graph.size)], axis=1)
            if target is None
            else np.asarray(target, dtype=float))
        self._coupling = graph.coupling_matrix()
        self._steps: dict[tuple[bytes, float], ExponentialStep] = {}
        self._linear: dict[bytes, tuple[Array, Array]] = {}

    @cached_property
    def rho(self) -> Array:
        """Attraction ρ of each Andronov-Hopf oscillator, ndarray (N,) [1/s], for proofs.

        Raises
        ------
        ParameterError
            If the oscillators are of another family, of which no bound is known.
        """
        if not isinstance(self.oscillators, AndronovHopf):
            raise ParameterError(f'no bounds are known of {type(self.oscillators).__name__}')
        return self._one_per_node('rho')

    def _one_per_node(self, name: str) -> Array:
        values, n = getattr(self.oscillators, name), self.graph.size
        if np.shape(values) not in ((), (n,)):
            raise ParameterError(f'{n} nodes need one {name} or {n}, not {np.size(values)}')
        return np.broadcast_to(np.asarray(values, dtype=float), n)

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
            Both are kept for the next time, and not to be written to.
        """
        key = gains.tobytes()
        linear = self._linear.get(key)
        if linear is None:
            if len(self._linear) > MOST_KEPT:
                self._linear.clear()
            alpha = np.repeat(gains, 2)
            linear = self._linear[key] = (
                self._coupling - np.diag(alpha), alpha * self.target.ravel())
        return linear

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
        (M, c), state = self.linear_part(gains), x.ravel()
        return (M.dot(state) + c).reshape(x.shape) + self.oscillators.field(x, omega)

    def jacobian(self, x: Array, omega: float | Array, gains: Array) -> Array:
        """Jacobian of :meth:`field`.

        Returns
        -------
        ndarray (2N, 2N)
        """
        matrix, n = self.linear_part(gains)[0].copy(), len(x)
        own = np.ndarray((n, 2, 2), float, matrix, 0, (32 * n + 16, 16 * n, 8))  # on the diagonal
        own += self.oscillators.jacobian(x, omega)
        return matrix

    def newton_step(self, x: Array, omega: float | Array, gains: Array, field: Array) -> Array:
        """States (N, 2) one of Newton's steps nearer to an equilibrium, from those with a known
        field (N, 2); LinAlgError where the Jacobian is singular.
        """
        step = np.linalg.solve(self.jacobian(x, omega, gains), field.ravel())
        return x - step.reshape(x.shape)

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
        field = self.oscillators.field
        return step(x, lambda at: field(at, omega))
