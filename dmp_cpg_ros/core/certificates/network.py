# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a certificate is computed from, and the inequalities of the oscillators: synchronisation,
inhibition, capture, mismatch.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.contraction import inhibited
from dmp_cpg_ros.core.contraction.capture import CaptureSet, capture_set
from dmp_cpg_ros.core.contraction.capture_anywhere import needed_gain_anywhere
from dmp_cpg_ros.core.contraction.delays import (
    Capture,
    Premise,
    asked_premises,
    carried_margin,
    carried_premises,
    held_margin,
    late_margin,
)
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium, inhibited_equilibrium
from dmp_cpg_ros.core.contraction.finding import CONTINUOUS, PROVED
from dmp_cpg_ros.core.contraction.heterogeneity import mismatch_bound, mismatch_margin
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.contraction.inhibited import InhibitedContraction
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation, synchronisation
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.contact_feedback import ContactLimits
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.entry import entry_tolerances, farthest_way, half_arc
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.maths.roots import last_that_holds
from dmp_cpg_ros.core.reference.operating_range import OperatingRange, operating_range
from dmp_cpg_ros.core.suite_parameters import SuiteParameters

EXPECTED_MISMATCH = 0.05
"""Difference of the legs' frequencies that should be tolerated, as a share of the highest."""

EXPECTED_TICKS = 3
"""Ticks that a sample should be allowed to be old: held for one, a tick late, one message lost."""


NETWORK_ROWS = ('synchronisation', 'contraction', 'capture', 'rest_in_region')
"""Names of the required inequalities of the oscillators, in their order."""


@dataclass(frozen=True)
class Setting:
    """What a certificate is computed from.

    Attributes
    ----------
    network : GaitNetwork
        Oscillators, couplings, gait and the robot's scale.
    parameters : SuiteParameters
        Of the other parts: inhibition, reference, legs, posture, voting.
    tick_s : float
        Control tick [s].
    span : OperatingRange
        Speeds and cadences to hold for.
    way : float
        Largest way of the oscillators to where one can be caught, its arc included [rad].
    """

    network: GaitNetwork
    parameters: SuiteParameters
    tick_s: float
    span: OperatingRange
    way: float = 2.0 * math.pi

    @classmethod
    def of(cls, network: GaitNetwork, parameters: SuiteParameters, tick_s: float,
           span: OperatingRange | None = None, way: float | None = None) -> Setting:
        """Setting of running parameters, by default with speeds, cadences and way of the gait.

        Raises
        ------
        ParameterError
            If the tick is not positive and finite.
        """
        if not (np.isfinite(tick_s) and tick_s > 0.0):
            raise ParameterError(f'tick = {tick_s!r} s must be positive and finite')
        return cls(network, parameters, tick_s, span or operating_range(
            network, parameters.inhibition, parameters.reference),
            farthest_way(network, parameters.inhibition) if way is None else way)

    @property
    def alike(self) -> bool:
        """Whether all legs turn at one frequency and only the service stops them."""
        return not (self.parameters.voting.voting or self.network.parameters.contact_feedback)

    @property
    def arc(self) -> float:
        """Arc of the limit cycle that lies in C [rad]."""
        return 2.0 * half_arc(self.parameters.inhibition.region_radius,
                              self.network.parameters.radius)


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
    system : CanonicalSystem
        Its oscillators.
    span : OperatingRange
        Cadences.
    """

    found: Synchronisation
    capture: CaptureSet
    contraction: InhibitedContraction
    system: CanonicalSystem
    span: OperatingRange

    @cached_property
    def rest(self) -> InhibitedEquilibrium | None:
        """Equilibrium at zero reference."""
        return inhibited_equilibrium(self.system, self.span.omega_at_rest, self.capture.gains)

    @cached_property
    def rest_at_speed(self) -> InhibitedEquilibrium | None:
        """Equilibrium at the highest cadence, which grows out of that at zero reference."""
        at_rest, fastest = self.span.omega_at_rest, self.span.omega[1]
        return None if self.rest is None else inhibited_equilibrium(
            self.system, fastest, self.capture.gains, self.rest.state, at_rest / fastest)


def free_synchronisation(network: GaitNetwork) -> Synchronisation:
    """Theorem 4 for the oscillators of a gait without inhibition."""
    everywhere = float(growth(network.parameters.rho, network.parameters.radius))
    return synchronisation(network.system.graph, everywhere)


def analyse_network(network: GaitNetwork, inhibition: InhibitionParameters,
                    span: OperatingRange, found: Synchronisation | None = None
                    ) -> NetworkAnalysis:
    """Apply the theorems to the network of a gait at the cadences of a range; Theorem 4 may have
    been applied already.
    """
    system = network.system
    # A gain of zero holds nothing; the smallest positive one says so in numbers.
    acting = replace(
        inhibition, inhibition_gain=max(inhibition.inhibition_gain, 1e-9)).armed_gains
    capture = capture_set(system, span.omega[1], acting, inhibition.region_radius)
    return NetworkAnalysis(found or free_synchronisation(network), capture,
                           inhibited.inhibited_contraction(system, capture), system, span)


def network_inequalities(s: Setting, analysis: NetworkAnalysis) -> Iterator[Inequality]:
    """Required inequalities of the oscillators: (a), (b) and (c); those that cost least first."""
    found = analysis.found
    yield Inequality('synchronisation', found.growth, found.connectivity, '1/s', 'rho r^2',
                     'connectivity of L_K', CONTINUOUS,
                     f'from every state the legs find their places, at {found.rate:.4g} 1/s '
                     f'({found.method} bound)')
    yield _contraction(analysis.contraction)
    yield from _capture(s, analysis)


def mismatch_inequality(s: Setting, found: Synchronisation) -> Inequality:
    """Inequality (g) of a setting."""
    p = s.network.parameters
    margin = mismatch_margin(s.network.system.graph, found, p.rho, p.radius,
                             LOCKED_PHASE_ERROR)
    return Inequality('frequency_mismatch', EXPECTED_MISMATCH * s.span.omega[1], margin, 'rad/s',
                      f'{EXPECTED_MISMATCH:.0%} of omega_max', 'tolerated mismatch', CONTINUOUS,
                      f'legs whose own frequencies differ stay within {LOCKED_PHASE_ERROR:g} rad '
                      'of their places', required=False)


def armed_capture(s: Setting, analysis: NetworkAnalysis, contact: ContactLimits | None) -> Capture:
    """Capture at the cadences at which inhibition is armed, for its delays; contact feedback may
    add to the frequency of a leg.
    """
    r0 = s.parameters.inhibition.region_radius
    omega = s.span.omega_armed[1] + (contact.own if contact else 0.0)
    return Capture(s.network.system, omega, analysis.capture.gains, r0,
                   *entry_tolerances(s.network, r0))


def split_premises(s: Setting, contact: ContactLimits | None
                   ) -> tuple[list[Premise], list[Premise]]:
    """Premises of ``carried_coupling`` where couplings are split over nodes: those that follow
    from parameters, and those that the suite's gate does not keep, because it splits none.
    """
    capture = armed_capture(s, analyse_network(s.network, s.parameters.inhibition, s.span),
                            contact)
    return carried_premises(capture), asked_premises(capture, EXPECTED_TICKS * s.tick_s)


def _contraction(found: InhibitedContraction) -> Inequality:
    left_is = 'rho r^2' if found.reach == inhibited.GLOBAL else 'growth on the capture set'
    where = {inhibited.GLOBAL: 'from every state', inhibited.NONE: 'and comes to rest'}.get(
        found.reach, 'inside the capture set, which leaves the origin out')
    if found.reach != inhibited.NONE:
        where += f' ({found.reach} grade), at {found.rate:.4g} 1/s'
    return Inequality('contraction', found.growth, found.inhibition_rate, '1/s', left_is,
                      'connectivity of L_K + k_inh E', CONTINUOUS,
                      f'the inhibited network contracts {where}')


def _capture(s: Setting, analysis: NetworkAnalysis) -> Iterator[Inequality]:
    """Inequalities (c): C is not left again by those in their places."""
    p, span = s.parameters.inhibition, s.span
    held, gain, r0 = analysis.capture.gains > 0.0, p.inhibition_gain, p.region_radius
    needed = float(analysis.capture.needed_gain[held].max())
    cadence = f'at the highest cadence, {span.omega[1]:.4g} rad/s'
    yield Inequality('capture', needed, gain, '1/s', 'N omega r/r0 made exact', 'k_inh',
                     CONTINUOUS,
                     f'legs that enter C in their places cannot leave it again, {cadence}')
    rest = analysis.rest_at_speed
    distance = float('inf') if rest is None or not rest.slowest_rate > 0.0 else float(
        rest.distance[held].max())
    exists = '' if np.isfinite(distance) else '; there is none, the other legs break free'
    yield Inequality('rest_in_region', distance, r0, '', '|x_1* - x_d|', 'r0', PROVED,
                     f'the inhibited equilibrium lies inside C, {cadence}{exists}')


def capture_anywhere(s: Setting, analysis: NetworkAnalysis) -> Inequality:
    """Inequality (c) for legs that are out of their places: C is not left again by anyone."""
    p, system = s.parameters.inhibition, s.network.system
    held = analysis.capture.gains > 0.0
    # The legs' oscillators are alike: only how many act on them makes a difference.
    heard = np.bincount([node for node, _ in system.graph.edges], minlength=len(held))
    different = np.flatnonzero(held)[np.unique(heard[held], return_index=True)[1]]
    needed = max(needed_gain_anywhere(system, s.span.omega[1], int(node), p.region_radius)
                 for node in different)
    return Inequality('capture_anywhere', needed, p.inhibition_gain, '1/s',
                      'gain for any |x_j| <= r', 'k_inh', CONTINUOUS,
                      'C cannot be left even while the other legs are out of place',
                      required=False)


def contact_margin(s: Setting, found: Synchronisation) -> float:
    """Largest δ for which frequencies in [ω − δ, ω + δ] leave walking and stopping as certified.

    For all times after the legs were in their places, their phases stay within the error that
    phase lock allows, and places and radii within what capture assumes of the state at which
    inhibition sets in (:func:`~dmp_cpg_ros.core.contraction.heterogeneity.mismatch_bound`).

    Parameters
    ----------
    s : Setting
        Oscillators and region.
    found : Synchronisation
        Of the free network.

    Returns
    -------
    float
        [rad/s]; 0 when nothing is certified.
    """
    rho, radius = s.network.parameters.rho, s.network.parameters.radius
    places, radii = entry_tolerances(s.network, s.parameters.inhibition.region_radius)

    def within(delta: float) -> bool:
        bound = mismatch_bound(found, rho, radius, delta)
        return (bound.phase_spread <= LOCKED_PHASE_ERROR and bound.distance <= places
                and bound.smallest_radius >= radius - radii)

    return last_that_holds(within, 0.0, max(found.rate, 0.0), 30)


def contact_limits(s: Setting, found: Synchronisation, start: float
                   ) -> tuple[ContactLimits, Inequality]:
    """Limits of the feedback and the inequality that they keep, with a bound on the time from a
    release to phase lock [s].
    """
    share, margin = s.network.parameters.margin_share, contact_margin(s, found)
    return ContactLimits(share * margin, s.span.omega[1], start), Inequality(
        'contact_feedback', share * margin, margin, 'rad/s', f'{share:.0%} of it',
        'margin for unequal leg frequencies', CONTINUOUS,
        'however the feet touch down, the legs stay in their places and near their cycle')


def delay_inequalities(capture: Capture, tick_s: float) -> list[Inequality]:
    """Inequalities (j): delays, held samples and lost messages against what capture bears.

    Parameters
    ----------
    capture : Capture
        Of the suite, at the fastest cadence at which inhibition is armed.
    tick_s : float
        Control tick [s].

    Returns
    -------
    list of Inequality
        None is required: in the suite one node has all oscillators and switches inhibition.
    """
    age = EXPECTED_TICKS * tick_s
    slower = 1.0 + age * float(capture.coupling.sum(axis=1).max())

    def row(name: str, margin: float, what: str, how: str) -> Inequality:
        late = 'any number of' if math.isinf(margin) else max(0, math.floor(margin / tick_s) - 1)
        return Inequality(name, age, margin, 's', 'held, late, one lost', what, CONTINUOUS,
                          f'{how}, {late} ticks late or messages lost', required=False)

    return [
        row('late_inhibition', late_margin(capture), 'time to cross C',
            'inhibition captures as it does at once when it acts'),
        row('held_coupling', held_margin(capture), 'age of states',
            "with an oscillator per node that holds the others' states "
            f'(at {slower:.3g} times the period) capture would bear'),
        row('carried_coupling', carried_margin(capture), 'age of states',
            'with states that are carried on by the flow of the gait, at its pace, it would bear')]
