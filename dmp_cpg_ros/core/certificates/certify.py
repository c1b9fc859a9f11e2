# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
The certificate of a running suite: what its parameters guarantee, in inequalities.

Computed from the parameters that the nodes run with, for the highest cadence that the reference's
limits allow: (a) the legs synchronise, (b) inhibition makes the network contract, (c) capture
holds, (d) the tick is short enough, (e) reference and joints contract, (f) at rest all feet are on
the ground, (g) unequal leg frequencies are tolerated, (h) the time to rest is bounded, (i) where
legs can vote, a majority stops the gait and fewer do not, (j) capture bears delays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import cache, partial

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import degrees
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.certificates import network as of_network
from dmp_cpg_ros.core.certificates.inequality import Certificate, Inequality, discharged, lost
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.step import (
    cycle_inequalities,
    step_inequalities,
    stepped_network,
)
from dmp_cpg_ros.core.certificates.timing import LONGEST_STOP, time_to_rest, time_to_walking
from dmp_cpg_ros.core.certificates.votes import vote_inequalities
from dmp_cpg_ros.core.contraction import hierarchy
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.finding import CONTINUOUS, PROVED
from dmp_cpg_ros.core.contraction.hopf_bounds import transverse_rate
from dmp_cpg_ros.core.contraction.inhibited import GLOBAL, NONE, REGIONAL
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation
from dmp_cpg_ros.core.inhibition.entry import SMALLEST_RADIUS, eligible_legs
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR, REST_ACTIVITY
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.stop_distance import stop_distance
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.foot_path import FootPath

BEFORE_VOTES = 'time_to_walking'
"""Name of the last row before those of votes."""

CLOSED_ROWS = 'cycle_radius', 'region_per_tick', 'reference', 'transformation', 'hierarchy'
QUICK_ROWS = (*CLOSED_ROWS, *of_network.NETWORK_ROWS, 'rest_radius')
"""Names of required rows that are closed formulas, and of all that take little, in the order in
which they are looked at; after them others may be missing.
"""


def certify(s: Setting, legs: Collection[int] = (), *, required_only: bool = False,
            until_lost: bool = False, until: str = '') -> Certificate:
    """Compute the certificate of running parameters.

    Parameters
    ----------
    s : Setting
        What runs.
    legs : collection of int
        Where ``auto`` chooses the leg, those of which the worst is certified; the eligible ones
        without.
    required_only : bool
        Whether inequalities that are not required are left out, which are most of the work, and
        those of votes where another required one does not hold.
    until_lost : bool
        Whether rows after a required one that does not hold may be missing: so it is known at a
        fraction of the cost that the certificate does not hold.
    until : str
        Name of a row after which others may be missing: one of ``QUICK_ROWS`` or
        ``BEFORE_VOTES``.

    Returns
    -------
    Certificate
    """
    p, votes = s.parameters.inhibition, cache(partial(vote_inequalities, s))  # of all legs alike
    if not p.auto:
        return _certificate(s, required_only, until_lost, until, votes)
    number = degrees(s.network.parameters.coupling_graph, len(LEGS))
    legs = legs or ((s.network.parameters.first_leg,) if until_lost and len(set(number)) == 1
                    else eligible_legs(s.network, p))
    found = []
    for leg in {number[leg]: leg for leg in legs}.values():       # others are alike
        found.append(_certificate(replace(s, parameters=replace(
            s.parameters, inhibition=replace(p, inhibited_legs=(LEGS[leg],)))),
            required_only, until_lost, until, votes))
        if until_lost and not found[-1].holds:
            return found[-1]
    rows = [min(same, key=lambda row: (row.holds, row.margin))  # without votes where one is lost
            for same in zip(*(each.inequalities for each in found), strict=False)]
    clearance = s.parameters.leg.clearance * REST_ACTIVITY
    rows = [row if row.name != 'rest_posture' or math.isinf(row.left) else replace(
        row, left=max(row.left, clearance)) for row in rows]
    slowest = max(found, key=lambda each: each.time_to_walking)
    return replace(
        slowest, inequalities=tuple(discharged(rows, alike=s.alike)),
        time_to_rest=max(each.time_to_rest for each in found),
        contraction_grade=max((each.contraction_grade for each in found),
                              key=(GLOBAL, REGIONAL, NONE).index),
        legs=tuple(LEGS[leg] for leg in sorted(legs)))


def _certificate(s: Setting, required_only: bool, until_lost: bool, until: str,
                 votes: Callable[[], list[Inequality]]) -> Certificate:
    p, network = s.network.parameters, s.network
    found = of_network.free_synchronisation(network)
    quick = [*cycle_inequalities(s), *hierarchy_inequalities(s, found)]
    if until in {row.name for row in quick} or (until_lost and lost(quick)):
        return Certificate(tuple(quick), NONE, s.span.omega[1])
    rows: list[Inequality] = []
    analysis = of_network.analyse_network(network, s.parameters.inhibition, s.span, found)
    contraction = analysis.contraction
    for row in of_network.network_inequalities(s, analysis):
        rows.append(row)
        if row.name == until or (until_lost and not row.holds):
            return Certificate((*quick, *rows), contraction.reach, s.span.omega[1])
    rest = analysis.rest
    at_rest = rest_inequalities(s, rest)
    if until in QUICK_ROWS or (until_lost and not at_rest[-1].holds):
        return Certificate((*quick, *rows, at_rest[-1]), contraction.reach, s.span.omega[1])
    rates = (found.rate, max(contraction.rate, analysis.capture.rate), 2.0 * p.rho * p.radius**2)
    slowest = min(rate for rate in rates if rate > 0.0)       # rates that there are to keep
    step, stop = None, time_to_rest(s, analysis.capture, rest)
    if stop < LONGEST_STOP and all(row.holds for row in rows):
        step = stepped_network(s, analysis)
        in_steps = 0.0 if step is None or not step.proved else time_to_rest(
            s, analysis.capture, rest, step)
        # a step that is proved to contract too slowly is of no use
        step, stop = (step, max(stop, in_steps)) if in_steps < LONGEST_STOP else (None, stop)
    start = time_to_walking(s, found, rest)
    if not required_only:
        rows.append(of_network.capture_anywhere(s, analysis))
    rows += [*step_inequalities(s, slowest, step), *quick, *at_rest]
    if not required_only:
        rows.append(of_network.mismatch_inequality(s, found))
    contact = None
    if p.contact_feedback:
        contact, row = of_network.contact_limits(s, found, start)
        # The tick in which a request is on its way may still be shifted, and the stop begins with
        # a leg that is as far behind its place as phase lock allows.
        stop += s.tick_s + LOCKED_PHASE_ERROR / s.span.omega_armed[0]
        rows.append(row)
    reference = s.parameters.reference
    fastest = math.hypot(reference.max_speed, reference.max_lateral_speed)
    if not required_only:
        rows += of_network.delay_inequalities(
            of_network.armed_capture(s, analysis, contact), s.tick_s)
    rows += [
        Inequality('time_to_rest', stop, LONGEST_STOP, 's', 'bound', 'longest stop', CONTINUOUS,
                   'from a request at any phase of the locked gait, at any speed, to rest'),
        Inequality(BEFORE_VOTES, start, LONGEST_STOP, 's', 'bound', 'longest start',
                   CONTINUOUS, 'from release at rest to locked phases and full swings', False)]
    rows = discharged(rows, alike=s.alike)
    if until != BEFORE_VOTES and not (required_only and lost(rows)):
        rows += votes()
    return Certificate(
        tuple(rows), contraction.reach, s.span.omega[1], stop, start,
        () if rest is None else tuple(rest.phase_ahead.tolist()),
        () if rest is None else tuple(rest.radius.tolist()), contact,
        stop_distance(reference, fastest, fastest, s.tick_s,
                      reference.max_turn_rate * network.scale.hip_radius),
        s.parameters.inhibition.inhibited_legs)


GROUND = 0.01
"""Height of a foot that counts as on the ground, as a fraction of the standing height."""

def rest_inequalities(s: Setting, rest: InhibitedEquilibrium | None) -> list[Inequality]:
    """Inequalities (f): feet on the ground and sound phases at the inhibited equilibrium.

    The clearance of a swing is scaled by an activity that vanishes with the phase's speed. At rest
    it is below ``REST_ACTIVITY``, so that a foot whose leg came to rest within its swing hangs
    over the ground by that share of its path's height at most, and sinks on.

    Parameters
    ----------
    s : Setting
        Gait and clearance.
    rest : InhibitedEquilibrium or None
        Equilibrium at zero reference; None when there is none.

    Returns
    -------
    list of Inequality
    """
    height, radius, ahead = math.inf, 0.0, 'there is no equilibrium'
    if rest is not None:
        gait = s.network.gait
        path = FootPath((0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, gait.duty(0.0, s.network.scale),
                        s.parameters.leg.clearance * REST_ACTIVITY)
        height = path.clearance if s.parameters.leg.motion else max(  # it may lift feet anywhere
            float(path.at(float(position))[0][2])
            for position in gait.cycle_position(phase(rest.state)))
        radius = float(rest.radius.min()) / s.network.parameters.radius
        degrees = ', '.join(f'{np.degrees(a):.1f}' for a in rest.phase_ahead)
        ahead = f'legs rest {degrees} degrees ahead of their places'
    return [
        Inequality('rest_posture', height, GROUND, '', 'highest foot', 'on the ground', PROVED,
                   f'as fractions of the standing height, when rest is declared; {ahead}'),
        Inequality('rest_radius', SMALLEST_RADIUS, radius, '', 'sound radius',
                   'smallest |x_i|/r at rest', PROVED,
                   'every oscillator at rest is far from the origin, so that its phase is sound')]


_CRITICAL = 1e-3  # share of the rate that is given away where no metric attains it
_INNER = 0.9  # inner radius of the annulus around the cycle, as a share of r


def spring_damper_contraction(stiffness: float, damping: float) -> tuple[float, Array]:
    """Contraction rate of θ̈ = k(g − θ) + b(ġ − θ̇) with the coordinates that show it.

    In (s θ, θ̇ + (b/2) θ) the Jacobian is [[−b/2, s], [(b²/4 − k)/s, −b/2]], whose matrix measure
    is −b/2 + |s + (b²/4 − k)/s|/2. With s² = |k − b²/4| it is the slowest eigenvalue's real part;
    critical damping has none that attains it, and s = 2ε(b/2) comes within ε.

    Parameters
    ----------
    stiffness, damping : float
        k > 0 [1/s^2] and b > 0 [1/s].

    Returns
    -------
    rate : float
        λ [1/s].
    Theta : ndarray (2, 2)
        Change of coordinates of (θ, θ̇).
    """
    half = 0.5 * damping
    s = max(math.sqrt(abs(stiffness - half**2)), 2.0 * _CRITICAL * half)
    rate = half - 0.5 * abs(s + (half**2 - stiffness) / s)
    return rate, np.array([[s, 0.0], [half, 1.0]])


def hierarchy_inequalities(s: Setting, found: Synchronisation) -> list[Inequality]:
    """Inequalities (e): rates of the driving and the driven systems, and Theorem 4 for the whole,
    with the synchronisation of the oscillators.
    """
    leg, p = s.parameters.leg, s.network.parameters
    spring, _ = spring_damper_contraction(leg.stiffness, leg.damping)
    filters = min(leg.activity_rate, leg.placement_rate, s.parameters.posture.activity_rate)
    hold = p.contact_hold if p.contact_feedback else 0.0      # late feet may hold the phase back
    oscillator = transverse_rate(
        p.rho, p.radius, (1.0 - hold) * s.span.omega[0], _INNER * p.radius, p.radius)
    alpha_r = s.parameters.reference.alpha_r
    whole = hierarchy.coupled_primitives(
        hierarchy.Part('reference', hierarchy.CONTRACTING, alpha_r),
        hierarchy.Part('oscillator', hierarchy.TRANSVERSE, oscillator), found,
        [hierarchy.Part('swing filters', hierarchy.CONTRACTING, filters),
         hierarchy.Part('joints', hierarchy.CONTRACTING, spring)])
    return [
        Inequality('reference', 0.0, alpha_r, '1/s', 'zero', 'alpha_r', PROVED,
                   'the reference forgets how it was commanded before, but while its acceleration '
                   'is limited'),
        Inequality('transformation', 0.0, spring, '1/s', 'zero', 'rate of the joints', PROVED,
                   'the joints converge to what the oscillators and the reference ask for'),
        Inequality('hierarchy', 0.0, whole.rate, '1/s', 'zero', 'smallest rate of all', CONTINUOUS,
                   f'for a held command the whole suite is {whole.kind} (Theorem 4)')]
