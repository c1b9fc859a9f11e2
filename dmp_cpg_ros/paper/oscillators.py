# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Families of oscillators for networks: Andronov-Hopf, Van der Pol, mixed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.jacobians import Array


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

    count: int
    state_size: int
    rotation_invariant: bool

    def field(self, x: Array) -> Array:
        """Rates ẋ_i = f(x_i; ω_i): ndarray (N, n) → (N, n) [1/s]."""

    def jacobian(self, x: Array) -> Array:
        """Jacobians ∂f/∂x at each state: ndarray (N, n) → (N, n, n) [1/s]."""

    def stiffness(self, x: Array) -> float:
        """Bound on the norm of the Jacobians at these states [1/s]."""


def _one_per_oscillator(name: str, values: ArrayLike, count: int, lowest: float) -> Array:
    """Check and spread a parameter: a number for all oscillators, or one for each."""
    given = np.asarray(values, dtype=float)
    if given.shape not in ((), (count,)):
        raise ParameterError(f'{name} needs one value or {count}, not an array {given.shape}')
    if not np.all(np.isfinite(given) & (given > lowest)):
        least = 'finite' if lowest == -np.inf else f'finite and greater than {lowest:g}'
        raise ParameterError(f'every {name} must be {least}')
    return np.array(np.broadcast_to(given, (count,)))


class HopfOscillators:
    """N oscillators ẋ = ω S x + ρ (r² − |x|²) x (paper eqs. hopf1, hopf2).

    Parameters
    ----------
    count : int
        Number N.
    omega : array_like
        Angular frequencies, one for all or (N,) [rad/s].
    rho : array_like
        Attractions ρ > 0 [1/s].
    radius : array_like
        Radii r > 0 of the limit cycles.

    Raises
    ------
    ParameterError
        If a parameter is not finite, out of its range or of another length.
    """

    state_size = 2
    rotation_invariant = True

    def __init__(self, count: int, omega: ArrayLike, rho: ArrayLike = 8.0,
                 radius: ArrayLike = 1.0) -> None:
        self.count = count
        self.omega = _one_per_oscillator('omega', omega, count, -np.inf)
        self.rho = _one_per_oscillator('rho', rho, count, 0.0)
        self.radius = _one_per_oscillator('radius', radius, count, 0.0)
        self._fastest = float(np.hypot(self.rho * self.radius**2, self.omega).max())

    def field(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2)."""
        return AndronovHopf(self.rho, self.radius).field(x, self.omega)

    def jacobian(self, x: Array) -> Array:
        """Jacobians, ndarray (N, 2) → (N, 2, 2)."""
        return AndronovHopf(self.rho, self.radius).jacobian(x, self.omega)

    def stiffness(self, x: Array) -> float:
        """Bound |ω| + ρ r² + 3 ρ |x|² on the norms of the Jacobians [1/s]."""
        return self._fastest + 3.0 * float((self.rho * np.einsum('ij,ij->i', x, x)).max())


class VanDerPolOscillators:
    """N Van der Pol oscillators ẋ₁ = x₂, ẋ₂ = −ω² x₁ + μ (1 − x₁²) x₂ (paper, figure vdp).

    The caption of the figure prints (1 − x₁); the oscillator of van der Pol (*On
    relaxation-oscillations*, Phil. Mag. 2 (1926)) has x₁², without which there is no limit cycle.

    Parameters
    ----------
    count : int
        Number N.
    omega : array_like
        Angular frequencies ω > 0 for small μ, one for all or (N,) [rad/s].
    mu : array_like
        Nonlinearities μ > 0 [1/s].

    Raises
    ------
    ParameterError
        If a parameter is not finite, out of its range or of another length.
    """

    state_size = 2
    rotation_invariant = False

    def __init__(self, count: int, omega: ArrayLike, mu: ArrayLike) -> None:
        self.count = count
        self.omega = _one_per_oscillator('omega', omega, count, 0.0)
        self.mu = _one_per_oscillator('mu', mu, count, 0.0)

    def field(self, x: Array) -> Array:
        """Rates, ndarray (N, 2) → (N, 2)."""
        x1, x2 = x.T
        return np.stack([x2, self.mu * (1.0 - x1 * x1) * x2 - self.omega * self.omega * x1], 1)

    def jacobian(self, x: Array) -> Array:
        """Jacobians, ndarray (N, 2) → (N, 2, 2)."""
        x1, x2 = x.T
        rows = [np.zeros(self.count), np.ones(self.count),
                -self.omega**2 - 2.0 * self.mu * x1 * x2, self.mu * (1.0 - x1 * x1)]
        return np.stack(rows, axis=1).reshape(-1, 2, 2)

    def stiffness(self, x: Array) -> float:
        """Largest Frobenius norm of the Jacobians [1/s]."""
        return float(np.linalg.norm(self.jacobian(x), axis=(1, 2)).max())


class MixedOscillators:
    """Families one after the other: the first has the first nodes, and so on.

    Parameters
    ----------
    families : sequence of OscillatorFamily
        With states of the same size.

    Raises
    ------
    ParameterError
        If there are none, or their states differ in size.
    """

    def __init__(self, families: Sequence[OscillatorFamily]) -> None:
        sizes = sorted({family.state_size for family in families})
        if len(sizes) != 1:
            raise ParameterError(f'mixed oscillators need states of one size, not {sizes}')
        self.families, self.state_size = tuple(families), sizes[0]
        self.rotation_invariant = all(family.rotation_invariant for family in families)
        ends = np.cumsum([family.count for family in families])
        self.count, self._starts = int(ends[-1]), ends[:-1]

    def field(self, x: Array) -> Array:
        """Rates, ndarray (N, n) → (N, n)."""
        return np.concatenate([family.field(part) for family, part in self._parts(x)])

    def jacobian(self, x: Array) -> Array:
        """Jacobians, ndarray (N, n) → (N, n, n)."""
        return np.concatenate([family.jacobian(part) for family, part in self._parts(x)])

    def stiffness(self, x: Array) -> float:
        """Largest bound of the families [1/s]."""
        return max(family.stiffness(part) for family, part in self._parts(x))

    def _parts(self, x: Array) -> zip[tuple[OscillatorFamily, Array]]:
        return zip(self.families, np.split(x, self._starts), strict=True)
