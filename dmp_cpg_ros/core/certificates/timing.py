# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Bounds on the time to rest and on the time to walking, for every state that a request may meet.

To rest: the reference decays to the speed at which inhibition is armed; the oscillator goes round
once at most until it is in C; from anywhere in the capture set the rates |ẋ_i| obey

    v̇ ≤ −(L + diag α − diag b) v + |∂f/∂ω| |ω̇|

(contraction applied to ẋ itself, driven by the reference's decay), and the swings' activity
follows the phase rates through its filter. Where it is proved, the same is computed for the step
that runs, by what it has moved. Every step rounds the bound up.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.certificates.network import Setting, free_synchronisation
from dmp_cpg_ros.core.certificates.step import SteppedNetwork
from dmp_cpg_ros.core.contraction.capture import CaptureSet
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.heterogeneity import disagreement, phase_spread
from dmp_cpg_ros.core.contraction.hopf_bounds import growth, largest_radial
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation, comparison_laplacian
from dmp_cpg_ros.core.inhibition import entry, supervisor
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import phi_functions
from dmp_cpg_ros.core.reference.operating_range import REST_SPEED
from dmp_cpg_ros.core.reference.stop_distance import slowing_time

DELAY_TICKS = 6
"""Ticks that requests, arming and sampling may add to the continuous bound."""

LONGEST_STOP = 10.0
"""Time within which a stop and a start must be bounded; predictions look as far ahead [s]."""

_STEP, _BLOCK, _BLOCKS = 0.01, 32, 4  # [s], steps of a block, and blocks looked at at once
_HORIZON = 10.0  # [s] beyond it a bound is of no use


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
        What is proved of the step; where it is, the bound is the larger of its and the equation's.

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
    if step is not None and step.proved:
        settling = max(settling, _settling(s, capture, rest, slowed, step))
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
    mean, epsilon, pair, _ = disagreement(found.weights, z)
    inner = float(np.real(z * np.conj(mean)).min()) / max(abs(mean), 1e-300)
    if not inner > 0.0:
        return math.inf
    coupling = float(np.diag(comparison_laplacian(s.network.system.graph)).max())
    kept, activity = math.exp(-s.parameters.leg.activity_rate * _STEP), 0.0
    for k in range(int(_HORIZON / _STEP)):
        distance = epsilon * pair * math.exp(-found.rate * k * _STEP)
        if phase_spread(distance, inner) <= LOCKED_PHASE_ERROR and (
                activity >= supervisor.LOCKED_ACTIVITY):
            return k * _STEP + DELAY_TICKS * s.tick_s
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
    R, step = abs(mean), min(_STEP, 0.1 / (p.rho * p.radius**2))
    inward = _time_inward(p.rho, p.radius, float(np.hypot(*x.T).max()), p.radius + radii)
    for k in range(round(_HORIZON / _STEP)):
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


class _Falling(NamedTuple):
    """How bounds fall in a cell of time, and what ω̇ and ω feed them.

    Attributes
    ----------
    cell : float
        Its length [s].
    start : ndarray (n,)
        Bounds at first; the last 2N are those of |ẋ_i| and of the distance from rest.
    carry : ndarray (n, n)
        Of bounds in a cell.
    turning, away : ndarray (n,)
        What r |ω̇| and r times what ω is off that of rest add to them [s].
    inner : ndarray (N,)
        Smallest |x_i| in the set.
    """

    cell: float
    start: Array
    carry: Array
    turning: Array
    away: Array
    inner: Array


def _fastest(s: Setting, gains: Array, u: Array, disc: float) -> Array:
    """Bound of |ẋ_i| in a box and a disc, ndarray (N,)."""
    system, r, degree = s.network.system, s.network.parameters.radius, np.diag(
        comparison_laplacian(s.network.system.graph))
    return np.asarray(
        s.span.omega_armed[1] * disc + largest_radial(float(system.rho[0]), r, disc)
        + gains * u + degree * (u + u.max()))


def _falling(s: Setting, capture: CaptureSet, turning: float, away: float) -> _Falling:
    """Of the differential equation."""
    system, u = s.network.system, capture.distance
    K = comparison_laplacian(system.graph) + np.diag(capture.gains) - np.diag(
        growth(system.rho, system.radius, capture.smallest_radius))
    phi, none = phi_functions(-K * _STEP, 1), np.zeros_like(K)
    feed, idle = _STEP * phi[1].sum(axis=1), none[0]
    shape = np.linalg.solve(K, np.ones(len(K)))              # K shape = 1: bounds above it fall
    fastest = _fastest(s, capture.gains, u, s.network.parameters.radius)
    start = np.concatenate([max(float((fastest / shape).max()), turning) * shape,
                            max(float((2.0 * u / shape).max()), away) * shape])
    return _Falling(_STEP, start, np.block([[phi[0], none], [none, phi[0]]]),
                    np.concatenate([feed, idle]), np.concatenate([idle, feed]),
                    capture.smallest_radius)


def _falling_in_steps(s: Setting, capture: CaptureSet, step: SteppedNetwork) -> _Falling:
    """Of the step, some of which make a cell; what it has moved is bounded too."""
    r, u, none = s.network.parameters.radius, step.distance, np.zeros_like(step.moved)
    fastest, idle = _fastest(s, capture.gains, u, step.disc), none[0]
    start = np.concatenate([np.minimum(2.0 * u, step.moved @ fastest), fastest, 2.0 * u])
    each = np.block([[step.differences, none, none], [*step.rates, none],
                     [none, none, step.differences]])
    kicks = np.stack([
        np.concatenate([step.forced, np.full(len(u), step.disc / r), idle]) * step.step_s,
        np.concatenate([idle, idle, step.forced])], axis=1)
    carry, feed = np.eye(len(each)), 0.0 * kicks
    count = max(1, round(_STEP / step.step_s))
    for _ in range(count):
        carry, feed = each @ carry, each @ feed + kicks
    return _Falling(count * step.step_s, start, carry, feed[:, 0], feed[:, 1],
                    np.maximum(r - u, 0.0))


def _settling(s: Setting, capture: CaptureSet, rest: InhibitedEquilibrium, speed: float,
              step: SteppedNetwork | None = None) -> float:
    """Time from any state in the capture set to the thresholds of rest [s]."""
    r, span, N = s.network.parameters.radius, s.span, len(capture.distance)
    alpha_r, a_b = s.parameters.reference.alpha_r, s.parameters.reference.braking

    def drive(speed: Array) -> tuple[Array, Array]:
        """|∂f/∂ω| |ω̇| and |∂f/∂ω| |ω − ω_rest|: sideways and turning count twice in the speed
        that sets the cadence.
        """
        return (span.omega_slope * np.maximum(alpha_r * speed, 2.0 * a_b * (speed > 0.0)) * r,
                span.omega_slope * speed * r)

    turning, away = map(float, drive(np.array(speed)))
    of = _falling(s, capture, turning, away) if step is None else _falling_in_steps(
        s, capture, step)
    fade, cells = math.exp(-alpha_r * of.cell), int(_HORIZON / of.cell)
    if a_b == 0.0 and not speed * fade ** (cells - 1) <= 1.001 * REST_SPEED:
        return math.inf
    swings = _filtered(math.exp(-s.parameters.leg.activity_rate * of.cell))
    carried, fed = _in_a_block(of)
    bounds, activity = of.start, np.ones((1, N))
    for begin in range(0, cells, _BLOCKS * _BLOCK):
        falling = list[float]()
        for _ in range(_BLOCKS * _BLOCK):
            falling.append(speed)
            speed = max(0.0, min(speed * fade, speed - a_b * of.cell))
        within, swinging = list[Array](), list[Array]()
        for driven in np.stack(drive(speeds := np.array(falling)), axis=1).reshape(_BLOCKS, -1):
            block = (carried @ bounds + fed @ driven).reshape(_BLOCK + 1, -1)
            within.append(block[:-1, -2 * N:])
            bounds = block[-1]
        v, e = np.concatenate(within).reshape(-1, 2, N).swapaxes(0, 1)
        inner = np.maximum(of.inner, rest.radius - e)
        phase_rate = np.divide(v, inner, out=np.full_like(v, np.inf), where=inner > 1e-12)
        for wanted in np.minimum(1.0, phase_rate / span.omega_armed[0]).reshape(
                _BLOCKS, _BLOCK, N):
            block = swings @ np.concatenate([activity, wanted])
            swinging.append(block[:-1])
            activity = block[-1:]
        resting = np.flatnonzero(
            (phase_rate.max(axis=1) <= supervisor.REST_PHASE_RATE)
            & (speeds <= REST_SPEED)
            & (np.concatenate(swinging).max(axis=1) <= supervisor.REST_ACTIVITY))
        if len(resting) > 0:
            cell = begin + int(resting[0])
            return cell * of.cell if cell < cells else math.inf
    return math.inf


def _in_a_block(of: _Falling) -> tuple[Array, Array]:
    """Matrices that make of bounds, and of what feeds them in each cell of a block, those at the
    ends of all its cells, the first included.
    """
    n, carry = len(of.start), of.carry
    powers = np.eye(n)
    while len(powers) < _BLOCK * n:
        powers, carry = np.concatenate([powers, powers @ carry]), carry @ carry
    fed = np.zeros((_BLOCK + 1, n, 2))                           # the last: of cells to come
    fed[:_BLOCK] = (powers @ np.stack([of.turning, of.away], axis=1)).reshape(_BLOCK, n, 2)
    return np.concatenate([powers, carry]), fed.swapaxes(0, 1)[:, _SINCE].swapaxes(0, 1).reshape(
        (_BLOCK + 1) * n, 2 * _BLOCK)


_CELLS = np.arange(_BLOCK + 1)
_LATER = _CELLS[:, None] - _CELLS
_SINCE = np.where(_LATER > 0, _LATER - 1, _BLOCK)[:, :-1]
"""Cells between one of a block that is fed and the end of another, ndarray (_BLOCK + 1, _BLOCK);
_BLOCK where that comes first.
"""


def _filtered(kept: float) -> Array:
    """Matrix that makes of the first value of a filter and what it follows in each cell of a block
    its values at the ends of all cells, the first included.
    """
    weights = np.where(_LATER >= 0, (1.0 - kept) * kept ** np.maximum(_LATER, 0), 0.0)
    weights[:, 0] = kept ** _CELLS
    return weights
