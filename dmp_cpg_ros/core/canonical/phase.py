# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Phase of an oscillator state: the only file with the direction of rotation.

With the signs that the paper prints (eqs. hopf1, hopf2) the state turns clockwise. The phase is
defined as φ = atan2(−x₂, x₁), so that it *grows* at the rate ω on the limit cycle; φ = 0 is the
paper's x_d = [1, 0].
"""

from __future__ import annotations

from math import atan2

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.maths import Array


def phase(x: ArrayLike) -> Array:
    """Phase of states.

    Parameters
    ----------
    x : array_like (..., 2)
        Oscillator states.

    Returns
    -------
    ndarray (...)
        φ in (−π, π] [rad].
    """
    x = np.asarray(x, dtype=float)
    return np.arctan2(-x[..., 1], x[..., 0])


def state_at(phi: ArrayLike, radius: ArrayLike = 1.0) -> Array:
    """State with the given phase and radius, the inverse of :func:`phase`.

    Parameters
    ----------
    phi : array_like (...)
        Phases [rad].
    radius : array_like
        Radii, broadcast against ``phi``.

    Returns
    -------
    ndarray (..., 2)
    """
    phi, radius = np.asarray(phi, dtype=float), np.asarray(radius, dtype=float)
    return np.stack([radius * np.cos(phi), -radius * np.sin(phi)], axis=-1)


def phase_rate(x: ArrayLike, x_dot: ArrayLike) -> Array:
    """Rate of the phase, φ̇ = (x₂ ẋ₁ − x₁ ẋ₂)/|x|² [rad/s].

    Parameters
    ----------
    x, x_dot : array_like (..., 2)
        States and their time derivatives [1/s].

    Returns
    -------
    ndarray (...)
        0 at the origin, where there is no phase.
    """
    x, x_dot = np.asarray(x, dtype=float), np.asarray(x_dot, dtype=float)
    squared = x[..., 0] ** 2 + x[..., 1] ** 2
    turning = x[..., 1] * x_dot[..., 0] - x[..., 0] * x_dot[..., 1]
    return np.divide(turning, squared, out=np.zeros_like(turning), where=squared > 0.0)


def scalar_phase(x_1: float, x_2: float) -> float:
    """Phase of one state in (−π, π] [rad], without arrays: for code that runs per leg and tick."""
    return atan2(-x_2, x_1)


def scalar_phase_rate(x_1: float, x_2: float, x_1_dot: float, x_2_dot: float) -> float:
    """Rate of the phase of one state [rad/s], without arrays; 0 at the origin."""
    squared = x_1 * x_1 + x_2 * x_2
    return (x_2 * x_1_dot - x_1 * x_2_dot) / squared if squared > 0.0 else 0.0


def scalar_phase_rates(x: Array, x_dot: Array) -> list[float]:
    """As :func:`phase_rate` of a few states (N, 2), without arithmetic on arrays."""
    rates = x_dot.tolist()
    return [scalar_phase_rate(x_1, x_2, *rates[i]) for i, (x_1, x_2) in enumerate(x.tolist())]


def phase_rotation(phi: float) -> Array:
    """Matrix R(φ) that advances the phase of a state by φ: ``phase(R x) = phase(x) + φ``.

    Returns
    -------
    ndarray (2, 2)
    """
    c, s = np.cos(phi), np.sin(phi)
    return np.array([[c, s], [-s, c]])


def turned(x: ArrayLike, phi: ArrayLike) -> Array:
    """States R(φ) x, whose phases are advanced by φ.

    Parameters
    ----------
    x : array_like (N, 2)
        States.
    phi : array_like (N,)
        Angles [rad].

    Returns
    -------
    ndarray (N, 2)
    """
    c, s = np.cos(phi), np.sin(phi)
    x = np.asarray(x, dtype=float)
    return np.stack([c * x[:, 0] + s * x[:, 1], c * x[:, 1] - s * x[:, 0]], axis=1)


def phase_generator() -> Array:
    """Generator of the rotation: ``x_dot = omega * phase_generator() @ x`` has φ̇ = ω.

    Returns
    -------
    ndarray (2, 2)
    """
    return np.array([[0.0, 1.0], [-1.0, 0.0]])


def wrapped(angle: ArrayLike) -> Array:
    """Angle brought into [−π, π) [rad]."""
    return (np.asarray(angle, dtype=float) + np.pi) % (2.0 * np.pi) - np.pi
