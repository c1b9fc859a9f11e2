# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Bounds on the time to rest and on the time to walking, for every state that a request may meet.

To rest: the reference decays to the speed at which inhibition is armed; the oscillator goes round
once at most until it is in C; from anywhere in the capture set the rates |ẋ_i| obey

    v̇ ≤ −(L + diag α − diag b) v + |∂f/∂ω| |ω̇|

(contraction applied to ẋ itself, driven by the reference's decay), and the swings' activity
follows the phase rates through its filter. Every step rounds the bound up.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.certificates.network import Setting, free_synchronisation
from dmp_cpg_ros.core.contraction.capture import CaptureSet
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation, comparison_laplacian
from dmp_cpg_ros.core.inhibition import entry, supervisor
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import phi_functions
from dmp_cpg_ros.core.reference.stop_distance import slowing_time

DELAY_TICKS = 6
"""Ticks that requests, arming and sampling may add to the continuous bound."""

LONGEST_STOP = 10.0
"""Time within which a stop and a start must be bounded; predictions look as far ahead [s]."""

_STEP = 0.01  # [s]
_HORIZON = 10.0  # [s] beyond it a bound is of no use


def time_to_rest(s: Setting, capture: CaptureSet, rest: InhibitedEquilibrium | None) -> float:
    """Bound on the time from a request to rest, for a gait whose legs are in their places.

    Parameters
    ----------
    s : Setting
        What runs.
    capture : CaptureSet
        Invariant set under inhibition.
    rest : InhibitedEquilibrium or None
        Equilibrium at zero reference.

    Returns
    -------
    float
        [s]; infinite when capture does not hold or the set does not contract.
    """
    if not capture.holds or not capture.rate > 0.0 or rest is None:
        return math.inf
    span, alpha_r = s.span, s.parameters.reference.alpha_r
    if not span.armed_speed > 0.0 < span.foot_speed:
        arming = 0.0 if span.foot_speed == 0.0 else math.inf
    else:
        arming = slowing_time(s.parameters.reference, span.foot_speed, span.armed_speed, s.tick_s)
    arriving = max(0.0, s.way - s.arc) / span.omega_armed[0]
    slowed = min(span.armed_speed * math.exp(-alpha_r * arriving), max(
        0.0, span.armed_speed - s.parameters.reference.braking * arriving))
    settling = _settling(s, capture, rest, slowed)
    return arming + arriving + settling + DELAY_TICKS * s.tick_s


def time_to_walking(s: Setting, found: Synchronisation, rest: InhibitedEquilibrium | None
                    ) -> float:
    """Bound on the time from the release of a resting gait to phase lock and full swings.

    Disagreement shrinks at Theorem 4's rate, the smallest n·x_i over a direction n that turns with
    the oscillators does not fall, and the phase rates differ from ω by what the coupling adds.

    Parameters
    ----------
    s : Setting
        What runs.
    found : Synchronisation
        Of the free network.
    rest : InhibitedEquilibrium or None
        Where it starts.

    Returns
    -------
    float
        [s]; infinite when synchronisation is not certified or the rest state is too spread out.
    """
    if rest is None or not found.synchronises or found.weights is None:
        return math.inf
    z = rest.radius * np.exp(1j * rest.phase_ahead)
    mean, epsilon, pair, _ = _disagreement(found.weights, z)
    inner = float(np.real(z * np.conj(mean)).min()) / max(abs(mean), 1e-300)
    if not inner > 0.0:
        return math.inf
    coupling = float(np.diag(comparison_laplacian(s.network.system.graph)).max())
    kept, activity = math.exp(-s.parameters.leg.activity_rate * _STEP), 0.0
    for k in range(int(_HORIZON / _STEP)):
        distance = epsilon * pair * math.exp(-found.rate * k * _STEP)
        spread = math.pi if distance >= 2.0 * inner else 2.0 * math.asin(distance / (2.0 * inner))
        if spread <= LOCKED_PHASE_ERROR and activity >= supervisor.LOCKED_ACTIVITY:
            return k * _STEP + DELAY_TICKS * s.tick_s
        wanted = max(0.0, 1.0 - coupling * distance / (inner * s.span.omega[0]))
        activity = wanted + (activity - wanted) * kept
    return math.inf


def _disagreement(weights: Array, z: NDArray[np.complex128]
                  ) -> tuple[complex, float, float, float]:
    """Mean of locked coordinates and ε = (Σ ξ_i |z_i − z̄|²)^½, with the largest distance of two of
    them and of one from the mean, as multiples of ε.
    """
    mean = complex(weights @ z)
    smallest, second = np.sort(weights)[:2].tolist()
    return (mean, math.sqrt(float(weights @ np.abs(z - mean) ** 2)),
            math.sqrt(1.0 / smallest + 1.0 / second), math.sqrt(1.0 / smallest - 1.0))


def time_to_places(s: Setting, x: Array) -> float:
    """Bound on the time in which free legs come to their places, from a state that is known.

    Disagreement shrinks at Theorem 4's rate, and the mean of the locked coordinates obeys
    Ṙ ≥ ρ(r²R − R³ − 3ε²R − ε² max|e|) (:mod:`~dmp_cpg_ros.core.contraction.heterogeneity`).

    Parameters
    ----------
    s : Setting
        What runs.
    x : ndarray (4, 2)
        States.

    Returns
    -------
    float
        [s]; 0 for legs in their places, infinite when the bound does not come down.
    """
    p, network, r0 = s.network.parameters, s.network, s.parameters.inhibition.region_radius
    found = free_synchronisation(network)
    if not found.synchronises or found.weights is None or not found.free_mean:
        return math.inf
    if entry.in_places(network, x, r0):
        return 0.0
    places, radii = entry.entry_tolerances(network, r0)
    mean, epsilon, pair, single = _disagreement(found.weights, entry.locked(network, x))
    R, step = abs(mean), min(_STEP, 0.1 / (p.rho * p.radius**2))
    for k in range(round(_HORIZON / _STEP)):
        if epsilon * pair <= places and R - epsilon * single >= p.radius - radii:
            return k * step
        R += step * p.rho * ((p.radius**2 - R**2 - 3.0 * epsilon**2) * R - epsilon**3 * single)
        epsilon *= math.exp(-found.rate * step)
        if not R > 0.0:
            break
    return math.inf


def later_arming(s: Setting, x: Array, r: Array) -> float:
    """What a state that is faster than the limits, or whose legs are not in their places, adds to
    :func:`time_to_rest` [s].

    Parameters
    ----------
    s : Setting
        What runs, and what the bound holds for.
    x, r : ndarray (4, 2), (3,)
        States and reference at the request.
    """
    span, radius = s.span, s.network.parameters.radius
    locking = time_to_places(s, x)
    if locking > 0.0:
        places, _ = entry.entry_tolerances(s.network, s.parameters.inhibition.region_radius)
        locking += places / (radius * span.omega_armed[0])
    speed, limit = s.network.scale.foot_speed(*r.tolist()), max(span.foot_speed, span.armed_speed)
    if not speed > limit:
        return locking
    return max(locking, slowing_time(s.parameters.reference, speed, limit, s.tick_s))


def _settling(s: Setting, capture: CaptureSet, rest: InhibitedEquilibrium, speed: float) -> float:
    """Time from any state in the capture set to the thresholds of rest [s]."""
    system, r, span = s.network.system, s.network.parameters.radius, s.span
    alpha_r, L = s.parameters.reference.alpha_r, comparison_laplacian(system.graph)
    a_b = s.parameters.reference.braking
    K = L + np.diag(capture.gains) - np.diag(growth(system.rho, system.radius,
                                                    capture.smallest_radius))
    phi = phi_functions(-K * _STEP, 1)
    carry, feed = phi[0], _STEP * phi[1].sum(axis=1)
    shape = np.linalg.solve(K, np.ones(len(K)))              # K shape = 1: bounds above it fall
    # |∂f/∂ω| |ω̇| at first: sideways and turning count twice in the speed that sets the cadence
    turning = span.omega_slope * max(alpha_r * speed, 2.0 * a_b * (speed > 0.0)) * r
    away = span.omega_slope * speed * r                      # |∂f/∂ω| |ω − ω_rest| at first
    u = capture.distance
    fastest = (span.omega_armed[1] * r + 0.385 * system.rho * r**3 + capture.gains * u
               + np.diag(L) * (u + u.max()))
    v = max(float((fastest / shape).max()), turning) * shape
    e = max(float((2.0 * u / shape).max()), away) * shape
    fade, swing_fade = math.exp(-alpha_r * _STEP), math.exp(
        -s.parameters.leg.activity_rate * _STEP)
    activity = np.ones(len(K))
    for k in range(int(_HORIZON / _STEP)):
        inner = np.maximum(capture.smallest_radius, rest.radius - e)
        phase_rate = np.divide(v, inner, out=np.full_like(v, np.inf), where=inner > 1e-12)
        if (phase_rate.max() <= supervisor.REST_PHASE_RATE and speed <= supervisor.REST_SPEED
                and activity.max() <= supervisor.REST_ACTIVITY):
            return k * _STEP
        wanted = np.minimum(1.0, phase_rate / span.omega_armed[0])
        activity = wanted + (activity - wanted) * swing_fade
        v, e = carry @ v + feed * turning, carry @ e + feed * away
        if a_b > 0.0:
            speed = max(0.0, min(speed * fade, speed - a_b * _STEP))
            turning = span.omega_slope * max(alpha_r * speed, 2.0 * a_b * (speed > 0.0)) * r
            away = span.omega_slope * speed * r
        else:
            speed, turning, away = speed * fade, turning * fade, away * fade
    return math.inf
