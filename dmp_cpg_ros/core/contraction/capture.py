# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Does capture hold? A set that the inhibited network cannot leave, in closed form (Section 4.2).

Contraction on C is not enough: at rest one node holds all N rotors, so that C must be shown
forward invariant. In locked coordinates let u_i = |x_i − x_d|. Because the couplings average,

    u̇_i ≤ g_i(u_i) + Σ_j k_ij (u_j − u_i) − α_i u_i,
    g_i(u) = sup over |n| = 1 of n·f_i(x_d + u n) ≤ ω_i |x_d| + ρ_i max_c (r_i² − |x|²)(c + u)

with c = n·x_d, and the box {u ≤ ū} is invariant when the right side is not positive on its faces.
With ū = r0 at the inhibited nodes the others take ū_f = r0 + (what their rotation is worth), and
what remains is one inequality for each inhibited node: *the* condition, N ω r / k_inh < r0 made
exact. Every state that enters C with its nodes in their places lies in the box.

Inside the box a half-plane n·x_i ≥ c_i is invariant too (same argument for −n·x_i); it keeps the
nodes away from the origin, where oscillators diverge, and gives contraction on the region.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.phase import phase_rotation
from dmp_cpg_ros.core.canonical.system import MOST_KEPT, CanonicalSystem
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.contraction.synchronisation import (
    comparison_laplacian,
    invariant_radius,
    overshoot,
    slowest_rate,
)
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array

Mask = NDArray[np.bool_]

RADIUS_TOLERANCE = 0.02
"""Deviation from the limit cycle's radius that the set allows at capture, as a fraction of r."""

PLACE_TOLERANCE = 0.02
"""Distance of a node from its place that the set allows at capture, as a fraction of r."""

_ROUNDING = 1e-14  # share by which r and |x_d| differ that are the same


@dataclass(frozen=True)
class CaptureSet:
    """The box {|x_i − x_d| ≤ ū_i} with its half-planes, and what makes it invariant.

    Attributes
    ----------
    distance : ndarray (N,)
        ū_i: r0 at the inhibited nodes.
    smallest_radius : ndarray (N,)
        Lower bound on |x_i| inside; 0 where the origin is not excluded.
    needed_gain : ndarray (N,)
        Gain above which each inhibited node keeps its state in C [1/s]; NaN at the others.
    gains : ndarray (N,)
        α_i [1/s].
    tolerance : float
        Distance from the leader's place that each follower may have at capture.
    rate : float
        Contraction rate inside the set, in a weighted norm max_i |δx_i|/v_i [1/s].
    """

    distance: Array
    smallest_radius: Array
    needed_gain: Array
    gains: Array
    tolerance: float
    rate: float

    @property
    def holds(self) -> bool:
        """Whether every inhibited node's gain exceeds what it needs."""
        held = ~np.isnan(self.needed_gain)
        return bool(held.any() and (self.gains[held] > self.needed_gain[held]).all())


def capture_set(system: CanonicalSystem, omega: float | Array, gains: Array,
                region_radius: float, places: float = PLACE_TOLERANCE, *,
                contracts: bool = True) -> CaptureSet:
    """Build the invariant set of an inhibited network.

    Parameters
    ----------
    system : CanonicalSystem
        Coupled oscillators; the targets of the inhibited nodes must be in their places.
    omega : float or ndarray (N,)
        Upper bounds on the angular frequencies, which may vary below [rad/s].
    gains : ndarray (N,)
        Inhibition gains α_i [1/s]; those above zero are switched on inside C_i.
    region_radius : float
        r0 of C_i = {|x_i − x_{i,d}| ≤ r0}.
    places : float
        Largest distance of a node from its place at capture, as a fraction of |x_d|.
    contracts : bool
        Whether radii and rate are computed, which are most of the work; 0 and −∞ without.

    Returns
    -------
    CaptureSet

    Raises
    ------
    ParameterError
        If a number cannot be used, no node is inhibited, or the targets of inhibited nodes are not
        in their places.
    """
    size = system.graph.size
    omega = np.full(size, np.abs(omega), dtype=float)
    gains = np.asarray(gains, dtype=float)
    if not (np.isfinite(region_radius) and region_radius > 0.0):
        raise ParameterError(f'region_radius = {region_radius!r} must be positive and finite')
    if not (np.isfinite(omega).all() and np.isfinite(gains).all() and (gains >= 0.0).all()):
        raise ParameterError(f'frequencies {omega.tolist()} must be finite, and gains '
                             f'{gains.tolist()} finite and not negative')
    if not 0.0 <= places < np.inf:
        raise ParameterError(f'places = {places!r} must be finite and not negative')
    inhibited = gains > 0.0
    D, L, largest, u, needed = _box(
        system, omega.tobytes(), inhibited.tobytes(), float(region_radius))
    tolerance = places * D
    if not inhibited.all():
        tolerance = min(tolerance, float(u[~inhibited].min()) - region_radius)
    if not contracts:
        return CaptureSet(u, np.zeros(size), needed, gains, tolerance, -np.inf)
    M = L + np.diag(gains)
    inner = np.maximum(0.0, D - u) if overshoot(L) > 0.0 else _smallest_radii(
        system, M, omega, u, D, region_radius, largest, tolerance)
    rate = slowest_rate(M - np.diag(growth(system.rho, system.radius, inner)))
    return CaptureSet(u, inner, needed, gains, tolerance, rate)


@lru_cache(maxsize=MOST_KEPT)
def _box(system: CanonicalSystem, frequencies: bytes, nodes: bytes, region_radius: float
         ) -> tuple[float, Array, float, Array, Array]:
    """|x_d|, L (N, N) [1/s], radius of the invariant disc, ū (N,) and the needed gains (N,) [1/s]:
    what depends on no gain, for frequencies (N,) and inhibited nodes (N,) as bytes.
    """
    omega, inhibited = np.frombuffer(frequencies), np.frombuffer(nodes, dtype=bool)
    D, L = target_radius(system, inhibited), comparison_laplacian(system.graph)
    largest = invariant_radius(
        max(float(system.radius.max()), D), overshoot(L), float(system.rho.min()))
    u = _distances(system, L, omega, inhibited, D, region_radius, largest + D)
    needed = np.where(
        inhibited, (outward_growth(system, omega, D, u) - L @ u) / region_radius, np.nan)
    u.flags.writeable = needed.flags.writeable = False
    return D, L, largest, u, needed


def place_tolerance(omega: float, degree: float, radius: float) -> float:
    """Distance from each other at which nodes that enter C are certain to be in the box.

    u_f − r0 ≥ ω r/Σ_j k_fj in every row of the fixed point, because no u_j is below r0.

    Parameters
    ----------
    omega : float
        Angular frequency, not above that of the box [rad/s].
    degree : float
        Largest Σ_j k_ij of a node [1/s].
    radius : float
        r = |x_d|.
    """
    lag = abs(omega) / degree if degree > 0.0 else np.inf
    return radius * min(PLACE_TOLERANCE, lag)


def radius_tolerance(radius: float, region_radius: float) -> float:
    """Deviation from r at which nodes are certain to meet C, on an arc not shorter than r's."""
    return min(RADIUS_TOLERANCE * radius, region_radius**2 / radius)


def outward_growth(system: CanonicalSystem, omega: Array, D: float, u: Array) -> Array:
    """g_i(u_i): fastest that an uncoupled oscillator moves away from x_d at the distance u_i.

    With c = n·x_d ∈ [−|x_d|, |x_d|] the radial part is ρ (r² − |x_d|² − 2uc − u²)(c + u), a
    parabola in c; for r = |x_d| its maximum is ρu³/8.

    Returns
    -------
    ndarray (N,)
        Upper bound [1/s].
    """
    return np.abs(omega) * D + np.maximum(_radial_growth(system.rho, system.radius, D, u), 0.0)


def outward_growth_within(system: CanonicalSystem, omega: Array, D: float, u: Array) -> Array:
    """Largest g_i(v) over v ≤ u_i, which rises with u as the iteration for the box needs [1/s]."""
    return np.abs(omega) * D + _radial_growth_within(system.rho, system.radius, D)(u)


def _radial_growth_within(rho: Array, r: Array, D: float) -> Callable[[Array], Array]:
    """Radial part of it, ndarray (N,) → (N,) [1/s].

    For r = |x_d| it is g_i's itself up to where c reaches −|x_d|, and from there up to where
    |x| = r/√3 with x along x_d. Else it has its other maxima there, or where c leaves or reaches
    ±|x_d|.
    """
    reach, eighth, bend = r / np.sqrt(3.0), 0.125 * rho, 4.0 / 3.0 * D

    def alike(u: Array) -> Array:
        v = np.minimum(u, reach + D)
        inner = np.asarray(eighth * (v * v * v))
        return inner if max(v.tolist()) <= bend else np.where(
            v <= bend, inner, rho * (2.0 * v * D - v * v) * (v - D))

    def unlike(u: Array) -> Array:
        root = np.sqrt(np.maximum(4.0 * D**2 + 3.0 * (r**2 - D**2), 0.0))
        places = np.stack([u, 0.0 * r, reach - D, reach + D, (root - 2.0 * D) / 3.0,
                           (root + 2.0 * D) / 3.0, (2.0 * D - root) / 3.0])
        growth = _radial_growth(rho, r, D, np.clip(places, 0.0, u))
        return np.maximum(growth.max(axis=0), 0.0)

    return alike if (r == D).all() else unlike


def _radial_growth(rho: Array, r: Array, D: float, u: Array) -> Array:
    """Largest n·ρ(r² − |x|²)x over x = x_d + u n, ndarray (N,) [1/s]."""
    u = np.maximum(u, 1e-300)
    offset = r**2 - D**2 - u**2
    with np.errstate(invalid='ignore'):  # what is not bounded has a growth that is no number
        c = np.clip((offset - 2.0 * u**2) / (4.0 * u), -D, D)
        return np.asarray(rho * (offset - 2.0 * u * c) * (c + u))


def target_radius(system: CanonicalSystem, inhibited: Mask) -> float:
    """D = |x_d|; the inhibited nodes must be pulled to one state in locked coordinates."""
    return _target_radius(system, inhibited.tobytes())


@lru_cache(maxsize=MOST_KEPT)
def _target_radius(system: CanonicalSystem, nodes: bytes) -> float:
    inhibited = np.frombuffer(nodes, dtype=bool)
    if not inhibited.any():
        raise ParameterError('no node is inhibited: at least one gain must be positive')
    places = np.array([phase_rotation(float(phi)).T @ target for phi, target in zip(
        system.graph.phases[inhibited], system.target[inhibited], strict=True)])
    if len(places) > 1 and (
            np.abs(places - places[0]).max() > 1e-9 * (1.0 + np.abs(places).max())):
        raise ParameterError('the targets of inhibited nodes must be in their places relative to '
                             f'each other; in locked coordinates they are {places.tolist()}')
    D, r = float(np.hypot(*places[0])), float(system.radius[0])
    return r if abs(D - r) <= _ROUNDING * r else D


def _distances(system: CanonicalSystem, L: Array, omega: Array, inhibited: Mask, D: float,
               region_radius: float, largest: float) -> Array:
    """Least fixed point of u_f = L_ff⁻¹(g_f − L_fi r0), and r0 at the inhibited nodes.

    Every iterate from above is a valid box, since the growth that it is solved with does not fall
    where the box shrinks. A node that the inhibited ones do not reach, or
    not firmly, may be anywhere in the invariant disc.
    """
    u, free, inverse = np.where(inhibited, region_radius, largest), ~inhibited, None
    for _ in range(12):
        if inverse is None:
            inverse = _grounded_inverse(L, free) if free.any() else None
            if inverse is None:
                u[free] = largest
                break
            far = u[free]
            radial = _radial_growth_within(system.rho[free], system.radius[free], D)
            turning, pulled = omega[free] * D, L[free][:, ~free].dot(u[~free])
        solved = inverse.dot(turning + radial(far) - pulled)
        if max(solved.tolist()) >= largest:
            beyond = solved >= largest
            u[free] = np.where(beyond, largest, far)        # fixed at the edge of the disc
            free[free], inverse = ~beyond, None
            continue
        nearer = np.minimum(far, solved)
        if max((far - nearer).tolist()) < 1e-12:
            break
        u[free] = far = nearer
    return u


def _grounded_inverse(L: Array, free: Mask) -> Array | None:
    """Inverse of L at the free nodes, which makes of g the u with (L u)_i = g_i; None where that
    is not bounded.
    """
    heard, beside = ~free, L < 0.0
    for _ in range(len(L)):
        if heard.all():
            break
        heard = heard | (beside @ heard)
    if not heard.all():
        return None
    grounded = L[free][:, free]
    firm = slowest_rate(grounded) > 1e-9 * float(np.abs(grounded).max())
    return np.asarray(np.linalg.inv(grounded)) if firm else None


def _smallest_radii(system: CanonicalSystem, M: Array, omega: Array, u: Array, D: float,
                    region_radius: float, largest: float, tolerance: float) -> Array:
    """Lower bounds on |x_i|: the box itself, and invariant half-planes n_β·x_i ≥ c_i.

    On the face of a half-plane the rotation takes away ω t, t the largest extent along the flow,
    the coupling, for K_ij = k_ij I, averages the c_j and inhibition pulls towards n_β·x_d; so
    c = n_β·x_d − s with M s ≥ ω t suffices, as long as every state at capture is inside and no c
    is negative: there the radial part would push outwards.
    """
    inner = np.maximum(0.0, D - u)
    tiny = 1e-9 * float(np.abs(M).max())
    if slowest_rate(M) <= tiny:
        return inner
    extent = np.clip(u - D * _SINE, 0.0, largest)                        # (13, N)
    loss = omega * extent + system.rho * np.maximum(largest**2 - system.radius**2, 0.0) * largest
    s = np.linalg.solve(M, loss.T).T
    entry = _entry_height(D, region_radius, float(system.radius.min())) - tolerance
    s = s + np.maximum(0.0, (D * _COSINE - entry - s).max(axis=1, keepdims=True))
    heights = D * _COSINE - s                                            # (13, N)
    sound = (heights >= 0.0).all(axis=1, keepdims=True)
    return np.maximum(inner, np.where(sound, heights, 0.0).max(axis=0))


_BETA = np.linspace(0.0, 1.2, 13)[:, None]                               # (13, 1) [rad]
_SINE, _COSINE = np.sin(_BETA), np.cos(_BETA)


@lru_cache(maxsize=MOST_KEPT)
def _entry_height(D: float, region_radius: float, r: float) -> Array:
    """Smallest n_β·x over the states of C with |x| ≥ (1 − RADIUS_TOLERANCE) min(|x_d|, r)."""
    inner = (1.0 - RADIUS_TOLERANCE) * min(D, r)
    cosine = (inner**2 + D**2 - region_radius**2) / (2.0 * inner * D)
    corner = inner * np.cos(np.minimum(np.arccos(np.clip(cosine, -1.0, 1.0)) + _BETA, np.pi))
    lowest = D * _COSINE - region_radius                                 # of all of C
    radius_there = np.sqrt(D**2 + region_radius**2 - 2.0 * D * region_radius * _COSINE)
    found = np.where(radius_there >= inner, lowest, np.maximum(corner, lowest))
    found.flags.writeable = False
    return np.asarray(found)
