# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning of discrete primitives from demonstrations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.learning import learning
from dmp_cpg_ros.core.learning.learning import Demonstrations, FitOptions
from dmp_cpg_ros.core.learning.regression import Indices, Rows, Task
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.discrete import DiscreteInput, DiscretePrimitive
from dmp_cpg_ros.core.primitives.primitive import Bases, GaussianBases
from dmp_cpg_ros.core.primitives.responses import Force, transient_responses
from dmp_cpg_ros.core.primitives.time_scaling import Form

FINAL_PHASE = 0.01
"""Phase x at the end of the demonstration, the usual choice; it fixes α_x = −ln(0.01)/T."""

_OVERLAP = 0.6
_STEPS_PER_MOVEMENT = 400


class DiscreteTask(Task):
    """Phases that decay, and an unknown initial state of every demonstration."""

    @property
    def decay(self) -> float:
        """Phase decay α_x [1/s]."""
        return float(-np.log(FINAL_PHASE) / self.duration)

    def bases(self, count: int) -> GaussianBases:
        """Bases of the given number over the movement."""
        return GaussianBases.evenly_in_time(
            count, self.decay, self.duration, self.options.overlap_or(_OVERLAP))

    def phases(self, i: int) -> Array:
        """Phases x of the samples of demonstration i."""
        return np.exp(-self.decay * self._scaled_times(i))

    def inputs(self, phases: Array) -> Array:
        """The phase, (m, 1)."""
        return phases[:, None]

    def responses(self, i: int, k: float, b: float, force: Force, count: int
                  ) -> tuple[Array, Array]:
        """Movements that forces cause from rest, and the two free ones."""
        return transient_responses(
            k, b, self._scaled_times(i), lambda s: force(np.exp(-self.decay * s)),
            self.duration / _STEPS_PER_MOVEMENT)

    def _scaled_times(self, i: int) -> Array:
        times = self.demonstrations[i].times
        return (times - times[0]) / self.taus[i]

    def has_gaps(self, bases: Bases) -> bool:
        """Whether some interval without samples spans more than two bases."""
        times = np.unique(np.concatenate([self._scaled_times(i)
                                          for i in range(len(self.demonstrations))]))
        return bool(np.diff(times).max() * bases.count > 2.0 * self.duration)

    def initial(self, rows: list[tuple[Indices, list[Rows]]], weights: Array
                ) -> tuple[Array, Array]:
        """Mean start, and mean velocity there at τ = 1: measured, or what fits the weights best
        where responses are fitted.
        """
        movements, taus = self.demonstrations, self.taus[:, None]
        if self.options.method == 'response':
            initial = np.empty((len(movements), 2, movements[0].dofs))
            for members, parts in rows:
                for i, part in enumerate(parts):
                    initial[i][:, members] = part.initial_state(weights[:, members])
            starts, rates = initial[:, 0] + np.array(self.goals), initial[:, 1]
        else:
            starts = np.array([movement.positions[0] for movement in movements])
            rates = taus * [np.asarray(movement.velocities)[0] for movement in movements]
        velocities = rates / (1.0 if self.spring.form == 'scaled' else taus)
        return np.mean(starts, axis=0), np.mean(velocities, axis=0)


def task(
    demonstrations: Demonstrations, stiffness: ArrayLike | None = None,
    damping: ArrayLike | None = None, goals: Sequence[ArrayLike] | None = None,
    form: Form = 'scaled', options: FitOptions | None = None) -> DiscreteTask:
    """Regression of a discrete primitive.

    Parameters
    ----------
    demonstrations : Demonstration or iterable of Demonstration
        Velocities and accelerations are used when present.
    stiffness, damping : array_like (n,) or float, optional
        k [1/s²] and b [1/s]; critically damped gains that fit the duration without.
    goals : sequence of array_like (n,), optional
        Goal of each demonstration; its last position without.
    form : {'scaled', 'printed'}
        Reading of τ; it matters when the durations differ.
    options : FitOptions, optional
        Method and regularisation.

    Raises
    ------
    DataError
        If the demonstrations cannot be used together.
    ParameterError
        If an argument is out of range.
    """
    options = options or FitOptions()
    movements = learning.prepared(demonstrations, options)
    durations = [movement.duration for movement in movements]
    spring = learning.chosen_gains(durations, stiffness, damping, movements[0].dofs, form)
    ends = learning.targets_of(goals, [movement.positions[-1] for movement in movements], 'goal')
    return DiscreteTask(movements, durations, ends, spring, options)


def learn_discrete(demonstrations: Demonstrations, bases: int | None = 25, **how: Any
                   ) -> DiscretePrimitive:
    """Learn a discrete primitive.

    Demonstrations may differ in start, goal and duration: the mean duration is the primitive's at
    τ = 1, and each demonstration takes part with its own τ and goal.

    Parameters
    ----------
    demonstrations : Demonstration or iterable of Demonstration
        What is learned from.
    bases : int, optional
        Number of bases; None chooses it by the held-out error.
    **how
        Gains, goals, reading of τ and options, as for :func:`task`.

    Returns
    -------
    DiscretePrimitive

    Raises
    ------
    DataError, ParameterError
        As :func:`task`.
    """
    fit = task(demonstrations, **how)
    made, response = fit.chosen_bases(bases), fit.options.method == 'response'
    gaps = fit.has_gaps(made)
    if gaps and not response:
        raise DataError(f"method '{fit.options.method}' knows no forces in gaps of the samples "
                        "that several bases share; use the method 'response', or fewer bases")
    rows = fit.rows(made) if response else []
    weights = fit.fit(made, rows)
    start, velocity = fit.initial(rows, weights)
    primitive = DiscretePrimitive(
        weights=weights, bases=made, phase_decay=fit.decay, transformation=fit.spring,
        start=start, goal=np.mean(fit.goals, axis=0), duration=fit.duration,
        start_velocity=velocity, names=fit.demonstrations[0].names)
    if not response:
        errors = reproduction_errors(primitive, fit.demonstrations, fit.goals)
        learning.check_reproduction(errors, fit.options)
    if gaps:
        learning.check_range(fit.demonstrations,
                             primitive.rollout(np.linspace(0.0, fit.duration, 101)).positions)
    return primitive


def reproduction_errors(primitive: DiscretePrimitive, demonstrations: Demonstrations,
                        goals: Sequence[ArrayLike] | None = None) -> Array:
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
    movements, made = learning.as_demonstrations(demonstrations), []
    ends = learning.targets_of(goals, [movement.positions[-1] for movement in movements], 'goal')
    for movement, goal in zip(movements, ends, strict=True):
        tau = movement.duration / primitive.duration
        state = primitive.initial_state(movement.positions[0], None, goal, tau)
        made.append(primitive.rollout(movement.times, DiscreteInput(goal, tau), state).positions)
    return learning.largest_errors(movements, made)
