# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The time step of the canonical system, stacked over the settings of many networks."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log2

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.maths import Array


@dataclass(frozen=True)
class Setting:
    """One network with its inhibition."""

    system: CanonicalSystem
    omega: Array
    gains: Array
    region_radius: float
    name: str = ''

    @property
    def node(self) -> int:
        """The inhibited oscillator."""
        return int(np.argmax(self.gains))


def locked(setting: Setting, phi: float, radius: float = 1.0) -> Array:
    """All oscillators in their places at phase φ, radii as a share of r."""
    return state_at(phi + setting.system.graph.phases, radius * setting.system.radius)


class Batch:
    """Steps many networks at once; inhibition is switched by region where it is armed.

    Parameters
    ----------
    settings : list of Setting
        Of networks of the same size N.
    dt : float or ndarray (settings,)
        Length of the step [s].
    """

    def __init__(self, settings: list[Setting], dt: ArrayLike) -> None:
        """Compute the matrices of the step, free and inhibited, of every setting."""
        self._settings = settings
        rho = np.stack([s.system.rho for s in settings])
        self._stacked = {
            'omega': np.stack([s.omega for s in settings]), 'rho': rho,
            'gains': np.stack([s.gains for s in settings]),
            'target': np.stack([s.system.target for s in settings]),
            'region': np.array([s.region_radius for s in settings])[:, None],
            'pull': rho * np.stack([s.system.radius for s in settings]) ** 2}
        parts = [s.system.linear_part(gains) for s in settings for gains in (0.0 * s.gains,
                                                                             s.gains)]
        dts = np.repeat(np.broadcast_to(dt, len(settings)), 2)
        self._steps = step_matrices(np.stack([M for M, _ in parts]),
                                    np.stack([c for _, c in parts]), dts)
        self.rows = np.arange(0)
        self.use(np.arange(len(settings)))

    def use(self, rows: NDArray[np.intp]) -> None:
        """Step the states (rows,) by these settings from now on."""
        if len(rows) != len(self.rows):
            self._now = [np.empty((len(rows), *part.shape[1:])) for part in self._steps]
            self._at = np.full(len(rows), -1)
        self.rows = rows
        for name, values in self._stacked.items():
            setattr(self, name, values[rows])

    omega: Array
    rho: Array
    gains: Array
    target: Array
    region: Array
    pull: Array

    @property
    def settings(self) -> list[Setting]:
        """The setting of each state."""
        return [self._settings[row] for row in self.rows]

    def inside(self, x: Array) -> NDArray[np.bool_]:
        """Which states (states, N, 2) have their inhibited oscillators in C, (states,)."""
        close = np.linalg.norm(x - self.target, axis=2) <= self.region
        return np.asarray(np.all(close | (self.gains == 0.0), axis=1))

    def step(self, x: Array, armed: bool | NDArray[np.bool_] = True) -> Array:
        """One step of all states (states, N, 2)."""
        at = 2 * self.rows + (self.inside(x) & armed)
        if (moved := at != self._at).any():
            for now, every in zip(self._now, self._steps, strict=True):
                now[moved] = every[at[moved]]
            self._at = at
        half, end, final, c_half, c = self._now
        flat, linear = x.reshape(len(x), -1), self.pull - 1j * self.omega

        def nonlinear(state: Array) -> Array:
            z = np.ascontiguousarray(state).view(complex)
            return np.asarray(((linear - self.rho * (z.real**2 + z.imag**2)) * z).view(float))

        n0 = nonlinear(flat)
        n_half = nonlinear(_times(half, flat, n0) + c_half)
        n_end = nonlinear(_times(end, flat, n0, n_half) + c)
        return np.asarray((_times(final, flat, n0, n_half, n_end) + c).reshape(x.shape))

    def speed(self, x: Array) -> Array:
        """Largest |ẋ_i| of each state, by its own vector field."""
        acting = self.inside(x)
        return np.array([np.linalg.norm(s.system.field(x[k], s.omega, s.gains * acting[k]),
                                        axis=1).max() for k, s in enumerate(self.settings)])


def step_matrices(M: Array, c: Array, dt: Array) -> list[Array]:
    """Matrices of :class:`~dmp_cpg_ros.core.maths.exponential.ExponentialStep`, stacked.

    φ₃ by its series where the norm is below 1/2, φ_k = M φ_{k+1} + 1/k!, and by doubling
    φ_k(2M) = 2^−k (φ₀ φ_k + Σ_j φ_j/(k − j)!).

    Parameters
    ----------
    M, c, dt : ndarray (s, n, n), (s, n), (s,)
        Linear parts [1/s], constants and lengths of the steps [s].

    Returns
    -------
    list of ndarray
        To half, to the end, final (s, n, 2n … 4n), and the constants of both (s, n).
    """
    unit, h = np.eye(M.shape[-1]), dt[:, None, None]
    norm = float(np.abs(M * h).sum(axis=-2).max())
    doublings = max(0, ceil(log2(norm))) if norm > 0.0 else 0
    A = M * (0.5 * h / 2.0**doublings)
    series = np.broadcast_to(unit, M.shape)
    for k in range(16, 3, -1):
        series = unit + A @ series / k
    p3 = series / 6.0
    p2 = A @ p3 + 0.5 * unit
    p1 = A @ p2 + unit
    phi = [A @ p1 + unit, p1, p2, p3]
    half = phi
    for _ in range(doublings + 1):
        half = phi
        p0, p1, p2, p3 = np.split(phi[0] @ np.concatenate(phi, axis=2), 4, axis=2)
        phi = [p0, (p1 + phi[1]) / 2.0, (p2 + phi[1] + phi[2]) / 4.0,
               (p3 + phi[1] / 2.0 + phi[2] + phi[3]) / 8.0]
    whole, p1, p2, p3 = phi
    to_half, to_end = 0.5 * h * half[1], h * p1
    return [np.concatenate([half[0], to_half], axis=2),
            np.concatenate([whole, -to_end, 2.0 * to_end], axis=2),
            np.concatenate([whole, h * (p1 - 3.0 * p2 + 4.0 * p3), h * (4.0 * p2 - 8.0 * p3),
                            h * (4.0 * p3 - p2)], axis=2),
            (to_half @ c[:, :, None])[:, :, 0], (to_end @ c[:, :, None])[:, :, 0]]


def _times(matrix: Array, *parts: Array) -> Array:
    return np.asarray(np.matmul(matrix, np.concatenate(parts, axis=1)[:, :, None])[:, :, 0])
