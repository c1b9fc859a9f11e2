# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A topic whose readers tell how much of it they have taken."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState

from dmp_cpg_ros.nodes.framework.own_messages import OwnMessages
from dmp_cpg_ros.nodes.messages.interfaces import Interface, private
from dmp_cpg_ros.nodes.messages.values import read_counts


class AcknowledgedTopic:
    """Publishes an interface of the table and counts what its readers have taken.

    Parameters
    ----------
    node : Node
        Who sends.
    heard : OwnMessages
        What it reads.
    topic : Interface
        Topic whose readers tell of it on ``~/commands_taken``.
    """

    def __init__(self, node: Node, heard: OwnMessages, topic: Interface) -> None:
        """Create the publisher, and a subscription for each reader."""
        self._name = topic.name
        self._publisher = node.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._sent, self._taken = 0, dict.fromkeys(topic.subscribers, 0.0)
        self._missed, self._last = dict.fromkeys(topic.subscribers, 0), list[Any]()
        self._then: Callable[[], None] | None = None
        self._answers = [
            heard.listen(private('~/commands_taken', reader), self._hearing(reader))
            for reader in topic.subscribers]

    def connected(self) -> bool:
        """Whether all readers are there."""
        return bool(self._publisher.get_subscription_count() >= len(self._answers) and all(
            answer.get_publisher_count() for answer in self._answers))

    def send(self, messages: Sequence[Any], then: Callable[[], None]) -> None:
        """Publish, and call back once, when every reader has taken everything that was sent."""
        for message in messages:
            self._publisher.publish(message)
        self._sent, self._then, self._last = self._sent + len(messages), then, [*messages]
        self._look()

    def renew(self, readers: Collection[str]) -> None:
        """Send the last messages again when one of the readers was restarted."""
        restarted = [reader for reader in readers if reader in self._taken]
        for reader in restarted:
            self._missed[reader], self._taken[reader] = self._sent, 0.0
        if restarted and self._sent:
            self.send(self._last, self._then or (lambda: None))

    def _hearing(self, reader: str) -> Callable[[JointState], None]:
        def hear(message: JointState) -> None:
            self._taken[reader] = read_counts(message).get(self._name, 0.0)
            self._look()

        return hear

    def _look(self) -> None:
        if self._then is not None and all(
                taken + self._missed[reader] >= self._sent
                for reader, taken in self._taken.items()):
            then, self._then = self._then, None
            then()
