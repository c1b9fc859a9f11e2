# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning of rhythmic primitives from demonstrations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.phase import state_at
from dmp_cpg_ros.core.primitives.basis import VonMisesBases
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, columns
from dmp_cpg_ros.core.primitives.learning import (
    BASIS_CANDIDATES,
    FitOptions,
    as_demonstrations,
    chosen_gains,
    folds,
    locally_weighted_regression,
    ranges,
    ridge_regression,
    smallest_good,
)
from dmp_cpg_ros.core.primitives.period import find_period, fourier_series, phase_lead
from dmp_cpg_ros.core.primitives.responses import periodic_responses
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicInput, RhythmicPrimitive
from dmp_cpg_ros.core.primitives.time_scaling import Form
from dmp_cpg_ros.core.primitives.transformation import SpringDamper

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_SERIES = 12
"""Harmonics by which recordings are centred and aligned."""


@dataclass(frozen=True, eq=False)
class _Task:
    """What the regression of one set of demonstrations shares."""

    demonstrations: list[Demonstration]
    periods: list[float]
    leads: list[float]
    centres: list[Array]
    spring: SpringDamper
    options: FitOptions

    @property
    def period(self) -> float:
        return float(np.mean(self.periods))

    def tau(self, i: int) -> float:
        return self.periods[i] / self.period

    def phases(self, i: int) -> Array:
        times = self.demonstrations[i].times
        return self.leads[i] + 2.0 * np.pi / self.periods[i] * (times - times[0])


def learn_rhythmic(
    demonstrations: Demonstration | Iterable[Demonstration],
    bases: int | None = 25,
    *,
    period: float | Sequence[float] | None = None,
    stiffness: ArrayLike | None = None,
    damping: ArrayLike | None = None,
    rho: float | None = None,
    form: Form = 'scaled',
    options: FitOptions | None = None,
) -> RhythmicPrimitive:
    """Learn a rhythmic primitive.

    Demonstrations are taken as steady rhythms; they may differ in centre, period and phase. Phase
    0 is the first sample of the first one; the others are shifted to agree with it. The mean
    period is the primitive's at τ = 1.

    Parameters
    ----------
    demonstrations : Demonstration or iterable of Demonstration
        Velocities and accelerations are used when present.
    bases : int, optional
        Number of bases, with two weights each per degree of freedom; None chooses it by the
        held-out error.
    period : float or sequence of float, optional
        Period of all or of each demonstration [s]; found from the data without.
    stiffness, damping : array_like (n,) or float, optional
        k [1/s²] and b [1/s]; critically damped gains that fit the period without.
    rho : float, optional
        Attraction of the oscillator [1/s]; its angular frequency without.
    form : {'scaled', 'printed'}
        Reading of τ; it matters when the periods differ.
    options : FitOptions, optional
        Method and regularisation.

    Returns
    -------
    RhythmicPrimitive

    Raises
    ------
    DataError
        If the demonstrations cannot be used together or have no period.
    ParameterError
        If an argument is out of range.
    """
    task = _task(demonstrations, period, stiffness, damping, form, options)
    if bases is None:
        bases = smallest_good({count: _held_out_error(task, count) for count in BASIS_CANDIDATES})
    made, omega = (
        VonMisesBases.evenly_around(bases, task.options.basis_overlap),
        2.0 * np.pi / task.period,
    )
    weights = _fit(task, made)
    return RhythmicPrimitive(
        weights,
        made,
        omega,
        omega if rho is None else rho,
        task.spring,
        np.mean(task.centres, axis=0),
        names=task.demonstrations[0].names,
    )


def held_out_errors(
    demonstrations: Demonstration | Iterable[Demonstration],
    candidates: Sequence[int] = BASIS_CANDIDATES,
    *,
    period: float | Sequence[float] | None = None,
    stiffness: ArrayLike | None = None,
    damping: ArrayLike | None = None,
    form: Form = 'scaled',
    options: FitOptions | None = None,
) -> dict[int, float]:
    """Error on held-out samples for several numbers of bases.

    Parameters
    ----------
    demonstrations, period, stiffness, damping, form, options
        As for :func:`learn_rhythmic`.
    candidates : sequence of int
        Numbers of bases.

    Returns
    -------
    dict
        Number of bases → root mean square error of the steady movement over the held-out samples,
        as a fraction of each degree of freedom's range.
    """
    task = _task(demonstrations, period, stiffness, damping, form, options)
    return {count: _held_out_error(task, count) for count in candidates}


def place(
    primitive: RhythmicPrimitive, demonstration: Demonstration, period: float | None = None
) -> tuple[float, RhythmicInput]:
    """Place a recording on the primitive's cycle: its first phase, and the input that makes it.

    Parameters
    ----------
    primitive : RhythmicPrimitive
    demonstration : Demonstration
    period : float, optional
        [s]; found from the data without.

    Returns
    -------
    phi : float
        [rad]
    command : RhythmicInput
        The recording's centre and τ at amplitude 1.
    """
    period = find_period(demonstration) if period is None else period
    tau = period / primitive.period
    grid = 2.0 * np.pi * np.arange(8 * _SERIES) / (8 * _SERIES)
    cycle = fourier_series(grid, primitive.on_cycle(grid, tau)[0], 1.0, _SERIES)
    times = demonstration.times - demonstration.times[0]
    series = fourier_series(times, demonstration.positions, 2.0 * np.pi / period, _SERIES)
    return phase_lead(cycle, series), RhythmicInput(series[0].real, 1.0, tau)


def reproduction_errors(
    primitive: RhythmicPrimitive,
    demonstrations: Demonstration | Iterable[Demonstration],
    period: float | None = None,
) -> Array:
    """Largest distance of reproduced from demonstrated positions, as a fraction of the range.

    The primitive starts on its limit cycle and runs freely for as long as the recording.

    Parameters
    ----------
    primitive : RhythmicPrimitive
    demonstrations : Demonstration or iterable of Demonstration
    period : float, optional
        Period of the recordings [s]; found from the data without.

    Returns
    -------
    ndarray (n,)
    """
    movements = as_demonstrations(demonstrations)
    worst = np.zeros(primitive.dofs)
    for movement in movements:
        phi, command = place(primitive, movement, period)
        made = primitive.rollout(movement.times, command, primitive.initial_state(phi, command))
        worst = np.maximum(worst, np.abs(made.positions - movement.positions).max(axis=0))
    return worst / ranges(movements)


def _task(
    demonstrations: Demonstration | Iterable[Demonstration],
    period: float | Sequence[float] | None,
    stiffness: ArrayLike | None,
    damping: ArrayLike | None,
    form: Form,
    options: FitOptions | None,
) -> _Task:
    movements, options = as_demonstrations(demonstrations), options or FitOptions()
    if options.method != 'response':
        movements = [movement.with_derivatives() for movement in movements]
    if period is None:
        periods = [find_period(movement) for movement in movements]
    else:
        periods = columns(period, len(movements), 'period').tolist()
        if min(periods) <= 0.0:
            raise ParameterError(f'period = {period!r} s must be positive')
    series = [
        fourier_series(m.times - m.times[0], m.positions, 2.0 * np.pi / p, _SERIES)
        for m, p in zip(movements, periods, strict=True)
    ]
    scale = ranges(movements)
    leads = [0.0] + [phase_lead(series[0] / scale, other / scale) for other in series[1:]]
    spring = chosen_gains(float(np.mean(periods)), stiffness, damping, movements[0].dofs, form)
    return _Task(movements, periods, leads, [c[0].real for c in series], spring, options)


def _inputs(bases: VonMisesBases, phi: Array) -> Array:
    """Products ψ_i(φ) x_c on the unit cycle, (m, 2 b), the components of a basis side by side."""
    return (bases.activations(phi)[:, :, None] * state_at(phi)[:, None, :]).reshape(len(phi), -1)


def _rows(
    task: _Task, bases: VonMisesBases, i: int, k: float, b: float, members: NDArray[np.int_]
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


def _fit(task: _Task, bases: VonMisesBases, kept: Sequence[Mask] | None = None) -> Array:
    """Weights (b, n, 2) from the samples that are kept."""
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


def _fit_force(task: _Task, bases: VonMisesBases, kept: Sequence[Mask]) -> Array:
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


def _held_out_error(task: _Task, count: int) -> float:
    bases = VonMisesBases.evenly_around(count, task.options.basis_overlap)
    span, squares, samples = ranges(task.demonstrations), 0.0, 0
    for hidden in folds(task.demonstrations):
        weights = _fit(task, bases, [~mask for mask in hidden])
        for i, mask in enumerate(hidden):
            for k, b, members in task.spring.groups():
                A, B = _rows(task, bases, i, k, b, members)
                solved = weights[:, members].transpose(0, 2, 1).reshape(2 * count, -1)
                error = (A[: len(mask)][mask] @ solved - B[: len(mask)][mask]) / span[members]
                squares, samples = squares + float(np.sum(error**2)), samples + error.size
    return float(np.sqrt(squares / samples))
