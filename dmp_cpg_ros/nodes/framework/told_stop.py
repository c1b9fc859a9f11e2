# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the service tells others: what acts of a stop, its state, and where the gait is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.framework.promise import Promise
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages.canonical_state import GaitMemoryWriter
from dmp_cpg_ros.nodes.messages.inhibition import InhibitionGainsWriter, inhibition_state
from dmp_cpg_ros.nodes.messages.values import Array

HEARTBEAT_NS = 100_000_000
"""Time after which the gains are told again although they are the same [ns]."""


class ToldStop:
    """Topics of the service: ``inhibition_gains``, ``inhibition_state``, and ``gait_memory`` for
    nodes that come back.

    Parameters
    ----------
    node : SuiteNode
        The node that tells.
    gaits : tuple of str
        Names of all gaits.
    voting : bool
        Whether votes are part of what is told.
    """

    def __init__(self, node: SuiteNode, gaits: tuple[str, ...], voting: bool) -> None:
        """Make the publishers."""
        self._voting, self._lock_step = voting, node.lock_step
        self._state_publisher = node.publisher('inhibition_state')
        self._gains_publisher = node.publisher('inhibition_gains')
        self._gains_writer, self._gains_ns = InhibitionGainsWriter(), -HEARTBEAT_NS
        self._remembers = node.lock_step or bool(node.return_ns)
        if self._remembers:
            self._memory_writer = GaitMemoryWriter(gaits)
            self._memory_publisher = node.publisher('gait_memory')
        self._news: tuple[Any, ...] = ()

    def are_gains_due(self, stamp_ns: int) -> bool:
        """Whether the gains are to be told again at a stamp although they are the same."""
        return self._lock_step or not 0 <= stamp_ns - self._gains_ns < HEARTBEAT_NS

    def is_news(self, state: SupervisorState, promise: Promise) -> bool:
        """Whether there is what ``inhibition_state`` has not told."""
        return _news(state, promise) != self._news

    def forget(self) -> None:
        """Tell the state again: what it says of the certificate may be another."""
        self._news = ()

    def tell_gains(self, stamp_ns: int, announced: Announced) -> None:
        """Tell at a stamp [ns] what acts."""
        self._gains_ns = stamp_ns
        self._gains_publisher.publish(
            self._gains_writer.fill(stamp_ns, announced.latest, announced.latest_ns))

    def tell_memory(self, stamp_ns: int, x: Array, x_dot: Array, gait: GaitInForce, r: Array
                    ) -> None:
        """Tell at a stamp [ns] where the gait is: canonical states (4, 2), their rates, gait, and
        reference (3,); nothing where no node could come back.
        """
        if self._remembers:
            self._memory_publisher.publish(self._memory_writer.fill(stamp_ns, x, x_dot, gait, r))

    def tell_state(self, state: SupervisorState, announced: Announced, promise: Promise,
                   certificate: Mapping[str, Any]) -> None:
        """Tell people the state of the stop, what was promised and what the certificate says."""
        acting, self._news = announced.latest, _news(state, promise)
        told = {'requested': state.in_force, 'armed': state.armed, 'automatic': state.automatic,
                'pushed': state.push.acts, 'blocked': state.block.acts,
                **_by_leg('gain', acting.gains), 'region_radius': acting.region_radius,
                'rest_phase': acting.rest_phase,
                'request_stamp': state.request_ns * 1e-9, 'predicted_s': promise.predicted_s,
                'bound_s': promise.bound_s, 'bound_m': promise.bound_m,
                'stands_s': promise.stands_s, 'measured_s': state.measured_s, **certificate}
        if self._voting:
            told |= {**_by_leg('vote', state.tally.weights), 'voted': state.voted,
                     'asked': state.asked, 'cause': state.tally.cause}
        self._state_publisher.publish(inhibition_state(state.time_ns, state.state, told))


def _news(state: SupervisorState, promise: Promise) -> tuple[Any, ...]:
    """What is told when it changes."""
    return (state.state, state.requested, state.armed, state.automatic, state.request_ns,
            state.voted, state.tally.causes, state.tally.weights.tobytes(), state.leg,
            state.rest_phase, state.block.acts, promise)


def _by_leg(what: str, numbers: Array) -> dict[str, float]:
    return {f'{what}_{leg}': number for leg, number in zip(LEGS, numbers.tolist(), strict=True)}
