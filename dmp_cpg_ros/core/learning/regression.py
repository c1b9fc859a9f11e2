# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Regression of a primitive's weights on demonstrations, discrete or rhythmic.

The two kinds differ in their phase, in their bases and what these multiply (the phase itself, or
the two states of the oscillator), and in how a force becomes a movement: from an unknown initial
state, or periodically. All else is here.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.learning import learning
from dmp_cpg_ros.core.learning.learning import BASIS_CANDIDATES, FitOptions
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.primitives.primitive import Bases
from dmp_cpg_ros.core.primitives.responses import Force
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper

Mask = NDArray[np.bool_]
Indices = NDArray[np.int_]


class Rows(NamedTuple):
    """Regression rows of one demonstration, for degrees of freedom that share their gains.

    Attributes
    ----------
    forced : ndarray (q, p)
        Movements that the bases cause; they multiply the weights.
    free : ndarray (q, 2) or (q, 0)
        Free movements; they multiply the unknown initial state, if there is one.
    targets : ndarray (q, n)
        Measured positions relative to the goal or centre, and derivatives if there are any.
    """

    forced: Array
    free: Array
    targets: Array

    def of(self, chosen: Mask) -> Rows:
        """Rows of the chosen samples (m,); every kind of rows is in the order of the samples."""
        keep = np.tile(chosen, len(self.targets) // len(chosen))
        return Rows(*(part[keep] for part in self))

    def without_initial_state(self) -> tuple[Array, Array]:
        """Regressors and targets, with what an initial state can explain projected out."""
        q = np.linalg.qr(self.free)[0]
        return self.forced - q @ (q.T @ self.forced), self.targets - q @ (q.T @ self.targets)

    def initial_state(self, weights: Array) -> Array:
        """Distance from the goal and velocity at the start, (2, n), that fit the weights best."""
        rest = self.targets - self.forced @ weights
        return np.asarray(np.linalg.lstsq(self.free, rest, rcond=None)[0])

    def missed(self, weights: Array, hidden: Mask) -> Array:
        """Errors of the hidden positions, with the initial state that fits the others best."""
        start = self.of(hidden if hidden.all() else ~hidden).initial_state(weights)
        made = self.forced @ weights + self.free @ start
        return np.asarray((made - self.targets)[: len(hidden)][hidden])  # positions come first


@dataclass(frozen=True, eq=False)
class Task(ABC):
    """What the regression of one set of demonstrations shares.

    Attributes
    ----------
    demonstrations : list of Demonstration
        With derivatives, unless the method is ``response``.
    durations : list of float
        Duration or period of each demonstration [s].
    goals : list of ndarray (n,)
        Goal or centre of each demonstration.
    spring : SpringDamper
        Gains and reading of τ.
    options : FitOptions
        Method and regularisation.
    """

    demonstrations: list[Demonstration]
    durations: list[float]
    goals: list[Array]
    spring: SpringDamper
    options: FitOptions

    @property
    def duration(self) -> float:
        """Duration or period at τ = 1 [s]."""
        return float(np.mean(self.durations))

    @property
    def taus(self) -> Array:
        """Temporal scale τ of each demonstration."""
        return np.asarray(self.durations) / self.duration

    @abstractmethod
    def bases(self, count: int) -> Bases:
        """Bases of the given number over the movement or around the cycle."""

    @abstractmethod
    def phases(self, i: int) -> Array:
        """Phases (m,) of the samples of demonstration i."""

    @abstractmethod
    def inputs(self, phases: Array) -> Array:
        """What each basis multiplies at the phases, ndarray (m, c)."""

    @abstractmethod
    def responses(self, i: int, k: float, b: float, force: Force, count: int
                  ) -> tuple[Array, Array]:
        """Movements (3, m, p) at the samples of demonstration i that forces cause, functions of
        the phase made of a number of bases, and free movements (3, m, 2 or 0).
        """

    def chosen_bases(self, count: int | None) -> Bases:
        """Bases of the given number, or of the smallest number with a good held-out error."""
        if count is None:
            count = learning.smallest_good(self.held_out_errors())
        samples = sum(len(movement.times) for movement in self.demonstrations)
        if count > samples:  # nothing would tell their weights apart
            raise DataError(f'{samples} samples tell at most as many bases, not {count}')
        return self.bases(count)

    def held_out_errors(self, candidates: Sequence[int] = BASIS_CANDIDATES) -> dict[int, float]:
        """Error at samples that took no part in the fit, for several numbers of bases: root mean
        square over all folds, as a fraction of each degree of freedom's range.
        """
        return {count: self._held_out_error(self.bases(count)) for count in candidates}

    def rows(self, bases: Bases) -> list[tuple[Indices, list[Rows]]]:
        """Degrees of freedom that share their gains, and their rows of every demonstration."""
        return [(members, [self._rows(bases, i, k, b, members)
                           for i in range(len(self.demonstrations))])
                for k, b, members in self.spring.groups()]

    def fit(self, bases: Bases, rows: Sequence[tuple[Indices, list[Rows]]],
            kept: Sequence[Mask] | None = None) -> Array:
        """Fit the weights by the method of the options.

        Parameters
        ----------
        bases : Bases
        rows : sequence of (ndarray, list of Rows)
            From :meth:`rows`; only the method ``response`` takes them.
        kept : sequence of ndarray of bool, optional
            Samples of each demonstration that take part; all without.

        Returns
        -------
        ndarray (p, n)
            For each basis one row per input.
        """
        movements, options = self.demonstrations, self.options
        kept = kept or [np.ones(len(movement.times), bool) for movement in movements]
        if options.method == 'response':
            weights = np.empty((rows[0][1][0].forced.shape[1], movements[0].dofs))
            for members, parts in rows:
                used = [part.of(keep).without_initial_state()
                        for part, keep in zip(parts, kept, strict=True) if keep.any()]
                weights[:, members] = learning.ridge_regression(
                    np.vstack([A for A, _ in used]), np.vstack([B for _, B in used]),
                    options.ridge)
            return weights
        phases = np.concatenate([self.phases(i)[keep] for i, keep in enumerate(kept)])
        forces = np.vstack([self._required_force(i)[keep] for i, keep in enumerate(kept)])
        if options.method == 'joint':
            return learning.ridge_regression(
                self._regressors(bases, phases), forces, options.ridge)
        local = learning.locally_weighted_regression(
            bases.activations(phases), self.inputs(phases), forces, options.ridge)
        return local.reshape(-1, forces.shape[1])

    def _required_force(self, i: int) -> Array:
        movement = self.demonstrations[i]
        y, v, a = (np.asarray(values) for values in (
            movement.positions, movement.velocities, movement.accelerations))
        return self.spring.required_force(y, v, a, self.goals[i], self.taus[i])

    def _regressors(self, bases: Bases, phases: Array) -> Array:
        """Products of bases and inputs (m, p), the inputs of a basis side by side."""
        products = bases.activations(phases)[:, :, None] * self.inputs(phases)[:, None, :]
        return products.reshape(len(phases), -1)

    def _rows(self, bases: Bases, i: int, k: float, b: float, members: Indices) -> Rows:
        """Rows of positions, and of velocities and accelerations if there are any.

        With constant τ the printed form is the scaled one with stiffness τk and force τf, so that
        one solver serves both.
        """
        movement, tau = self.demonstrations[i], self.taus[i]
        stretch = tau if self.spring.form == 'printed' else 1.0
        forced, free = self.responses(
            i, stretch * k, b, lambda phases: stretch * self._regressors(bases, phases),
            bases.count)
        measured = (movement.positions - self.goals[i], movement.velocities,
                    movement.accelerations)
        parts = [(scale * forced[order], scale * free[order],
                  scale * (tau**order * values[:, members]))
                 for order, (scale, values) in enumerate(
                     zip((1.0, 1.0 / b, 1.0 / k), measured, strict=True)) if values is not None]
        return Rows(*(np.vstack(kind) for kind in zip(*parts, strict=True)))

    def _held_out_error(self, bases: Bases) -> float:
        span, rows = learning.ranges(self.demonstrations), self.rows(bases)
        squares, samples = 0.0, 0
        for hidden in self._folds():
            weights = self.fit(bases, rows, [~mask for mask in hidden])
            for members, parts in rows:
                for part, mask in zip(parts, hidden, strict=True):
                    if mask.any():
                        error = part.missed(weights[:, members], mask) / span[members]
                        squares, samples = squares + float(np.sum(error**2)), samples + error.size
        return float(np.sqrt(squares / samples))

    def _folds(self, count: int = 5) -> list[list[Mask]]:
        """Samples to hold out, a mask per demonstration: whole demonstrations in turn if there are
        several, else every count-th sample.
        """
        movements = self.demonstrations
        if len(movements) > 1:
            return [[np.full(len(d.times), i == j) for j, d in enumerate(movements)]
                    for i in range(len(movements))]
        index = np.arange(len(movements[0].times))
        return [[(index + count // 2) % count == fold] for fold in range(count)]
