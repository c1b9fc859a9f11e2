# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The plane on which the robot walks, from where its feet last stood.

A least-squares plane through the newest foothold of every leg, followed slowly (Gehring et al.,
"Dynamic trotting on slopes for quadrupedal robots", IROS 2015). Footholds are kept in ``odom``:
over one stride leg odometry drifts by millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEEPEST = 0.7
"""Largest slope that is believed; 35 degrees."""

STANDING = 0.5
"""Trust in a contact from which its place counts as a foothold."""

NARROWEST = 1e-3
"""Spread of the footholds, squared, below which they tell no slope [m^2]."""


@dataclass(frozen=True)
class TerrainState:
    """Footholds and plane.

    Attributes
    ----------
    foothold_in_world : ndarray (4, 3)
        Where each foot stood last [m].
    slope : ndarray (2,)
        ∂z/∂x and ∂z/∂y of the plane in ``odom``.
    """

    foothold_in_world: Array
    slope: Array


def initial_terrain(contact_in_world: Array) -> TerrainState:
    """Plane of a robot that stands on its four feet (4, 3)."""
    return TerrainState(contact_in_world, fitted_slope(contact_in_world))


def terrain_step(
    terrain: TerrainState, contact_in_world: Array, trust: Array, dt: float, time_constant: float
) -> TerrainState:
    """Take over new footholds and follow their plane.

    Parameters
    ----------
    terrain : TerrainState
        State one tick before.
    contact_in_world : ndarray (4, 3)
        Contact points now, of swinging feet too [m].
    trust : ndarray (4,)
        How well each foot stands, in [0, 1].
    dt : float
        Time since the last tick [s].
    time_constant : float
        Of the low-pass [s].

    Returns
    -------
    TerrainState
    """
    stands = (trust >= STANDING)[:, None]
    footholds = np.where(stands, contact_in_world, terrain.foothold_in_world)
    share = 1.0 - exp(-dt / time_constant)
    slope = terrain.slope + share * (fitted_slope(footholds) - terrain.slope)
    return TerrainState(footholds, slope)


def fitted_slope(points: Array) -> Array:
    """Slope (2,) of the least-squares plane z = a₀ + a₁ x + a₂ y through points (n, 3).

    Directions in which the points do not spread get no slope; slopes beyond ``STEEPEST`` are cut.
    """
    centred = points - points.mean(axis=0)
    (xx, xy, xz), (_, yy, yz), _ = (centred.T @ centred).tolist()
    xx, yy = xx + NARROWEST, yy + NARROWEST
    determinant = xx * yy - xy * xy
    a, b = (yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant
    scale = min(1.0, STEEPEST / max(hypot(a, b), 1e-12))
    return np.array((a * scale, b * scale))


def normal_in_world(slope: Array) -> Array:
    """Unit normal (3,), upwards, of a plane with a slope (2,)."""
    a, b = slope.tolist()
    length = (1.0 + a * a + b * b) ** 0.5
    return np.array((-a / length, -b / length, 1.0 / length))
