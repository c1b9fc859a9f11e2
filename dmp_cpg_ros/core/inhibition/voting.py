# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stopping by vote (paper, Section 6): sensors, legs and users in, the inhibition they make out.

Every source asks with weights for legs; a leg's weight α_i is the sum of what is left of its
votes, clamped to [0, α_max]; its oscillator is inhibited with k_inh α_i in its own region C_i. A
few votes slow the oscillators there and no more. Votes that overcome the threshold stop the gait.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.threshold import VoteClamp, holds_at_rest, vote_clamp
from dmp_cpg_ros.core.inhibition.voters import (
    NEVER,
    FootWatch,
    LastGood,
    UpFilter,
    VoteSensors,
    watch_feet,
)
from dmp_cpg_ros.core.inhibition.votes import (
    COLLISION,
    FOOTING,
    NO_VOTES,
    SILENCE,
    TILT,
    Tally,
    Vote,
    VoteMemory,
    acting_gains,
)
from dmp_cpg_ros.core.inhibition.voting_parameters import VoteSourceParameters, VotingParameters
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]

FRESH_NS = 20_000_000
"""Age up to which contacts are compared with the phase of the tick [ns]."""


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
        p, memory = self.sources, state.memory
        last_good = state.last_good.after(sensors)
        feet, lost, hit = self._feet(state.feet, time_ns, network, sensors, x, r, walking)
        silent, blind = last_good.silent(time_ns, round(p.silence_time * 1e9))
        up = state.up.after(sensors)
        tilted = up.tilt > p.tilt_limit and not blind
        for source, legs, weight in (
            (FOOTING, lost, p.footing_weight),
            (COLLISION, hit, p.collision_weight),
            (TILT, np.full(len(LEGS), tilted), p.tilt_weight),
            (SILENCE, silent | blind, p.silence_weight),
        ):
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
        clamp = vote_clamp(network, self.inhibition, self.voting, span)
        return ClampInForce(clamp, omega, omega, rules)

    def _feet(self, feet: FootWatch, time_ns: int, network: GaitNetwork, sensors: VoteSensors,
              x: Array, r: Array, walking: bool
              ) -> tuple[FootWatch, NDArray[np.bool_], NDArray[np.bool_]]:
        load = sensors.foot_force / self._weight
        if time_ns - sensors.contact_ns > FRESH_NS:
            load = np.full(len(LEGS), np.nan)
        speed = network.scale.foot_speed(float(r[0]), float(r[1]), float(r[2]))
        return watch_feet(
            feet, self.sources, time_ns, walking, network.gait.cycle_position(phase(x)),
            network.gait.duty(speed, network.scale), network.omega(r), load)

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
        omega = network.omega(np.zeros(3))
        stops = holds_at_rest(network.system, omega, gains, p.region_radius)
        return Tally(weights, gains, stops, causes)
