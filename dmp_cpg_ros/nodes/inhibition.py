# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``inhibition``: the service that stops and starts the gait, and the state of the stop."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.certificates.certify import Certificate
from dmp_cpg_ros.core.gait.contact_feedback import initial_contact_state
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.running import CanonicalState
from dmp_cpg_ros.core.inhibition.prediction import predict
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.inhibition.voting_parameters import VotingParameters
from dmp_cpg_ros.core.reference.filter import ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import (
    INHIBITION,
    VOTE_SOURCES,
    TickParameters,
)
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.nodes.framework.certified import CertifiedNode
from dmp_cpg_ros.nodes.framework.execution import run_node
from dmp_cpg_ros.nodes.framework.gaits import certificate_words, gait_name
from dmp_cpg_ros.nodes.framework.parameters import LockStepParameters
from dmp_cpg_ros.nodes.inputs.votes import NodeVotes
from dmp_cpg_ros.nodes.messages.conversions import (
    CanonicalStateReader,
    CommandReader,
    InhibitionGainsWriter,
    read_reference,
)
from dmp_cpg_ros.nodes.messages.inhibition_state import InhibitionStateWriter
from dmp_cpg_ros.suite_table import KINDS


class InhibitionNode(CertifiedNode):
    """Stops and starts the gait on request, says when it will be at rest, and watches that it
    is.
    """

    KIND = INHIBITION
    PARAMETER_SETS = (*KINDS[KIND].sets, LockStepParameters)
    CHANGEABLE = (*CertifiedNode.CHANGEABLE, *VOTE_SOURCES)

    def configure(self) -> None:
        """Build the supervisor and its topics and service."""
        self.prepare_certificate()
        gaits = self.gaits
        self._running_gait = self.new_running()
        self._network = self._running_gait.network(gaits.named(gait_name(self)))
        self._supervisor = self._new_supervisor()
        self._gate = self.new_gate()
        self._reference = ReferenceSystem(self.parameters_of(ReferenceParameters))
        self._state = self._supervisor.initial_state()
        self._acting = self._supervisor.inhibition(self._state)
        self._x: Any = None
        self._x_dot: Any = None
        self._r = np.zeros(3)
        self._predicted = self._bound = self._way = float('nan')
        self._told: tuple[Any, ...] = ()
        self._lock_step = self.parameters_of(LockStepParameters).lock_step
        self._writer, self._publisher = InhibitionStateWriter(), self.publisher('inhibition_state')
        self._gains_writer = InhibitionGainsWriter()
        self._gains_publisher = self.publisher('inhibition_gains')
        self._votes = NodeVotes(self, self._network)
        self._body_mode = 'standing'
        inputs = ('canonical_state', 'reference', *self._votes.readers)
        self.match(
            (*inputs, 'posture_feedback') if self._lock_step else inputs,
            'canonical_state',
            delayed=() if self._lock_step else ('posture_feedback',),
            optional=tuple(self._votes.readers),
            lock_step=self._lock_step,
        )
        body = CommandReader()
        self.feed({
            'posture_feedback': lambda message: body.read(message).mode,
            'canonical_state': CanonicalStateReader(gaits).read,
            'reference': read_reference,
            **self._votes.readers,
        })
        self.listen_to_commands(self._gate)
        self.serve('inhibit', self._answer_inhibit)

    def activate(self) -> None:
        """Tell late joiners the state from the start; in lock-step the first tick does."""
        if not self._lock_step:
            self._publish()
            self._publish_gains()

    def on_parameters(self) -> None:
        """Take over what may change while walking."""
        self._supervisor = self._new_supervisor()
        self.limit(self._gate)
        self._reference = ReferenceSystem(self.parameters_of(ReferenceParameters))
        self._running_gait = self.new_running()
        self._network = self._running_gait.network(self._network.gait)
        self._votes.follow()

    def _new_supervisor(self) -> GaitSupervisor:
        return GaitSupervisor(
            self.parameters_of(InhibitionParameters), self.parameters_of(VotingParameters),
            self.parameters_of(LegParameters).activity_rate)

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the state of the stop to the stamp of the canonical state."""
        self._x, self._x_dot, gait = values['canonical_state']
        self._r = values['reference']
        self._network = network = self._running_gait.network(gait)
        before = self._state
        self._body_mode = values['posture_feedback'] or self._body_mode
        tally = self._votes.count(stamp_ns, values, network, before.word)
        self._state = self._supervisor.step(
            before,
            stamp_ns,
            network,
            self._x,
            self._x_dot,
            self._r,
            self._gate.at(stamp_ns),
            tally,
            self._body_mode,
        )
        self._acting = self._supervisor.inhibition(self._state)
        if self._state.requested != before.requested:
            self._predict(self._acting)
        news = self._news() != self._told
        if news:
            self._publish()
        if news or self._lock_step:
            self._publish_gains()

    def acting_cadence(self) -> float | None:
        """Factor on the cadence of the states of the last tick."""
        return None if self._x is None else self._network.gait.cadence_scale

    def stop_in_force(self) -> tuple[GaitNetwork, Inhibition, Any] | None:
        """Network, inhibition and states of the last tick."""
        return None if self._x is None else (self._network, self._acting, self._x)

    def _certificate_in_force(self) -> Certificate:
        return self.certificate_in(self._network.gait)

    def _words(self) -> str:
        return certificate_words(self._certificate_in_force())

    def diagnostic_values(self) -> Mapping[str, Any]:
        """State of the stop."""
        return {
            'inhibition': self._state.word,
            'requested': self._state.requested,
            'command': self._gate.at(self._state.time_ns),
        }

    def _news(self) -> tuple[Any, ...]:
        """What is told when it changes."""
        now = self._state
        votes = self._votes.news(now)
        return now.word, now.requested, now.armed, now.automatic, now.request_ns, *votes

    def _answer_inhibit(self, request: Any, response: Any) -> Any:
        """Take a request; the answer says when it will be fulfilled. It acts from the next tick
        on.
        """
        verb = 'at rest' if request.data else 'walking'
        if not self.active:
            response.success, response.message = (
                False,
                f'inhibition is {self.state_label}, not active',
            )
            return response
        if self._x is None:
            response.success = False
            response.message = (
                'no canonical_state and reference yet; is canonical_oscillators running?'
            )
            return response
        if not request.data and self._body_mode != 'standing':
            response.success = False
            response.message = (
                f'the gait cannot start: the robot is {self._body_mode}, not standing; call '
                f'{"recover" if self._body_mode == "damped" else "stand_up"}, or wait until it '
                'stands'
            )
            return response
        already = request.data == self._state.requested
        self._state = self._supervisor.request(self._state, request.data)
        response.success = request.data == self._state.requested
        if not response.success:
            response.message = f'held by votes: {self._state.tally.cause}; ask again without them'
            return response
        if already:
            response.message = f'already {self._state.word}'
            return response
        self._predict(self._acting)
        when = f'in {self._predicted:.3f} s' if isfinite(self._predicted) else 'not within 10 s'
        most = (
            f'at most {self._bound:.3f} s' if isfinite(self._bound)
            else 'without a bound from this state'
        )
        way = f'; the reference goes on for at most {self._way:.3f} m' if request.data else ''
        response.message = f'{verb} {when}, {most}; {self._words()}{way}'
        return response

    def _predict(self, published: Inhibition) -> None:
        """Look ahead to the rest or the walk that was just requested."""
        tick_s = self.parameters_of(TickParameters).tick_ns * 1e-9
        gait = self._network.gait
        canon = CanonicalState(
            gait, self.gaits.named(gait_name(self)), gait.cadence_scale, self._x, self._x_dot,
            initial_contact_state(),
        )
        self._predicted = predict(
            self._supervisor,
            self._reference,
            self._running_gait,
            self._state,
            published,
            canon,
            self._r,
            self._gate.at(self._state.time_ns),
            tick_s,
            body_mode=self._body_mode,
        )
        self._bound = (
            self.running_in(gait).time_to_rest(self._network, self._x, self._r)
            if self._state.requested
            else self._certificate_in_force().time_to_walking
        )
        self._way = self.running_in(gait).stop_distance(
            self._r, self._gate.at(self._state.time_ns)) if self._state.requested else float('nan')
        if self._state.voted:
            self._bound = self._votes.bound(self._supervisor, self._network, self._state)

    def _publish_gains(self) -> None:
        self._gains_publisher.publish(
            self._gains_writer.fill(self._state.time_ns, self._acting))

    def _publish(self) -> None:
        state, acting, self._told = self._state, self._acting, self._news()
        values: dict[str, Any] = {
            'requested': state.requested,
            'armed': state.armed,
            'automatic': state.automatic,
        }
        values.update(
            (f'gain_{leg}', gain) for leg, gain in zip(LEGS, acting.gains.tolist(), strict=True)
        )
        values.update(
            region_radius=acting.region_radius,
            request_stamp=state.request_ns * 1e-9,
            predicted_s=self._predicted,
            bound_s=self._bound,
            bound_m=self._way,
            measured_s=state.measured_s,
            grade=self._words(),
            **self._votes.told(state),
        )
        self._publisher.publish(self._writer.fill(state.time_ns, state.word, values))


def main() -> int:
    """Run the node."""
    return run_node(InhibitionNode)


if __name__ == '__main__':
    sys.exit(main())
