# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node knows of the parameters that other nodes own."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterEvent, ParameterValue
from rcl_interfaces.srv import GetParameters
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import qos_profile_parameter_events
from rclpy.task import Future

from dmp_cpg_ros.core import suite_parameters as suite
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.framework.parameters import NodeParameters, plain
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode


ANYBODYS = 'not believed: a stranger answers in the name of this service too'
"""Why an answer is dropped."""

ASK_EVERY_S, FIRST_ASK_S = 5.0, 0.1
"""Period of asking the owners [s], what an event did not tell is known after this time; and at
first, until every owner that takes part has answered.
"""

AWAITED_S = 2.0
"""In lock-step, where the robot waits: how long a node waits for what owners have accepted [s]."""


class ParameterFollower:
    """Lets a node follow what the owners of parameters have accepted.

    What ``/parameter_events`` tells anybody can have said, so news make the node ask the owner,
    and so does time that has passed. False news, and answers that the node refuses, are counted
    as dropped. A node that is started again begins with the parameters of its file, and does not
    know what was accepted before, nor do others know that its own are as at the start: it asks at
    once, is not ready before it has been told, and tells then what it has.
    """

    def __init__(self, node: SuiteNode) -> None:
        """Listen, and ask the owners that are there."""
        self._node, space = node, node.get_namespace().rstrip('/')
        self._names = {owner: names for owner, names in suite.CHANGEABLE.items()
                       if owner != node.KIND}
        self._owners = {f'{space}/{owner}': owner for owner in self._names}
        self._events = node.create_subscription(
            ParameterEvent, '/parameter_events', self._on_event, qos_profile_parameter_events,
            raw=True)
        self._teller = node.create_publisher(
            ParameterEvent, '/parameter_events', qos_profile_parameter_events)
        self._read = serialized_reader(ParameterEvent)
        self._askers = {owner: node.create_client(GetParameters, f'{owner}/get_parameters')
                        for owner in self._names}
        self._pending: dict[str, Future] = {}
        self._asked_s: dict[str, float] = {}
        self._claimed: dict[str, dict[str, Any]] = {}
        expected = node.parameters_of(NodeParameters).expected_nodes
        self.unheard = {owner for owner in self._names if owner in expected}
        self._until_s = inf
        self._timer = node.create_steady_timer(
            FIRST_ASK_S if self.unheard else ASK_EVERY_S, self._ask)

    def awaited(self) -> bool:
        """Whether an owner may still tell what it has accepted, for a tick that can wait."""
        now_s = time.monotonic()
        self._until_s = min(self._until_s, now_s + AWAITED_S)
        return bool(self.unheard) and now_s < self._until_s

    def end(self) -> None:
        """Stop following."""
        self._node.destroy_timer(self._timer)
        self._node.destroy_subscription(self._events)
        self._node.destroy_publisher(self._teller)
        for client in self._askers.values():
            self._node.destroy_client(client)

    def _on_event(self, data: bytes) -> None:
        event: ParameterEvent = self._read(data)
        owner = self._owners.get(event.node)
        if owner is None:
            return
        told = self._plain(owner, {entry.name: entry.value for entry in (
            *event.new_parameters, *event.changed_parameters)})
        if not told:
            return
        if not self._askers[owner].service_is_ready():
            raise DataError(f'{told} is said to be changed by {owner}, which does not answer')
        asked, client = self._pending.get(owner), self._askers[owner]
        self._claimed[owner] = told
        if asked is not None and time.monotonic() - self._asked_s[owner] > FIRST_ASK_S:
            client.remove_pending_request(asked)  # who was asked may have died, and not answer
            asked = None
        if asked is None or asked.done():  # else it asks again when the answer is there
            self._ask_owner(owner)

    def _plain(self, owner: str, values: Mapping[str, ParameterValue]) -> dict[str, Any]:
        """Values of the owner's parameters that are followed; raises DataError."""
        try:
            return {name: plain(parameter_value_to_python(value))
                    for name, value in values.items() if name in self._names[owner]}
        except RuntimeError as error:
            raise DataError(f'a value of {owner} cannot be read: {error}') from None

    def _ask(self) -> None:
        for owner, client in self._askers.items():
            if self.unheard and owner not in self.unheard:
                continue
            former = self._pending.pop(owner, None)
            if former is not None and not former.done():
                client.remove_pending_request(former)
            if client.service_is_ready():
                self._ask_owner(owner)

    def _ask_owner(self, owner: str) -> None:
        claimed = self._claimed.pop(owner, {})
        future = self._askers[owner].call_async(
            GetParameters.Request(names=self._names[owner]))
        self._pending[owner], self._asked_s[owner] = future, time.monotonic()
        future.add_done_callback(self._node.guarded(
            f'{owner}/get_parameters', partial(self._answered, owner, claimed)))

    def _answered(self, owner: str, claimed: Mapping[str, Any], future: Future) -> None:
        answer, names = future.result(), self._names[owner]
        if answer is None or len(answer.values) != len(names):
            return
        asked = f'{owner}/get_parameters'
        if who := self._node.strangers.serving(asked):
            self._node.drop(asked, DataError(ANYBODYS), who)
            return
        told = self._plain(owner, dict(zip(names, answer.values, strict=True)))
        if owner in self._claimed:
            self._ask_owner(owner)
        if not self._node.parameter_changes.follow(told) and any(
                told[name] != value for name, value in claimed.items()):
            self._node.drop('/parameter_events', DataError(
                f'{dict(claimed)} is said to be changed by {owner}, which has not'),
                self._node.strangers.publishing('/parameter_events'))
        if owner in self.unheard:
            self.unheard.remove(owner)
            if not self.unheard:
                self._heard_all()

    def _heard_all(self) -> None:
        """Tell the others what this node has, and ask less often."""
        node, names = self._node, suite.CHANGEABLE.get(self._node.KIND, ())
        node.destroy_timer(self._timer)
        self._timer = node.create_steady_timer(ASK_EVERY_S, self._ask)
        self._teller.publish(ParameterEvent(
            stamp=node.get_clock().now().to_msg(), node=node.get_fully_qualified_name(),
            changed_parameters=[
                node.get_parameter(name).to_parameter_msg() for name in names]))
