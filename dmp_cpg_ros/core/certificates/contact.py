# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What contact feedback may do without touching the certificate."""

from __future__ import annotations

from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.certificates.network import NetworkAnalysis
from dmp_cpg_ros.core.contraction.finding import PROVED
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation
from dmp_cpg_ros.core.gait.contact_feedback import ContactLimits
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR, entry_tolerances
from dmp_cpg_ros.core.maths.roots import last_that_holds
from dmp_cpg_ros.core.reference.operating_range import OperatingRange


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
