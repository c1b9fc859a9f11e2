# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning of discrete primitives from demonstrations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.primitives.basis import GaussianBases
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, columns, vector
from dmp_cpg_ros.core.primitives.discrete import DiscreteInput, DiscretePrimitive
from dmp_cpg_ros.core.primitives.learning import (BASIS_CANDIDATES, FitOptions, as_demonstrations, folds,
                                                  locally_weighted_regression, ranges, ridge_regression,
                                                  smallest_good)
from dmp_cpg_ros.core.primitives.responses import transient_responses
from dmp_cpg_ros.core.primitives.time_scaling import Form
from dmp_cpg_ros.core.primitives.transformation import SpringDamper, default_gains

Array = NDArray[np.float64]

FINAL_PHASE = 0.01
"""Phase x at the end of the demonstration, the usual choice; it fixes α_x = −ln(0.01)/T."""

_STEPS_PER_MOVEMENT = 400


@dataclass(frozen=True, eq=False)
class _Task:
    """What the regression of one set of demonstrations shares."""

    demonstrations: list[Demonstration]
    goals: list[Array]
    spring: SpringDamper
    duration: float
    options: FitOptions

    @property
    def decay(self) -> float:
        return float(-np.log(FINAL_PHASE) / self.duration)

    def tau(self, i: int) -> float:
        return self.demonstrations[i].duration / self.duration

    def bases(self, count: int) -> GaussianBases:
        return GaussianBases.evenly_in_time(count, self.decay, self.duration, self.options.overlap)


def learn_discrete(demonstrations: Demonstration | Iterable[Demonstration], bases: int | None = 25, *,
                   stiffness: ArrayLike | None = None, damping: ArrayLike | None = None,
                   goals: Sequence[ArrayLike] | None = None, form: Form = 'scaled',
                   options: FitOptions | None = None) -> DiscretePrimitive:
    """Learn a discrete primitive.

    Demonstrations may differ in start, goal and duration: the mean duration is the primitive's at τ = 1, and
    each demonstration takes part with its own τ and goal.

    Parameters
    ----------
    demonstrations : Demonstration or iterable of Demonstration
        Velocities and accelerations are used when present.
    bases : int, optional
        Number of bases; None chooses it by the held-out error, see :func:`held_out_errors`.
    stiffness, damping : array_like (n,) or float, optional
        k [1/s²] and b [1/s]; critically damped gains that fit the duration without.
    goals : sequence of array_like (n,), optional
        Goal of each demonstration; its last position without.
    form : {'scaled', 'printed'}
        Reading of τ; it matters when the durations differ.
    options : FitOptions, optional
        Method and regularisation.

    Returns
    -------
    DiscretePrimitive

    Raises
    ------
    DataError
        If the demonstrations cannot be used together.
    ParameterError
        If an argument is out of range.
    """
    task = _task(demonstrations, stiffness, damping, goals, form, options)
    if bases is None:
        bases = smallest_good(_held_out(task, BASIS_CANDIDATES))
    made = task.bases(bases)
    weights, start, velocity = (_fit_force if task.options.method != 'response' else _fit_response)(task, made)
    return DiscretePrimitive(weights, made, task.decay, task.spring, start, np.mean(task.goals, axis=0),
                             task.duration, velocity, names=task.demonstrations[0].names)


def held_out_errors(demonstrations: Demonstration | Iterable[Demonstration],
                    candidates: Sequence[int] = BASIS_CANDIDATES, *, stiffness: ArrayLike | None = None,
                    damping: ArrayLike | None = None, goals: Sequence[ArrayLike] | None = None,
                    form: Form = 'scaled', options: FitOptions | None = None) -> dict[int, float]:
    """Error on held-out samples for several numbers of bases.

    Whole demonstrations are held out in turn when there are at least two, else every fifth sample.

    Parameters
    ----------
    demonstrations, stiffness, damping, goals, form, options
        As for :func:`learn_discrete`.
    candidates : sequence of int
        Numbers of bases.

    Returns
    -------
    dict
        Number of bases → root mean square error of the reproduced position over the held-out samples, as a
        fraction of each degree of freedom's range.
    """
    return _held_out(_task(demonstrations, stiffness, damping, goals, form, options), candidates)


def reproduction_errors(primitive: DiscretePrimitive,
                        demonstrations: Demonstration | Iterable[Demonstration]) -> Array:
    """Largest distance of the reproduced from the demonstrated positions, as a fraction of the range.

    The primitive runs from each demonstration's start to its last position with τ to match its duration.

    Parameters
    ----------
    primitive : DiscretePrimitive
    demonstrations : Demonstration or iterable of Demonstration

    Returns
    -------
    ndarray (n,)
        Largest error per degree of freedom, divided by that degree's range.
    """
    movements = as_demonstrations(demonstrations)
    worst = np.zeros(primitive.dofs)
    for movement in movements:
        tau = movement.duration / primitive.duration
        state = primitive.initial_state(movement.positions[0], None, movement.positions[-1], tau)
        made = primitive.rollout(movement.times, DiscreteInput(movement.positions[-1], tau), state)
        worst = np.maximum(worst, np.abs(made.positions - movement.positions).max(axis=0))
    return worst / ranges(movements)


def _task(demonstrations: Demonstration | Iterable[Demonstration], stiffness: ArrayLike | None,
          damping: ArrayLike | None, goals: Sequence[ArrayLike] | None, form: Form,
          options: FitOptions | None) -> _Task:
    movements, options = as_demonstrations(demonstrations), options or FitOptions()
    if options.method != 'response':
        movements = [movement.with_derivatives() for movement in movements]
    dofs = movements[0].dofs
    if goals is not None and len(goals) != len(movements):
        raise ParameterError(f'{len(goals)} goals do not match {len(movements)} demonstrations')
    ends = [m.positions[-1] if goals is None else vector(goals[i], dofs, 'goal') for i, m in enumerate(movements)]
    duration = float(np.mean([movement.duration for movement in movements]))
    k, b = default_gains(duration)
    if stiffness is not None or damping is not None:                                  # the other: critically damped
        b = 2.0 * np.sqrt(np.asarray(stiffness, dtype=float)) if damping is None else damping
        k = 0.25 * np.asarray(b, dtype=float) ** 2 if stiffness is None else stiffness
    spring = SpringDamper(columns(k, dofs, 'stiffness'), columns(b, dofs, 'damping'), form)
    return _Task(movements, ends, spring, duration, options)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Regression rows of one demonstration for degrees of freedom of one pair of gains.

    ``targets`` are measured, ``forced`` columns multiply the weights, ``free`` ones the unknown initial state.
    """

    forced: Array
    free: Array
    targets: Array
    samples: Array

    def of(self, chosen: Array) -> _Rows:
        keep = chosen[self.samples]
        return _Rows(self.forced[keep], self.free[keep], self.targets[keep], self.samples[keep])

    def without_initial_state(self) -> tuple[Array, Array]:
        """Regressors and targets with the part that an initial state can explain projected out."""
        q = np.linalg.qr(self.free)[0]
        return self.forced - q @ (q.T @ self.forced), self.targets - q @ (q.T @ self.targets)

    def initial_state(self, weights: Array) -> Array:
        """Initial distance from the goal and velocity by s, (2, n), that fit best for given weights."""
        return np.linalg.lstsq(self.free, self.targets - self.forced @ weights, rcond=None)[0]


def _groups(spring: SpringDamper) -> list[tuple[float, float, Array]]:
    """Degrees of freedom that share their gains: (k, b, indices)."""
    pairs = np.stack([spring.stiffness, spring.damping], axis=1)
    return [(float(k), float(b), np.flatnonzero(np.all(pairs == (k, b), axis=1)))
            for k, b in np.unique(pairs, axis=0)]


def _rows(task: _Task, bases: GaussianBases, i: int, k: float, b: float, members: Array) -> _Rows:
    """Rows of demonstration i: positions, and velocities and accelerations if it has them.

    With constant τ the printed form is the scaled one with stiffness τk and force τf, so one solver serves both.
    """
    movement, tau = task.demonstrations[i], task.tau(i)
    stretch = tau if task.spring.form == 'printed' else 1.0
    scaled = (movement.times - movement.times[0]) / tau

    def force(s: Array) -> Array:
        x = np.exp(-task.decay * s)
        return stretch * x[:, None] * bases.activations(x)

    forced, free = transient_responses(stretch * k, b, scaled, force, task.duration / _STEPS_PER_MOVEMENT)
    offsets = movement.positions[:, members] - task.goals[i][members]
    observed = [(0, 1.0, offsets)]
    if movement.velocities is not None:
        observed.append((1, 1.0 / b, tau * movement.velocities[:, members]))
    if movement.accelerations is not None:
        observed.append((2, 1.0 / k, tau**2 * movement.accelerations[:, members]))
    return _Rows(np.vstack([scale * forced[order] for order, scale, _ in observed]),
                 np.vstack([scale * free[order] for order, scale, _ in observed]),
                 np.vstack([scale * values for _, scale, values in observed]),
                 np.tile(np.arange(len(scaled)), len(observed)))


def _solve(rows: Sequence[_Rows], ridge: float) -> Array:
    """Weights of one group of degrees of freedom."""
    parts = [part.without_initial_state() for part in rows if len(part.samples) > 2]
    return ridge_regression(np.vstack([A for A, _ in parts]), np.vstack([B for _, B in parts]), ridge)


def _fit_response(task: _Task, bases: GaussianBases) -> tuple[Array, Array, Array]:
    """Weights (b, n), start (n,) and velocity at the start at τ = 1 (n,) by regression on responses."""
    dofs, count = task.demonstrations[0].dofs, len(task.demonstrations)
    weights, initial = np.empty((bases.count, dofs)), np.empty((count, 2, dofs))
    for k, b, members in _groups(task.spring):
        rows = [_rows(task, bases, i, k, b, members) for i in range(count)]
        weights[:, members] = _solve(rows, task.options.ridge)
        for i, part in enumerate(rows):
            initial[i][:, members] = part.initial_state(weights[:, members])
    taus = np.array([task.tau(i) for i in range(count)])
    velocities = initial[:, 1] / (1.0 if task.spring.form == 'scaled' else taus[:, None])
    return weights, np.mean(initial[:, 0] + np.array(task.goals), axis=0), np.mean(velocities, axis=0)


def _fit_force(task: _Task, bases: GaussianBases, chosen: list[Array] | None = None) -> tuple[Array, Array, Array]:
    """The same by regression on the required force, which needs derivatives."""
    phases, targets, starts, velocities = [], [], [], []
    for i, movement in enumerate(task.demonstrations):
        tau, keep = task.tau(i), slice(None) if chosen is None else chosen[i]
        y, v, a = movement.positions, movement.velocities, movement.accelerations
        phases.append(np.exp(-task.decay * (movement.times[keep] - movement.times[0]) / tau))
        targets.append(task.spring.required_force(y[keep], v[keep], a[keep], task.goals[i], tau))
        starts.append(y[0])
        velocities.append(v[0] * (tau if task.spring.form == 'scaled' else 1.0))
    x, f = np.concatenate(phases), np.vstack(targets)
    if task.options.method == 'joint':
        weights = ridge_regression(x[:, None] * bases.activations(x), f, task.options.ridge)
    else:
        weights = locally_weighted_regression(bases.activations(x), x[:, None], f, task.options.ridge)[:, 0]
    return weights, np.mean(starts, axis=0), np.mean(velocities, axis=0)


def _held_out(task: _Task, candidates: Sequence[int]) -> dict[int, float]:
    """Held-out error of the reproduced positions for every candidate."""
    return {count: _held_out_error(task, task.bases(count)) for count in candidates}


def _held_out_error(task: _Task, bases: GaussianBases) -> float:
    movements = task.demonstrations
    groups = _groups(task.spring)
    rows = {j: [_rows(task, bases, i, k, b, members) for i in range(len(movements))]
            for j, (k, b, members) in enumerate(groups)}
    span, squares, samples = ranges(movements), 0.0, 0
    for hidden in folds(movements):
        kept = [~mask for mask in hidden]
        forced = None if task.options.method == 'response' else _fit_force(task, bases, kept)[0]
        for j, (_, _, members) in enumerate(groups):
            weights = (_solve([part.of(keep) for part, keep in zip(rows[j], kept)], task.options.ridge)
                       if forced is None else forced[:, members])
            for part, mask, keep, movement in zip(rows[j], hidden, kept, movements):
                if not np.any(mask):
                    continue
                start = part.of(keep if np.any(keep) else mask).initial_state(weights)
                positions = part.forced[:len(movement.times)] @ weights + part.free[:len(movement.times)] @ start
                error = (positions - part.targets[:len(movement.times)])[mask] / span[members]
                squares, samples = squares + float(np.sum(error**2)), samples + error.size
    return float(np.sqrt(squares / samples))
