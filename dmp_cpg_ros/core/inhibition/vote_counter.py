# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Counting votes tick by tick: what the inhibition node and the plain loop have in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.voting_parameters import VoteSourceParameters
from dmp_cpg_ros.core.gait.gait import GRAVITY
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.ballot import NO_VOTES, Ballot
from dmp_cpg_ros.core.inhibition.vote_box import VoteBox
from dmp_cpg_ros.core.inhibition.voting import Voting, VotingState
from dmp_cpg_ros.core.inhibition.voting_sensors import VoteSensors
from dmp_cpg_ros.core.reference.filter import ReferenceParameters

Array = NDArray[np.float64]


class VoteCounter:
    """Box, rules and memory of the votes; without voting it counts nothing.

    Parameters
    ----------
    inhibition, sources, network, reference
        As of :class:`~dmp_cpg_ros.core.inhibition.voting.Voting`.
    mass : float
        Mass of the robot [kg].

    Attributes
    ----------
    box : VoteBox
        Where votes from outside go.
    voting : Voting or None
        The rules; None when ``voting`` is off.
    """

    def __init__(self, inhibition: InhibitionParameters, sources: VoteSourceParameters,
                 network: GaitNetwork, reference: ReferenceParameters, mass: float) -> None:
        """Compute the clamp, when there are votes to clamp."""
        self.box = VoteBox()
        self.voting = None if not inhibition.voting else Voting(
            inhibition, sources, network, reference, mass * GRAVITY)
        self._state: VotingState | None = None

    def follow(self, inhibition: InhibitionParameters, reference: ReferenceParameters,
               sources: VoteSourceParameters) -> None:
        """Take over parameters that have changed; whether there is voting never does."""
        if self.voting is not None:
            self.voting.follow(inhibition, reference, sources)

    def count(self, time_ns: int, sensors: VoteSensors, network: GaitNetwork, x: Array, r: Array,
              word: str) -> Ballot:
        """Count the votes of one tick.

        Parameters
        ----------
        time_ns : int
            Stamp of the tick [ns].
        sensors : VoteSensors
            Newest readings.
        network : GaitNetwork
            The oscillators that act, with their gait.
        x : ndarray (4, 2)
            Canonical states.
        r : ndarray (3,)
            Reference.
        word : str
            State word of the stop after the tick before.

        Returns
        -------
        Ballot
        """
        votes = self.box.take()
        if self.voting is None:
            return NO_VOTES
        self.voting.network = network
        self._state = self.voting.step(
            self._state, time_ns, sensors, x, r, word in ('walking', 'free'), votes)
        return self._state.ballot
