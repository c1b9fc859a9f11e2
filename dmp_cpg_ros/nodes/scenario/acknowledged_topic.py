# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A topic whose sender asks its readers whether they have taken what it sent."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from dmp_cpg_ros.nodes.messages.interfaces import interface


class AcknowledgedTopic:
    """Publishes an interface of the table and counts what its readers have taken.

    Parameters
    ----------
    node : Node
        Who sends.
    name : str
        Topic whose readers offer ``~/commands_taken`` for it.
    """

    def __init__(self, node: Node, name: str) -> None:
        """Create the publisher, and a client for each reader."""
        topic, self._name = interface(name), name
        self._publisher = node.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._readers = len(topic.subscribers)
        self._clients = [
            node.create_client(Trigger, f'{reader}/commands_taken') for reader in topic.subscribers
        ]
        self._sent = 0

    def connected(self) -> bool:
        """Whether all readers are there."""
        return bool(self._publisher.get_subscription_count() >= self._readers) and all(
            client.service_is_ready() for client in self._clients
        )

    def send(self, message: Any) -> None:
        """Publish."""
        self._publisher.publish(message)
        self._sent += 1

    def when_taken(self, then: Callable[[], None]) -> None:
        """Call back when every reader has taken everything that was sent."""
        self._ask(list(self._clients), then)

    def _ask(self, clients: list[Any], then: Callable[[], None]) -> None:
        if not clients:
            then()
            return

        def answered(future: Future) -> None:
            taken = _count(future.result().message, self._name)
            self._ask(clients[1:] if taken >= self._sent else clients, then)

        clients[0].call_async(Trigger.Request()).add_done_callback(answered)


def _count(answer: str, topic: str) -> int:
    """Messages on one topic from an answer such as ``cmd_vel 12, votes 3``."""
    counts = dict(entry.rsplit(' ', 1) for entry in answer.split(', '))
    return int(counts[topic])
