# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a restarted node was in the gait, as others remember it."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.nodes.messages.canonical_state import GaitMemoryReader
from dmp_cpg_ros.nodes.messages.interfaces import BLIND_NS
from dmp_cpg_ros.nodes.messages.values import header_ns

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

FRESH_NS = 20_000_000
"""In lock-step: age up to which a restarted node goes on from a memory of the gait [ns]. Within it
the robot has not moved, which waits; in real time the gait goes on without the node for longer.
"""

PATIENT_NS = 300_000_000
"""In real time: how long a node that may have been restarted waits for the memory [ns]. It is
latched, and may come after the first tick.
"""


class GaitMemory:
    """Listens for what a node held before it was restarted, until its first tick.

    Parameters
    ----------
    node : SuiteNode
        Who listens.
    gaits : KnownGaits
        Gaits that are known.
    """

    def __init__(self, node: SuiteNode, gaits: KnownGaits) -> None:
        """Listen."""
        self._node, self._reader = node, GaitMemoryReader(gaits)
        self._kept: deque[Any] = deque(maxlen=1)
        self._heard = node.listen('gait_memory', self._kept.append)
        self._asked, self._began_ns = False, -1
        self._fresh_ns = node.return_ns + BLIND_NS if node.return_ns else FRESH_NS

    def awaited(self, stamp_ns: int) -> bool:
        """Whether nothing is remembered yet that may be; a run's first tick has the stamp 0."""
        if self._asked or self._kept or not self._node.return_ns or stamp_ns <= 0:
            return False
        if self._began_ns < 0:
            self._began_ns = stamp_ns
        return stamp_ns - self._began_ns < PATIENT_NS

    def take(self, stamp_ns: int) -> tuple[float, Any] | None:
        """At the first tick: the time since the memory [s] and what it says, if it is of the
        tick or of one shortly before; None at all others.
        """
        if self._asked:
            return None
        self._asked = True
        if self._heard is not None:
            self._node.leave(self._heard)
        for message in self._kept:
            age = stamp_ns - header_ns(message)
            if 0 <= age <= self._fresh_ns:
                try:
                    return 1e-9 * age, self._reader.read(message)
                except DataError as error:
                    self._node.drop('gait_memory', error)
        return None
