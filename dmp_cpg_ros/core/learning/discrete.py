# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning of discrete primitives from demonstrations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.learning.discrete_regression import (
    DiscreteTask,
    fit_force,
    fit_response,
    held_out_error,
)
from dmp_cpg_ros.core.learning.learning import (
    BASIS_CANDIDATES,
    FitOptions,
    as_demonstrations,
    check_bases,
    check_reproduction,
    chosen_gains,
    ranges,
    smallest_good,
)
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, vector
from dmp_cpg_ros.core.primitives.discrete import DiscretePrimitive
from dmp_cpg_ros.core.primitives.states import DiscreteInput
from dmp_cpg_ros.core.primitives.time_scaling import Form

Array = NDArray[np.float64]


def learn_discrete(
    demonstrations: Demonstration | Iterable[Demonstration],
    bases: int | None = 25,
    *,
    stiffness: ArrayLike | None = None,
    damping: ArrayLike | None = None,
    goals: Sequence[ArrayLike] | None = None,
    form: Form = 'scaled',
    options: FitOptions | None = None,
) -> DiscretePrimitive:
    """Learn a discrete primitive.

    Demonstrations may differ in start, goal and duration: the mean duration is the primitive's at
    τ = 1, and each demonstration takes part with its own τ and goal.

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
    check_bases(bases, task.demonstrations)
    if bases is None:
        bases = smallest_good({n: held_out_error(task, task.bases(n)) for n in BASIS_CANDIDATES})
    made = task.bases(bases)
    fit = fit_response if task.options.method == 'response' else fit_force
    weights, start, velocity = fit(task, made)
    primitive = DiscretePrimitive(
        weights,
        made,
        task.decay,
        task.spring,
        start,
        np.mean(task.goals, axis=0),
        task.duration,
        velocity,
        names=task.demonstrations[0].names,
    )
    if task.options.method != 'response':
        errors = reproduction_errors(primitive, task.demonstrations, task.goals)
        check_reproduction(errors, task.options)
    return primitive


def held_out_errors(
    demonstrations: Demonstration | Iterable[Demonstration],
    candidates: Sequence[int] = BASIS_CANDIDATES,
    *,
    stiffness: ArrayLike | None = None,
    damping: ArrayLike | None = None,
    goals: Sequence[ArrayLike] | None = None,
    form: Form = 'scaled',
    options: FitOptions | None = None,
) -> dict[int, float]:
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
        Number of bases → root mean square error of the reproduced position over the held-out
        samples, as a fraction of each degree of freedom's range.
    """
    task = _task(demonstrations, stiffness, damping, goals, form, options)
    return {count: held_out_error(task, task.bases(count)) for count in candidates}


def reproduction_errors(
    primitive: DiscretePrimitive,
    demonstrations: Demonstration | Iterable[Demonstration],
    goals: Sequence[ArrayLike] | None = None,
) -> Array:
    """Largest distance of reproduced from demonstrated positions, as a fraction of the range.

    The primitive runs from each demonstration's start to its goal with τ to match its duration.

    Parameters
    ----------
    primitive : DiscretePrimitive
    demonstrations : Demonstration or iterable of Demonstration
    goals : sequence of array_like (n,), optional
        Goal of each demonstration; its last position without.

    Returns
    -------
    ndarray (n,)
        Largest error per degree of freedom, divided by that degree's range.
    """
    movements = as_demonstrations(demonstrations)
    worst = np.zeros(primitive.dofs)
    for movement, goal in zip(movements, _goals(movements, goals), strict=True):
        tau = movement.duration / primitive.duration
        state = primitive.initial_state(movement.positions[0], None, goal, tau)
        made = primitive.rollout(movement.times, DiscreteInput(goal, tau), state)
        worst = np.maximum(worst, np.abs(made.positions - movement.positions).max(axis=0))
    return worst / ranges(movements)


def _task(
    demonstrations: Demonstration | Iterable[Demonstration],
    stiffness: ArrayLike | None,
    damping: ArrayLike | None,
    goals: Sequence[ArrayLike] | None,
    form: Form,
    options: FitOptions | None,
) -> DiscreteTask:
    movements, options = as_demonstrations(demonstrations), options or FitOptions()
    if options.method != 'response':
        movements = [movement.with_derivatives() for movement in movements]
    duration = float(np.mean([movement.duration for movement in movements]))
    spring = chosen_gains(duration, stiffness, damping, movements[0].dofs, form)
    return DiscreteTask(movements, _goals(movements, goals), spring, duration, options)


def _goals(movements: list[Demonstration], goals: Sequence[ArrayLike] | None) -> list[Array]:
    """The given goals, checked, or the last positions."""
    if goals is None:
        return [movement.positions[-1] for movement in movements]
    if len(goals) != len(movements):
        raise ParameterError(f'{len(goals)} goals do not match {len(movements)} demonstrations')
    return [vector(goal, movements[0].dofs, 'goal') for goal in goals]
