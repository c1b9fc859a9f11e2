# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Forward invariance of C while the other nodes are anywhere on their bound.

On ∂C the inward part of ẋ_1 must be positive for *every* |x_j| ≤ R, not only for states that can
be together. It needs no synchronisation beforehand, and gains several times those of
:mod:`~dmp_cpg_ros.core.contraction.capture`, where the followers' places are taken into account.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.synchronisation import (
    comparison_laplacian,
    invariant_radius,
    overshoot,
)
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.maths import Array

_BOXES = 512
_ROUNDS = 40
_TOLERANCE = 1e-4


def needed_gain_anywhere(system: CanonicalSystem, omega: float, node: int,
                         region_radius: float) -> float:
    """Gain above which one inhibited node keeps C whatever the others do, proved by intervals.

    Parameters
    ----------
    system : CanonicalSystem
        Coupled oscillators.
    omega : float
        Upper bound on the node's angular frequency [rad/s].
    node : int
        The inhibited node i.
    region_radius : float
        r0 of C_i.

    Returns
    -------
    float
        max over n of (n·f_i(x_d + r0 n) + Σ_j k_ij (R − n·x_i)) / r0, rounded up [1/s], with R of
        the disc that no oscillator leaves and no target is out of. Where K_ij are no multiples of
        I, n·K_ij x_d is not k_ij n·x_d, and Σ_j (‖K_ij‖ (R + |x_d|) − λ_min(K_ij) r0) takes the
        place of the sum.

    Raises
    ------
    ParameterError
        For a node that there is not, or a region without a positive radius.
    """
    if not 0 <= node < len(system.target):
        raise ParameterError(f'node = {node} must be in [0, {len(system.target) - 1}]')
    if not 0.0 < region_radius < inf:
        raise ParameterError(f'region_radius = {region_radius} must be positive and finite')
    reach = float(np.linalg.norm(system.target[node]))
    laplacian = comparison_laplacian(system.graph)
    largest = invariant_radius(max(float(system.radius.max()), reach), overshoot(laplacian),
                               float(system.rho.min()))
    L = laplacian[node]
    held, pulled = float(L[node]), float(-L[np.arange(len(L)) != node].sum())
    scalar = system.graph.weights is not None
    turning, pull = Interval.of(abs(omega)) * reach, Interval.of(pulled) * (
        largest if scalar else Interval.of(largest) + reach)
    rho, r_squared = float(system.rho[node]), Interval.of(float(system.radius[node])).square()
    both = Interval.of(reach).square() + Interval.of(region_radius).square()

    def outward(cosine: Interval) -> Interval:
        """n·ẋ_i without inhibition at x_i = x_d + r0 n, with n·x_d = |x_d| cos."""
        sine = (1.0 - cosine.square()).sqrt()
        along = cosine * reach + region_radius                               # n·x_i
        squared = cosine * (2.0 * reach * region_radius) + both
        radial = rho * ((r_squared - squared) * along)
        return sine * turning + radial + pull - held * (
            along if scalar else Interval.of(region_radius))

    return float((Interval.of(_maximum(outward)) / region_radius).upper)


def _maximum(function: Callable[[Interval], Interval]) -> float:
    """Upper bound on a function over [−1, 1], by bisection of the intervals that decide."""
    edges = np.linspace(-1.0, 1.0, _BOXES + 1)
    boxes = Interval(edges[:-1], edges[1:])
    settled = -np.inf
    for _ in range(_ROUNDS):
        upper = function(boxes).upper
        attained = float(function(Interval.of(boxes.middle)).lower.max())
        keep = upper > attained + _TOLERANCE * max(1.0, abs(attained))
        if np.any(~keep):
            settled = max(settled, float(upper[~keep].max()))
        if not np.any(keep):
            return settled
        boxes = boxes[keep]
        middle = boxes.middle
        boxes = Interval(np.concatenate([boxes.lower, middle]),
                         np.concatenate([middle, boxes.upper]))
    return max(settled, float(function(boxes).upper.max()))


def _down(x: Array) -> Array:
    return np.nextafter(x, -np.inf)


def _up(x: Array) -> Array:
    return np.nextafter(x, np.inf)


@dataclass(frozen=True)
class Interval:
    """Closed intervals [lower, upper], element by element.

    Attributes
    ----------
    lower, upper : ndarray (...)
        Ends; lower ≤ upper.

    Raises
    ------
    DataError
        If an end is not a number or the ends are in the wrong order.
    """

    lower: Array
    upper: Array
    __array_ufunc__ = None  # lets ``ndarray + Interval`` reach __radd__

    def __post_init__(self) -> None:
        """Validate."""
        lower, upper = np.asarray(self.lower, float), np.asarray(self.upper, float)
        if not (lower <= upper).all():
            raise DataError('the ends of an interval must be numbers with lower <= upper')
        object.__setattr__(self, 'lower', lower)
        object.__setattr__(self, 'upper', upper)

    @classmethod
    def of(cls, value: Interval | ArrayLike) -> Interval:
        """Return the value as intervals; numbers become points."""
        if isinstance(value, Interval):
            return value
        point = np.asarray(value, dtype=float)
        return cls(point, point)

    def __add__(self, other: Interval | ArrayLike) -> Interval:
        other = Interval.of(other)
        return Interval(_down(self.lower + other.lower), _up(self.upper + other.upper))

    def __neg__(self) -> Interval:
        return Interval(-self.upper, -self.lower)

    def __sub__(self, other: Interval | ArrayLike) -> Interval:
        return self + (-Interval.of(other))

    def __mul__(self, other: Interval | ArrayLike) -> Interval:
        other = Interval.of(other)
        products = (self.lower * other.lower, self.lower * other.upper,
                    self.upper * other.lower, self.upper * other.upper)
        return Interval(_down(np.minimum.reduce(products)), _up(np.maximum.reduce(products)))

    def __truediv__(self, other: Interval | ArrayLike) -> Interval:
        other = Interval.of(other)
        if np.any((other.lower <= 0.0) & (other.upper >= 0.0)):
            raise DataError('an interval can only be divided by intervals without zero')
        one = np.ones_like(other.lower)
        return self * Interval(_down(one / other.upper), _up(one / other.lower))

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: Interval | ArrayLike) -> Interval:
        return (-self) + other

    def square(self) -> Interval:
        """x², tight where the interval contains zero."""
        low, high = self.lower * self.lower, self.upper * self.upper
        contains_zero = (self.lower <= 0.0) & (self.upper >= 0.0)
        smallest = np.where(contains_zero, 0.0, np.maximum(_down(np.minimum(low, high)), 0.0))
        return Interval(smallest, _up(np.maximum(low, high)))

    def sqrt(self) -> Interval:
        """√x of the part that is not negative.

        Raises
        ------
        DataError
            If an interval is negative altogether.
        """
        if np.any(self.upper < 0.0):
            raise DataError('the square root needs intervals that reach zero or above')
        lower = np.maximum(_down(np.sqrt(np.maximum(self.lower, 0.0))), 0.0)
        return Interval(lower, _up(np.sqrt(self.upper)))

    @property
    def middle(self) -> Array:
        """Midpoint, an ordinary array."""
        return 0.5 * (self.lower + self.upper)

    @property
    def radius(self) -> Array:
        """Half width, rounded up so that middle ± radius contains the interval."""
        return _up(np.maximum(self.upper - self.middle, self.middle - self.lower))

    @property
    def magnitude(self) -> Array:
        """Largest absolute value."""
        return np.maximum(np.abs(self.lower), np.abs(self.upper))

    def __getitem__(self, key: Any) -> Interval:
        return Interval(self.lower[key], self.upper[key])
