# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Limit-cycle oscillators of the canonical system: the protocol, and the Andronov-Hopf family."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from dmp_cpg_ros.core.canonical.phase import phase_generator
from dmp_cpg_ros.core.maths import Array, check_positive


class Oscillators(Protocol):
    """What :class:`~dmp_cpg_ros.core.canonical.system.CanonicalSystem` needs of a family.

    A class with these members is all that a new family takes, inside of this package or outside.
    Phases, locked states and gaits read x with :mod:`~dmp_cpg_ros.core.canonical.phase`: where
    they are used, the family must turn clockwise and commute with rotations.

    Attributes
    ----------
    radius : float or ndarray (N,)
        Radius of the limit cycle, of all oscillators or of each.
    """

    @property
    def radius(self) -> float | Array:
        """Radius of the limit cycle."""
        ...

    def field(self, x: Array, omega: float | Array) -> Array:
        """ẋ of uncoupled oscillators, ndarray (N, 2) → (N, 2) [1/s], at frequencies ω [rad/s]."""
        ...

    def jacobian(self, x: Array, omega: float | Array) -> Array:
        """∂ẋ_i/∂x_i, ndarray (N, 2) → (N, 2, 2) [1/s]."""
        ...


_GENERATOR, _UNIT = phase_generator(), np.eye(2)

FEW = 16
"""Numbers up to which an array is worked on as plain floats."""


@dataclass(frozen=True)
class AndronovHopf:
    """Andronov-Hopf oscillators ẋ = ω S x + ρ (r² − |x|²) x (paper eqs. hopf1, hopf2).

    S is the generator of the phase rotation.

    Attributes
    ----------
    rho : float or ndarray (N,)
        Attraction to the limit cycle ρ > 0 [1/s at radius 1]; the radius recovers at 2ρr².
    radius : float or ndarray (N,)
        Radius r > 0 of the limit cycle.

    Raises
    ------
    ParameterError
        If ρ or r is not a positive finite number.
    """

    rho: float | Array
    radius: float | Array = 1.0

    def __post_init__(self) -> None:
        """Validate."""
        check_positive(rho=self.rho, radius=self.radius)

    def field(self, x: Array, omega: float | Array) -> Array:
        """Vector field, as one product with the complex number x₁ + i x₂.

        Parameters
        ----------
        x : ndarray (..., 2)
            States.
        omega : float or ndarray (...)
            Angular frequency [rad/s].

        Returns
        -------
        ndarray (..., 2)
            ẋ [1/s].
        """
        rho, at_origin = self.rho, self.rho * self.radius**2
        if self._are_few(x, omega):
            growth = np.array([complex(at_origin - rho * (x_1 * x_1 + x_2 * x_2), 0.0 - omega)
                               for x_1, x_2 in x.tolist()])
        else:
            squared = x * x
            damping = rho * (squared[..., 0] + squared[..., 1])
            if x.dtype.kind == 'c':  # a step of a derivative: x₁, x₂ are no parts of one number
                turning = np.asarray(omega)[..., None] * (x @ phase_generator().T)
                return np.asarray(turning + (at_origin - damping)[..., None] * x)
            growth = np.empty(damping.shape, complex)  # filled, for NumPy is slow where types mix
            growth.real, growth.imag = at_origin - damping, 0.0 - omega
        return (growth[..., None] * np.ascontiguousarray(x, dtype=float).view(complex)).view(float)

    def jacobian(self, x: Array, omega: float | Array) -> Array:
        """Jacobian A = ∂f/∂x = ω S + ρ (r² − |x|²) I − 2ρ x xᵀ.

        Parameters
        ----------
        x : ndarray (..., 2)
            States.
        omega : float or ndarray (...)
            Angular frequency [rad/s].

        Returns
        -------
        ndarray (..., 2, 2)
        """
        rho, disc = self.rho, self.radius**2
        if self._are_few(x, omega):
            twice = 2.0 * rho
            of = [(rho * (disc - (x_1 * x_1 + x_2 * x_2)), x_1, x_2) for x_1, x_2 in x.tolist()]
            return np.array([entry for growth, x_1, x_2 in of for entry in (
                growth - twice * x_1 * x_1, omega - twice * x_1 * x_2,
                -omega - twice * x_2 * x_1, growth - twice * x_2 * x_2)]).reshape(-1, 2, 2)
        squared = x * x
        growth = np.asarray(rho * (disc - (squared[..., 0] + squared[..., 1])))
        return (
            np.asarray(omega)[..., None, None] * _GENERATOR
            + growth[..., None, None] * _UNIT
            - 2.0 * np.asarray(rho)[..., None, None] * x[..., :, None] * x[..., None, :])

    def _are_few(self, x: Array, omega: float | Array) -> bool:
        """Whether plain floats of equal oscillators are read and written in less time than NumPy
        needs to begin.
        """
        return (x.size <= FEW and x.ndim == 2 and x.dtype.char == 'd'
                and isinstance(omega, float) and self._are_alike)

    @cached_property
    def _are_alike(self) -> bool:
        """Whether all oscillators have the same numbers."""
        return isinstance(self.rho, float) and isinstance(self.radius, float)
