# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a restarted node was in the gait, as others remember it."""

from __future__ import annotations

import time
from collections import deque
from math import inf
from typing import TYPE_CHECKING, Any

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.suite_parameters import TickParameters
from dmp_cpg_ros.nodes.messages.canonical_state import GaitMemoryReader
from dmp_cpg_ros.nodes.messages.interfaces import BLIND_NS
from dmp_cpg_ros.nodes.messages.values import header_ns

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

FRESH_NS = 20_000_000
"""In lock-step: age up to which a restarted node goes on from a memory of the gait [ns]. Within it
the robot has not moved, which waits; in real time the gait goes on without the node for longer.
"""

PATIENT_NS = 500_000_000
"""In real time: how long a node that may have been restarted waits for the memory, and for the
gains without which it would be at rest [ns]. They are latched and may come after the first tick,
for participants announce themselves four times a second; sooner nobody believes another writer.
Gains are waited for as long as the others go on without the node where a memory has come, and a
memory as long where they do not stop the gait.
"""

LOCK_STEP_S, LOOK_EVERY_S = 2.0, 0.1
"""In lock-step, where the robot waits: how long the first tick of a node that may have been
restarted waits for the memory, and how often it is looked whether that is over [s].
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
        self._held: tuple[int, dict[str, Any]] | None = None
        self._heard = node.listen('gait_memory', self._hear)
        self._asked, self._began_ns = False, -1
        if node.lock_step:
            self._until_s = inf
            node.look_every(LOOK_EVERY_S, self._try_again)
        self._fresh_ns = node.return_ns + BLIND_NS if node.return_ns else FRESH_NS

    def awaited(self, stamp_ns: int, values: dict[str, Any]) -> bool:
        """Whether nothing is remembered yet that may be; a run's first tick has the stamp 0. In
        lock-step the node takes the tick as soon as that is over, and it knows the parameters of
        the others and what acts; a tick of before the memory it does not take at all.
        """
        if self._asked or stamp_ns <= 0:
            return False
        if self._node.lock_step:
            now_s, certified = time.monotonic(), self._node.certified
            self._until_s = min(self._until_s, now_s + LOCK_STEP_S)
            known_ns = header_ns(self._kept[0]) if self._kept else -1
            if known_ns > stamp_ns:
                return True  # all have ended that tick, also this node, before it died
            values['inhibition_gains'] = gains = self._node.inputs.before(
                'inhibition_gains', stamp_ns)
            acting_ns = min(known_ns, stamp_ns - self._node.parameters_of(TickParameters).tick_ns)
            waits = (certified is not None and certified.others.awaited()) or (
                now_s < self._until_s and (not self._kept or not gains or gains[0] < acting_ns))
            self._held = (stamp_ns, values) if waits else None
            return waits
        gains = values.get('inhibition_gains')
        if not self._node.return_ns or (self._kept and gains is not None):
            return False
        if self._began_ns < 0:
            self._began_ns = stamp_ns
        goes_on = self._kept or (gains is not None and not gains[1].latest.requested)
        longest_ns = max(PATIENT_NS, self._node.return_ns) if goes_on else PATIENT_NS
        return stamp_ns - self._began_ns < longest_ns

    def _hear(self, message: Any) -> None:
        self._kept.append(message)
        self._try_again()

    def _try_again(self) -> None:
        """Take the tick that waits, or let it wait on."""
        held, self._held = self._held, None
        if held is not None:
            self._node.take_parameters()
            self._node.on_tick(*held)

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
