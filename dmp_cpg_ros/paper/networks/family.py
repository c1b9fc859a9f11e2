# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a network needs to know of its oscillators."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]


class OscillatorFamily(Protocol):
    """N uncoupled oscillators of one kind, each with its own parameters (paper eq. hetero).

    Attributes
    ----------
    count : int
        Number N of oscillators.
    state_size : int
        Dimension n of one oscillator's state.
    rotation_invariant : bool
        Whether f(R x) = R f(x) for rotations R, which phase offsets need (paper, footnote of
        Section 5).
    """

    @property
    def count(self) -> int:
        """Number N of oscillators."""

    @property
    def state_size(self) -> int:
        """Dimension n of one oscillator's state."""

    @property
    def rotation_invariant(self) -> bool:
        """Whether the field commutes with rotations of the state."""

    def field(self, x: Array) -> Array:
        """Rates ẋ_i = f(x_i; ω_i): ndarray (N, n) → (N, n) [1/s]."""

    def jacobian(self, x: Array) -> Array:
        """Jacobians ∂f/∂x at each state: ndarray (N, n) → (N, n, n) [1/s]."""

    def stiffness(self, x: Array) -> float:
        """Bound on the norm of the Jacobians at these states [1/s]."""


def one_per_oscillator(name: str, values: ArrayLike, count: int, lowest: float) -> Array:
    """Check and spread a parameter: a number for all oscillators, or one for each.

    Parameters
    ----------
    name : str
        Name for the error.
    values : array_like
        One number, or ``count`` numbers.
    count : int
        Number of oscillators.
    lowest : float
        What every value must be greater than.

    Returns
    -------
    ndarray (count,)

    Raises
    ------
    ParameterError
        If there are neither one nor ``count`` finite values greater than ``lowest``.
    """
    given = np.asarray(values, dtype=float)
    if given.shape not in ((), (count,)):
        raise ParameterError(f'{name} needs one value or {count}, not an array {given.shape}')
    if not np.all(np.isfinite(given) & (given > lowest)):
        least = 'finite' if lowest == -np.inf else f'finite and greater than {lowest:g}'
        raise ParameterError(f'every {name} must be {least}')
    return np.array(np.broadcast_to(given, (count,)))
