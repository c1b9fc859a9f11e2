# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What discrete and rhythmic primitives share: weighted bases that drive a spring-damper.

The bases of the forcing terms are normalised, Φ_i/Σ_j Φ_j: Gaussian (discrete) and von Mises
(rhythmic). The largest exponent is subtracted before the exponential is taken, so the quotient
stays defined where every Φ_i underflows.
"""

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
from dmp_cpg_ros.core.primitives.demonstration import Trajectory, columns, vector
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.core.primitives.time_scaling import Form, StepGrid, TimeScaling


@dataclass(frozen=True, eq=False)
class Bases(ABC):
    """Normalised basis functions with a centre and a width each.

    Attributes
    ----------
    centres : ndarray (n,)
        Phases at which the bases are largest.
    widths : ndarray (n,)
        σ_i > 0.

    Raises
    ------
    ParameterError
        If the arrays differ in shape, are empty or hold values out of range.
    """

    centres: Array
    widths: Array

    def __post_init__(self) -> None:
        """Validate."""
        centres, widths = (np.array(values, dtype=float) for values in (self.centres, self.widths))
        if centres.ndim != 1 or centres.shape != widths.shape or not centres.size:
            raise ParameterError(
                f'centres and widths must be two lists of the same length, at least 1; they have '
                f'shapes {centres.shape} and {widths.shape}')
        check_positive(widths=widths)
        if not np.isfinite(centres).all():
            raise ParameterError('centres must be finite')
        object.__setattr__(self, 'centres', centres)
        object.__setattr__(self, 'widths', widths)

    @property
    def count(self) -> int:
        """Number of bases."""
        return len(self.centres)

    def activations(self, phase: ArrayLike) -> Array:
        """Normalised bases Φ_i/Σ_j Φ_j.

        Parameters
        ----------
        phase : array_like (...)
            Of the canonical system.

        Returns
        -------
        ndarray (..., n)
            Each row sums to 1.
        """
        exponents = self._exponents(np.asarray(phase, dtype=float)[..., None])
        values = np.exp(exponents - exponents.max(axis=-1, keepdims=True))
        return np.asarray(values / values.sum(axis=-1, keepdims=True))

    @abstractmethod
    def _exponents(self, phase: Array) -> Array:
        """Logarithms of Φ_i (..., n) at phases (..., 1)."""


class GaussianBases(Bases):
    """Φ_i(x) = exp(−(x − c_i)²/(2σ_i²)) of the discrete forcing function, c_i in (0, 1].

    The paper prints σ₁ for every basis; x falls exponentially, so with one width either the first
    bases leave gaps or the last ones coincide. One width per basis is what Ijspeert et al. (2013)
    use, and what is used here; equal entries in ``widths`` give the printed form.
    """

    @classmethod
    def evenly_in_time(cls, count: int, decay: float, duration: float, overlap: float = 0.6
                       ) -> GaussianBases:
        """Bases whose centres are reached at evenly spaced times.

        Parameters
        ----------
        count : int
            Number of bases, at least 1.
        decay : float
            Phase decay α_x [1/s].
        duration : float
            Time over which the centres are spread [s].
        overlap : float
            Value of a basis at the centre of its later neighbour, in (0, 1).

        Returns
        -------
        GaussianBases

        Raises
        ------
        ParameterError
            If an argument is out of range.
        """
        _check_count(count, overlap)
        centres = np.exp(-decay * np.linspace(0.0, duration, count))
        if count == 1:
            return cls(centres, np.ones(1))
        gaps = -np.diff(centres)
        return cls(centres, np.append(gaps, gaps[-1]) / np.sqrt(-2.0 * np.log(overlap)))

    def _exponents(self, phase: Array) -> Array:
        return np.asarray(-0.5 * ((phase - self.centres) / self.widths) ** 2)


class VonMisesBases(Bases):
    """Φ_i(φ) = exp((cos(φ − φ_i) − 1)/(2σ_i²)) of the rhythmic forcing function, in radians.

    The paper prints σ₁ for every basis and uses the clockwise angle θ = −φ; since the cosine is
    even, bases at φ_i here are bases at θ_i = −φ_i there.
    """

    @classmethod
    def evenly_around(cls, count: int, overlap: float = 0.2) -> VonMisesBases:
        """Bases evenly spaced around the cycle, all of one width.

        Parameters
        ----------
        count : int
            Number of bases, at least 1.
        overlap : float
            Value of a basis at the centre of its neighbour, in (0, 1).

        Returns
        -------
        VonMisesBases

        Raises
        ------
        ParameterError
            If an argument is out of range.
        """
        _check_count(count, overlap)
        gap = 2.0 * np.pi / max(count, 2)
        width = np.sqrt((np.cos(gap) - 1.0) / (2.0 * np.log(overlap)))
        return cls(2.0 * np.pi * np.arange(count) / count, np.full(count, width))

    def _exponents(self, phase: Array) -> Array:
        return np.asarray((np.cos(phase - self.centres) - 1.0) / (2.0 * self.widths**2))


def _check_count(count: int, overlap: float) -> None:
    if not (isinstance(count, (int, np.integer)) and count >= 1):
        raise ParameterError(f'number of bases = {count!r} must be a whole number of at least 1')
    if not 0.0 < overlap < 1.0:
        raise ParameterError(f'overlap = {overlap!r} must lie between 0 and 1')


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
