# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What discrete and rhythmic primitives share: weighted bases that drive a spring-damper."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import ceil
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array, check_positive
from dmp_cpg_ros.core.maths.first_order import FirstOrderFilter
from dmp_cpg_ros.core.primitives.basis import Bases
from dmp_cpg_ros.core.primitives.demonstration import Trajectory, columns, vector
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.core.primitives.time_scaling import Form, StepGrid, TimeScaling

LONGEST_STEP = 0.01
"""Longest step of a rollout, as a share of the time that a movement or cycle takes."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Primitive(ABC):
    """Canonical system, forcing function and transformation system.

    A subclass names its numbers in ``SCALARS`` (positive) and ``VECTORS`` (one entry per degree
    of freedom), what the spring pulls to, ``TARGET``, and how long a movement or a cycle takes at
    τ = 1, ``LENGTH``.

    Attributes
    ----------
    weights : ndarray (m, n) or (m, n, 2)
        w_i for m bases and n degrees of freedom.
    bases : Bases
        The m basis functions.
    transformation : SpringDamper
        k, b and the reading of τ.
    tau_rate : float
        Rate of the filter on τ [1/s].
    names : tuple of str
        Names of the degrees of freedom; empty when they have none.

    Raises
    ------
    ParameterError
        If shapes do not match or a number is out of range.
    """

    WEIGHT: ClassVar[tuple[int, ...]]
    TARGET: ClassVar[str]
    LENGTH: ClassVar[str]
    SCALARS: ClassVar[tuple[str, ...]]
    VECTORS: ClassVar[tuple[str, ...]]

    weights: Array
    bases: Bases
    transformation: SpringDamper
    tau_rate: float = 10.0
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Validate; scalars of the transformation are spread over the degrees of freedom."""
        weights, count = np.array(self.weights, dtype=float), self.bases.count
        width = weights.shape[1:2]
        if not width or weights.shape != (count, *width, *self.WEIGHT):
            shape = ', '.join(map(str, (count, 'n', *self.WEIGHT)))
            raise ParameterError(f'weights must have shape ({shape}), not {weights.shape}')
        if not np.all(np.isfinite(weights)):
            raise ParameterError('weights must be finite')
        object.__setattr__(self, 'weights', weights)
        for name in self.VECTORS:
            spread = columns if name == 'start_velocity' else vector
            object.__setattr__(self, name, spread(getattr(self, name), self.dofs, name))
        object.__setattr__(self, 'transformation', self.transformation.spread(self.dofs))
        check_positive(**{name: getattr(self, name) for name in self.SCALARS})
        if self.names and len(self.names) != self.dofs:
            raise ParameterError(f'{len(self.names)} names do not match {self.dofs} dofs')

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""
        return int(self.weights.shape[1])

    @property
    def form(self) -> Form:
        """Reading of τ."""
        return self.transformation.form

    def _grid(self, state: Any, command: Any, dt: float, nodes: int) -> StepGrid:
        return TimeScaling(self.tau_rate).grid(state.tau, command.tau, dt, nodes, self.form)

    @abstractmethod
    def forcing(self, x: ArrayLike) -> Array:
        """Forcing function f(x) (..., n)."""

    @abstractmethod
    def default_input(self) -> Any:
        """Input of the demonstration."""

    @abstractmethod
    def step(self, state: Any, command: Any, dt: float) -> Any:
        """Advance by one step with the input held."""

    @abstractmethod
    def _start(self, command: Any) -> Any:
        """Usual initial state for an input."""

    def _transformed(self, state: Any, command: Any, x: Array, grid: StepGrid
                     ) -> tuple[Array, Array, Array]:
        """Position, velocity and filtered target at the end of a step with three nodes."""
        wanted = vector(getattr(command, self.TARGET), self.dofs, self.TARGET)
        targets = FirstOrderFilter(getattr(self, f'{self.TARGET}_rate')).at(
            getattr(state, self.TARGET), wanted, grid.elapsed)
        position, velocity = self.transformation.step(
            state.position, state.velocity, targets, self.forcing(x), grid)
        return position, velocity, targets[-1]

    def acceleration(self, state: Any, command: Any) -> Array:
        """Acceleration ÿ in a state.

        Parameters
        ----------
        state : DiscreteState or RhythmicState
        command : DiscreteInput or RhythmicInput
            Its τ_ext gives τ̇.

        Returns
        -------
        ndarray (n,)
        """
        return self.transformation.acceleration(
            state.position, state.velocity, getattr(state, self.TARGET), self.forcing(state.x),
            state.tau, self.tau_rate * (command.tau - state.tau))

    def rollout(self, times: ArrayLike, command: Any = None, state: Any = None) -> Trajectory:
        """Run the primitive with a constant input.

        Parameters
        ----------
        times : array_like (m,)
            Increasing times; the state holds at the first [s]. Intervals of more than
            ``LONGEST_STEP`` of a movement or cycle are taken in several steps.
        command : DiscreteInput or RhythmicInput, optional
            The demonstration's without.
        state : DiscreteState or RhythmicState, optional
            Initial state; without, the demonstration's start at the commanded goal and τ, or the
            limit cycle of the command at phase 0.

        Returns
        -------
        Trajectory
        """
        command = command or self.default_input()
        times, states = np.asarray(times, dtype=float), [state or self._start(command)]
        for dt in np.diff(times).tolist():
            tau, after = min(states[-1].tau, command.tau), states[-1]
            check_positive(dt=dt, tau=tau)
            parts = max(1, ceil(dt / (LONGEST_STEP * getattr(self, self.LENGTH) * tau) - 1e-6))
            for _ in range(parts):
                after = self.step(after, command, dt / parts)
            states.append(after)
        return Trajectory(
            times, np.array([s.position for s in states]), np.array([s.velocity for s in states]),
            np.array([self.acceleration(s, command) for s in states]))
