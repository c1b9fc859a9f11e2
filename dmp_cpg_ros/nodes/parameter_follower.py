# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Copies of other nodes' parameters, kept up to date while those nodes change them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters
from rclpy.clock import Clock, ClockType
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import qos_profile_parameter_events
from rclpy.task import Future

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.guarded_node import GuardedNode
from dmp_cpg_ros.nodes.ros_parameters import plain
from dmp_cpg_ros.nodes.serialized_messages import serialized_reader

ASK_EVERY_S = 5.0
"""Period of asking the owners [s]: what an event did not tell, because a node was not there yet or
had to be started again, is known after this time.
"""


class ParameterFollower:
    """Tells a node what the owners of some parameters have accepted.

    Owners announce changes on ``/parameter_events``; they are also asked now and then.

    Parameters
    ----------
    node : GuardedNode
        The node that follows.
    owners : mapping of str to sequence of str
        Names of nodes in the same namespace, with the names of their parameters.
    take : callable (values)
        Told names and values whenever an owner says them, changed or not; what it raises is
        counted as dropped.
    """

    def __init__(
        self,
        node: GuardedNode,
        owners: Mapping[str, Sequence[str]],
        take: Callable[[dict[str, Any]], None],
    ) -> None:
        """Listen, and ask the owners that are there."""
        self._node, self._take = node, take
        self._names = {owner: tuple(names) for owner, names in owners.items()}
        space = node.get_namespace().rstrip('/')
        self._owners = {f'{space}/{owner}': owner for owner in owners}
        self._events = node.create_subscription(
            ParameterEvent,
            '/parameter_events',
            self._on_event,
            qos_profile_parameter_events,
            raw=True,
        )
        self._read = serialized_reader(ParameterEvent)
        self._askers = {
            owner: node.create_client(GetParameters, f'{owner}/get_parameters') for owner in owners
        }
        self._pending: dict[str, Future] = {}
        self._timer = node.create_timer(
            ASK_EVERY_S, self._ask, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def end(self) -> None:
        """Stop following."""
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._events)
        for client in self._askers.values():
            self._node.destroy_client(client)

    def _on_event(self, data: bytes) -> None:
        event: ParameterEvent = self._read(data)
        owner = self._owners.get(event.node)
        if owner is not None:
            self._tell(owner, [*event.new_parameters, *event.changed_parameters])

    def _tell(self, owner: str, parameters: Iterable[ParameterMessage]) -> None:
        names = self._names[owner]
        try:
            values = {
                entry.name: plain(Parameter.from_parameter_msg(entry).value)
                for entry in parameters
                if entry.name in names
            }
        except (TypeError, ValueError) as error:
            raise DataError(f'a value of {owner} cannot be read: {error}') from None
        if values:
            self._take(values)

    def _ask(self) -> None:
        for owner, client in self._askers.items():
            former = self._pending.pop(owner, None)
            if former is not None and not former.done():
                client.remove_pending_request(former)
            if client.service_is_ready():
                future = client.call_async(GetParameters.Request(names=self._names[owner]))
                self._pending[owner] = future
                future.add_done_callback(self._node.guarded(
                    f'{owner}/get_parameters', self._answer_of(owner)))

    def _answer_of(self, owner: str) -> Callable[[Future], None]:
        def answered(future: Future) -> None:
            answer, names = future.result(), self._names[owner]
            if answer is not None and len(answer.values) == len(names):
                values = map(parameter_value_to_python, answer.values)
                self._take({name: plain(value)
                            for name, value in zip(names, values, strict=True)})

        return answered
