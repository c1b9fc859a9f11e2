# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The homogeneous map T(y) = s R y + y_T: scale, rotation, translation (Section 3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.diffeomorphism import Diffeomorphism

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Homogeneous(Diffeomorphism):
    """T(y) = s R y + y_T with s > 0 and R ∈ SO(n).

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
        """Validate."""
        R, shift = (
            np.array(self.rotation, dtype=float),
            np.atleast_1d(np.array(self.translation, dtype=float)),
        )
        if R.ndim != 2 or R.shape != (len(shift), len(shift)):
            raise ParameterError(
                f'rotation and translation must fit; shapes are {R.shape} and {shift.shape}'
            )
        if not (np.isfinite(self.scale) and self.scale > 0.0 and np.all(np.isfinite(shift))):
            raise ParameterError(
                f'scale = {self.scale!r} must be positive and finite, the translation finite'
            )
        if not (np.allclose(R @ R.T, np.eye(len(R)), atol=1e-9) and np.linalg.det(R) > 0.0):
            raise ParameterError(
                'rotation must be orthogonal with determinant 1 (R Rᵀ = I, det R = 1)'
            )
        object.__setattr__(self, 'rotation', R)
        object.__setattr__(self, 'translation', shift)

    @classmethod
    def of(
        cls,
        dofs: int,
        scale: float = 1.0,
        rotation: ArrayLike | None = None,
        translation: ArrayLike | None = None,
    ) -> Homogeneous:
        """Map of n degrees of freedom in which what is not given does nothing.

        Parameters
        ----------
        dofs : int
            n.
        scale : float
        rotation : array_like (n, n), optional
        translation : array_like (n,), optional

        Returns
        -------
        Homogeneous
        """
        return cls(
            scale,
            np.eye(dofs) if rotation is None else np.asarray(rotation, dtype=float),
            np.zeros(dofs) if translation is None else np.asarray(translation, dtype=float),
        )

    def forward(self, y: Array) -> Array:
        """T(y); also of many points (m, n) at once."""
        return self.scale * (y @ self.rotation.T) + self.translation

    def jacobian(self, y: Array) -> Array:
        """J = s R."""
        return self.scale * self.rotation

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y') = Rᵀ(y' − y_T)/s; also of many points (m, n) at once."""
        return (y_prime - self.translation) @ self.rotation / self.scale

    def direction(self, v: Array) -> Array:
        """J v, for velocities and forces; also of many (m, n) at once."""
        return self.scale * (v @ self.rotation.T)
