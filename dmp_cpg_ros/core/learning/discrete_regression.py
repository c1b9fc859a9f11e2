# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Regression rows of discrete demonstrations, and the fits on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.learning.learning import (
    FitOptions,
    folds,
    locally_weighted_regression,
    ranges,
    ridge_regression,
)
from dmp_cpg_ros.core.primitives.basis import GaussianBases
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.primitives.responses import transient_responses
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FINAL_PHASE = 0.01
"""Phase x at the end of the demonstration, the usual choice; it fixes α_x = −ln(0.01)/T."""

_OVERLAP = 0.6
_STEPS_PER_MOVEMENT = 400


@dataclass(frozen=True, eq=False)
class DiscreteTask:
    """What the regression of one set of demonstrations shares.

    Attributes
    ----------
    demonstrations : list of Demonstration
        With derivatives, unless the method is ``response``.
    goals : list of ndarray (n,)
        Goal of each demonstration.
    spring : SpringDamper
        Gains and reading of τ.
    duration : float
        Duration at τ = 1 [s].
    options : FitOptions
        Method and regularisation.
    """

    demonstrations: list[Demonstration]
    goals: list[Array]
    spring: SpringDamper
    duration: float
    options: FitOptions

    @property
    def decay(self) -> float:
        """Phase decay α_x [1/s]."""
        return float(-np.log(FINAL_PHASE) / self.duration)

    def tau(self, i: int) -> float:
        """Temporal scale τ of demonstration i."""
        return self.demonstrations[i].duration / self.duration

    def bases(self, count: int) -> GaussianBases:
        """Bases of the given number over the movement."""
        return GaussianBases.evenly_in_time(
            count, self.decay, self.duration, self.options.overlap_or(_OVERLAP)
        )


@dataclass(frozen=True, eq=False)
class Rows:
    """Regression rows of one demonstration, for degrees of freedom that share their gains.

    Attributes
    ----------
    forced : ndarray (q, b)
        Movements that the bases cause; they multiply the weights.
    free : ndarray (q, 2)
        Free movements; they multiply the unknown initial state.
    targets : ndarray (q, n)
        Measured positions relative to the goal, and derivatives if there are any.
    samples : ndarray (q,) of int
        Sample that each row belongs to.
    """

    forced: Array
    free: Array
    targets: Array
    samples: NDArray[np.int_]

    def of(self, chosen: Mask) -> Rows:
        """Rows of the chosen samples."""
        keep = chosen[self.samples]
        return Rows(self.forced[keep], self.free[keep], self.targets[keep], self.samples[keep])

    def without_initial_state(self) -> tuple[Array, Array]:
        """Regressors and targets, with what an initial state can explain projected out."""
        q = np.linalg.qr(self.free)[0]
        return (
            np.asarray(self.forced - q @ (q.T @ self.forced)),
            np.asarray(self.targets - q @ (q.T @ self.targets)),
        )

    def initial_state(self, weights: Array) -> Array:
        """Distance from the goal and velocity at the start, (2, n), that fit the weights best."""
        return np.asarray(
            np.linalg.lstsq(self.free, self.targets - self.forced @ weights, rcond=None)[0]
        )


def response_rows(
    task: DiscreteTask, bases: GaussianBases, i: int, k: float, b: float, members: NDArray[np.int_]
) -> Rows:
    """Rows of one demonstration for the ``response`` method.

    With constant τ the printed form is the scaled one with stiffness τk and force τf, so that one
    solver serves both.

    Parameters
    ----------
    task : DiscreteTask
        What is learned.
    bases : GaussianBases
        Bases of the forcing function.
    i : int
        Number of the demonstration.
    k, b : float
        Gains of the degrees of freedom in ``members``.
    members : ndarray of int
        Degrees of freedom.

    Returns
    -------
    Rows
        Positions, and velocities and accelerations if the demonstration has them.
    """
    movement, tau = task.demonstrations[i], task.tau(i)
    stretch = tau if task.spring.form == 'printed' else 1.0
    scaled = (movement.times - movement.times[0]) / tau

    def force(s: Array) -> Array:
        x = np.exp(-task.decay * s)
        return stretch * x[:, None] * bases.activations(x)

    forced, free = transient_responses(
        stretch * k, b, scaled, force, task.duration / _STEPS_PER_MOVEMENT
    )
    offsets = movement.positions[:, members] - task.goals[i][members]
    observed = [(0, 1.0, offsets)]
    if movement.velocities is not None:
        observed.append((1, 1.0 / b, tau * movement.velocities[:, members]))
    if movement.accelerations is not None:
        observed.append((2, 1.0 / k, tau**2 * movement.accelerations[:, members]))
    return Rows(
        np.vstack([scale * forced[order] for order, scale, _ in observed]),
        np.vstack([scale * free[order] for order, scale, _ in observed]),
        np.vstack([scale * values for _, scale, values in observed]),
        np.tile(np.arange(len(scaled)), len(observed)),
    )


def fit_response(task: DiscreteTask, bases: GaussianBases) -> tuple[Array, Array, Array]:
    """Fit weights and initial state by regression on responses.

    Parameters
    ----------
    task : DiscreteTask
        What is learned.
    bases : GaussianBases
        The b bases.

    Returns
    -------
    weights : ndarray (b, n)
        Weights of the forcing function.
    start, velocity : ndarray (n,)
        Mean start, and velocity there at τ = 1.
    """
    dofs, count = task.demonstrations[0].dofs, len(task.demonstrations)
    weights, initial = np.empty((bases.count, dofs)), np.empty((count, 2, dofs))
    for k, b, members in task.spring.groups():
        rows = [response_rows(task, bases, i, k, b, members) for i in range(count)]
        weights[:, members] = _solve(rows, task.options.ridge)
        for i, part in enumerate(rows):
            initial[i][:, members] = part.initial_state(weights[:, members])
    taus = np.array([task.tau(i) for i in range(count)])
    velocities = initial[:, 1] / (1.0 if task.spring.form == 'scaled' else taus[:, None])
    starts = initial[:, 0] + np.array(task.goals)
    return weights, np.mean(starts, axis=0), np.mean(velocities, axis=0)


def fit_force(
    task: DiscreteTask, bases: GaussianBases, chosen: Sequence[Mask] | None = None
) -> tuple[Array, Array, Array]:
    """Fit weights by regression on the required force; the initial state is the measured one.

    Parameters
    ----------
    task : DiscreteTask
        What is learned, with derivatives.
    bases : GaussianBases
        The b bases.
    chosen : sequence of ndarray of bool, optional
        Samples of each demonstration that take part; all without.

    Returns
    -------
    weights, start, velocity
        As from :func:`fit_response`.
    """
    phases, targets, starts, velocities = [], [], [], []
    for i, movement in enumerate(task.demonstrations):
        tau, keep = task.tau(i), slice(None) if chosen is None else chosen[i]
        y, v, a = movement.all_derivatives()
        phases.append(np.exp(-task.decay * (movement.times[keep] - movement.times[0]) / tau))
        targets.append(task.spring.required_force(y[keep], v[keep], a[keep], task.goals[i], tau))
        starts.append(y[0])
        velocities.append(v[0] * (tau if task.spring.form == 'scaled' else 1.0))
    x, f = np.concatenate(phases), np.vstack(targets)
    psi, ridge = bases.activations(x), task.options.ridge
    if task.options.method == 'joint':
        weights = ridge_regression(x[:, None] * psi, f, ridge)
    else:
        weights = locally_weighted_regression(psi, x[:, None], f, ridge)[:, 0]
    return weights, np.mean(starts, axis=0), np.mean(velocities, axis=0)


def held_out_error(task: DiscreteTask, bases: GaussianBases) -> float:
    """Error of reproduced positions at samples that took no part in the fit.

    Parameters
    ----------
    task : DiscreteTask
        What is learned.
    bases : GaussianBases
        The b bases.

    Returns
    -------
    float
        Root mean square over all folds, as a fraction of each degree of freedom's range.
    """
    movements, groups = task.demonstrations, task.spring.groups()
    rows = [
        [response_rows(task, bases, i, k, b, members) for i in range(len(movements))]
        for k, b, members in groups
    ]
    span, squares, samples = ranges(movements), 0.0, 0
    for hidden in folds(movements):
        kept = [~mask for mask in hidden]
        by_force = None if task.options.method == 'response' else fit_force(task, bases, kept)[0]
        for parts, (_, _, members) in zip(rows, groups, strict=True):
            weights = (
                by_force[:, members]
                if by_force is not None
                else _solve(
                    [part.of(keep) for part, keep in zip(parts, kept, strict=True)],
                    task.options.ridge,
                )
            )
            for part, mask, keep in zip(parts, hidden, kept, strict=True):
                if not np.any(mask):
                    continue
                start = part.of(keep if np.any(keep) else mask).initial_state(weights)
                count = len(mask)  # the first rows are the positions
                positions = part.forced[:count] @ weights + part.free[:count] @ start
                error = (positions - part.targets[:count])[mask] / span[members]
                squares, samples = squares + float(np.sum(error**2)), samples + error.size
    return float(np.sqrt(squares / samples))


def _solve(rows: Sequence[Rows], ridge: float) -> Array:
    """Weights of degrees of freedom that share their gains."""
    parts = [part.without_initial_state() for part in rows if len(part.samples) > 2]
    return ridge_regression(
        np.vstack([A for A, _ in parts]), np.vstack([B for _, B in parts]), ridge
    )
