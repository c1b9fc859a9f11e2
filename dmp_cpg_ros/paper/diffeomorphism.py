# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of space y' = T(y) that scale a primitive, and those that draw a limit cycle (paper,
Section 3.2).

In the paper's example a canonical limit cycle in ℝⁿ is drawn by a diffeomorphism. The mother is an
Andronov-Hopf oscillator with ẋ₃ = −x₃, …, ẋ_n = −x_n appended; its limit cycle is the unit circle.
A diffeomorphism carries the circle to the wanted closed curve, such as the joint angles of a robot
arm, and the daughter is transverse contracting around that curve.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import newton, root

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import phase, state_at
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.learning.period import fourier_series
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.paper.jacobians import Array, numerical_jacobian

_SMALLEST_PIECE = 2.0**-20
_GRID = 2.0 * np.pi * np.arange(513) / 512
_LEAST_SLOPE = 0.02


class Diffeomorphism(ABC):
    """A smooth map of ℝⁿ with a smooth inverse; points and velocities are ndarray (n,)."""

    @abstractmethod
    def forward(self, y: Array) -> Array:
        """T(y)."""

    @abstractmethod
    def jacobian(self, y: Array) -> Array:
        """J = ∂T/∂y, ndarray (n, n)."""

    @abstractmethod
    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y'); maps without a closed inverse search from the guess, a point near it."""

    def velocity(self, y: Array, y_dot: Array) -> Array:
        """Velocity of the image, J(y) ẏ."""
        return self.jacobian(y) @ y_dot


@dataclass(frozen=True)
class FunctionDiffeomorphism(Diffeomorphism):
    """A diffeomorphism given by its function, with or without Jacobian and inverse.

    Attributes
    ----------
    function : callable
        T: ndarray (n,) → ndarray (n,).
    jacobian_function : callable, optional
        J: ndarray (n,) → ndarray (n, n). Without, T is differentiated numerically.
    inverse_function : callable, optional
        T⁻¹: ndarray (n,) → ndarray (n,). Without, it is found by Newton's method.
    """

    function: Callable[[Array], Array]
    jacobian_function: Callable[[Array], Array] | None = None
    inverse_function: Callable[[Array], Array] | None = None

    def forward(self, y: Array) -> Array:
        """T(y)."""
        return np.asarray(self.function(np.asarray(y, dtype=float)), dtype=float)

    def jacobian(self, y: Array) -> Array:
        """J(y), given or by :func:`~dmp_cpg_ros.paper.jacobians.numerical_jacobian`."""
        if self.jacobian_function is None:
            return numerical_jacobian(self.function, y)
        return np.asarray(self.jacobian_function(np.asarray(y, dtype=float)), dtype=float)

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y'), given or by Newton's method (:func:`newton_inverse`)."""
        y_prime = np.asarray(y_prime, dtype=float)
        if self.inverse_function is not None:
            return np.asarray(self.inverse_function(y_prime), dtype=float)
        start = y_prime if guess is None else guess
        return newton_inverse(self.forward, self.jacobian, y_prime, start)


def newton_inverse(forward: Callable[[Array], Array], jacobian: Callable[[Array], Array],
                   y_prime: Array, guess: Array) -> Array:
    """Solve T(y) = y' by SciPy's root finder along the segment from T(guess) to y'.

    The whole way is tried first; where the root finder fails, it is halved. For a diffeomorphism
    of ℝⁿ the segment has a unique pre-image, so small enough pieces always succeed.

    Parameters
    ----------
    forward, jacobian : callable
        T and J.
    y_prime : ndarray (n,)
    guess : ndarray (n,)
        Where the search starts.

    Returns
    -------
    ndarray (n,)

    Raises
    ------
    ParameterError
        If no solution is found: the map is singular on the way, or y' is not in its image.
    """
    y = np.array(guess, dtype=float)
    begin, done, piece = forward(y), 0.0, 1.0
    tolerance = 1e-10 * (1.0 + float(np.abs(y_prime).max()) + float(np.abs(begin).max()))
    while done < 1.0:
        target = begin + min(done + piece, 1.0) * (y_prime - begin)
        found = root(lambda at, to=target: forward(at) - to, y, jac=jacobian, tol=1e-14)
        if np.abs(found.fun).max() <= tolerance:
            y, done, piece = found.x, done + piece, 2.0 * piece
        elif (piece := 0.5 * piece) < _SMALLEST_PIECE:
            raise ParameterError("T(y) = y' has no solution that is found from this guess")
    return y


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
        """Complete the plane to a basis of ℝⁿ, and tabulate the angles of the curve over φ."""
        n = self.series.shape[1]
        if self.plane.shape != (2, n) or not np.allclose(
                self.plane @ self.plane.T, np.eye(2), atol=1e-9):
            raise ParameterError(f'plane must be two orthonormal rows of length {n}')
        slope = _winding(self.series, self.plane)
        if slope < _LEAST_SLOPE:
            raise ParameterError(f'the curve must wind once, one way; least slope {slope:.3g}')
        object.__setattr__(self, '_complement', np.linalg.svd(self.plane)[2][2:])
        angles = np.unwrap(np.angle(_projected(self.series, self.plane, _GRID)))
        object.__setattr__(self, '_angles', angles)

    @classmethod
    def through(cls, demonstration: Demonstration, period: float, harmonics: int = 8
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
        best = max(_planes(series), key=lambda plane: _winding(series, plane))
        if _winding(series, best) < _LEAST_SLOPE:
            raise DataError('the curve winds monotonically in none of the planes tried')
        return cls(series, best)

    def curve(self, phi: Array) -> Array:
        """Points of the curve at phases [rad], ndarray (m,) → (m, n)."""
        return self.series[0].real + _from_centre(self.series, phi)

    def forward(self, y: Array) -> Array:
        """T(x)."""
        outward = np.hypot(y[0], y[1]) * _from_centre(self.series, phase(y[:2]))
        return self.series[0].real + outward + y[2:] @ self._complement

    def jacobian(self, y: Array) -> Array:
        """J(x); not defined at x₁ = x₂ = 0."""
        if not np.any(y[:2]):
            raise ParameterError('the Jacobian is not defined at the centre x1 = x2 = 0')
        phi = phase(y[:2])
        d, slope = _from_centre(self.series, phi), _from_centre(self.series, phi, 1)
        along, across = state_at(phi), state_at(phi + 0.5 * np.pi)  # ∂R/∂(x₁, x₂), R ∂φ/∂(x₁, x₂)
        return np.hstack([np.outer(d, along) + np.outer(slope, across), self._complement.T])

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y'): the phase from the angle in the plane, then radius and the rest."""
        offset = y_prime - self.series[0].real
        seen = complex(*(self.plane @ offset))
        if seen == 0.0:
            return np.append(np.zeros(2), self._complement @ offset)
        phi = self._phase_of(seen)
        radius = abs(seen / _projected(self.series, self.plane, phi))
        return np.append(state_at(phi, radius), self._complement @ (
            offset - radius * _from_centre(self.series, phi)))

    def _phase_of(self, seen: complex) -> float:
        """Phase at which the curve is in a direction of the plane: table, then Newton's method."""
        turn = np.sign(self._angles[-1] - self._angles[0])
        ahead = turn * (np.angle(seen) - self._angles[0]) % (2.0 * np.pi)
        start = np.interp(ahead, turn * (self._angles - self._angles[0]), _GRID)

        def beside(phi: float, order: int = 0) -> float:
            return float((_projected(self.series, self.plane, phi, order) / seen).imag)

        return float(newton(beside, start, lambda phi: beside(phi, 1), tol=1e-14, disp=False))


def _from_centre(series: Array, phi: ArrayLike, order: int = 0) -> Array:
    """Derivative of the curve without its mean, (..., n)."""
    orders = np.arange(1, len(series))
    waves = np.exp(1j * np.multiply.outer(phi, orders))
    return np.asarray((waves @ (series[1:] * (1j * orders[:, None]) ** order)).real)


def _projected(series: Array, plane: Array, phi: ArrayLike, order: int = 0
               ) -> NDArray[np.complex128]:
    """The same in the plane, as complex numbers (...)."""
    return np.asarray(_from_centre(series, phi, order) @ (plane[0] + 1j * plane[1]))


def _winding(series: Array, plane: Array) -> float:
    """Least sine between projected radius and tangent; negative if it does not wind once."""
    p, q = (_projected(series, plane, _GRID, order) for order in (0, 1))
    size = np.abs(p) * np.abs(q)
    if not np.all(size > 0.0):
        return -1.0
    turns = np.sum(np.angle(p[1:] / p[:-1]))
    once = abs(abs(turns) - 2.0 * np.pi) < 0.1
    return float(np.min(np.sign(turns) * (p.conj() * q).imag / size)) if once else -1.0


def _planes(series: Array) -> list[Array]:
    """Planes that are tried: of the fundamental, of principal components, of coordinates."""
    planes = [np.linalg.svd(np.stack([series[1].real, series[1].imag]), full_matrices=False)[2]]
    components = np.linalg.svd(np.vstack([series[1:].real, series[1:].imag]))[2]
    for basis in (components, np.eye(series.shape[1])):
        planes.extend(basis[list(pair)] for pair in combinations(range(len(basis)), 2))
    return planes
