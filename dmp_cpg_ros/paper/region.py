# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Regions of the state space on which contraction is tested, and what a test has found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.contraction.capture_anywhere import Interval
from dmp_cpg_ros.core.contraction.finding import GRADES
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array


@dataclass(frozen=True)
class Ball:
    """{x : |x − center| ≤ radius} in any dimension.

    Attributes
    ----------
    center : ndarray (n,)
        Centre.
    radius : float
        Radius ≥ 0.
    """

    center: Array
    radius: float

    def __post_init__(self) -> None:
        """Validate."""
        if not (np.isfinite(self.radius) and self.radius >= 0.0):
            raise ParameterError(f'radius = {self.radius!r} of a ball must be finite and >= 0')

    def sample(self, count: int, seed: int = 0) -> Array:
        """Points, half of them on the boundary, ndarray (count, n)."""
        center = np.asarray(self.center, dtype=float)
        rng = np.random.default_rng(seed)
        directions = rng.normal(size=(count, center.size))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        shares = rng.random((count, 1)) ** (1.0 / center.size)
        shares[::2] = 1.0
        return center + self.radius * shares * directions


@dataclass(frozen=True)
class Annulus:
    """{x ∈ ℝ² : inner ≤ |x| ≤ outer}, the region K around a limit cycle.

    Attributes
    ----------
    inner, outer : float
        Radii, 0 ≤ inner ≤ outer.
    """

    inner: float
    outer: float

    def __post_init__(self) -> None:
        """Validate."""
        if not 0.0 <= self.inner <= self.outer < np.inf:
            raise ParameterError(f'an annulus needs 0 <= inner <= outer, not {self.inner!r} and '
                                 f'{self.outer!r}')

    def sample(self, count: int, seed: int = 0) -> Array:
        """Points, a quarter on each boundary, ndarray (count, 2)."""
        rng = np.random.default_rng(seed)
        radius = np.sqrt(rng.uniform(self.inner**2, self.outer**2, count))
        radius[::4], radius[1::4] = self.inner, self.outer
        angle = rng.uniform(0.0, 2.0 * np.pi, count)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


@dataclass(frozen=True)
class Box:
    """{x : lower ≤ x ≤ upper}, the region on which intervals prove.

    Attributes
    ----------
    lower, upper : ndarray (n,)
        Corners.
    """

    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        """Validate."""
        lower, upper = np.asarray(self.lower, float), np.asarray(self.upper, float)
        if lower.shape != upper.shape or lower.ndim != 1 or not np.all(lower <= upper):
            raise ParameterError('a box needs two corners of equal length with lower <= upper')

    def sample(self, count: int, seed: int = 0) -> Array:
        """Points, the corners among them as far as the count goes, ndarray (count, n)."""
        lower, upper = np.asarray(self.lower, float), np.asarray(self.upper, float)
        rng = np.random.default_rng(seed)
        points = rng.uniform(lower, upper, size=(count, lower.size))
        corners = min(count // 2, 2 ** min(lower.size, 12))
        bits = (np.arange(corners)[:, None] >> np.arange(lower.size)) & 1
        points[:corners] = np.where(bits, upper, lower)
        return points

    def as_interval(self) -> Interval:
        """Return the box as intervals, Interval (1, n)."""
        return Interval(np.asarray(self.lower, float)[None], np.asarray(self.upper, float)[None])


Region = Ball | Annulus | Box


@dataclass(frozen=True)
class Finding:
    """Outcome of a contraction test on a region.

    Attributes
    ----------
    rate : float
        λ of the definitions in Section 3.1 [1/s]: distances shrink at least like exp(−λt).
        Negative where the test found no contraction.
    grade : str
        ``proved``, ``continuous`` or ``sampled``.
    evaluations : int
        Points (sampled) or boxes (proved) at which the Jacobian was evaluated; 0 for closed forms.
    statement : str
        The result in one sentence.

    Raises
    ------
    ParameterError
        If the grade is none of the three.
    """

    rate: float
    grade: str
    evaluations: int
    statement: str

    def __post_init__(self) -> None:
        """Validate."""
        if self.grade not in GRADES:
            raise ParameterError(f"grade '{self.grade}' is not known; valid are "
                                 f"{', '.join(GRADES)}")
