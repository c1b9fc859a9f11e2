# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The Andronov-Hopf oscillator, the canonical system of a rhythmic primitive (paper eqs.

hopf1, hopf2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.phase import phase_generator
from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AndronovHopf:
    """ẋ = ω S x + ρ (r² − |x|²) x, with S the generator of the phase rotation.

    Attributes
    ----------
    rho : float
        Attraction to the limit cycle ρ > 0 [1/s at radius 1]; the radius recovers at 2ρr².
    radius : float
        Radius r > 0 of the limit cycle.

    Raises
    ------
    ParameterError
        If ρ or r is not a positive finite number.
    """

    rho: float
    radius: float = 1.0

    def __post_init__(self) -> None:
        """Validate."""
        for name in ('rho', 'radius'):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ParameterError(f'{name} = {value!r} must be a positive finite number')

    def field(self, x: Array, omega: float | Array) -> Array:
        """Vector field.

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
        return hopf_field(x, omega, self.rho, self.radius)

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
        return hopf_jacobian(x, omega, self.rho, self.radius)

    def symmetric_eigenvalues(self, x: Array) -> Array:
        """Eigenvalues of A_s: ρ(r² − |x|²) along the flow and ρ(r² − 3|x|²) along the radius.

        Returns
        -------
        ndarray (..., 2)
            The larger one first; their supremum over the plane is ρr².
        """
        squared = np.sum(x * x, axis=-1)
        return np.stack(
            [self.rho * (self.radius**2 - squared), self.rho * (self.radius**2 - 3.0 * squared)],
            axis=-1,
        )


def hopf_field(
    x: Array, omega: float | Array, rho: float | Array, radius: float | Array
) -> Array:
    """Field of :class:`AndronovHopf` with parameters for each of the states (..., 2)."""
    turned = x @ phase_generator().T
    growth = rho * (radius**2 - np.sum(x * x, axis=-1))
    return np.asarray(np.asarray(omega)[..., None] * turned + growth[..., None] * x)


def hopf_jacobian(
    x: Array, omega: float | Array, rho: float | Array, radius: float | Array
) -> Array:
    """Jacobian of :func:`hopf_field`, (..., 2, 2)."""
    growth = rho * (radius**2 - np.sum(x * x, axis=-1))
    return np.asarray(
        np.asarray(omega)[..., None, None] * phase_generator()
        + growth[..., None, None] * np.eye(2)
        - np.asarray(2.0 * rho)[..., None, None] * x[..., :, None] * x[..., None, :]
    )
