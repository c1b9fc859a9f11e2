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
from dmp_cpg_ros.core.canonical.voting_parameters import VoteSourceParameters
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.ballot import NO_VOTES, Ballot, acting_gains
from dmp_cpg_ros.core.inhibition.threshold import VoteClamp, holds_at_rest, vote_clamp
from dmp_cpg_ros.core.inhibition.up_direction import UpDirection
from dmp_cpg_ros.core.inhibition.vote_box import COLLISION, FOOTING, SILENCE, TILT, Vote
from dmp_cpg_ros.core.inhibition.vote_memory import VoteMemory
from dmp_cpg_ros.core.inhibition.voting_contact import ContactState, judge_contact
from dmp_cpg_ros.core.inhibition.voting_sensors import LastGood, VoteSensors
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]

FRESH_NS = 20_000_000
"""Age up to which contacts are compared with the phase of the tick [ns]."""


@dataclass(frozen=True)
class VotingState:
    """What voting remembers from tick to tick.

    Attributes
    ----------
    time_ns : int
        Stamp of the tick [ns].
    memory : VoteMemory
        Votes of all sources.
    contact : ContactState
        What the feet have felt.
    last_good : LastGood
        When sensors last said something good.
    up : UpDirection
        Which way is up, by the IMU.
    ballot : Ballot
        Result; the same object as long as no vote changes.
    """

    time_ns: int
    memory: VoteMemory
    contact: ContactState
    last_good: LastGood
    up: UpDirection
    ballot: Ballot = NO_VOTES


class Voting:
    """Counts votes; state in, state out.

    Parameters
    ----------
    inhibition : InhibitionParameters
        How votes are counted.
    sources : VoteSourceParameters
        What makes the legs vote.
    network : GaitNetwork
        The oscillators that are inhibited; those that act may be set before each step.
    reference : ReferenceParameters
        Limits of the commands: they decide the cadences.
    weight : float
        Weight m g of the robot [N].
    """

    def __init__(self, inhibition: InhibitionParameters, sources: VoteSourceParameters,
                 network: GaitNetwork, reference: ReferenceParameters, weight: float) -> None:
        """Compute the clamp."""
        self.inhibition, self.sources, self.network = inhibition, sources, network
        self.reference, self._weight = reference, weight
        self._omega = self._clamped_omega = float('nan')
        self._rules: tuple[object, ...] = ()
        self.clamp: VoteClamp
        self._limit()

    def initial_state(self, time_ns: int = 0) -> VotingState:
        """Nobody has voted; sensors have their time from here on."""
        return VotingState(time_ns, VoteMemory(), ContactState.initial(), LastGood.at(time_ns),
                           UpDirection.upright())

    def step(self, state: VotingState | None, time_ns: int, sensors: VoteSensors,
             x: Array, r: Array, walking: bool, votes: tuple[Vote, ...] = ()) -> VotingState:
        """Advance by one tick.

        Parameters
        ----------
        state : VotingState or None
            After the tick before; None at the first.
        time_ns : int
            Stamp of this tick [ns].
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
        if state is None or time_ns < state.time_ns:
            state = self.initial_state(time_ns)
        p, memory = self.sources, state.memory
        last_good = state.last_good.after(sensors)
        contact, lost, hit = self._contact(state.contact, time_ns, sensors, x, r, walking)
        silent, blind = last_good.silent(time_ns, round(p.silence_time * 1e9))
        up = state.up if not sensors.imu_is_good else state.up.after(
            sensors.rate_in_base, sensors.specific_force_in_base, sensors.imu_ns)
        tilted = up.tilt > p.tilt_limit and not blind
        for source, legs, weight in (
            (FOOTING, lost, p.footing_weight),
            (COLLISION, hit, p.collision_weight),
            (TILT, np.full(len(LEGS), tilted), p.tilt_weight),
            (SILENCE, silent | blind, p.silence_weight),
        ):
            if weight > 0.0 and legs.any():
                memory = memory.heard(source, np.where(legs, weight, np.nan).tolist(), time_ns)
        for voter, weights in votes:
            memory = memory.heard(voter, weights, time_ns)
        fade_ns = round(self.inhibition.vote_fade * 1e9)
        memory = memory.alive(time_ns, fade_ns) if memory.asks else memory
        ballot = self._count(state.ballot, memory, time_ns, fade_ns, self._limit())
        return VotingState(time_ns, memory, contact, last_good, up, ballot)

    def follow(self, inhibition: InhibitionParameters, reference: ReferenceParameters,
               sources: VoteSourceParameters) -> None:
        """Take over parameters that have changed; they act from the next step on."""
        self.inhibition, self.reference, self.sources = inhibition, reference, sources

    def _limit(self) -> float:
        """Clamp of the weights for the oscillators that act.

        It is computed anew for new parameters and for a gait that has come to stay; in between it
        follows the cadence, as the threshold of stiff couplings does.
        """
        omega = self.network.omega(np.zeros(3))
        stays, self._omega = omega == self._omega, omega
        rules = (self.inhibition, self.network.parameters, self.reference)
        if rules != self._rules or (stays and omega != self._clamped_omega):
            self._rules, self._clamped_omega = rules, omega
            self.clamp = vote_clamp(self.network, self.inhibition, operating_range(
                self.network, self.inhibition, self.reference))
        return self.clamp.limit * (omega / self._clamped_omega)

    def _contact(self, contact: ContactState, time_ns: int, sensors: VoteSensors, x: Array,
                 r: Array, walking: bool
                 ) -> tuple[ContactState, NDArray[np.bool_], NDArray[np.bool_]]:
        network, load = self.network, sensors.foot_force / self._weight
        if time_ns - sensors.contact_ns > FRESH_NS:
            load = np.full(len(LEGS), np.nan)
        speed = network.scale.foot_speed(float(r[0]), float(r[1]), float(r[2]))
        return judge_contact(
            contact, self.sources, time_ns, walking, network.gait.cycle_position(phase(x)),
            network.gait.duty(speed, network.scale), network.omega(r), load)

    def _count(self, before: Ballot, memory: VoteMemory, time_ns: int, fade_ns: int,
               limit: float) -> Ballot:
        """Count; the threshold is computed only when a weight has changed."""
        if not memory.asks:
            return NO_VOTES
        p = self.inhibition
        weights = np.minimum(memory.weights(time_ns, fade_ns), limit)
        causes = memory.causes(time_ns, fade_ns)
        if np.array_equal(weights, before.weights):
            return before if causes == before.causes else replace(before, causes=causes)
        gains = acting_gains(weights, p.inhibition_gain, p.vote_rule)
        omega = self.network.omega(np.zeros(3))
        stops = holds_at_rest(self.network.system, omega, gains, p.region_radius)
        return Ballot(weights, gains, stops, causes)
