# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inequalities of the oscillators: synchronisation, inhibition, capture, mismatch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.contraction.capture import (
    CaptureSet,
    capture_set,
    place_tolerance,
    radius_tolerance,
)
from dmp_cpg_ros.core.contraction.capture_anywhere import needed_gain_anywhere
from dmp_cpg_ros.core.contraction.delays import Capture
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium, inhibited_equilibrium
from dmp_cpg_ros.core.contraction.finding import PROVED
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound, mismatch_margin
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.contraction.inhibited import (
    GLOBAL,
    NONE,
    InhibitedContraction,
    inhibited_contraction,
)
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation, synchronisation
from dmp_cpg_ros.core.gait.contact_feedback import ContactLimits
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.inhibition.supervisor import (
    LOCKED_PHASE_ERROR,
    entry_tolerances,
    largest_degree,
)
from dmp_cpg_ros.core.maths.roots import last_that_holds
from dmp_cpg_ros.core.reference.operating_range import OperatingRange
from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]

EXPECTED_MISMATCH = 0.05
"""Difference of the legs' frequencies that should be tolerated, as a share of the highest."""


@dataclass(frozen=True)
class NetworkAnalysis:
    """What contraction theory says about the oscillators of a gait.

    Attributes
    ----------
    found : Synchronisation
        Theorem 4.
    capture : CaptureSet
        Invariant set under inhibition at the highest cadence.
    contraction : InhibitedContraction
        Of the inhibited network.
    rest, rest_at_speed : InhibitedEquilibrium or None
        Equilibria at zero reference and at the highest cadence.
    """

    found: Synchronisation
    capture: CaptureSet
    contraction: InhibitedContraction
    rest: InhibitedEquilibrium | None
    rest_at_speed: InhibitedEquilibrium | None


def analyse_network(network: GaitNetwork, inhibition: InhibitionParameters,
                    span: OperatingRange) -> NetworkAnalysis:
    """Apply the theorems to the network of a gait.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators.
    inhibition : InhibitionParameters
        Gain, region and legs.
    span : OperatingRange
        Cadences.

    Returns
    -------
    NetworkAnalysis
    """
    system = network.system
    everywhere = float(growth(system.rho, system.radius).max())
    # A gain of zero holds nothing; the smallest positive one says so in numbers.
    acting = np.where(_chosen(inhibition), max(inhibition.inhibition_gain, 1e-9), 0.0)
    capture = capture_set(system, span.omega[1], acting, inhibition.region_radius)
    return NetworkAnalysis(
        synchronisation(system.graph, everywhere), capture, inhibited_contraction(system, capture),
        inhibited_equilibrium(system, span.omega_at_rest, acting),
        inhibited_equilibrium(system, span.omega[1], acting))


def network_inequalities(network: GaitNetwork, inhibition: InhibitionParameters,
                         span: OperatingRange, analysis: NetworkAnalysis) -> list[Inequality]:
    """Inequalities (a), (b), (c) and (g).

    Parameters
    ----------
    network : GaitNetwork
        Oscillators.
    inhibition : InhibitionParameters
        Gain, region and legs.
    span : OperatingRange
        Cadences.
    analysis : NetworkAnalysis
        Of the same network.

    Returns
    -------
    list of Inequality
    """
    found, p = analysis.found, network.parameters
    margin = mismatch_margin(found, p.rho, p.radius, LOCKED_PHASE_ERROR)
    return [
        Inequality('synchronisation', found.growth, found.connectivity, '1/s', 'rho r^2',
                   'connectivity of L_K', PROVED,
                   f'from every state the legs find their places, at {found.rate:.4g} 1/s '
                   f'({found.method} bound)'),
        _contraction(analysis.contraction),
        *_capture(network, inhibition, span, analysis),
        Inequality('frequency_mismatch', EXPECTED_MISMATCH * span.omega[1], margin, 'rad/s',
                   f'{EXPECTED_MISMATCH:.0%} of omega_max', 'tolerated mismatch', PROVED,
                   f'legs whose own frequencies differ stay within {LOCKED_PHASE_ERROR:g} rad of '
                   'their places', required=False)]


def armed_capture(network: GaitNetwork, analysis: NetworkAnalysis, span: OperatingRange,
                  inhibition: InhibitionParameters, contact: ContactLimits | None) -> Capture:
    """Capture at the cadences at which inhibition is armed, for its delays.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators.
    analysis : NetworkAnalysis
        Of the network.
    span : OperatingRange
        Cadences.
    inhibition : InhibitionParameters
        For the region.
    contact : ContactLimits or None
        What contact feedback may add to the frequency of a leg.
    """
    p, r0 = network.parameters, inhibition.region_radius
    places = place_tolerance(span.omega_at_rest, p.coupling_gain * largest_degree(
        p.coupling_graph), p.radius)
    omega = span.omega_armed[1] + (contact.own if contact else 0.0)
    return Capture(network.system, omega, analysis.capture.gains, r0, places,
                   radius_tolerance(p.radius, r0))


def _contraction(contraction: InhibitedContraction) -> Inequality:
    where = {GLOBAL: 'from every state', NONE: 'and comes to rest'}.get(
        contraction.reach, 'inside the capture set, which leaves the origin out')
    return Inequality(
        'contraction', contraction.growth, contraction.inhibition_rate, '1/s',
        'rho r^2' if contraction.reach == GLOBAL else 'growth on the capture set',
        'connectivity of L_K + k_inh E', PROVED,
        f'the inhibited network contracts {where}' + (
            '' if contraction.reach == NONE else
            f' ({contraction.reach} grade), at {contraction.rate:.4g} 1/s'))


def _capture(network: GaitNetwork, inhibition: InhibitionParameters, span: OperatingRange,
             analysis: NetworkAnalysis) -> list[Inequality]:
    """Inequalities (c): C is not left again, by those in their places and by anyone."""
    held = _chosen(inhibition)
    gain, r0 = inhibition.inhibition_gain, inhibition.region_radius
    needed = float(analysis.capture.needed_gain[held].max())
    rest = analysis.rest_at_speed
    distance = float('inf') if rest is None or not rest.slowest_rate > 0.0 else float(
        rest.distance[held].max())
    # The legs' oscillators are alike: only how many act on them makes a difference.
    heard = np.array([sum(edge[0] == node for edge in network.system.graph.edges)
                      for node in np.flatnonzero(held)])
    different = np.flatnonzero(held)[np.unique(heard, return_index=True)[1]]
    anywhere = max(needed_gain_anywhere(network.system, span.omega[1], int(node), r0)
                   for node in different)
    exists = '' if np.isfinite(distance) else '; there is none, the other legs break free'
    cadence = f'at the highest cadence, {span.omega[1]:.4g} rad/s'
    return [
        Inequality('capture', needed, gain, '1/s', 'N omega r/r0 made exact', 'k_inh', PROVED,
                   f'legs that enter C in their places cannot leave it again, {cadence}'),
        Inequality('rest_in_region', distance, r0, '', '|x_1* - x_d|', 'r0', PROVED,
                   f'the inhibited equilibrium lies inside C, {cadence}{exists}'),
        Inequality('capture_anywhere', anywhere, gain, '1/s', 'gain for any |x_j| <= r', 'k_inh',
                   PROVED, 'C cannot be left even while the other legs are out of place',
                   required=False)]


def _chosen(inhibition: InhibitionParameters) -> NDArray[np.bool_]:
    """Which oscillators are inhibited, whatever the gain."""
    return np.array([leg in inhibition.inhibited_legs for leg in LEGS])


def contact_margin(found: Synchronisation, rho: float, radius: float,
                   tolerances: tuple[float, float]) -> float:
    """Largest δ for which frequencies in [ω − δ, ω + δ] leave walking and stopping as certified.

    For all times after the legs were in their places, their phases stay within the error that
    phase lock allows, and places and radii within what capture assumes of the state at which
    inhibition sets in (:func:`~dmp_cpg_ros.core.contraction.heterogeneity.mismatch_bound`).

    Parameters
    ----------
    found : Synchronisation
        Of the free network.
    rho, radius : float
        Parameters of the oscillators.
    tolerances : tuple of float
        Of places and radii, at which inhibition may set in
        (:func:`~dmp_cpg_ros.core.inhibition.supervisor.entry_tolerances`).

    Returns
    -------
    float
        [rad/s]; 0 when nothing is certified.
    """
    places, radii = tolerances

    def within(delta: float) -> bool:
        bound = mismatch_bound(found, rho, radius, delta)
        return (bound.phase_spread <= LOCKED_PHASE_ERROR and bound.distance <= places
                and bound.smallest_radius >= radius - radii)

    return last_that_holds(within, 0.0, max(found.rate, 0.0), 30)


def contact_limits(network: GaitNetwork, analysis: NetworkAnalysis, span: OperatingRange,
                   region_radius: float, start: float) -> tuple[ContactLimits, Inequality]:
    """Limits of the feedback, and the inequality that they keep.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators, with the share of the margin.
    analysis : NetworkAnalysis
        Of the network.
    span : OperatingRange
        Cadences.
    region_radius : float
        r0 of C.
    start : float
        Bound on the time from a release to phase lock [s].

    Returns
    -------
    limits : ContactLimits
    inequality : Inequality
    """
    p = network.parameters
    margin = contact_margin(analysis.found, p.rho, p.radius,
                            entry_tolerances(network, region_radius))
    own = p.margin_share * margin
    return ContactLimits(own, span.omega[1], start), Inequality(
        'contact_feedback', own, margin, 'rad/s', f'{p.margin_share:.0%} of it',
        'margin for unequal leg frequencies', PROVED,
        'however the feet touch down, the legs stay in their places and near their cycle')


def slowest_cadence(span: OperatingRange, parameters: CanonicalParameters) -> float:
    """Slowest ω, where late feet may hold the phase back [rad/s]."""
    hold = parameters.contact_hold if parameters.contact_feedback else 0.0
    return (1.0 - hold) * span.omega[0]


def later_stop(span: OperatingRange, tick_s: float) -> float:
    """What feedback adds to the bound on the time to rest [s].

    The tick in which a request is on its way may still be shifted, and the stop begins with a leg
    that is as far behind its place as phase lock allows.
    """
    return tick_s + LOCKED_PHASE_ERROR / span.omega_armed[0]
