# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning of rhythmic primitives from demonstrations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.learning import learning
from dmp_cpg_ros.core.learning.learning import Demonstrations, FitOptions
from dmp_cpg_ros.core.learning.period import find_period, fourier_series, phase_lead
from dmp_cpg_ros.core.learning.regression import Task
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, columns, vector
from dmp_cpg_ros.core.primitives.primitive import VonMisesBases
from dmp_cpg_ros.core.primitives.responses import Force, periodic_responses
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicInput, RhythmicPrimitive
from dmp_cpg_ros.core.primitives.time_scaling import Form

_OVERLAP = 0.2
_SERIES = 12
"""Harmonics by which recordings are centred and aligned."""


@dataclass(frozen=True, eq=False)
class RhythmicTask(Task):
    """Phases that turn, and movements that are periodic from the first sample on.

    Attributes
    ----------
    leads : list of float
        Phase of the first sample of each demonstration [rad].
    """

    leads: list[float]

    @property
    def omega(self) -> float:
        """Angular frequency at τ = 1 [rad/s]."""
        return 2.0 * np.pi / self.duration

    def bases(self, count: int) -> VonMisesBases:
        """Bases of the given number around the cycle."""
        return VonMisesBases.evenly_around(count, self.options.overlap_or(_OVERLAP))

    def phases(self, i: int) -> Array:
        """Phases of the samples of demonstration i [rad]."""
        times = self.demonstrations[i].times
        return self.leads[i] + 2.0 * np.pi / self.durations[i] * (times - times[0])

    def inputs(self, phases: Array) -> Array:
        """States of the oscillator on the unit cycle, (m, 2)."""
        return state_at(phases)

    def responses(self, i: int, k: float, b: float, force: Force, count: int
                  ) -> tuple[Array, Array]:
        """Periodic movements; an initial state has long been forgotten."""
        forced = periodic_responses(k, b, self.omega, force, self.phases(i), 4 * count + 32)
        return forced, np.empty((*forced.shape[:2], 0))


def task(
    demonstrations: Demonstrations, period: float | Sequence[float] | None = None,
    leads: Sequence[float] | None = None, centres: Sequence[ArrayLike] | None = None,
    stiffness: ArrayLike | None = None, damping: ArrayLike | None = None, form: Form = 'scaled',
    options: FitOptions | None = None) -> RhythmicTask:
    """Regression of a rhythmic primitive.

    Parameters
    ----------
    demonstrations : Demonstration or iterable of Demonstration
        Velocities and accelerations are used when present.
    period : float or sequence of float, optional
        Period of all or of each demonstration [s]; found from the data without.
    leads : sequence of float, optional
        Phase of the first sample of each demonstration [rad]; 0 for the first one and found from
        the data for the others without.
    centres : sequence of array_like (n,), optional
        Centre of each demonstration; the mean of its cycle without.
    stiffness, damping : array_like (n,) or float, optional
        k [1/s²] and b [1/s]; critically damped gains that fit the period without.
    form : {'scaled', 'printed'}
        Reading of τ; it matters when the periods differ.
    options : FitOptions, optional
        Method and regularisation.

    Raises
    ------
    DataError
        If the demonstrations cannot be used together or have no period.
    ParameterError
        If an argument is out of range.
    """
    options = options or FitOptions()
    movements = learning.prepared(demonstrations, options)
    if period is None:
        periods = [find_period(movement) for movement in movements]
    else:
        periods = columns(period, len(movements), 'period').tolist()
        if min(periods) <= 0.0:
            raise ParameterError(f'period = {period!r} s must be positive')
    series = [_series(m, p) for m, p in zip(movements, periods, strict=True)]
    if leads is None:
        first, *others = (coefficients / learning.ranges(movements) for coefficients in series)
        leads = [0.0, *(phase_lead(first, other) for other in others)]
    spring = learning.chosen_gains(periods, stiffness, damping, movements[0].dofs, form)
    middles = learning.targets_of(centres, [c[0].real for c in series], 'centre')
    phases = vector(leads, len(movements), 'leads').tolist()
    return RhythmicTask(movements, periods, middles, spring, options, phases)


def learn_rhythmic(demonstrations: Demonstrations, bases: int | None = 25, *,
                   rho: float | None = None, **how: Any) -> RhythmicPrimitive:
    """Learn a rhythmic primitive.

    Demonstrations are taken as steady rhythms; they may differ in centre, period and phase. Phase
    0 is the first sample of the first one; the others are shifted to agree with it. The mean
    period is the primitive's at τ = 1.

    Parameters
    ----------
    demonstrations : Demonstration or iterable of Demonstration
        What is learned from.
    bases : int, optional
        Number of bases, with two weights each per degree of freedom; None chooses it by the
        held-out error.
    rho : float, optional
        Attraction of the oscillator [1/s]; its angular frequency without.
    **how
        Periods, phases, centres, gains, reading of τ and options, as for :func:`task`.

    Returns
    -------
    RhythmicPrimitive

    Raises
    ------
    DataError, ParameterError
        As :func:`task`.
    """
    fit = task(demonstrations, **how)
    movements, made = fit.demonstrations, fit.chosen_bases(bases)
    response = fit.options.method == 'response'
    weights = fit.fit(made, fit.rows(made) if response else [])
    primitive = RhythmicPrimitive(
        weights=np.ascontiguousarray(weights.reshape(made.count, 2, -1).transpose(0, 2, 1)),
        bases=made, omega=fit.omega, rho=fit.omega if rho is None else rho,
        transformation=fit.spring, centre=np.mean(fit.goals, axis=0), names=movements[0].names)
    if not response:
        cycles = [primitive.on_cycle(fit.phases(i), fit.taus[i])[0] + fit.goals[i]
                  for i in range(len(movements))]
        learning.check_reproduction(learning.largest_errors(movements, cycles), fit.options)
    learning.check_range(movements, primitive.on_cycle(np.linspace(0.0, 2.0 * np.pi, 200))[0])
    return primitive


def place(primitive: RhythmicPrimitive, demonstration: Demonstration, period: float | None = None
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
    series = _series(demonstration, period)
    return phase_lead(cycle, series), RhythmicInput(series[0].real, 1.0, tau)


def reproduction_errors(primitive: RhythmicPrimitive, demonstrations: Demonstrations,
                        period: float | None = None) -> Array:
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
    movements, made = learning.as_demonstrations(demonstrations), []
    for movement in movements:
        phi, command = place(primitive, movement, period)
        state = primitive.initial_state(phi, command)
        made.append(primitive.rollout(movement.times, command, state).positions)
    return learning.largest_errors(movements, made)


def _series(demonstration: Demonstration, period: float) -> Array:
    """Fourier series over the time since the first sample."""
    times = demonstration.times - demonstration.times[0]
    return fourier_series(times, demonstration.positions, 2.0 * np.pi / period, _SERIES)
