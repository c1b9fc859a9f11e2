# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Temporal scaling τ(t): scaled time s with ds/dt = 1/τ(t) (paper eq. differ, left-hand side).

Everything that runs on a canonical system runs in s. When τ follows a first-order filter, s(t) has
a closed form, so a change of speed costs no accuracy and makes no velocity jump.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.maths import Array, check_positive
from dmp_cpg_ros.core.maths.first_order import FirstOrderFilter

Form = Literal['scaled', 'printed']


@dataclass(frozen=True, eq=False)
class StepGrid:
    """Nodes inside one time step, evenly spaced in the variable in which the step is taken.

    Attributes
    ----------
    elapsed : ndarray (m,)
        Real time since the start of the step [s].
    scaled : ndarray (m,)
        Scaled time since the start of the step [s].
    tau : ndarray (m,)
        τ at the nodes.
    length : float
        Length of the step in the variable in which the nodes are evenly spaced [s].
    density : ndarray (m,)
        Derivative of scaled time by that variable at the nodes.
    """

    elapsed: Array
    scaled: Array
    tau: Array
    length: float
    density: Array

    def halved(self) -> StepGrid:
        """Every second node."""
        return StepGrid(
            self.elapsed[::2], self.scaled[::2], self.tau[::2], self.length, self.density[::2])


class TimeScaling(FirstOrderFilter):
    """τ as a filtered reference: τ̇ = α_τ (τ_ext − τ), with scaled time in closed form."""

    def scaled_time(self, tau: float, command: float, elapsed: ArrayLike) -> Array:
        """Scaled time s = ∫ dt/τ(t) since the start of the step.

        Closed form s = t/τ_ext + ln(τ(t)/τ(0))/(α τ_ext), with τ(t) from :meth:`at`.

        Parameters
        ----------
        tau, command : float
            τ at the start and τ_ext, both positive.
        elapsed : array_like (...)
            Time since the start of the step [s].

        Returns
        -------
        ndarray (...)
            [s]
        """
        elapsed = np.asarray(elapsed, dtype=float)
        change = (command - tau) / tau * -np.expm1(-self.rate * elapsed)  # τ(t)/τ(0) − 1
        return (elapsed + np.log1p(change) / self.rate) / command

    def real_time(self, tau: float, command: float, scaled: ArrayLike) -> Array:
        """Real time after which a scaled time has passed, the inverse of :meth:`scaled_time`.

        Parameters
        ----------
        tau, command : float
            τ at the start and τ_ext, both positive.
        scaled : array_like (...)
            Scaled time since the start of the step [s].

        Returns
        -------
        ndarray (...)
            [s]
        """
        scaled = np.asarray(scaled, dtype=float)
        return np.log1p(tau / command * np.expm1(self.rate * command * scaled)) / self.rate

    def grid(self, tau: float, command: float, dt: float, count: int, form: Form) -> StepGrid:
        """Nodes of one step.

        Parameters
        ----------
        tau, command : float
            τ at the start of the step and τ_ext, held during it.
        dt : float
            Length of the step in real time [s].
        count : int
            Number of nodes, both ends included.
        form : {'scaled', 'printed'}
            Evenly spaced in scaled time or in real time.

        Returns
        -------
        StepGrid

        Raises
        ------
        ParameterError
            If τ, τ_ext or dt is not a positive finite number.
        """
        check_positive(tau=tau, commanded_tau=command, dt=dt)
        fraction = np.linspace(0.0, 1.0, count)
        if tau == command:
            elapsed, taus = fraction * dt, np.full(count, tau)
            scaled = elapsed / tau
        elif form == 'scaled':
            scaled = fraction * float(self.scaled_time(tau, command, dt))
            elapsed = self.real_time(tau, command, scaled)
            taus = self.at(tau, command, elapsed)
        else:
            elapsed = fraction * dt
            scaled, taus = (of(tau, command, elapsed) for of in (self.scaled_time, self.at))
        if form == 'scaled':
            return StepGrid(elapsed, scaled, taus, float(scaled[-1]), np.ones(count))
        return StepGrid(elapsed, scaled, taus, dt, 1.0 / taus)
