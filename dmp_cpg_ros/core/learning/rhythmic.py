# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning of rhythmic primitives from demonstrations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
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
from dmp_cpg_ros.core.learning.period import find_period, fourier_series, phase_lead
from dmp_cpg_ros.core.learning.rhythmic_regression import (
    RhythmicTask,
    fit_weights,
    held_out_error,
)
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, columns, vector
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicInput, RhythmicPrimitive
from dmp_cpg_ros.core.primitives.time_scaling import Form

Array = NDArray[np.float64]

_SERIES = 12
"""Harmonics by which recordings are centred and aligned."""


def learn_rhythmic(
    demonstrations: Demonstration | Iterable[Demonstration],
    bases: int | None = 25,
    *,
    period: float | Sequence[float] | None = None,
    leads: Sequence[float] | None = None,
    centres: Sequence[ArrayLike] | None = None,
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
    leads : sequence of float, optional
        Phase of the first sample of each demonstration [rad]; 0 for the first one and found from
        the data for the others without.
    centres : sequence of array_like (n,), optional
        Centre of each demonstration; the mean of its cycle without.
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
    task = _task(demonstrations, period, leads, centres, stiffness, damping, form, options)
    check_bases(bases, task.demonstrations)
    if bases is None:
        bases = smallest_good({n: held_out_error(task, task.bases(n)) for n in BASIS_CANDIDATES})
    made, omega = task.bases(bases), 2.0 * np.pi / task.period
    primitive = RhythmicPrimitive(
        fit_weights(task, made),
        made,
        omega,
        omega if rho is None else rho,
        task.spring,
        np.mean(task.centres, axis=0),
        names=task.demonstrations[0].names,
    )
    if task.options.method != 'response':
        errors = [
            np.abs(primitive.on_cycle(task.phases(i), task.tau(i))[0] + task.centres[i]
                   - movement.positions).max(axis=0)
            for i, movement in enumerate(task.demonstrations)
        ]
        check_reproduction(np.max(errors, axis=0) / ranges(task.demonstrations), task.options)
    return primitive


def held_out_errors(
    demonstrations: Demonstration | Iterable[Demonstration],
    candidates: Sequence[int] = BASIS_CANDIDATES,
    *,
    period: float | Sequence[float] | None = None,
    centres: Sequence[ArrayLike] | None = None,
    stiffness: ArrayLike | None = None,
    damping: ArrayLike | None = None,
    form: Form = 'scaled',
    options: FitOptions | None = None,
) -> dict[int, float]:
    """Error on held-out samples for several numbers of bases.

    Parameters
    ----------
    demonstrations, period, centres, stiffness, damping, form, options
        As for :func:`learn_rhythmic`.
    candidates : sequence of int
        Numbers of bases.

    Returns
    -------
    dict
        Number of bases → root mean square error of the steady movement over the held-out samples,
        as a fraction of each degree of freedom's range.
    """
    task = _task(demonstrations, period, None, centres, stiffness, damping, form, options)
    return {count: held_out_error(task, task.bases(count)) for count in candidates}


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
    leads: Sequence[float] | None,
    centres: Sequence[ArrayLike] | None,
    stiffness: ArrayLike | None,
    damping: ArrayLike | None,
    form: Form,
    options: FitOptions | None,
) -> RhythmicTask:
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
    if leads is None:
        leads = [0.0] + [phase_lead(series[0] / scale, other / scale) for other in series[1:]]
    spring = chosen_gains(float(np.mean(periods)), stiffness, damping, movements[0].dofs, form)
    if centres is None:
        middles = [coefficients[0].real for coefficients in series]
    elif len(centres) == len(movements):
        middles = [vector(centre, movements[0].dofs, 'centre') for centre in centres]
    else:
        raise ParameterError(
            f'{len(centres)} centres do not match {len(movements)} demonstrations'
        )
    phases = vector(leads, len(movements), 'leads').tolist()
    return RhythmicTask(movements, periods, phases, middles, spring, options)
