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
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.timing import LONGEST_STOP, time_to_rest
from dmp_cpg_ros.core.contraction import inhibited
from dmp_cpg_ros.core.contraction.capture import capture_set
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.finding import CONTINUOUS, SAMPLED
from dmp_cpg_ros.core.contraction.voting import different_voters, shared_capture
from dmp_cpg_ros.core.gait.network import GaitNetwork, at_own_cadence
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.reference.operating_range import OperatingRange
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.voting.parameters import VotingParameters
from dmp_cpg_ros.core.voting.thresholds import enough_for_all, too_weak_for_all, votes_of
from dmp_cpg_ros.core.voting.voting import VoteClamp, vote_clamp

VOTE_ROWS = ('votes_contraction', 'votes_suffice', 'votes_needed', 'votes_time_to_rest')
"""Names of the inequalities of voting, in their order."""


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
    """Find out how many legs can stop the gait, at the cadences of a range."""
    system, r0 = network.system, inhibition.region_radius
    voters = [different_voters(system, count) for count in range(1, len(LEGS) + 1)]
    return VotesNeeded(
        vote_clamp(network, inhibition, voting, span),
        tuple(enough_for_all(system, span.omega_armed[1], sets, r0) for sets in voters),
        tuple(too_weak_for_all(system, span.omega[0], sets, r0) for sets in voters))


def vote_bound(s: Setting, gains: Array) -> float:
    """Bound on the time from the vote that stops the gait to rest.

    Parameters
    ----------
    s : Setting
        What runs.
    gains : ndarray (4,)
        Gains k_inh α_i [1/s].

    Returns
    -------
    float
        [s], for legs that are in their places; infinite without a certificate.
    """
    return _under(s, s.network.system, gains)[2]


def _under(s: Setting, system: CanonicalSystem, gains: Array
           ) -> tuple[float, inhibited.InhibitedContraction, float]:
    """Gain that capture needs, contraction, and bound on the time to rest under some votes."""
    s = replace_unchecked(s, way=2.0 * math.pi)                   # votes wait for fl's phase 0
    omega, r0 = s.span.omega_armed[1], s.parameters.inhibition.region_radius
    capture = shared_capture(system, omega, capture_set(system, omega, gains, r0), r0)
    found = inhibited.inhibited_contraction(system, capture)
    bound = math.inf if found.reach == inhibited.NONE else time_to_rest(
        s, capture, inhibited_equilibrium(system, s.span.omega_at_rest, gains))
    return float(np.nanmax(capture.needed_gain)), found, bound


@dataclass(frozen=True)
class _Asked:
    """A setting, and all of it that the rows of votes depend on: legs in their places are alike in
    all gaits, and who votes has nothing to do with whom the service inhibits.
    """

    of: tuple[object, ...]
    setting: Setting = field(compare=False)


def vote_inequalities(s: Setting) -> list[Inequality]:
    """Inequalities of voting, for whoever votes; none when there is no voting. All are required:
    who lets legs vote relies on them.
    """
    p, inhibition = s.parameters, replace(s.parameters.inhibition, inhibited_legs=LEGS)
    return [] if not p.voting.voting else list(_rows(_Asked(
        (at_own_cadence(s.network.parameters), inhibition, p.voting, p.reference,
         p.leg, s.tick_s, s.span), s)))


@lru_cache(maxsize=32)
def _rows(asked: _Asked) -> tuple[Inequality, ...]:
    s = asked.setting
    p, voting = s.parameters.inhibition, s.parameters.voting
    clamp, count = vote_clamp(s.network, p, voting, s.span), voting.majority
    system = clamp.window.system
    acting = max(clamp.gain, 1e-9)
    needed, found, bounds = zip(*(_under(s, system, votes_of(system, voters, acting))
                                  for voters in different_voters(system, count)), strict=True)
    worst = min(found, key=lambda contraction: contraction.rate)
    who = 'any leg alone' if count == 1 else f'any {count} legs'
    where, left_is = ('from every state', 'rho r^2') if worst.reach == inhibited.GLOBAL else (
        'on the capture set', 'growth on the capture set')
    fewer = {1: 'without a vote nothing stops', 2: 'one leg alone cannot stop'}.get(
        count, f'{count - 1} legs cannot stop')
    return (
        Inequality('votes_contraction', worst.growth, worst.inhibition_rate, '1/s', left_is,
                   f'connectivity of L_K + k_inh alpha E_{count}', CONTINUOUS,
                   f'the network contracts {where} under the votes of {who}'),
        Inequality('votes_suffice', max(needed), clamp.gain, '1/s', f'capture by {count}',
                   'k_inh alpha_max', CONTINUOUS,
                   f'{who} can stop the gait, with weights of {clamp.limit:.4g}'),
        # There may be equilibria that do not grow out of the one without rotation.
        Inequality('votes_needed', clamp.gain, clamp.window.highest, '1/s', 'k_inh alpha_max',
                   f'rest held by {count - 1}', SAMPLED, f'{fewer} the gait'),
        Inequality('votes_time_to_rest', max(bounds), LONGEST_STOP, 's', 'bound', 'longest stop',
                   CONTINUOUS, 'from the vote that stops the locked gait to rest'))
