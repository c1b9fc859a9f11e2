# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A canonical limit cycle in ℝⁿ drawn by a diffeomorphism (the paper's example in Section 3.2).

The mother is an Andronov-Hopf oscillator with ẋ₃ = −x₃, …, ẋ_n = −x_n appended; its limit cycle is
the unit circle. A diffeomorphism carries the circle to the wanted closed curve, such as the joint
angles of a robot arm, and the daughter is transverse contracting around that curve.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import phase, state_at
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.learning.period import fourier_series
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.paper.diffeomorphism import Diffeomorphism

Array = NDArray[np.float64]

_GRID = 512
_LEAST_SLOPE = 0.02


def canonical_field(x: Array, oscillator: AndronovHopf, omega: float, decay: float = 1.0) -> Array:
    """The mother: (x₁, x₂) on an Andronov-Hopf oscillator, the other states decaying.

    Parameters
    ----------
    x : ndarray (n,)
        State, n ≥ 2.
    oscillator : AndronovHopf
    omega : float
        [rad/s]
    decay : float
        Rate of the appended states; the paper has 1 [1/s].

    Returns
    -------
    ndarray (n,)
        ẋ [1/s].
    """
    return np.concatenate([oscillator.field(x[:2], omega), -decay * x[2:]])


@dataclass(frozen=True, eq=False)
class ClosedCurveDiffeomorphism(Diffeomorphism):
    """T(x) = c + R d(φ) + Nᵀ(x₃, …, x_n) with (R, φ) the polar coordinates of (x₁, x₂).

    c is the curve's centre, d(φ) the curve seen from there, N spans the complement of a plane. The
    unit circle goes to the curve, concentric circles to scaled copies of it. T is smooth with a
    smooth inverse wherever R > 0 exactly when the curve's projection onto the plane winds once
    around the centre with increasing angle; at R = 0, the equilibrium that every region of
    transverse contraction leaves out, it is only continuous.

    Attributes
    ----------
    series : ndarray (harmonics + 1, n) of complex
        Fourier coefficients of the curve over the phase.
    plane : ndarray (2, n)
        Orthonormal rows that span the plane.

    Raises
    ------
    ParameterError
        If the projection does not wind around the centre monotonically.
    """

    series: Array
    plane: Array
    _complement: Array = field(init=False, repr=False)
    _angles: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Validate and complete the plane to a basis of ℝⁿ."""
        n = self.series.shape[1]
        if self.plane.shape != (2, n) or not np.allclose(
            self.plane @ self.plane.T, np.eye(2), atol=1e-9
        ):
            raise ParameterError(f'plane must be two orthonormal rows of length {n}')
        slope = _winding(self.series, self.plane)
        if slope < _LEAST_SLOPE:
            raise ParameterError(
                'the projection of the curve must wind once around its centre with its angle '
                f'always in one direction; the least normalised slope is {slope:.3g}'
            )
        complement = np.linalg.svd(self.plane)[2][2:]
        grid = 2.0 * np.pi * np.arange(_GRID + 1) / _GRID
        angles = np.unwrap(np.arctan2(*(self._from_centre(grid) @ self.plane.T).T[::-1]))
        object.__setattr__(self, '_complement', complement)
        object.__setattr__(self, '_angles', angles)

    @classmethod
    def through(
        cls, demonstration: Demonstration, period: float, harmonics: int = 8
    ) -> ClosedCurveDiffeomorphism:
        """Diffeomorphism whose curve is a recorded rhythm, in the plane that suits it best.

        Parameters
        ----------
        demonstration : Demonstration
            n ≥ 2 degrees of freedom; its first sample is at phase 0.
        period : float
            [s]
        harmonics : int
            Number of harmonics that are kept.

        Returns
        -------
        ClosedCurveDiffeomorphism

        Raises
        ------
        DataError
            If there is one degree of freedom only, or no plane suits.
        """
        if demonstration.dofs < 2:
            raise DataError('a closed curve needs at least 2 degrees of freedom')
        times = demonstration.times - demonstration.times[0]
        series = fourier_series(times, demonstration.positions, 2.0 * np.pi / period, harmonics)
        planes = _planes(series)
        best = max(planes, key=lambda plane: _winding(series, plane))
        if _winding(series, best) < _LEAST_SLOPE:
            raise DataError(
                'the curve winds around its centre monotonically in none of the planes that '
                'were tried (fundamental, principal, coordinate planes)'
            )
        return cls(series, best)

    def curve(self, phi: Array) -> Array:
        """Points of the curve.

        Parameters
        ----------
        phi : ndarray (m,)
            [rad]

        Returns
        -------
        ndarray (m, n)
        """
        return self.series[0].real + self._from_centre(phi)

    def forward(self, y: Array) -> Array:
        """T(x)."""
        radius = float(np.hypot(y[0], y[1]))
        outward = self._from_centre(np.atleast_1d(phase(y[:2])))[0]
        return self.series[0].real + radius * outward + y[2:] @ self._complement

    def jacobian(self, y: Array) -> Array:
        """J(x); not defined at x₁ = x₂ = 0."""
        radius, phi = float(np.hypot(y[0], y[1])), phase(y[:2])
        # ∂R/∂(x₁, x₂)
        along = state_at(phi)
        # R ∂φ/∂(x₁, x₂)
        across = state_at(phi + 0.5 * np.pi)
        d, slope = self._from_centre(np.atleast_1d(phi))[0], self._slope(np.atleast_1d(phi))[0]
        if radius == 0.0:
            raise ParameterError('the Jacobian is not defined at the centre x1 = x2 = 0')
        return np.hstack([np.outer(d, along) + np.outer(slope, across), self._complement.T])

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y'): the phase from the angle in the plane, then radius and the rest."""
        offset = y_prime - self.series[0].real
        flat = self.plane @ offset
        if not np.any(flat):
            return np.concatenate([np.zeros(2), self._complement @ offset])
        phi = self._phase_of(float(np.arctan2(flat[1], flat[0])))
        d = self._from_centre(np.array([phi]))[0]
        radius = float(np.hypot(*flat) / np.hypot(*(self.plane @ d)))
        return np.concatenate([state_at(phi, radius), self._complement @ (offset - radius * d)])

    def _phase_of(self, angle: float) -> float:
        """Phase at which the projected curve has a given angle: table, then Newton's method."""
        angles, turn = self._angles, self._angles[-1] - self._angles[0]
        angle = angles[0] + np.sign(turn) * ((np.sign(turn) * (angle - angles[0])) % (2.0 * np.pi))
        phi = float(
            np.interp(
                np.sign(turn) * angle,
                np.sign(turn) * angles,
                2.0 * np.pi * np.arange(_GRID + 1) / _GRID,
            )
        )
        wanted = np.array([np.cos(angle), np.sin(angle)])
        for _ in range(8):
            p, q = (
                self.plane @ self._from_centre(np.array([phi]))[0],
                self.plane @ self._slope(np.array([phi]))[0],
            )
            step = -(wanted[0] * p[1] - wanted[1] * p[0]) / (wanted[0] * q[1] - wanted[1] * q[0])
            phi += step
            if abs(step) < 1e-15:
                break
        return phi

    def _from_centre(self, phi: Array) -> Array:
        return _evaluate(self.series, phi, 0)

    def _slope(self, phi: Array) -> Array:
        return _evaluate(self.series, phi, 1)


def _evaluate(series: Array, phi: Array, order: int) -> Array:
    """Derivative of the curve without its mean, (m, n)."""
    orders = np.arange(1, len(series))
    return (
        np.exp(1j * np.outer(phi, orders)) @ (series[1:] * (1j * orders[:, None]) ** order)
    ).real


def _winding(series: Array, plane: Array) -> float:
    """Least sine between projected radius and tangent; negative if it does not wind once."""
    phi = 2.0 * np.pi * np.arange(_GRID) / _GRID
    p, q = _evaluate(series, phi, 0) @ plane.T, _evaluate(series, phi, 1) @ plane.T
    cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    size = np.hypot(*p.T) * np.hypot(*q.T)
    if not np.all(size > 0.0):
        return -1.0
    turns = np.sum(
        np.angle(
            np.exp(1j * np.diff(np.arctan2(p[:, 1], p[:, 0]), append=np.arctan2(p[0, 1], p[0, 0])))
        )
    )
    once = abs(abs(turns) - 2.0 * np.pi) < 0.1
    return float(np.min(np.sign(turns) * cross / size)) if once else -1.0


def _planes(series: Array) -> list[Array]:
    """Planes that are tried: of the fundamental, of principal components, of coordinates."""
    n = series.shape[1]
    planes = [np.linalg.svd(np.stack([series[1].real, series[1].imag]), full_matrices=False)[2]]
    components = np.linalg.svd(np.vstack([series[1:].real, series[1:].imag]))[2]
    for basis in (components, np.eye(n)):
        planes.extend(basis[list(pair)] for pair in combinations(range(n), 2))
    return planes
