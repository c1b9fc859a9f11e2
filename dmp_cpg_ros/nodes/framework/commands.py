# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands to a node: what anybody may send, and what waits for the tick."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.subscription import Subscription

from dmp_cpg_ros.nodes.framework.ticks import drain
from dmp_cpg_ros.nodes.messages.interfaces import Interface
from dmp_cpg_ros.nodes.messages.values import counts_message

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.connected_node import ConnectedNode


class Commands:
    """Topics of a node whose queues are emptied at the start of every tick.

    Parameters
    ----------
    node : ConnectedNode
        Who is commanded.
    """

    def __init__(self, node: ConnectedNode) -> None:
        """Know no topic yet."""
        self._node, self._taken = node, dict[str, int]()
        self._topics: list[tuple[Interface, Subscription]] = []

    def forget(self) -> None:
        """Forget the topics, with their subscriptions."""
        self._topics = []

    def counted(self, topic: str, callback: Callable[[Any], None]) -> Callable[..., None]:
        """Say how many commands have been taken: who has sent them may wait for it."""
        counts = self._taken
        counts.setdefault(topic, 0)
        if not self._topics:
            self._publisher = self._node.publisher('~/commands_taken')

        def receive(message: Any) -> None:
            try:
                callback(message)
            finally:
                if self._topics:  # else it was due when the node was cleaned up
                    counts[topic] += 1
                    self._publisher.publish(counts_message(counts))

        return self._node.writers.numbered(topic, receive)

    def add(self, topic: Interface, subscription: Subscription) -> None:
        """Take from a subscription from now on."""
        self._topics.append((topic, subscription))

    def take(self) -> None:
        """Take what waits."""
        for _, subscription in self._topics:
            drain(subscription)

    def watch_types(self) -> None:
        """Warn of publishers of commands whose type no reader can match: DDS says nothing."""
        node = self._node
        for topic, subscription in self._topics:
            name = subscription.topic_name
            types = {end.topic_type for end in node.get_publishers_info_by_topic(name)}
            wrong = ', '.join(sorted(types - {topic.type_name}))
            if wrong:
                node.warn(f'type of {name}', f'{name} is published as {wrong}, and this node '
                          f'reads {topic.type_name}{topic.other_type}')
            else:
                node.clear(f'type of {name}')
