# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stopping by vote (paper, Section 6): sensors, legs and users in, the inhibition they make out.

Every source asks with weights for legs; a leg's weight α_i is the sum of what is left of its
votes, clamped to [0, α_max]; its oscillator is inhibited with k_inh α_i in its own region C_i. A
few votes slow the oscillators there and no more. Votes that overcome the threshold stop the gait:
N rotors that want to turn at ω are held at rest by forces α_i k_inh |x_{i,d} − x_i|, each of which
ends at the edge of its region, so that the voters' equilibrium must lie inside their regions. With
stiff couplings that is Σ k_inh α_i > N ω r / r0, whoever votes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.canonical.system import MOST_KEPT, CanonicalSystem
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.gait.network import (
    CanonicalParameters,
    GaitNetwork,
    at_own_cadence,
    network_system,
)
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import OperatingRange, operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.voting import voters
from dmp_cpg_ros.core.voting.parameters import (
    WINNER_TAKE_ALL,
    VoteSourceParameters,
    VotingParameters,
)
from dmp_cpg_ros.core.voting.thresholds import MajorityClamp, majority_clamp
from dmp_cpg_ros.core.voting.voters import NEVER, FootWatch, LastGood, UpFilter, VoteSensors
from dmp_cpg_ros.core.voting.votes import NO_VOTES, OWN_SOURCES, Tally, Vote, VoteMemory

FRESH_NS = 20_000_000
"""Age up to which contacts are compared with the phase of the tick [ns]."""

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
    window = _window(at_own_cadence(network.parameters), span.omega_armed[1],
                     inhibition.region_radius, voting.majority, span.omega[0])
    k_inh = inhibition.inhibition_gain
    if voting.vote_limit > 0.0 or k_inh == 0.0:
        return VoteClamp(voting.vote_limit * k_inh, voting.vote_limit, window)
    if not np.isfinite(window.lowest):
        return VoteClamp(k_inh, 1.0, window)
    gain = float(np.sqrt(window.lowest * min(window.highest, ROOM**2 * window.lowest)))
    gain = gain if window.possible else LEAST_ROOM * window.lowest
    return VoteClamp(gain, gain / k_inh, window)


@lru_cache(maxsize=MOST_KEPT)
def _window(parameters: CanonicalParameters, *of: Any) -> MajorityClamp:
    """Window of every gait: in locked coordinates offsets are in nothing that it depends on."""
    return majority_clamp(network_system(parameters, np.zeros(len(LEGS))), *of)


def holds_at_rest(network: GaitNetwork, gains: Array, region_radius: float) -> bool:
    """Whether votes overcome the threshold: they can hold the gait at rest, at the cadence that
    acts and at the one that it is on its way to.

    Parameters
    ----------
    network : GaitNetwork
        Oscillators that act.
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
    acting, wanted = network.gait.cadence_scale, network.parameters.cadence_scale
    omega = network.omega(np.zeros(3)) * max(1.0, wanted / acting)
    return _holds(network.system, omega, tuple(gains.tolist()), region_radius)


@lru_cache(maxsize=MOST_KEPT)
def _holds(system: CanonicalSystem, omega: float, gains: tuple[float, ...],
           region_radius: float) -> bool:
    acting = np.array(gains)
    while acting.any():
        rest = inhibited_equilibrium(system, omega, acting)
        if rest is None or not rest.slowest_rate > 0.0:
            return False
        inside = np.where(rest.distance > region_radius, 0.0, acting)
        if np.array_equal(inside, acting):
            return True
        acting = inside
    return False


def acting_gains(weights: Array, inhibition_gain: float, rule: str) -> Array:
    """Gains that the weights make act.

    Parameters
    ----------
    weights : ndarray (N,)
        Clamped weights α_i.
    inhibition_gain : float
        k_inh [1/s].
    rule : str
        ``sum``: every leg's vote acts on its own oscillator. ``winner_take_all``: the largest
        alone gets its gain, the first of equal ones (the stable state of a winner-take-all
        network; Rutishauser, Douglas and Slotine 2010).

    Returns
    -------
    ndarray (N,)
        [1/s]
    """
    gains: Array = inhibition_gain * weights
    largest = np.arange(len(gains)) == np.argmax(gains)
    return np.where(largest, gains, 0.0) if rule == WINNER_TAKE_ALL else gains


@dataclass(frozen=True)
class ClampInForce:
    """Clamp of the weights for the oscillators that act.

    Attributes
    ----------
    clamp : VoteClamp
        As computed.
    computed_at : float
        Cadence at zero reference for which it was computed [rad/s].
    omega : float
        The same at this tick [rad/s].
    rules : tuple
        Parameters that it was computed with.
    """

    clamp: VoteClamp
    computed_at: float
    omega: float
    rules: tuple[object, ...]

    @property
    def limit(self) -> float:
        """Largest weight at this tick; it follows the cadence as the threshold does."""
        return self.clamp.limit * (self.omega / self.computed_at)


@dataclass(frozen=True)
class VotingState:
    """What voting remembers from tick to tick.

    Attributes
    ----------
    time_ns : int
        Stamp of the tick [ns]; −1 before the first.
    memory : VoteMemory
        Votes of all sources.
    feet : FootWatch
        What the feet have felt.
    last_good : LastGood
        When sensors last said something good.
    up : UpFilter
        Which way is up, by the IMU.
    clamp : ClampInForce or None
        Clamp of the weights; None without voting.
    tally : Tally
        Result; the same object as long as no vote changes.
    """

    time_ns: int = NEVER
    memory: VoteMemory = VoteMemory()
    feet: FootWatch = FootWatch()
    last_good: LastGood = LastGood.at(0)
    up: UpFilter = UpFilter()
    clamp: ClampInForce | None = None
    tally: Tally = NO_VOTES


class Voting:
    """Counts votes; state in, state out. With ``voting`` off it counts nothing.

    Parameters
    ----------
    inhibition : InhibitionParameters
        Gain and region.
    voting : VotingParameters
        How votes are counted.
    sources : VoteSourceParameters
        What makes the legs vote.
    reference : ReferenceParameters
        Limits of the commands: they decide the cadences.
    weight : float
        Weight m g of the robot [N].
    """

    def __init__(self, inhibition: InhibitionParameters, voting: VotingParameters,
                 sources: VoteSourceParameters, reference: ReferenceParameters, weight: float
                 ) -> None:
        """Keep the parts."""
        self.inhibition, self.voting, self.sources = inhibition, voting, sources
        self.reference, self._weight = reference, weight

    def initial_state(self, network: GaitNetwork) -> VotingState:
        """Nobody has voted; the clamp, which takes a while, is computed here for a first gait."""
        return VotingState(clamp=self._clamp(None, network) if self.voting.voting else None)

    def step(self, state: VotingState, time_ns: int, network: GaitNetwork, sensors: VoteSensors,
             x: Array, r: Array, walking: bool, votes: tuple[Vote, ...] = ()) -> VotingState:
        """Count the votes of one tick.

        Parameters
        ----------
        state : VotingState
            After the tick before.
        time_ns : int
            Stamp of this tick [ns]; sensors have their time from the first on, and from one that
            is earlier than the last.
        network : GaitNetwork
            The oscillators that act, with their gait.
        sensors : VoteSensors
            Newest readings.
        x : ndarray (4, 2)
            Canonical states.
        r : ndarray (3,)
            Reference.
        walking : bool
            Whether the gait runs.
        votes : tuple of Vote
            From outside, since the tick before.

        Returns
        -------
        VotingState
        """
        if not self.voting.voting:
            return state
        if state.time_ns == NEVER or time_ns < state.time_ns:
            state = VotingState(last_good=LastGood.at(time_ns), clamp=state.clamp)
        p, memory, gait = self.sources, state.memory, network.gait
        last_good, up = state.last_good.after(sensors), state.up.after(sensors)
        fresh = time_ns - sensors.contact_ns <= FRESH_NS
        speed = network.scale.foot_speed(*r.tolist())
        feet, lost, hit = voters.watch_feet(
            state.feet, p, time_ns, walking, gait.cycle_position(phase(x)),
            gait.duty(speed, network.scale), network.omega(r),
            sensors.foot_force / self._weight if fresh else np.full(len(LEGS), np.nan))
        silent, blind = last_good.silent(time_ns, round(p.silence_time * 1e9))
        tilted = np.full(len(LEGS), up.tilt > p.tilt_limit and not blind)
        asking = lost, hit, tilted, silent | blind
        weights_of = p.footing_weight, p.collision_weight, p.tilt_weight, p.silence_weight
        for source, legs, weight in zip(OWN_SOURCES, asking, weights_of, strict=True):
            if weight > 0.0 and legs.any():
                memory = memory.heard(source, np.where(legs, weight, np.nan), time_ns)
        for voter, weights in votes:
            memory = memory.heard(voter, weights, time_ns)
        fade_ns = round(self.voting.vote_fade * 1e9)
        memory = memory.alive(time_ns, fade_ns) if memory.asks else memory
        clamp = self._clamp(state.clamp, network)
        tally = self._count(state.tally, memory, time_ns, fade_ns, network, clamp.limit)
        return VotingState(time_ns, memory, feet, last_good, up, clamp, tally)

    def _clamp(self, before: ClampInForce | None, network: GaitNetwork) -> ClampInForce:
        """Clamp at this tick, computed anew for new parameters and for a gait that has come to
        stay.
        """
        omega = network.omega(np.zeros(3))
        rules = (self.inhibition, self.voting, network.parameters, self.reference)
        if before is not None and before.rules == rules and (
                omega != before.omega or omega == before.computed_at):
            return replace(before, omega=omega)
        span = operating_range(network, self.inhibition, self.reference)
        return ClampInForce(
            vote_clamp(network, self.inhibition, self.voting, span), omega, omega, rules)

    def _count(self, before: Tally, memory: VoteMemory, time_ns: int, fade_ns: int,
               network: GaitNetwork, limit: float) -> Tally:
        """Count; the threshold is computed only when a weight has changed."""
        if not memory.asks:
            return NO_VOTES
        p = self.inhibition
        weights = np.minimum(memory.weights(time_ns, fade_ns), limit)
        causes = memory.causes(time_ns, fade_ns)
        if np.array_equal(weights, before.weights):
            return before if causes == before.causes else replace(before, causes=causes)
        gains = acting_gains(weights, p.inhibition_gain, self.voting.vote_rule)
        stops = holds_at_rest(network, gains, p.region_radius)
        return Tally(weights, gains, stops, causes)
