# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The votes of the inhibition node: what it listens to for them, and what it says about them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.certificates.votes import vote_bound
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor, SupervisorState
from dmp_cpg_ros.core.inhibition.voters import VoteSensors
from dmp_cpg_ros.core.inhibition.votes import Tally, VoteInbox
from dmp_cpg_ros.core.inhibition.voting import Voting
from dmp_cpg_ros.core.inhibition.voting_parameters import VoteSourceParameters, VotingParameters
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import TickParameters
from dmp_cpg_ros.nodes.framework.gaits import description_of
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages.conversions import read_votes
from dmp_cpg_ros.nodes.messages.robot_state import FootContactsReader, read_imu
from dmp_cpg_ros.nodes.messages.values import stamped

CONTACTS, IMU = 'foot_contacts', 'imu'


class NodeVotes:
    """Votes in the inhibition node; without ``voting`` it listens to nothing.

    Parameters
    ----------
    node : SuiteNode
        The node.
    network : GaitNetwork
        Its oscillators.

    Attributes
    ----------
    readers : mapping of str to callable
        How to read the sensors that belong to a tick; in real time it does not wait for them.
    """

    def __init__(self, node: SuiteNode, network: GaitNetwork) -> None:
        """Compute the clamp."""
        self._node = node
        self._weight, self.inbox = description_of(node).mass * GRAVITY, VoteInbox()
        self.follow()
        self._state = self.voting.initial_state(network)
        self.readers: dict[str, Callable[[Any], Any]] = {}
        if self.voting.voting.voting:
            self.readers = {
                CONTACTS: stamped(FootContactsReader().read), IMU: stamped(read_imu)}
            node.listen(
                'votes', lambda message: self.inbox.accept(*read_votes(message)), command=True)

    def follow(self) -> None:
        """Take over changed parameters."""
        of = self._node.parameters_of
        self.voting = Voting(of(InhibitionParameters), of(VotingParameters),
                             of(VoteSourceParameters), of(ReferenceParameters), self._weight)

    def count(self, stamp_ns: int, values: dict[str, Any], network: GaitNetwork,
              word: str) -> Tally:
        """Count the votes of a tick.

        Parameters
        ----------
        stamp_ns : int
            Stamp of the tick [ns].
        values : dict
            Inputs of the tick.
        network : GaitNetwork
            The oscillators that act.
        word : str
            State word after the tick before.

        Returns
        -------
        Tally
        """
        nothing = np.full(3, np.nan)
        contact_ns, load = values.get(CONTACTS) or (stamp_ns, np.full(len(LEGS), np.nan))
        imu_ns, (rate, force) = values.get(IMU) or (stamp_ns, (nothing, nothing))
        sensors = VoteSensors(contact_ns, imu_ns, load, rate, force)
        x, r = values['canonical_state'][0], values['reference']
        self._state = self.voting.step(self._state, stamp_ns, network, sensors, x, r,
                                       word in ('walking', 'free'), self.inbox.take())
        return self._state.tally

    def news(self, state: SupervisorState) -> tuple[Any, ...]:
        """What is told when it changes."""
        return state.voted, state.tally.causes, state.tally.weights.tobytes()

    def bound(self, supervisor: GaitSupervisor, network: GaitNetwork, state: SupervisorState
              ) -> float:
        """Bound on the time from now to rest under the votes [s]."""
        of, p = self._node.parameters_of, supervisor.parameters
        gains = supervisor.inhibition(replace(state, armed=True)).gains
        return vote_bound(
            network, gains, p.region_radius, operating_range(network, p, of(ReferenceParameters)),
            of(ReferenceParameters).alpha_r, supervisor.activity_rate,
            of(TickParameters).tick_ns * 1e-9)

    def told(self, state: SupervisorState) -> dict[str, Any]:
        """Values of ``inhibition_state`` about the votes."""
        if not self.readers:
            return {}
        weights = zip(LEGS, state.tally.weights.tolist(), strict=True)
        return {**{f'vote_{leg}': weight for leg, weight in weights}, 'voted': state.voted,
                'asked': state.asked, 'cause': state.tally.cause}
