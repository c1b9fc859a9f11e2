# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Movements as sampled data: what is learned from and what a rollout returns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.maths import Array


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A movement that a primitive made.

    Attributes
    ----------
    times : ndarray (m,)
        [s]
    positions, velocities, accelerations : ndarray (m, n)
    """

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array


@dataclass(frozen=True, eq=False)
class Demonstration:
    """A recorded movement.

    Attributes
    ----------
    times : ndarray (m,)
        Increasing times, evenly spaced or not [s].
    positions : ndarray (m, n)
        A list of m numbers is taken as one degree of freedom.
    velocities, accelerations : ndarray (m, n), optional
        Used when they are there.
    names : tuple of str
        Names of the degrees of freedom.

    Raises
    ------
    DataError
        If there are fewer than 8 samples, times do not increase, shapes differ or a value is not
        finite.
    """

    times: Array
    positions: Array
    velocities: Array | None = None
    accelerations: Array | None = None
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Validate and convert."""
        times = _numbers(self.times, 'times')
        if times.ndim != 1 or len(times) < 8:
            raise DataError(f'a demonstration needs at least 8 times, not shape {times.shape}')
        if not np.all(np.isfinite(times)):
            raise DataError('times of a demonstration must be finite')
        for i in np.flatnonzero(np.diff(times) <= 0.0)[:1]:
            raise DataError(f'times must increase; sample {i + 1} is at {times[i + 1]} s')
        object.__setattr__(self, 'times', times)
        for name in ('positions', 'velocities', 'accelerations'):
            if getattr(self, name) is not None:
                values = _samples(getattr(self, name), len(times), name)
                object.__setattr__(self, name, values)
                if values.shape != self.positions.shape:
                    raise DataError(f'{name} {values.shape} must have the shape of positions')
        if self.names and len(self.names) != self.dofs:
            raise DataError(f'{len(self.names)} names do not match {self.dofs} degrees of freedom')

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""
        return int(self.positions.shape[1])

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.times[-1] - self.times[0])

    def with_derivatives(self) -> Demonstration:
        """Fill in missing velocities and accelerations, by :func:`derivatives`."""
        velocities, accelerations = self.velocities, self.accelerations
        if velocities is None:
            velocities, second = derivatives(self.times, self.positions)
            accelerations = second if accelerations is None else accelerations
        elif accelerations is None:
            accelerations = derivatives(self.times, velocities)[0]
        return replace(self, velocities=velocities, accelerations=accelerations)


def derivatives(times: ArrayLike, values: ArrayLike, half_window: int = 3, degree: int = 4
                ) -> tuple[Array, Array]:
    """First and second derivative of sampled data by local polynomials (Savitzky & Golay 1964).

    Works for uneven spacing; at the ends the window is one-sided. On smooth data the errors fall
    with the powers ``degree`` and ``degree − 1`` of the spacing.

    Parameters
    ----------
    times : array_like (m,)
        Increasing [s].
    values : array_like (m, n)
        Samples.
    half_window : int
        Neighbours on each side; more of them suppress more noise.
    degree : int
        Degree of the polynomials, below 2·half_window + 1.

    Returns
    -------
    first, second : ndarray (m, n)
        Per second and per second squared.

    Raises
    ------
    ParameterError
        If the degree does not fit the window or the window does not fit the data.
    """
    times, values = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
    width = 2 * half_window + 1
    if not 2 <= degree < width or width > len(times):
        raise ParameterError(f'must be 2 <= degree {degree} < window {width} <= {len(times)}')
    starts = np.clip(np.arange(len(times)) - half_window, 0, len(times) - width)
    window = starts[:, None] + np.arange(width)  # (m, width)
    offsets = times[window] - times[:, None]
    scale = np.abs(offsets).max(axis=1)
    unit = (offsets / scale[:, None])[..., None]
    fitted = np.linalg.pinv(unit ** np.arange(degree + 1)) @ values[window]
    return fitted[:, 1] / scale[:, None], 2.0 * fitted[:, 2] / scale[:, None] ** 2


def minimum_jerk(share: Array) -> Array:
    """Smooth step 10 s³ − 15 s⁴ + 6 s⁵ of least jerk (Flash & Hogan 1985), s clipped to [0, 1]."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s * s))


def vector(values: ArrayLike, length: int, name: str) -> Array:
    """Array of the wanted length with finite entries.

    Raises
    ------
    ParameterError
        If it is not; the text names the value.
    """
    result = np.atleast_1d(np.array(values, dtype=float))
    if result.shape != (length,) or not np.all(np.isfinite(result)):
        raise ParameterError(f'{name} must be {length} finite number(s), not {result.tolist()}')
    return result


def columns(values: ArrayLike, length: int, name: str) -> Array:
    """Like :func:`vector`, but one number serves for all entries."""
    result = np.atleast_1d(np.array(values, dtype=float))
    return vector(np.repeat(result, length) if result.shape == (1,) else result, length, name)


def _numbers(values: ArrayLike, name: str) -> Array:
    try:
        return np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError(f'{name} of a demonstration must be numbers: {error}') from error


def _samples(values: ArrayLike, count: int, name: str) -> Array:
    result = _numbers(values, name)
    if result.ndim == 1:
        result = result[:, None]
    if result.ndim != 2 or len(result) != count or not result.shape[1]:
        raise DataError(f'{name} must have shape ({count}, n), not {result.shape}')
    if not np.all(np.isfinite(result)):
        row = int(np.argmax(~np.isfinite(result).all(axis=1)))
        raise DataError(f'{name} must be finite; sample {row} is not')
    return result
