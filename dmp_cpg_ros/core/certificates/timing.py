# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Bounds on the time to rest and on the time to walking, for every state that a request may meet.

To rest: the reference decays to the speed at which inhibition is armed; the oscillator goes round
once at most until it is in C; from anywhere in the capture set the network settles
(:mod:`~dmp_cpg_ros.core.certificates.settling`). Every step rounds the bound up.
"""

from __future__ import annotations

import math

import numpy as np

from dmp_cpg_ros.core.certificates.network import Setting, free_synchronisation
from dmp_cpg_ros.core.certificates.settling import HORIZON, STEP, settling
from dmp_cpg_ros.core.certificates.step import SteppedNetwork
from dmp_cpg_ros.core.contraction.capture import CaptureSet
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.heterogeneity import disagreement, phase_spread
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation, comparison_laplacian
from dmp_cpg_ros.core.inhibition import entry, supervisor
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.stop_distance import slowing_time

DELAY_TICKS = 6
"""Ticks that requests, arming and sampling may add to the continuous bound."""

LONGEST_STOP = 10.0
"""Time within which a stop and a start must be bounded; predictions look as far ahead [s]."""


def time_to_rest(s: Setting, capture: CaptureSet, rest: InhibitedEquilibrium | None,
                 step: SteppedNetwork | None = None) -> float:
    """Bound on the time from a request to rest, for a gait whose legs are in their places.

    Parameters
    ----------
    s : Setting
        What runs.
    capture : CaptureSet
        Invariant set under inhibition.
    rest : InhibitedEquilibrium or None
        Equilibrium at zero reference.
    step : SteppedNetwork, optional
        What is proved of the step, where that is to be bounded and not the equation.

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
    return arming + arriving + settling(s, capture, rest, slowed, step) + DELAY_TICKS * s.tick_s


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
    mean, epsilon, pair, _ = disagreement(found.weights, z)
    inner = float(np.real(z * np.conj(mean)).min()) / max(abs(mean), 1e-300)
    if not inner > 0.0:
        return math.inf
    coupling = float(np.diag(comparison_laplacian(s.network.system.graph)).max())
    kept, activity = math.exp(-s.parameters.leg.activity_rate * STEP), 0.0
    for k in range(int(HORIZON / STEP)):
        distance = epsilon * pair * math.exp(-found.rate * k * STEP)
        if phase_spread(distance, inner) <= LOCKED_PHASE_ERROR and (
                activity >= supervisor.LOCKED_ACTIVITY):
            return k * STEP + DELAY_TICKS * s.tick_s
        wanted = max(0.0, 1.0 - coupling * distance / (inner * s.span.omega[0]))
        activity = wanted + (activity - wanted) * kept
    return math.inf


def time_to_places(s: Setting, x: Array) -> float:
    """Bound on the time in which free legs come to their places, from a state that is known.

    Disagreement shrinks at Theorem 4's rate, and the mean of the locked coordinates obeys
    Ṙ ≥ ρ(r²R − R³ − 3ε²R − ε² max|e|) (:mod:`~dmp_cpg_ros.core.contraction.heterogeneity`). The
    farthest state comes in as one that is alone: ẏ ≤ 2ρy(r² − y) for y = max |x_i|².

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
    mean, epsilon, pair, single = disagreement(found.weights, entry.locked(network, x))
    R, step = abs(mean), min(STEP, 0.1 / (p.rho * p.radius**2))
    inward = _time_inward(p.rho, p.radius, float(np.hypot(*x.T).max()), p.radius + radii)
    for k in range(round(HORIZON / STEP)):
        if epsilon * pair <= places and R - epsilon * single >= p.radius - radii:
            return max(k * step, inward)
        R = _raised(R, p.radius**2 - 3.0 * epsilon**2, epsilon**3 * single, p.rho * step)
        epsilon *= math.exp(-found.rate * step)
        if not R > 0.0:
            break
    return math.inf


def _raised(R: float, linear: float, constant: float, span: float) -> float:
    """Lower bound on where R ≥ 0 is after a span of R' = linear R − R³ − constant: the right side
    is concave, so that it is least at an end of the way.
    """
    now = (linear - R * R) * R - constant
    if now < 0.0:
        return R + span * min(now, -constant)
    most = now if linear < 3.0 * R * R else 2.0 * (linear / 3.0) ** 1.5 - constant
    end = R + span * most
    return R + span * min(now, (linear - end * end) * end - constant)


def _time_inward(rho: float, radius: float, distance: float, to: float) -> float:
    """Time in which |x| comes from a distance to one that is beyond the radius [s]."""
    if distance <= to:
        return 0.0
    far, near = (math.log(y * y / (y * y - radius**2)) for y in (distance, to))
    return (near - far) / (2.0 * rho * radius**2)


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
