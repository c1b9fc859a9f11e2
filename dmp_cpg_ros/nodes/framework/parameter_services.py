# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of other nodes: following what their owners accept, and setting them there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import qos_profile_parameter_events
from rclpy.task import Future

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.suite_parameters import CHANGEABLE, OWNER
from dmp_cpg_ros.nodes.framework.lifecycle import GuardedLifecycleNode
from dmp_cpg_ros.nodes.framework.parameters import plain, ros_value
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader

ASK_EVERY_S = 5.0
"""Period of asking the owners [s]: what an event did not tell, because a node was not there yet or
had to be started again, is known after this time.
"""


class ParameterFollower:
    """Tells a node what the owners of some parameters have accepted.

    Owners announce changes on ``/parameter_events``; they are also asked now and then.

    Parameters
    ----------
    node : GuardedLifecycleNode
        The node that follows.
    owners : mapping of str to sequence of str
        Names of nodes in the same namespace, with the names of their parameters.
    take : callable (values)
        Told names and values whenever an owner says them, changed or not; what it raises is
        counted as dropped.
    """

    def __init__(self, node: GuardedLifecycleNode, owners: Mapping[str, Sequence[str]],
                 take: Callable[[dict[str, Any]], None]) -> None:
        """Listen, and ask the owners that are there."""
        self._node, self._take = node, take
        self._names = {owner: tuple(names) for owner, names in owners.items()}
        space = node.get_namespace().rstrip('/')
        self._owners = {f'{space}/{owner}': owner for owner in owners}
        self._events = node.create_subscription(
            ParameterEvent, '/parameter_events', self._on_event, qos_profile_parameter_events,
            raw=True)
        self._read = serialized_reader(ParameterEvent)
        self._askers = {owner: node.create_client(GetParameters, f'{owner}/get_parameters')
                        for owner in owners}
        self._pending: dict[str, Future] = {}
        self._timer = node.create_steady_timer(ASK_EVERY_S, self._ask)

    def end(self) -> None:
        """Stop following."""
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._events)
        for client in self._askers.values():
            self._node.destroy_client(client)

    def _on_event(self, data: bytes) -> None:
        event: ParameterEvent = self._read(data)
        owner = self._owners.get(event.node)
        if owner is None:
            return
        names = self._names[owner]
        try:
            values = {entry.name: plain(Parameter.from_parameter_msg(entry).value)
                      for entry in (*event.new_parameters, *event.changed_parameters)
                      if entry.name in names}
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


Done = Callable[[str], None]


class ParameterSetter:
    """Calls the nodes' own parameter services, as ``ros2 param set`` does.

    Parameters
    ----------
    node : Node
        Who asks.
    """

    def __init__(self, node: Node) -> None:
        """Create the clients."""
        self._setters = {owner: node.create_client(
            SetParametersAtomically, f'{owner}/set_parameters_atomically') for owner in CHANGEABLE}
        self._getters = {owner: node.create_client(GetParameters, f'{owner}/get_parameters')
                         for owner in CHANGEABLE}

    def connected(self) -> bool:
        """Whether all services are there."""
        return all(client.service_is_ready()
                   for client in (*self._setters.values(), *self._getters.values()))

    def set(self, values: Mapping[str, Any], done: Done) -> None:
        """Ask for a change.

        Parameters
        ----------
        values : mapping of str to value
            Parameters of one owner.
        done : callable (reason)
            Called with why the change is refused, or with an empty text once the owner has
            accepted it and all followers know it.
        """
        owner = OWNER[next(iter(values))]
        wanted = {name: ros_value(value) for name, value in values.items()}
        request = SetParametersAtomically.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in wanted.items()])

        def answered(future: Future) -> None:
            answer = future.result()
            if answer is None or not answer.result.successful:
                done('no answer' if answer is None else answer.result.reason)
                return
            self._await([node for node in CHANGEABLE if node != owner], wanted, done)

        self._setters[owner].call_async(request).add_done_callback(answered)

    def _await(self, followers: list[str], wanted: Mapping[str, Any], done: Done) -> None:
        """Ask each follower until it has the values."""
        if not followers:
            done('')
            return

        def answered(future: Future) -> None:
            answer = future.result()
            known = [] if answer is None else [
                plain(parameter_value_to_python(value)) for value in answer.values]
            follow = followers[1:] if known == list(wanted.values()) else followers
            self._await(follow, wanted, done)

        request = GetParameters.Request(names=list(wanted))
        self._getters[followers[0]].call_async(request).add_done_callback(answered)
