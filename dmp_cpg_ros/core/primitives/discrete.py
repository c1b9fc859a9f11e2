# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Discrete primitives: movements to a goal on an exponential phase (eqs. p2p_trans, p2p_phase)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths.first_order import FirstOrderFilter
from dmp_cpg_ros.core.primitives.basis import GaussianBases
from dmp_cpg_ros.core.primitives.demonstration import Trajectory, columns, vector
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.core.primitives.states import DiscreteInput, DiscreteState
from dmp_cpg_ros.core.primitives.time_scaling import Form, TimeScaling

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DiscretePrimitive:
    """f(x) = x Σ Φ_i(x) w_i / Σ Φ_i(x) on τẋ = −α_x x, a spring-damper towards a filtered goal.

    Attributes
    ----------
    weights : ndarray (m, n)
        w_i for m bases and n degrees of freedom.
    bases : GaussianBases
        The m basis functions.
    phase_decay : float
        α_x > 0 [1/s].
    transformation : SpringDamper
        k, b and the reading of τ.
    start, goal : ndarray (n,)
        Start and goal of the demonstration, defaults for a new movement.
    start_velocity : ndarray (n,)
        Velocity at the start at τ = 1, 0 for a movement from rest.
    goal_rate, tau_rate : float
        Rates of the filters on goal and τ [1/s].
    duration : float
        Duration of the demonstration [s].
    names : tuple of str
        Names of the degrees of freedom; empty when they have none.

    Raises
    ------
    ParameterError
        If shapes do not match or a number is out of range.
    """

    weights: Array
    bases: GaussianBases
    phase_decay: float
    transformation: SpringDamper
    start: Array
    goal: Array
    duration: float
    start_velocity: ArrayLike = 0.0
    goal_rate: float = 10.0
    tau_rate: float = 10.0
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Validate; scalars of the transformation are spread over the degrees of freedom."""
        weights = np.array(self.weights, dtype=float)
        if weights.ndim != 2 or len(weights) != self.bases.count:
            raise ParameterError(
                f'weights must have shape ({self.bases.count}, n), not {weights.shape}'
            )
        if not np.all(np.isfinite(weights)):
            raise ParameterError('weights must be finite')
        dofs = weights.shape[1]
        object.__setattr__(self, 'weights', weights)
        object.__setattr__(self, 'start', vector(self.start, dofs, 'start'))
        object.__setattr__(self, 'goal', vector(self.goal, dofs, 'goal'))
        object.__setattr__(
            self, 'start_velocity', columns(self.start_velocity, dofs, 'start_velocity')
        )
        object.__setattr__(self, 'transformation', self.transformation.spread(dofs))
        for name in ('phase_decay', 'duration'):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ParameterError(f'{name} = {value!r} must be a positive finite number')
        if self.names and len(self.names) != dofs:
            raise ParameterError(f'{len(self.names)} names do not match {dofs} degrees of freedom')
        self._filters  # noqa: B018  (checks the rates)

    @cached_property
    def _filters(self) -> tuple[FirstOrderFilter, TimeScaling]:
        return FirstOrderFilter(self.goal_rate), TimeScaling(self.tau_rate)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""
        return int(self.weights.shape[1])

    @property
    def form(self) -> Form:
        """Reading of τ."""
        return self.transformation.form

    def forcing(self, x: ArrayLike) -> Array:
        """Forcing function f(x).

        Parameters
        ----------
        x : array_like (...)
            Phase.

        Returns
        -------
        ndarray (..., n)
        """
        x = np.asarray(x, dtype=float)
        return np.asarray(x[..., None] * (self.bases.activations(x) @ self.weights))

    def default_input(self) -> DiscreteInput:
        """The demonstration's goal at τ = 1."""
        return DiscreteInput(self.goal)

    def initial_state(
        self,
        position: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        tau: float = 1.0,
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
        if not (np.isfinite(tau) and tau > 0.0):
            raise ParameterError(f'tau = {tau!r} must be a positive finite number')
        n = self.dofs
        usual = np.asarray(self.start_velocity) / (tau if self.form == 'scaled' else 1.0)
        return DiscreteState(
            self.start if position is None else vector(position, n, 'position'),
            usual if velocity is None else vector(velocity, n, 'velocity'),
            1.0,
            self.goal if goal is None else vector(goal, n, 'goal'),
            float(tau),
        )

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
        goal_filter, scaling = self._filters
        grid = scaling.grid(state.tau, command.tau, dt, 3, self.form)
        x = state.x * np.exp(-self.phase_decay * grid.scaled)  # (3,)
        goal = vector(command.goal, self.dofs, 'goal')
        goals = goal_filter.at(state.goal, goal, grid.elapsed)  # (3, n)
        position, velocity = self.transformation.step(
            state.position, state.velocity, goals, self.forcing(x), grid
        )
        return DiscreteState(position, velocity, float(x[-1]), goals[-1], float(grid.tau[-1]))

    def acceleration(self, state: DiscreteState, command: DiscreteInput) -> Array:
        """Acceleration ÿ in a state.

        Parameters
        ----------
        state : DiscreteState
        command : DiscreteInput
            Its τ_ext gives τ̇.

        Returns
        -------
        ndarray (n,)
        """
        return self.transformation.acceleration(
            state.position,
            state.velocity,
            state.goal,
            self.forcing(state.x),
            state.tau,
            self.tau_rate * (command.tau - state.tau),
        )

    def rollout(
        self,
        times: ArrayLike,
        command: DiscreteInput | None = None,
        state: DiscreteState | None = None,
    ) -> Trajectory:
        """Run the primitive with a constant input.

        Parameters
        ----------
        times : array_like (m,)
            Increasing times; the state holds at the first [s].
        command : DiscreteInput, optional
            Goal and τ; the demonstration's without.
        state : DiscreteState, optional
            Initial state; the demonstration's start at the commanded goal and τ without.

        Returns
        -------
        Trajectory
        """
        command = command or self.default_input()
        state = state or self.initial_state(goal=command.goal, tau=command.tau)
        times = np.asarray(times, dtype=float)
        states = [state]
        for dt in np.diff(times):
            states.append(self.step(states[-1], command, float(dt)))
        return Trajectory(
            times,
            np.array([s.position for s in states]),
            np.array([s.velocity for s in states]),
            np.array([self.acceleration(s, command) for s in states]),
        )
