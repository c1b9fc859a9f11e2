# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Discrete primitives: movements to a goal on an exponential phase (eqs. p2p_trans, p2p_phase)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.maths import Array, check_positive
from dmp_cpg_ros.core.primitives.demonstration import vector
from dmp_cpg_ros.core.primitives.primitive import Primitive


@dataclass(frozen=True, eq=False)
class DiscreteInput:
    """What may change while the movement runs; held during a step.

    Attributes
    ----------
    goal : ndarray (n,)
        External goal g_ext.
    tau : float
        Commanded τ_ext > 0; 2 makes the movement twice as slow.
    """

    goal: Array
    tau: float = 1.0


@dataclass(frozen=True, eq=False)
class DiscreteState:
    """State of reference, canonical and transformation system.

    Attributes
    ----------
    position, velocity : ndarray (n,)
        y and ẏ, in the demonstration's unit and per second.
    x : float
        Phase, 1 at the start, falling to 0.
    goal : ndarray (n,)
        Filtered goal g.
    tau : float
        Filtered τ.
    """

    position: Array
    velocity: Array
    x: float
    goal: Array
    tau: float


@dataclass(frozen=True, eq=False, kw_only=True)
class DiscretePrimitive(Primitive):
    """f(x) = x Σ Φ_i(x) w_i / Σ Φ_i(x) on τẋ = −α_x x, a spring-damper towards a filtered goal.

    Attributes
    ----------
    phase_decay : float
        α_x > 0 [1/s].
    start, goal : ndarray (n,)
        Start and goal of the demonstration, defaults for a new movement.
    duration : float
        Duration of the demonstration [s].
    start_velocity : ndarray (n,)
        Velocity at the start at τ = 1, 0 for a movement from rest.
    goal_rate : float
        Rate of the filter on the goal [1/s].
    """

    WEIGHT, TARGET, LENGTH = (), 'goal', 'duration'
    SCALARS = ('phase_decay', 'duration', 'goal_rate', 'tau_rate')
    VECTORS = ('start', 'goal', 'start_velocity')

    phase_decay: float
    start: Array
    goal: Array
    duration: float
    start_velocity: ArrayLike = 0.0
    goal_rate: float = 10.0

    def forcing(self, x: ArrayLike) -> Array:
        """Forcing function f(x) (..., n) at phases x (...)."""
        x = np.asarray(x, dtype=float)
        return np.asarray(x[..., None] * (self.bases.activations(x) @ self.weights))

    def default_input(self) -> DiscreteInput:
        """The demonstration's goal at τ = 1."""
        return DiscreteInput(self.goal)

    def initial_state(
        self, position: ArrayLike | None = None, velocity: ArrayLike | None = None,
        goal: ArrayLike | None = None, tau: float = 1.0,
    ) -> DiscreteState:
        """State at the start of a movement, with filters at rest.

        Parameters
        ----------
        position, velocity, goal : array_like (n,), optional
            y and g (the demonstration's without) and ẏ (the start velocity, adapted to τ,
            without).
        tau : float
            τ at the start.

        Returns
        -------
        DiscreteState

        Raises
        ------
        ParameterError
            If a length does not match, a number is not finite or τ is not positive.
        """
        check_positive(tau=tau)
        usual = np.asarray(self.start_velocity) / (tau if self.form == 'scaled' else 1.0)
        y, v, g = (
            own if given is None else vector(given, self.dofs, name)
            for name, given, own in (('position', position, self.start),
                                     ('velocity', velocity, usual), ('goal', goal, self.goal)))
        return DiscreteState(y, v, 1.0, g, float(tau))

    def _start(self, command: DiscreteInput) -> DiscreteState:
        return self.initial_state(goal=command.goal, tau=command.tau)

    def step(self, state: DiscreteState, command: DiscreteInput, dt: float) -> DiscreteState:
        """Advance by one step with the input held.

        Phase and filters are exact; the transformation is of fourth order (see
        ``SpringDamper.step``).

        Parameters
        ----------
        state : DiscreteState
            State at the start.
        command : DiscreteInput
            Goal and τ that are commanded during the step.
        dt : float
            Length of the step in real time [s].

        Returns
        -------
        DiscreteState

        Raises
        ------
        ParameterError
            If τ or dt is not positive or the goal does not fit.
        """
        grid = self._grid(state, command, dt, 3)
        x = state.x * np.exp(-self.phase_decay * grid.scaled)  # (3,)
        position, velocity, goal = self._transformed(state, command, x, grid)
        return DiscreteState(position, velocity, float(x[-1]), goal, float(grid.tau[-1]))
