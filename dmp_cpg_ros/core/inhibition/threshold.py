# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The threshold that votes must overcome, and the clamp for which it takes a majority.

N rotors that want to turn at ω are held at rest by forces α_i k_inh |x_{i,d} − x_i|, each of which
ends at the edge of its region: the gait stops when the voters' equilibrium lies inside their
regions. With stiff couplings that is Σ k_inh α_i > N ω r / r0, whoever votes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.voting import MajorityClamp, majority_clamp
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.voting_parameters import WINNER_TAKE_ALL, VotingParameters
from dmp_cpg_ros.core.reference.operating_range import OperatingRange

Array = NDArray[np.float64]

ROOM = 2.0
"""Factor over the certified threshold that a computed clamp has at most."""

LEAST_ROOM = 1.1
"""The same factor where fewer votes than the majority suffice too."""


@dataclass(frozen=True)
class VoteClamp:
    """The clamp of one leg's vote, and what it is computed from.

    Attributes
    ----------
    gain : float
        Largest gain of one leg's vote, k_inh α_max [1/s].
    limit : float
        Largest weight α_max.
    window : MajorityClamp
        Gains for which the majority stops the gait and fewer do not.
    """

    gain: float
    limit: float
    window: MajorityClamp


def majority(parameters: VotingParameters) -> int:
    """Number of legs that stop the gait: one alone where the winner takes all."""
    return 1 if parameters.vote_rule == WINNER_TAKE_ALL else parameters.vote_majority


def vote_clamp(network: GaitNetwork, inhibition: InhibitionParameters, voting: VotingParameters,
               span: OperatingRange) -> VoteClamp:
    """Clamp of the votes, from ``vote_limit`` or computed.

    A majority must stop the gait at every cadence at which inhibition is armed; fewer must not
    hold it at any cadence.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators.
    inhibition : InhibitionParameters
        Gain and region.
    voting : VotingParameters
        Rule, majority, limit.
    span : OperatingRange
        Cadences.

    Returns
    -------
    VoteClamp
        The computed clamp is the geometric mean of the window; without a window a little over what
        is certified for the majority, and the whole k_inh where nothing is.
    """
    window = majority_clamp(network.system, span.omega_armed[1], inhibition.region_radius,
                            majority(voting), slowest_omega=span.omega[0])
    k_inh = inhibition.inhibition_gain
    if voting.vote_limit > 0.0 or k_inh == 0.0:
        return VoteClamp(voting.vote_limit * k_inh, voting.vote_limit, window)
    if not np.isfinite(window.lowest):
        return VoteClamp(k_inh, 1.0, window)
    gain = float(np.sqrt(window.lowest * min(window.highest, ROOM**2 * window.lowest)))
    gain = gain if window.possible else LEAST_ROOM * window.lowest
    return VoteClamp(gain, gain / k_inh, window)


def holds_at_rest(system: CanonicalSystem, omega: float, gains: Array,
                  region_radius: float) -> bool:
    """Whether votes overcome the threshold: they can hold the gait at rest.

    Parameters
    ----------
    system : CanonicalSystem
        Oscillators.
    omega : float
        Angular frequency [rad/s].
    gains : ndarray (N,)
        Gains k_inh α_i [1/s].
    region_radius : float
        r0 of the regions C_i.

    Returns
    -------
    bool
        Whether there is a stable equilibrium with every node that acts inside its region; a vote
        whose node would rest outside its own does not act.
    """
    acting = np.asarray(gains, dtype=float)
    while acting.any():
        rest = inhibited_equilibrium(system, omega, acting)
        if rest is None or not rest.slowest_rate > 0.0:
            return False
        outside = (acting > 0.0) & (rest.distance > region_radius)
        if not outside.any():
            return True
        acting = np.where(outside, 0.0, acting)
    return False
