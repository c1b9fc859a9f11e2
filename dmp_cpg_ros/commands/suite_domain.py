# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS domain of a suite, which it has to itself."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rclpy.context import Context
from rclpy.node import Node

from dmp_cpg_ros.nodes.framework import claims, middleware
from dmp_cpg_ros.suite_table import RECORDER, WALKING_NODES

LOOK_S = 1.0
"""How long the graph is searched for nodes of another suite [s]: discovery takes its time."""

LOOK_EVERY_S = 0.1
"""Pause between two searches [s]."""


@contextmanager
def alone_in_domain(namespace: str, meanwhile: Callable[[], Any] = lambda: None
                    ) -> Iterator[Any]:
    """Hold the ROS domain for one suite in a namespace.

    Parameters
    ----------
    namespace : str
        Of the suite.
    meanwhile : callable ()
        What is done, and handed on, while the graph has time to tell of others.

    Raises
    ------
    AlreadyRunningError
        If another has it, or nodes of one are in the graph, left over perhaps.
    """
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    middleware.prepare_middleware()
    context = Context()
    middleware.start_ros([], context)
    try:
        domain = context.get_domain_id()
        held = claims.claim(f'{namespace}/suite', domain)
        names = [f'{namespace}/{name}' for name in (*WALKING_NODES, RECORDER)]
        lookout, deadline = Node('lookout', context=context, namespace=namespace), (
            time.monotonic() + LOOK_S)
        made = meanwhile()
        # Claims tell at once of nodes on this machine; the graph, after a while, of all others.
        others = claims.claimed(names, domain) or _in_graph(lookout, names, deadline)
        lookout.destroy_node()
    finally:
        context.try_shutdown()
    with held:
        if others:
            raise claims.AlreadyRunningError(
                claims.already_running(domain, f'nodes {", ".join(others)}'))
        yield made


def _in_graph(lookout: Node, names: Sequence[str], deadline: float) -> list[str]:
    """Those of some nodes that are in the graph, looked for as long as there are none."""
    while True:
        there = {f'{space.rstrip("/")}/{name}'
                 for name, space in lookout.get_node_names_and_namespaces()}
        found = [name for name in names if name in there]
        if found or time.monotonic() > deadline:
            return found
        time.sleep(LOOK_EVERY_S)
