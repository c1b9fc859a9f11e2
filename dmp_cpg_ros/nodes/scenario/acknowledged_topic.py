# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A topic whose readers tell how many of its messages they have taken."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState

from dmp_cpg_ros.nodes.messages.interfaces import interface


class AcknowledgedTopic:
    """Publishes an interface of the table and counts what its readers have taken.

    Parameters
    ----------
    node : Node
        Who sends.
    name : str
        Topic whose readers tell of it on ``~/commands_taken``.
    """

    def __init__(self, node: Node, name: str) -> None:
        """Create the publisher, and a subscription for each reader."""
        topic, taken, self._name = interface(name), interface('~/commands_taken'), name
        self._publisher = node.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._sent, self._taken = 0, dict.fromkeys(topic.subscribers, 0.0)
        self._then: Callable[[], None] | None = None
        self._answers = [
            node.create_subscription(taken.type, f'{reader}/commands_taken',
                                     self._hearing(reader), taken.reader_qos)
            for reader in topic.subscribers]

    def connected(self) -> bool:
        """Whether all readers are there."""
        return bool(self._publisher.get_subscription_count() >= len(self._answers) and all(
            answer.get_publisher_count() for answer in self._answers))

    def send(self, message: Any) -> None:
        """Publish."""
        self._publisher.publish(message)
        self._sent += 1

    def when_taken(self, then: Callable[[], None]) -> None:
        """Call back once, when every reader has taken everything that was sent."""
        self._then = then
        self._look()

    def _hearing(self, reader: str) -> Callable[[JointState], None]:
        def hear(message: JointState) -> None:
            counts = dict(zip(message.name, message.position, strict=True))
            self._taken[reader] = counts.get(self._name, 0.0)
            self._look()

        return hear

    def _look(self) -> None:
        if self._then is not None and min(self._taken.values()) >= self._sent:
            then, self._then = self._then, None
            then()
