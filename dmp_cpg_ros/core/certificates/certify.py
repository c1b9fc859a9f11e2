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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.certificates.network import (
    analyse_network,
    armed_capture,
    contact_limits,
    later_stop,
    network_inequalities,
    slowest_cadence,
)
from dmp_cpg_ros.core.certificates.step import delay_inequalities, step_inequalities
from dmp_cpg_ros.core.certificates.timing import time_to_rest, time_to_walking
from dmp_cpg_ros.core.certificates.votes import vote_inequalities
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.finding import PROVED, weakest
from dmp_cpg_ros.core.contraction.hierarchy import (
    CONTRACTING,
    TRANSVERSE,
    Part,
    coupled_primitives,
)
from dmp_cpg_ros.core.contraction.hopf_bounds import transverse_contraction
from dmp_cpg_ros.core.contraction.region import Annulus
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.contact_feedback import ContactLimits
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.supervisor import REST_ACTIVITY
from dmp_cpg_ros.core.inhibition.voting_parameters import VotingParameters
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import OperatingRange, operating_range
from dmp_cpg_ros.core.reference.stop_distance import stop_distance
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.leg import LegParameters

Array = NDArray[np.float64]

LONGEST_STOP = 10.0
"""Time within which a stop and a start must be bounded; predictions look as far ahead [s]."""


@dataclass(frozen=True)
class Certificate:
    """Inequalities of one set of parameters.

    Attributes
    ----------
    inequalities : tuple of Inequality
        In the order (a) to (j).
    contraction_grade : str
        ``global``: the inhibited network contracts from every state; ``regional``: on the set that
        capture leads into; ``none``.
    omega_max : float
        Highest cadence that was considered [rad/s].
    time_to_rest, time_to_walking : float
        Bounds on the time from a request to rest and from a release to walking [s]; infinite
        without a certificate.
    rest_phase : tuple of float
        Phase by which each leg rests ahead of its place [rad]; empty without an equilibrium.
    rest_radius : tuple of float
        |x_i| of each leg at rest.
    contact : ContactLimits or None
        What contact feedback may do; None where it is off.
    distance_to_rest : float
        Bound on the way of the reference after a request at the largest speed [m].
    """

    inequalities: tuple[Inequality, ...]
    contraction_grade: str
    omega_max: float
    time_to_rest: float
    time_to_walking: float
    rest_phase: tuple[float, ...]
    rest_radius: tuple[float, ...]
    contact: ContactLimits | None = None
    distance_to_rest: float = math.inf

    def __getitem__(self, name: str) -> Inequality:
        """Return the inequality of a name; raises ParameterError with the names that exist."""
        for inequality in self.inequalities:
            if inequality.name == name:
                return inequality
        raise ParameterError(f"there is no inequality '{name}'; valid are "
                             f"{', '.join(entry.name for entry in self.inequalities)}")

    @property
    def failing(self) -> tuple[Inequality, ...]:
        """Required inequalities that do not hold."""
        return tuple(entry for entry in self.inequalities if entry.required and not entry.holds)

    @property
    def holds(self) -> bool:
        """Whether every required inequality holds."""
        return not self.failing

    @property
    def sampled(self) -> tuple[str, ...]:
        """Names of the required inequalities that are sampled and not proved."""
        return tuple(entry.name for entry in self.inequalities
                     if entry.required and not entry.proved)

    @property
    def grade(self) -> str:
        """``proved`` when every required inequality is, else ``sampled``."""
        return weakest(tuple(entry.grade for entry in self.inequalities if entry.required))

    def as_rows(self) -> list[tuple[str, ...]]:
        """Rows of a table: name, verdict, left side, right side, unit, margin, grade, sentence."""
        return [(entry.name, _verdict(entry), f'{entry.left_is} = {entry.left:.4g}',
                 f'{entry.right_is} = {entry.right:.4g}', entry.unit, f'{entry.margin:.4g}',
                 entry.grade, entry.sentence) for entry in self.inequalities]

    def as_mapping(self) -> dict[str, object]:
        """Return everything as values that strict JSON can write, for ``metrics.json``."""
        return {
            'holds': self.holds, 'grade': self.grade, 'contraction_grade': self.contraction_grade,
            'omega_max': self.omega_max, 'time_to_rest_s': _finite(self.time_to_rest),
            'time_to_walking_s': _finite(self.time_to_walking),
            'distance_to_rest_m': _finite(self.distance_to_rest),
            'rest_phase_rad': list(self.rest_phase), 'rest_radius': list(self.rest_radius),
            'sampled': list(self.sampled), 'failing': [entry.name for entry in self.failing],
            'inequalities': {entry.name: entry.as_mapping() for entry in self.inequalities}}

    def explained(self) -> str:
        """One line: that all holds, or the inequalities that fail."""
        if self.holds:
            return 'every required inequality holds'
        return ' | '.join(entry.explained() for entry in self.failing)


def certify(network: GaitNetwork, inhibition: InhibitionParameters,
            reference: ReferenceParameters, leg: LegParameters, posture: PostureParameters,
            tick_s: float, span: OperatingRange | None = None,
            voting: VotingParameters | None = None) -> Certificate:
    """Compute the certificate of running parameters.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators, couplings, gait and the robot's scale.
    inhibition : InhibitionParameters
        Gain, region, legs.
    reference : ReferenceParameters
        Rate and limits: they decide the highest cadence.
    leg, posture : LegParameters, PostureParameters
        Transformation systems and swing filters.
    tick_s : float
        Control tick [s].
    span : OperatingRange, optional
        Cadences to hold for, when they are not those of the gait.
    voting : VotingParameters, optional
        Stopping by vote; without, nothing is certified about it.

    Returns
    -------
    Certificate

    Raises
    ------
    ParameterError
        If the tick is not positive and finite.
    """
    if not (np.isfinite(tick_s) and tick_s > 0.0):
        raise ParameterError(f'tick = {tick_s!r} s must be positive and finite')
    span = span or operating_range(network, inhibition, reference)
    analysis = analyse_network(network, inhibition, span)
    p, found = network.parameters, analysis.found
    rates = (found.rate, max(analysis.contraction.rate, analysis.capture.rate),
             2.0 * p.rho * p.radius**2)
    slowest = min(rate for rate in rates if rate > 0.0)       # rates that there are to keep
    stop = time_to_rest(network, analysis.capture, analysis.rest, span, reference.alpha_r,
                        leg.activity_rate, inhibition.region_radius, tick_s)
    start = time_to_walking(network, found, analysis.rest, span, leg.activity_rate, tick_s)
    contact = None
    if p.contact_feedback:
        contact, contact_row = contact_limits(network, analysis, span,
                                              inhibition.region_radius, start)
        stop += later_stop(span, tick_s)
    *rows, mismatch = network_inequalities(network, inhibition, span, analysis)
    rows += step_inequalities(p.rho, p.radius, span.omega[1], slowest, inhibition.region_radius,
                              tick_s)
    rows += hierarchy_inequalities(reference, leg, posture, found, p.rho, p.radius,
                                   slowest_cadence(span, p))
    rows += rest_inequalities(network, leg, analysis.rest)
    rows += [mismatch, contact_row] if p.contact_feedback else [mismatch]
    rows += delay_inequalities(armed_capture(network, analysis, span, inhibition, contact), tick_s)
    rows += _time_inequalities(stop, start)
    if voting is not None:
        rows += vote_inequalities(network, inhibition, voting, span, reference.alpha_r,
                                  leg.activity_rate, tick_s)
    ahead, radius = ((), ()) if analysis.rest is None else (
        tuple(analysis.rest.phase_ahead.tolist()), tuple(analysis.rest.radius.tolist()))
    fastest = math.hypot(reference.max_speed, reference.max_lateral_speed)
    return Certificate(tuple(rows), analysis.contraction.reach, span.omega[1], stop, start, ahead,
                       radius, contact, stop_distance(reference, fastest, fastest, tick_s))


def _time_inequalities(stop: float, start: float) -> list[Inequality]:
    return [
        Inequality('time_to_rest', stop, LONGEST_STOP, 's', 'bound', 'longest stop', PROVED,
                   'from a request at any phase of the locked gait, at any speed, to rest'),
        Inequality('time_to_walking', start, LONGEST_STOP, 's', 'bound', 'longest start', PROVED,
                   'from release at rest to locked phases and full swings', required=False)]


def _verdict(entry: Inequality) -> str:
    if entry.holds:
        return 'holds'
    return 'FAILS' if entry.required else 'no'


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


GROUND = 0.01
"""Height of a foot that counts as on the ground, as a fraction of the standing height."""

SMALLEST_RADIUS = 0.5
"""Radius that every oscillator must keep at rest for its phase to be sound, as a fraction of r."""


def rest_inequalities(network: GaitNetwork, leg: LegParameters,
                      rest: InhibitedEquilibrium | None) -> list[Inequality]:
    """Inequalities (f): feet on the ground and sound phases at the inhibited equilibrium.

    The clearance of a swing is scaled by an activity that vanishes with the phase's speed. At rest
    it is below ``REST_ACTIVITY``, so that a foot whose leg came to rest within its swing hangs
    over the ground by that share of its path's height at most, and sinks on.

    Parameters
    ----------
    network : GaitNetwork
        Gait and oscillators.
    leg : LegParameters
        For the clearance.
    rest : InhibitedEquilibrium or None
        Equilibrium at zero reference; None when there is none.

    Returns
    -------
    list of Inequality
    """
    height = float('inf') if rest is None else max(_heights(network, leg, rest))
    radius = 0.0 if rest is None else float(rest.radius.min()) / network.parameters.radius
    ahead = 'there is no equilibrium' if rest is None else (
        'legs rest ' + ', '.join(f'{np.degrees(a):.1f}' for a in rest.phase_ahead)
        + ' degrees ahead of their places')
    return [
        Inequality('rest_posture', height, GROUND, '', 'highest foot', 'on the ground', PROVED,
                   f'as fractions of the standing height, when rest is declared; {ahead}'),
        Inequality('rest_radius', SMALLEST_RADIUS, radius, '', 'sound radius',
                   'smallest |x_i|/r at rest', PROVED,
                   'every oscillator at rest is far from the origin, so that its phase is sound')]


def _heights(network: GaitNetwork, leg: LegParameters, rest: InhibitedEquilibrium) -> list[float]:
    """Heights of the feet at rest, as fractions of the standing height."""
    duty = network.gait.duty(0.0, network.scale)
    path = FootPath((0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, duty, leg.clearance * REST_ACTIVITY)
    positions = network.gait.cycle_position(phase(rest.state))
    return [float(path.at(float(position))[0][2]) for position in positions]


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


def hierarchy_inequalities(reference: ReferenceParameters, leg: LegParameters,
                           posture: PostureParameters, found: Synchronisation, rho: float,
                           radius: float, omega: float) -> list[Inequality]:
    """Inequalities (e): rates of the driving and the driven systems, and Theorem 4 for the whole.

    Parameters
    ----------
    reference, leg, posture : ReferenceParameters, LegParameters, PostureParameters
        Parameters of the systems.
    found : Synchronisation
        Of the oscillators.
    rho, radius, omega : float
        Parameters of the oscillators, the smallest ω.

    Returns
    -------
    list of Inequality
    """
    spring, _ = spring_damper_contraction(leg.stiffness, leg.damping)
    filters = min(leg.activity_rate, leg.placement_rate, posture.activity_rate)
    oscillator = transverse_contraction(AndronovHopf(rho, radius), omega,
                                        Annulus(_INNER * radius, radius))
    whole = coupled_primitives(
        Part('reference', CONTRACTING, reference.alpha_r),
        Part('oscillator', TRANSVERSE, oscillator.rate), found,
        [Part('swing filters', CONTRACTING, filters), Part('joints', CONTRACTING, spring)])
    return [
        Inequality('reference', 0.0, reference.alpha_r, '1/s', 'zero', 'alpha_r', PROVED,
                   'the reference forgets how it was commanded before, but while its acceleration '
                   'is limited'),
        Inequality('transformation', 0.0, spring, '1/s', 'zero', 'rate of the joints', PROVED,
                   'the joints converge to what the oscillators and the reference ask for'),
        Inequality('hierarchy', 0.0, whole.rate, '1/s', 'zero', 'smallest rate of all', PROVED,
                   f'for a held command the whole suite is {whole.kind} (Theorem 4)')]
