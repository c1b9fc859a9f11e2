# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ground plane through the newest footholds.

A least-squares plane through the newest foothold of every leg, followed slowly (Gehring et al.,
"Dynamic trotting on slopes for quadrupedal robots", IROS 2015). Footholds are kept in ``odom``:
over one stride leg odometry drifts by millimetres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, hypot

from dmp_cpg_ros.core.maths.vec3 import Triple

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
    foothold_in_world : tuple of (float, float, float)
        Where each foot stood last [m].
    slope : tuple of float
        ∂z/∂x and ∂z/∂y of the plane in ``odom``.
    """

    foothold_in_world: tuple[Triple, ...]
    slope: tuple[float, float]


def initial_terrain(contact_in_world: Sequence[Triple]) -> TerrainState:
    """Plane of a robot that stands on its four feet."""
    return TerrainState(tuple(contact_in_world), fitted_slope(contact_in_world))


def terrain_step(terrain: TerrainState, contact_in_world: Sequence[Triple], trust: Sequence[float],
                 dt: float, time_constant: float) -> TerrainState:
    """Take over new footholds and follow their plane.

    Parameters
    ----------
    terrain : TerrainState
        State one tick before.
    contact_in_world : sequence of four tuples of float
        Contact points now, of swinging feet too [m].
    trust : sequence of four floats
        How well each foot stands, in [0, 1].
    dt : float
        Time since the last tick [s].
    time_constant : float
        Of the low-pass [s].

    Returns
    -------
    TerrainState
    """
    feet = zip(contact_in_world, terrain.foothold_in_world, trust, strict=True)
    footholds = tuple(now if stands >= STANDING else before for now, before, stands in feet)
    share = 1.0 - exp(-dt / time_constant)
    (x, y), (x_now, y_now) = terrain.slope, fitted_slope(footholds)
    return TerrainState(footholds, (x + share * (x_now - x), y + share * (y_now - y)))


def fitted_slope(points: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Slope of the least-squares plane z = a₀ + a₁ x + a₂ y through points x, y, z.

    Directions in which the points do not spread get no slope; slopes beyond ``STEEPEST`` are cut.
    """
    xs, ys, zs = zip(*points, strict=True)
    x_mean, y_mean, z_mean = (sum(values) / len(xs) for values in (xs, ys, zs))
    xx, yy, xy, xz, yz = NARROWEST, NARROWEST, 0.0, 0.0, 0.0
    for x, y, z in zip(xs, ys, zs, strict=True):
        x, y, z = x - x_mean, y - y_mean, z - z_mean
        xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
        yy, yz = yy + y * y, yz + y * z
    determinant = xx * yy - xy * xy
    a, b = (yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant
    scale = min(1.0, STEEPEST / max(hypot(a, b), 1e-12))
    return a * scale, b * scale


def normal_in_world(slope: tuple[float, float]) -> Triple:
    """Unit normal, upwards, of a plane with a slope."""
    a, b = slope
    length = (1.0 + a * a + b * b) ** 0.5
    return -a / length, -b / length, 1.0 / length
