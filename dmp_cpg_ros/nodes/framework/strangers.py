# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who in the ROS graph may have sent what says nothing of its sender: requests, parameter events.

rclpy hands over neither the client of a request nor the publisher of an event. The graph knows
which nodes have a client of that service or publish that topic; those that are none of the
suite's are told, a maintainer's tool as well as an intruder.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from math import inf

from rclpy.exceptions import NotInitializedException
from rclpy.node import Node, NodeNameNonExistentError

from dmp_cpg_ros.suite_table import KINDS

LOOK_EVERY_S = 0.5
"""Period in which the graph is asked once at most, however much is dropped [s]."""

OWN = frozenset(name for kind in KINDS.values() for name in kind.instances)
"""Names of the suite's nodes."""


UNNAMED = '_NODE_NAME_UNKNOWN_'
"""What the graph calls a node of which it has heard no name yet, or that has none."""


def full_name(name: str, space: str) -> str:
    """Name of a node with its namespace."""
    return f'{space.rstrip("/")}/{name}'


ANYBODYS = '{} is not only of the suite{}: whoever is faster answers'
"""What is said to who asks a service that :meth:`Strangers.serving` tells of."""


class Strangers:
    """Names of nodes that are not the suite's, looked up in the graph of one of its nodes.

    Parameters
    ----------
    node : Node
        Whose graph and namespace these are.
    """

    def __init__(self, node: Node) -> None:
        """Know nobody yet."""
        self._node = node
        self._known: dict[str, tuple[float, str]] = {}

    def asking(self, service: str) -> str:
        """Text that names who has a client of a service; empty for nobody."""
        return self._told(f'clients of {service}', 'asked by', partial(
            self._ends, service, self._node.get_client_names_and_types_by_node))

    def serving(self, service: str) -> str:
        """Text that names who serves a service of the suite and is none of its nodes: of two
        servers whoever is faster answers. Empty for nobody.
        """
        return self._told(f'servers of {service}', 'served by', partial(
            self._ends, service, self._node.get_service_names_and_types_by_node))

    def _ends(self, service: str, of_node: Callable[[str, str], list[tuple[str, list[str]]]]
              ) -> Iterable[str]:
        """Nodes that have an end of a service."""
        full = self._node.resolve_service_name(service)
        for name, space in self._node.get_node_names_and_namespaces():
            with suppress(NodeNameNonExistentError):  # it has just gone
                if any(full == end for end, _ in of_node(name, space)):
                    yield self._stranger(name, space)

    def publishing(self, topic: str) -> str:
        """Text that names who publishes a topic; empty for nobody."""
        def names() -> Iterable[str]:
            for end in self._node.get_publishers_info_by_topic(
                    self._node.resolve_topic_name(topic)):
                yield self._stranger(end.node_name, end.node_namespace)

        return self._told(f'topic {topic}', 'may come from', names)

    def _stranger(self, name: str, space: str) -> str:
        """Full name of a node, empty if it is the suite's own."""
        own = (name in OWN or name == self._node.get_name()) and (
            space == self._node.get_namespace())
        return '' if own else full_name(name, space)

    def _told(self, key: str, verb: str, names: Callable[[], Iterable[str]]) -> str:
        now_s, (then_s, text) = time.monotonic(), self._known.get(key, (-inf, ''))
        if now_s >= then_s + LOOK_EVERY_S:
            with suppress(NotInitializedException):  # the node ends
                who = ', '.join(sorted(set(filter(None, names()))))
                text = f'; {verb} {who}' if who else ''
            self._known[key] = now_s, text
        return text
