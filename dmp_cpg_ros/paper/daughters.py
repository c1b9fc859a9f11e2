# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Daughters: a contracting mother scaled in space and time, and their sums (Section 3.2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.diffeomorphism import Diffeomorphism

Array = NDArray[np.float64]
Field = Callable[[float, Array], Array]
"""Vector field: time [s], state (n,) → derivative (n,); phase and references depend on time."""


def transported_metric(M: ArrayLike, J: ArrayLike) -> Array:
    """M' = J⁻ᵀ M J⁻¹: the metric of y' = T(y) in which distances are those of y in M.

    Parameters
    ----------
    M : array_like (n, n)
        Metric at y.
    J : array_like (n, n)
        Jacobian of T at y.

    Returns
    -------
    ndarray (n, n)
        Symmetric.
    """
    half = np.linalg.solve(np.asarray(J, dtype=float).T, np.asarray(M, dtype=float))  # J⁻ᵀ M
    transported = np.linalg.solve(np.asarray(J, dtype=float).T, half.T)
    return np.asarray(0.5 * (transported + transported.T))


@dataclass(frozen=True, eq=False)
class Daughter:
    """τ(t) ẏ' = J(y) f_y(y) at y = T⁻¹(y') (paper eq. differ).

    If the mother contracts with rate λ in M, the daughter contracts in :func:`transported_metric`
    with rate λ/τ(t).

    Attributes
    ----------
    mother : callable
        f_y(t, y).
    transformation : Diffeomorphism
        T.
    tau : float or callable
        τ, or τ(t) > 0.
    """

    mother: Field
    transformation: Diffeomorphism
    tau: float | Callable[[float], float] = 1.0

    def tau_at(self, t: float) -> float:
        """τ(t).

        Raises
        ------
        ParameterError
            If it is not positive and finite.
        """
        tau = float(self.tau(t)) if callable(self.tau) else float(self.tau)
        if not (np.isfinite(tau) and tau > 0.0):
            raise ParameterError(f'tau = {tau!r} at t = {t!r} s must be a positive finite number')
        return tau

    def __call__(self, t: float, y_prime: Array, guess: Array | None = None) -> Array:
        """The daughter's vector field.

        Parameters
        ----------
        t : float
            [s]
        y_prime : ndarray (n,)
        guess : ndarray (n,), optional
            A mother state near T⁻¹(y'), for maps without a closed inverse.

        Returns
        -------
        ndarray (n,)
            ẏ'.
        """
        y = self.transformation.inverse(y_prime, guess)
        return self.transformation.velocity(y, self.mother(t, y)) / self.tau_at(t)

    def metric(self, y_prime: Array, M: ArrayLike | Callable[[Array], Array]) -> Array:
        """The daughter's metric at y'.

        Parameters
        ----------
        y_prime : ndarray (n,)
        M : array_like (n, n) or callable
            The mother's metric, or M(y).

        Returns
        -------
        ndarray (n, n)
        """
        y = self.transformation.inverse(y_prime)
        return transported_metric(M(y) if callable(M) else M, self.transformation.jacobian(y))


@dataclass(frozen=True, eq=False)
class DaughterSum:
    """ẏ = Σ α_i f_i(t, y): additive copies of daughters, as the force fields found in frogs.

    If all daughters contract in one metric, so does the sum, with rate Σ α_i λ_i at least. In
    different metrics nothing is implied: two contracting fields may add up to an unstable one.

    Attributes
    ----------
    daughters : sequence of callable
        f_i(t, y).
    gains : ndarray (k,)
        α_i ≥ 0, not all zero.

    Raises
    ------
    ParameterError
        If the gains do not fit.
    """

    daughters: Sequence[Field]
    gains: Array

    def __post_init__(self) -> None:
        """Validate."""
        gains = np.atleast_1d(np.array(self.gains, dtype=float))
        if (
            gains.shape != (len(self.daughters),)
            or not np.all(np.isfinite(gains))
            or np.any(gains < 0.0)
            or not np.any(gains > 0.0)
        ):
            raise ParameterError(
                f'gains must be {len(self.daughters)} numbers of at least 0, not all 0; they are '
                f'{gains.tolist()}'
            )
        object.__setattr__(self, 'gains', gains)

    def __call__(self, t: float, y: Array) -> Array:
        """The summed vector field.

        Parameters
        ----------
        t : float
            [s]
        y : ndarray (n,)

        Returns
        -------
        ndarray (n,)
        """
        return np.sum(
            [
                gain * daughter(t, y)
                for gain, daughter in zip(self.gains, self.daughters, strict=True)
            ],
            axis=0,
        )
