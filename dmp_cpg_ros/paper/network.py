# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A network of any oscillators with any coupling and inhibition, for a few nodes or ten thousand.

    ẋ_i = f(x_i; ω_i) + Σ_j K_ij (R(φ_ij) x_j − x_i) + α_i (x_{i,d} − x_i)

(paper eqs. hetero, inhibitedCanonicalSystem). The four oscillators of a gait have their own,
faster step in :mod:`~dmp_cpg_ros.core.canonical.system`, which is exact in the linear part.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.coupling import Coupling
from dmp_cpg_ros.paper.oscillators import OscillatorFamily
from dmp_cpg_ros.paper.stabilised_step import (
    Field,
    chebyshev_stages,
    chebyshev_step,
    contractive_stages,
    contractive_step,
)

Array = NDArray[np.float64]


class OscillatorNetwork:
    """Vector field and time step; the state stays with the caller.

    Parameters
    ----------
    oscillators : OscillatorFamily
        The N oscillators.
    coupling : Coupling, optional
        What they receive from one another; nothing without.
    target : ndarray (N, n), optional
        x_{i,d}, where inhibition pulls each node; zeros without.

    Raises
    ------
    ParameterError
        If sizes differ, or phase offsets turn the states of oscillators that are not rotation
        invariant.
    """

    def __init__(self, oscillators: OscillatorFamily, coupling: Coupling | None = None,
                 target: Array | None = None) -> None:
        """Check that the parts fit."""
        self.oscillators, self.coupling = oscillators, coupling
        self.shape = (oscillators.count, oscillators.state_size)
        self.target = np.zeros(self.shape) if target is None else np.asarray(target, dtype=float)
        if self.target.shape != self.shape:
            raise ParameterError(f'the target of inhibition must have shape {self.shape}, not '
                                 f'{self.target.shape}')
        if coupling is None:
            return
        if (coupling.count, coupling.state_size) != self.shape:
            raise ParameterError(
                f'a coupling of {coupling.count} states of size {coupling.state_size} does not '
                f'fit {oscillators.count} oscillators with states of size '
                f'{oscillators.state_size}')
        if coupling.turned and not oscillators.rotation_invariant:
            raise ParameterError('phase offsets need oscillators that are rotation invariant, '
                                 'such as Andronov-Hopf or phase oscillators')

    def field(self, x: Array, gains: Array | None = None) -> Array:
        """Vector field ẋ.

        Parameters
        ----------
        x : ndarray (N, n)
            States.
        gains : ndarray (N,), optional
            Inhibition gains α_i ≥ 0 that act now [1/s]; none without.

        Returns
        -------
        ndarray (N, n)
            [1/s]
        """
        return self._field(gains)(x)

    def step(self, x: Array, dt: float, gains: Array | None = None) -> Array:
        """Advance by one time step, of order two and stable however large the gains are.

        The number of stages follows from the fastest rate: it grows with its square root when all
        couplings are symmetric, and in proportion when they are not.

        Parameters
        ----------
        x : ndarray (N, n)
            States.
        dt : float
            [s]
        gains : ndarray (N,), optional
            Inhibition gains that act during the step [1/s].

        Returns
        -------
        ndarray (N, n)
        """
        fastest = self.oscillators.stiffness(x)
        if self.coupling is not None:
            fastest += self.coupling.bound
        if gains is not None:
            fastest += float(gains.max())
        field = self._field(gains)
        if self.coupling is None or self.coupling.symmetric:
            return chebyshev_step(field, x, dt, chebyshev_stages(dt, fastest))
        return contractive_step(field, x, dt, contractive_stages(dt, fastest))

    def _field(self, gains: Array | None) -> Field:
        own, coupling, target = self.oscillators.field, self.coupling, self.target
        if gains is None:
            return own if coupling is None else lambda x: own(x) + coupling(x)
        pull = gains[:, None]
        if coupling is None:
            return lambda x: own(x) + pull * (target - x)
        return lambda x: own(x) + coupling(x) + pull * (target - x)
