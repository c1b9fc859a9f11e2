# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Regression rows of rhythmic demonstrations, and the fits on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.learning.learning import (
    FitOptions,
    folds,
    locally_weighted_regression,
    ranges,
    ridge_regression,
)
from dmp_cpg_ros.core.primitives.basis import VonMisesBases
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.primitives.responses import periodic_responses
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_OVERLAP = 0.2


@dataclass(frozen=True, eq=False)
class RhythmicTask:
    """What the regression of one set of demonstrations shares.

    Attributes
    ----------
    demonstrations : list of Demonstration
        With derivatives, unless the method is ``response``.
    periods : list of float
        Period of each demonstration [s].
    leads : list of float
        Phase of the first sample of each demonstration [rad].
    centres : list of ndarray (n,)
        Centre of each demonstration.
    spring : SpringDamper
        Gains and reading of τ.
    options : FitOptions
        Method and regularisation.
    """

    demonstrations: list[Demonstration]
    periods: list[float]
    leads: list[float]
    centres: list[Array]
    spring: SpringDamper
    options: FitOptions

    @property
    def period(self) -> float:
        """Period at τ = 1 [s]."""
        return float(np.mean(self.periods))

    def tau(self, i: int) -> float:
        """Temporal scale τ of demonstration i."""
        return self.periods[i] / self.period

    def phases(self, i: int) -> Array:
        """Phases of the samples of demonstration i [rad]."""
        times = self.demonstrations[i].times
        return self.leads[i] + 2.0 * np.pi / self.periods[i] * (times - times[0])

    def bases(self, count: int) -> VonMisesBases:
        """Bases of the given number around the cycle."""
        return VonMisesBases.evenly_around(count, self.options.overlap_or(_OVERLAP))


def _inputs(bases: VonMisesBases, phi: Array) -> Array:
    """Products ψ_i(φ) x_c on the unit cycle, (m, 2 b), the components of a basis side by side."""
    return (bases.activations(phi)[:, :, None] * state_at(phi)[:, None, :]).reshape(len(phi), -1)


def _rows(
    task: RhythmicTask, bases: VonMisesBases, i: int, k: float, b: float, members: NDArray[np.int_]
) -> tuple[Array, Array]:
    """Regressors (q m, 2 b) and targets (q m, n) of one demonstration with q kinds of samples."""
    movement, tau = task.demonstrations[i], task.tau(i)
    stretch = tau if task.spring.form == 'printed' else 1.0
    responses = periodic_responses(
        stretch * k,
        b,
        2.0 * np.pi / task.period,
        lambda phi: stretch * _inputs(bases, phi),
        task.phases(i),
        4 * bases.count + 32,
    )
    observed = [(0, 1.0, movement.positions[:, members] - task.centres[i][members])]
    if movement.velocities is not None:
        observed.append((1, 1.0 / b, tau * movement.velocities[:, members]))
    if movement.accelerations is not None:
        observed.append((2, 1.0 / k, tau**2 * movement.accelerations[:, members]))
    return (
        np.vstack([scale * responses[order] for order, scale, _ in observed]),
        np.vstack([scale * values for _, scale, values in observed]),
    )


def fit_weights(
    task: RhythmicTask, bases: VonMisesBases, kept: Sequence[Mask] | None = None
) -> Array:
    """Fit weights by the method of the task.

    Parameters
    ----------
    task : RhythmicTask
        What is learned.
    bases : VonMisesBases
        The b bases.
    kept : sequence of ndarray of bool, optional
        Samples of each demonstration that take part; all without.

    Returns
    -------
    ndarray (b, n, 2)
    """
    movements = task.demonstrations
    kept = kept or [np.ones(len(movement.times), bool) for movement in movements]
    if task.options.method != 'response':
        return _fit_force(task, bases, kept)
    weights = np.empty((bases.count, movements[0].dofs, 2))
    for k, b, members in task.spring.groups():
        parts = [_rows(task, bases, i, k, b, members) for i in range(len(movements))]
        masks = [
            np.tile(keep, len(A) // len(keep)) for (A, _), keep in zip(parts, kept, strict=True)
        ]
        solved = ridge_regression(
            np.vstack([A[mask] for (A, _), mask in zip(parts, masks, strict=True)]),
            np.vstack([B[mask] for (_, B), mask in zip(parts, masks, strict=True)]),
            task.options.ridge,
        )
        weights[:, members] = solved.reshape(bases.count, 2, -1).transpose(0, 2, 1)
    return weights


def _fit_force(task: RhythmicTask, bases: VonMisesBases, kept: Sequence[Mask]) -> Array:
    phases, targets = [], []
    for i, (movement, keep) in enumerate(zip(task.demonstrations, kept, strict=True)):
        y, v, a = movement.all_derivatives()
        phases.append(task.phases(i)[keep])
        targets.append(
            task.spring.required_force(y[keep], v[keep], a[keep], task.centres[i], task.tau(i))
        )
    phi, f = np.concatenate(phases), np.vstack(targets)
    if task.options.method == 'joint':
        solved = ridge_regression(_inputs(bases, phi), f, task.options.ridge).reshape(
            bases.count, 2, -1
        )
    else:
        solved = locally_weighted_regression(
            bases.activations(phi), state_at(phi), f, task.options.ridge
        )
    return np.ascontiguousarray(solved.transpose(0, 2, 1))


def held_out_error(task: RhythmicTask, bases: VonMisesBases) -> float:
    """Error of the steady movement at samples that took no part in the fit.

    Parameters
    ----------
    task : RhythmicTask
        What is learned.
    bases : VonMisesBases
        The b bases.

    Returns
    -------
    float
        Root mean square over all folds, as a fraction of each degree of freedom's range.
    """
    span, squares, samples = ranges(task.demonstrations), 0.0, 0
    for hidden in folds(task.demonstrations):
        weights = fit_weights(task, bases, [~mask for mask in hidden])
        for i, mask in enumerate(hidden):
            for k, b, members in task.spring.groups():
                A, B = _rows(task, bases, i, k, b, members)
                solved = weights[:, members].transpose(0, 2, 1).reshape(2 * bases.count, -1)
                error = (A[: len(mask)][mask] @ solved - B[: len(mask)][mask]) / span[members]
                squares, samples = squares + float(np.sum(error**2)), samples + error.size
    return float(np.sqrt(squares / samples))
