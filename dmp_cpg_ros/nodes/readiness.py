# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a node is connected with the nodes that it works with.

Discovery is not symmetric in time: a reader may know a writer before the writer knows the reader,
and a reliable volatile writer sends nothing to readers that it does not know yet. So each node
answers for its own ends only: its expected partners are in the graph, and as many ends as the
graph shows are matched here.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Iterable, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.subscription import Subscription
from rclpy.task import Future
from std_srvs.srv import Trigger

from dmp_cpg_ros.nodes.interfaces import Interface, partners
from dmp_cpg_ros.suite_table import KINDS

ASK_AGAIN_S = 2.0
"""Time after which a request without an answer is repeated [s]."""


class Intervals:
    """Growing intervals of wall time at which someone who waits says what for.

    Parameters
    ----------
    first_s : float
        The first of them [s]; each is twice as long as the one before.
    """

    def __init__(self, first_s: float = 1.0) -> None:
        """Begin the first."""
        self._length_s, self._end = first_s, time.monotonic() + first_s

    def due(self) -> bool:
        """Whether an interval has ended since the last time this was true."""
        now = time.monotonic()
        if now < self._end:
            return False
        self._length_s *= 2.0
        self._end = now + self._length_s
        return True


class ReadinessOfOthers:
    """Asks nodes whether they are ready, again and again until each has said so.

    Parameters
    ----------
    node : Node
        Who asks.
    names : iterable of str
        Names of nodes in its namespace.
    """

    def __init__(self, node: Node, names: Iterable[str]) -> None:
        """Create the clients."""
        self._node = node
        self._clients = {name: node.create_client(Trigger, f'{name}/ready') for name in names}
        self._asked: dict[str, tuple[float, Future]] = {}
        self._said: dict[str, str] = {}

    def missing(self) -> list[str]:
        """Take answers and ask again, without waiting; returns who has not said yes, and why."""
        for name, client in list(self._clients.items()):
            asked_s, future = self._asked.get(name, (-math.inf, Future()))
            answer = future.result() if future.done() else None
            if answer is not None and answer.success:
                self._node.destroy_client(self._clients.pop(name))
                continue
            if answer is not None:
                self._said[name] = answer.message
            # A response is lost where the server does not know the client yet.
            lost = time.monotonic() > asked_s + ASK_AGAIN_S
            if (answer is not None or lost) and client.service_is_ready():
                client.remove_pending_request(future)
                self._asked[name] = time.monotonic(), client.call_async(Trigger.Request())
        return [f'{name}: {self._said.get(name, "it does not answer")}' for name in self._clients]


def missing_connections(node: Node, kind: str,
                        outputs: Sequence[tuple[Interface, Sequence[str], Publisher]],
                        inputs: Sequence[tuple[Interface, Subscription]],
                        expected: Collection[str]) -> list[str]:
    """List what is missing.

    Parameters
    ----------
    node : Node
        The node.
    kind : str
        Its kind.
    outputs : sequence of (Interface, sequence of str, Publisher)
        Its publishers and the kinds of nodes that read them.
    inputs : sequence of (Interface, Subscription)
        Its subscriptions.
    expected : collection of str
        Kinds of nodes that take part; others are not waited for.

    Returns
    -------
    list of str
        One text per missing connection.
    """
    missing: list[str] = []
    for topic, readers, publisher in outputs:
        ends = node.get_subscriptions_info_by_topic(publisher.topic_name)
        absent = _absent(node, ends, readers, kind, expected)
        missing += [f'{topic.name} is not read by {name}' for name in absent]
        known = sum(_compatible(publisher.qos_profile, end.qos_profile) for end in ends)
        if not absent and publisher.get_subscription_count() < known:
            missing.append(f'{topic.name} is not matched with all of its {known} readers')
    for topic, subscription in inputs:
        ends = node.get_publishers_info_by_topic(subscription.topic_name)
        absent = _absent(node, ends, partners(topic, readers=False), kind, expected)
        missing += [f'{topic.name} is not published by {name}' for name in absent]
        known = sum(_compatible(end.qos_profile, subscription.qos_profile) for end in ends)
        if not absent and subscription.get_publisher_count() < known:
            missing.append(f'{topic.name} is not matched with all of its {known} publishers')
    return missing


def _absent(node: Node, ends: Sequence[Any], partners: Sequence[str],
            kind: str, expected: Collection[str]) -> list[str]:
    """Names of expected partners that are not among the ends of a topic."""
    found = {end.node_name for end in ends if end.node_namespace == node.get_namespace()}
    return [name for partner in partners if partner in expected and partner != kind
            for name in KINDS[partner].instances if name not in found]


def _compatible(offered: QoSProfile, requested: QoSProfile) -> bool:
    return bool(qos_check_compatible(offered, requested)[0] != QoSCompatibility.ERROR)
