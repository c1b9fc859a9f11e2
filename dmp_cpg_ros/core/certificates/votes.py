# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Inequalities of stopping by vote: a majority suffices, whoever votes, and fewer do not.

At the clamp each of m voters is inhibited with the gain k_inh α_max. For every set of m the
network must contract, λ_min(L_K + k_inh α_max E_m) > ρ r² or the regional grade, capture must hold
at every cadence at which inhibition is armed, and rest must be near; for every set of m − 1 there
must be no rest inside the regions at any cadence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.certificates.timing import time_to_rest
from dmp_cpg_ros.core.contraction.capture import capture_set
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.finding import PROVED, SAMPLED
from dmp_cpg_ros.core.contraction.inhibited import (
    GLOBAL,
    NONE,
    InhibitedContraction,
    inhibited_contraction,
)
from dmp_cpg_ros.core.contraction.voting import (
    certified_threshold,
    different_voters,
    rest_threshold,
)
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.voting import VoteClamp, majority, vote_clamp
from dmp_cpg_ros.core.inhibition.voting_parameters import VotingParameters
from dmp_cpg_ros.core.reference.operating_range import OperatingRange
from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]

LONGEST_STOP = 10.0
"""Time within which a stop by votes must be bounded [s]."""


@dataclass(frozen=True)
class VotesNeeded:
    """How many legs can stop the gait.

    Attributes
    ----------
    clamp : VoteClamp
        Largest vote of one leg.
    enough : tuple of float
        Gain from which any 1, 2, … N votes stop the gait for certain [1/s]; infinite: none does.
    too_weak : tuple of float
        Gain below which no 1, 2, … N votes can hold it [1/s].
    """

    clamp: VoteClamp
    enough: tuple[float, ...]
    too_weak: tuple[float, ...]

    @property
    def certain(self) -> int | None:
        """Smallest number of full votes that stop the gait for certain; None when no number."""
        counts = [m + 1 for m, gain in enumerate(self.enough) if self.clamp.gain > gain]
        return min(counts, default=None)

    @property
    def powerless(self) -> int:
        """Largest number of full votes that cannot hold the gait, whoever casts them."""
        weak = [self.clamp.gain < gain for gain in self.too_weak]
        return weak.index(False) if False in weak else len(weak)


def votes_needed(network: GaitNetwork, inhibition: InhibitionParameters, voting: VotingParameters,
                 span: OperatingRange) -> VotesNeeded:
    """Find out how many legs can stop the gait.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators.
    inhibition : InhibitionParameters
        Gain and region.
    voting : VotingParameters
        Rule, majority, clamp.
    span : OperatingRange
        Cadences.

    Returns
    -------
    VotesNeeded
    """
    system, r0, counts = network.system, inhibition.region_radius, range(1, len(LEGS) + 1)
    return VotesNeeded(
        vote_clamp(network, inhibition, voting, span),
        tuple(max(certified_threshold(system, span.omega_armed[1], voters, r0)
                  for voters in different_voters(system, count)) for count in counts),
        tuple(min(rest_threshold(system, span.omega[0], voters, r0)
                  for voters in different_voters(system, count)) for count in counts))


def vote_bound(network: GaitNetwork, gains: Array, region_radius: float, span: OperatingRange,
               alpha_r: float, activity_rate: float, tick_s: float) -> float:
    """Bound on the time from the vote that stops the gait to rest.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators.
    gains : ndarray (4,)
        Gains k_inh α_i [1/s].
    region_radius : float
        r0 of the regions.
    span : OperatingRange
        Speeds and cadences.
    alpha_r, activity_rate : float
        Rates of the reference and of the swings' activity [1/s].
    tick_s : float
        Control tick [s].

    Returns
    -------
    float
        [s], for legs that are in their places; infinite without a certificate.
    """
    capture = capture_set(network.system, span.omega_armed[1], gains, region_radius)
    if inhibited_contraction(network.system, capture).reach == NONE:
        return math.inf
    rest = inhibited_equilibrium(network.system, span.omega_at_rest, gains)
    return time_to_rest(network, capture, rest, span, alpha_r, activity_rate, region_radius,
                        tick_s)


def vote_inequalities(network: GaitNetwork, inhibition: InhibitionParameters,
                      voting: VotingParameters, span: OperatingRange, alpha_r: float,
                      activity_rate: float, tick_s: float) -> list[Inequality]:
    """Inequalities of voting; none when there is no voting.

    Parameters
    ----------
    network, inhibition, voting, span
        As of :func:`votes_needed`.
    alpha_r, activity_rate, tick_s : float
        As of :func:`vote_bound`.

    Returns
    -------
    list of Inequality
        All required: who lets legs vote relies on them.
    """
    if not voting.voting:
        return []
    clamp, count = vote_clamp(network, inhibition, voting, span), majority(voting)
    system, r0 = network.system, inhibition.region_radius
    worst: InhibitedContraction | None = None
    needed = bound = 0.0
    for voters in different_voters(system, count):
        gains = np.zeros(system.graph.size)
        gains[list(voters)] = max(clamp.gain, 1e-9)
        capture = capture_set(system, span.omega_armed[1], gains, r0)
        needed = max(needed, float(np.nanmax(capture.needed_gain)))
        found = inhibited_contraction(system, capture)
        worst = found if worst is None or found.rate < worst.rate else worst
        bound = max(bound, vote_bound(network, gains, r0, span, alpha_r, activity_rate, tick_s))
    assert worst is not None
    return _rows(clamp, count, worst, needed, bound)


def _rows(clamp: VoteClamp, count: int, worst: InhibitedContraction, needed: float,
          bound: float) -> list[Inequality]:
    who = 'any leg alone' if count == 1 else f'any {count} legs'
    where = 'from every state' if worst.reach == GLOBAL else 'on the capture set'
    fewer = {1: 'without a vote nothing stops', 2: 'one leg alone cannot stop'}.get(
        count, f'{count - 1} legs cannot stop')
    return [
        Inequality('votes_contraction', worst.growth, worst.inhibition_rate, '1/s',
                   'rho r^2' if worst.reach == GLOBAL else 'growth on the capture set',
                   f'connectivity of L_K + k_inh alpha E_{count}', PROVED,
                   f'the network contracts {where} under the votes of {who}'),
        Inequality('votes_suffice', needed, clamp.gain, '1/s', f'capture by {count}',
                   'k_inh alpha_max', PROVED,
                   f'{who} can stop the gait, with weights of {clamp.limit:.4g}'),
        # There may be equilibria that do not grow out of the one without rotation.
        Inequality('votes_needed', clamp.gain, clamp.window.highest, '1/s', 'k_inh alpha_max',
                   f'rest held by {count - 1}', SAMPLED, f'{fewer} the gait'),
        Inequality('votes_time_to_rest', bound, LONGEST_STOP, 's', 'bound', 'longest stop',
                   PROVED, 'from the vote that stops the locked gait to rest')]
