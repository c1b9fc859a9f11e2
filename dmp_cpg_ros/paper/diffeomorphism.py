# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of space y' = T(y) that scale a primitive (paper, Section 3.2)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import root

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.jacobians import Array, complex_step_jacobian, difference_jacobian

_SMALLEST_PIECE = 2.0**-20


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
    derivative : {'difference', 'complex'}
        Numerical differentiation: five-point differences (relative error about 1e-11), or the
        complex step (exact to rounding) for functions that are analytic and take complex numbers.
    """

    function: Callable[[Array], Array]
    jacobian_function: Callable[[Array], Array] | None = None
    inverse_function: Callable[[Array], Array] | None = None
    derivative: Literal['difference', 'complex'] = 'difference'

    def __post_init__(self) -> None:
        if self.derivative not in ('difference', 'complex'):
            raise ParameterError(
                f"derivative must be 'difference' or 'complex', not {self.derivative!r}")

    def forward(self, y: Array) -> Array:
        """T(y)."""
        return np.asarray(self.function(np.asarray(y, dtype=float)), dtype=float)

    def jacobian(self, y: Array) -> Array:
        """J(y), given or numerical."""
        if self.jacobian_function is not None:
            return np.asarray(self.jacobian_function(np.asarray(y, dtype=float)), dtype=float)
        numerical = complex_step_jacobian if self.derivative == 'complex' else difference_jacobian
        return numerical(self.function, y)

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y'), given or by Newton's method (:func:`newton_inverse`)."""
        y_prime = np.asarray(y_prime, dtype=float)
        if self.inverse_function is not None:
            return np.asarray(self.inverse_function(y_prime), dtype=float)
        start = y_prime if guess is None else guess
        return newton_inverse(self.forward, self.jacobian, y_prime, start)


@dataclass(frozen=True)
class Composition(Diffeomorphism):
    """T = T_k ∘ … ∘ T_1; the first of the list acts first.

    Attributes
    ----------
    parts : tuple of Diffeomorphism
    """

    parts: tuple[Diffeomorphism, ...]

    def forward(self, y: Array) -> Array:
        """T(y)."""
        for part in self.parts:
            y = part.forward(y)
        return y

    def jacobian(self, y: Array) -> Array:
        """J(y) by the chain rule."""
        J = np.eye(len(y))
        for part in self.parts:
            J, y = part.jacobian(y) @ J, part.forward(y)
        return J

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y'), part by part."""
        guesses = [guess]
        for part in self.parts[:-1]:
            guess = None if guess is None else part.forward(guess)
            guesses.append(guess)
        for part, near in zip(reversed(self.parts), reversed(guesses), strict=True):
            y_prime = part.inverse(y_prime, near)
        return y_prime


@dataclass(frozen=True)
class TangentLift(Diffeomorphism):
    """The map (y, v) → (T(y), J(y) v) on ℝ²ⁿ that T induces on positions and velocities.

    Attributes
    ----------
    base : Diffeomorphism
        T on ℝⁿ.
    """

    base: Diffeomorphism

    def forward(self, y: Array) -> Array:
        """(T(y), J v)."""
        position, velocity = np.split(np.asarray(y, dtype=float), 2)
        return np.append(self.base.forward(position), self.base.velocity(position, velocity))

    def jacobian(self, y: Array) -> Array:
        """[[J, 0], [∂(J v)/∂y, J]]; the lower left block by differences of J along v."""
        position, velocity = np.split(np.asarray(y, dtype=float), 2)
        J = self.base.jacobian(position)
        bend = difference_jacobian(lambda at: self.base.jacobian(at) @ velocity, position)
        return np.block([[J, np.zeros_like(J)], [bend, J]])

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """(T⁻¹(y'), J⁻¹ v')."""
        position, velocity = np.split(np.asarray(y_prime, dtype=float), 2)
        y = self.base.inverse(position, None if guess is None else np.split(guess, 2)[0])
        return np.append(y, np.linalg.solve(self.base.jacobian(y), velocity))


@dataclass(frozen=True, eq=False)
class Homogeneous(Diffeomorphism):
    """T(y) = s R y + y_T with s > 0 and R ∈ SO(n); maps many points (m, n) at once, too.

    Attributes
    ----------
    scale : float
        s.
    rotation : ndarray (n, n)
        R.
    translation : ndarray (n,)
        y_T.

    Raises
    ------
    ParameterError
        If s is not positive, R is not a rotation or the sizes differ.
    """

    scale: float
    rotation: Array
    translation: Array

    def __post_init__(self) -> None:
        R, shift = np.array(self.rotation, float), np.atleast_1d(np.array(self.translation, float))
        if R.shape != (len(shift), len(shift)):
            raise ParameterError(
                f'rotation and translation must fit; shapes are {R.shape} and {shift.shape}')
        if not (np.isfinite(self.scale) and self.scale > 0.0 and np.all(np.isfinite(shift))):
            raise ParameterError(
                f'scale = {self.scale!r} must be positive and finite, the translation finite')
        if not (np.allclose(R @ R.T, np.eye(len(R)), atol=1e-9) and np.linalg.det(R) > 0.0):
            raise ParameterError(
                'rotation must be orthogonal with determinant 1 (R Rᵀ = I, det R = 1)')
        object.__setattr__(self, 'rotation', R)
        object.__setattr__(self, 'translation', shift)

    @classmethod
    def of(cls, dofs: int, scale: float = 1.0, rotation: ArrayLike | None = None,
           translation: ArrayLike | None = None) -> Homogeneous:
        """Map of n degrees of freedom in which what is not given does nothing."""
        return cls(scale, np.asarray(np.eye(dofs) if rotation is None else rotation),
                   np.asarray(np.zeros(dofs) if translation is None else translation))

    def forward(self, y: Array) -> Array:
        """T(y)."""
        return self.direction(y) + self.translation

    def jacobian(self, y: Array) -> Array:
        """J = s R."""
        return self.scale * self.rotation

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y') = Rᵀ(y' − y_T)/s."""
        return (y_prime - self.translation) @ self.rotation / self.scale

    def direction(self, v: Array) -> Array:
        """J v, for velocities and forces."""
        return self.scale * (v @ self.rotation.T)


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
            raise ParameterError(
                f"T(y) = y' has no solution that is found for y' = {y_prime.tolist()}; give the "
                'inverse or a guess that is nearer')
    return y
