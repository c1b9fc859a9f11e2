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

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.contraction.capture import CaptureSet
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.contraction.synchronisation import (
    Synchronisation,
    comparison_laplacian,
    synchronisation,
)
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.supervisor import (
    LOCKED_ACTIVITY,
    LOCKED_PHASE_ERROR,
    REST_ACTIVITY,
    REST_PHASE_RATE,
    REST_SPEED,
    entry_tolerances,
)
from dmp_cpg_ros.core.maths.exponential import phi_functions
from dmp_cpg_ros.core.reference.operating_range import OperatingRange

Array = NDArray[np.float64]

DELAY_TICKS = 6
"""Ticks that requests, arming and sampling may add to the continuous bound."""

_STEP = 0.01  # [s]
_HORIZON = 10.0  # [s] beyond it a bound is of no use


def time_to_rest(network: GaitNetwork, capture: CaptureSet, rest: InhibitedEquilibrium | None,
                 span: OperatingRange, alpha_r: float, activity_rate: float, region_radius: float,
                 tick_s: float) -> float:
    """Bound on the time from a request to rest, for a gait whose legs are in their places.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators and gait.
    capture : CaptureSet
        Invariant set under inhibition.
    rest : InhibitedEquilibrium or None
        Equilibrium at zero reference.
    span : OperatingRange
        Speeds and cadences.
    alpha_r, activity_rate : float
        Rates of the reference and of the swings' activity [1/s].
    region_radius : float
        r0 of C.
    tick_s : float
        Control tick [s].

    Returns
    -------
    float
        [s]; infinite when capture does not hold or the set does not contract.
    """
    if not capture.holds or not capture.rate > 0.0 or rest is None:
        return math.inf
    if not span.armed_speed > 0.0 < span.foot_speed:
        arming = 0.0 if span.foot_speed == 0.0 else math.inf
    else:
        arming = math.log(span.foot_speed / span.armed_speed) / alpha_r
    radius = network.parameters.radius
    arc = 4.0 * math.asin(min(1.0, region_radius / (2.0 * radius)))
    arriving = (2.0 * math.pi - arc) / span.omega_armed[0]
    settling = _settling(network, capture, rest, span, alpha_r, activity_rate,
                         span.armed_speed * math.exp(-alpha_r * arriving))
    return arming + arriving + settling + DELAY_TICKS * tick_s


def time_to_walking(network: GaitNetwork, found: Synchronisation,
                    rest: InhibitedEquilibrium | None, span: OperatingRange, activity_rate: float,
                    tick_s: float) -> float:
    """Bound on the time from the release of a resting gait to phase lock and full swings.

    Disagreement shrinks at Theorem 4's rate, the smallest n·x_i over a direction n that turns with
    the oscillators does not fall, and the phase rates differ from ω by what the coupling adds.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators and gait.
    found : Synchronisation
        Of the free network.
    rest : InhibitedEquilibrium or None
        Where it starts.
    span : OperatingRange
        Cadences.
    activity_rate : float
        Rate of the swings' activity [1/s].
    tick_s : float
        Control tick [s].

    Returns
    -------
    float
        [s]; infinite when synchronisation is not certified or the rest state is too spread out.
    """
    if rest is None or not found.synchronises or found.weights is None:
        return math.inf
    z = rest.radius * np.exp(1j * rest.phase_ahead)
    mean = complex(found.weights @ z)
    inner = float(np.real(z * np.conj(mean)).min()) / max(abs(mean), 1e-300)
    if not inner > 0.0:
        return math.inf
    disagreement = math.sqrt(float(found.weights @ np.abs(z - mean) ** 2))
    pair = disagreement * math.sqrt(float(np.sum(1.0 / np.sort(found.weights)[:2])))
    coupling = float(np.diag(comparison_laplacian(network.system.graph)).max())
    activity = 0.0
    for k in range(int(_HORIZON / _STEP)):
        distance = pair * math.exp(-found.rate * k * _STEP)
        spread = math.pi if distance >= 2.0 * inner else 2.0 * math.asin(distance / (2.0 * inner))
        if spread <= LOCKED_PHASE_ERROR and activity >= LOCKED_ACTIVITY:
            return k * _STEP + DELAY_TICKS * tick_s
        wanted = max(0.0, 1.0 - coupling * distance / (inner * span.omega[0]))
        activity = wanted + (activity - wanted) * math.exp(-activity_rate * _STEP)
    return math.inf


def time_to_places(network: GaitNetwork, found: Synchronisation, x: Array,
                   tolerances: tuple[float, float]) -> float:
    """Bound on the time in which free legs come to their places, from a state that is known.

    Disagreement shrinks at Theorem 4's rate, and the mean of the locked coordinates obeys
    Ṙ ≥ ρ(r²R − R³ − 3ε²R − ε² max|e|) (:mod:`~dmp_cpg_ros.core.contraction.heterogeneity`).

    Parameters
    ----------
    network : GaitNetwork
        Oscillators and gait.
    found : Synchronisation
        Of the free network.
    x : ndarray (4, 2)
        States.
    tolerances : tuple of float
        Of places and radii (:func:`~dmp_cpg_ros.core.inhibition.supervisor.entry_tolerances`).

    Returns
    -------
    float
        [s]; 0 for legs in their places, infinite when the bound does not come down.
    """
    p, (places, radii) = network.parameters, tolerances
    if not found.synchronises or found.weights is None or not found.free_mean:
        return math.inf
    z = np.exp(1j * network.gait.phases) * (x[:, 0] + 1j * x[:, 1])
    if (np.abs(z[:, None] - z).max() <= places
            and np.abs(np.abs(z) - p.radius).max() <= radii):
        return 0.0
    mean = complex(found.weights @ z)
    R, epsilon = abs(mean), math.sqrt(float(found.weights @ np.abs(z - mean) ** 2))
    smallest, second = np.sort(found.weights)[:2].tolist()
    pair, single = math.sqrt(1.0 / smallest + 1.0 / second), math.sqrt(1.0 / smallest - 1.0)
    step = min(_STEP, 0.1 / (p.rho * p.radius**2))
    for k in range(round(_HORIZON / _STEP)):
        if epsilon * pair <= places and R - epsilon * single >= p.radius - radii:
            return k * step
        R += step * p.rho * ((p.radius**2 - R**2 - 3.0 * epsilon**2) * R - epsilon**3 * single)
        epsilon *= math.exp(-found.rate * step)
        if not R > 0.0:
            break
    return math.inf


def later_arming(network: GaitNetwork, inhibition: InhibitionParameters, span: OperatingRange,
                 alpha_r: float, x: Array, r: Array) -> float:
    """What a state that is faster than the limits, or whose legs are not in their places, adds to
    :func:`time_to_rest` [s].

    Parameters
    ----------
    network : GaitNetwork
        Oscillators and gait.
    inhibition : InhibitionParameters
        For the region.
    span : OperatingRange
        Speeds and cadences of the bound.
    alpha_r : float
        Rate of the reference [1/s].
    x, r : ndarray (4, 2), (3,)
        States and reference at the request.
    """
    tolerances = entry_tolerances(network, inhibition.region_radius)
    p = network.parameters
    everywhere = float(growth(p.rho, p.radius))
    locking = time_to_places(network, synchronisation(network.system.graph, everywhere), x,
                             tolerances)
    if locking > 0.0:
        locking += tolerances[0] / (p.radius * span.omega_armed[0])
    speed, limit = network.scale.foot_speed(*r.tolist()), max(span.foot_speed, span.armed_speed)
    slowing = math.log(speed / limit) / alpha_r if speed > limit > 0.0 else (
        math.inf if speed > limit else 0.0)
    return max(locking, slowing)


def _settling(network: GaitNetwork, capture: CaptureSet, rest: InhibitedEquilibrium,
              span: OperatingRange, alpha_r: float, activity_rate: float, speed: float) -> float:
    """Time from any state in the capture set to the thresholds of rest [s]."""
    system, r = network.system, network.parameters.radius
    L = comparison_laplacian(network.system.graph)
    K = L + np.diag(capture.gains) - np.diag(growth(system.rho, system.radius,
                                                    capture.smallest_radius))
    phi = phi_functions(-K * _STEP, 1)
    carry, feed = phi[0], _STEP * phi[1].sum(axis=1)
    shape = np.linalg.solve(K, np.ones(len(K)))              # K shape = 1: bounds above it fall
    turning = span.omega_slope * alpha_r * speed * r         # |∂f/∂ω| |ω̇| at first
    away = span.omega_slope * speed * r                      # |∂f/∂ω| |ω − ω_rest| at first
    u = capture.distance
    fastest = (span.omega_armed[1] * r + 0.385 * system.rho * r**3 + capture.gains * u
               + np.diag(L) * (u + u.max()))
    v = max(float((fastest / shape).max()), turning) * shape
    e = max(float((2.0 * u / shape).max()), away) * shape
    fade, swing_fade = math.exp(-alpha_r * _STEP), math.exp(-activity_rate * _STEP)
    activity = np.ones(len(K))
    for k in range(int(_HORIZON / _STEP)):
        inner = np.maximum(capture.smallest_radius, rest.radius - e)
        phase_rate = np.divide(v, inner, out=np.full_like(v, np.inf), where=inner > 1e-12)
        if (phase_rate.max() <= REST_PHASE_RATE and speed <= REST_SPEED
                and activity.max() <= REST_ACTIVITY):
            return k * _STEP
        wanted = np.minimum(1.0, phase_rate / span.omega_armed[0])
        activity = wanted + (activity - wanted) * swing_fade
        v, e = carry @ v + feed * turning, carry @ e + feed * away
        speed, turning, away = speed * fade, turning * fade, away * fade
    return math.inf
