# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What nodes know of the stop that acts, so that no death of some of them ends it.

The oscillators tell what acts on them (``acting_gains``), and the robot, which outlives all
others, keeps what they have told (``kept_gains``). Both are latched, and told when they change,
with the stamp of the knowledge: that of the gains that were heard, 0 where none were. A restarted
``inhibition`` takes up the newest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.clock import RESET_NS
from dmp_cpg_ros.nodes.messages.inhibition import InhibitionGainsReader, InhibitionGainsWriter
from dmp_cpg_ros.nodes.messages.values import header_ns

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

Heard = Callable[[int, Inhibition], None]

TELLERS = ('acting_gains', 'kept_gains')
"""Topics on which it is told what is known."""

PATIENT_NS, BRIEF_NS = 5_000_000_000, 400_000_000
"""Time for which a restarted node waits to be told what acts, longer than the 3 s after which a
participant announces itself again, and where nobody is to be expected who could tell [ns].
"""


class KnownStop:
    """The newest that a node knows of the inhibition, told when it changes.

    Parameters
    ----------
    node : SuiteNode
        Who knows it.
    topic : str
        One of ``TELLERS``.
    """

    def __init__(self, node: SuiteNode, topic: str) -> None:
        """Know nothing."""
        self._writer, self._publisher = InhibitionGainsWriter(), node.publisher(topic)
        self._stamp_ns = -1
        self._told: Inhibition | None = None

    def learn(self, stamp_ns: int, inhibition: Inhibition) -> None:
        """Take what is known as of a stamp [ns], unless something newer is; tell what is new, and
        after the clock was set back what acts.
        """
        if 0 < stamp_ns <= self._stamp_ns - RESET_NS:
            self._stamp_ns, self._told = -1, None
        new = self._told is None or self._stamp_ns <= 0 < stamp_ns or (
            inhibition.differs(self._told))
        if new and stamp_ns >= self._stamp_ns:
            self._stamp_ns, self._told = stamp_ns, inhibition
            self._publisher.publish(self._writer.fill(stamp_ns, inhibition))


def listen(node: SuiteNode, topics: Sequence[str], heard: Callable[[str, int, Inhibition], None]
           ) -> None:
    """Let a node hear what others know: the topic, the stamp [ns] and the inhibition."""
    def take(topic: str, message: Any) -> None:
        heard(topic, header_ns(message), reader.read(message))

    reader = InhibitionGainsReader()
    for topic in topics:
        node.listen(topic, partial(take, topic))


class OthersKnow:
    """The newest of what others tell a node that was restarted.

    Parameters
    ----------
    node : SuiteNode
        The node.
    news : callable (stamp_ns, inhibition)
        Told of what is not older than all before.

    Attributes
    ----------
    newest : (int, Inhibition) or None
        Stamp [ns] and inhibition.
    """

    def __init__(self, node: SuiteNode, news: Heard) -> None:
        """Listen."""
        self.newest: tuple[int, Inhibition] | None = None
        self._node, self._silent, self._news = node, set(TELLERS), news
        self._asked_ns = -1
        listen(node, TELLERS, self.hear)

    def have_told(self, now_ns: int) -> bool:
        """Whether everybody who can tell has, or has had time to since this was asked first."""
        if self._asked_ns < 0:
            self._asked_ns = now_ns
        self._asked_ns = min(self._asked_ns, now_ns)  # the clock may be set back meanwhile
        patience = PATIENT_NS if self.more_may_tell else BRIEF_NS
        return not self._silent or now_ns - self._asked_ns >= patience

    @property
    def more_may_tell(self) -> bool:
        """Whether somebody who can tell has not: one is in the graph, or no robot is there yet."""
        return bool(self._silent) and (
            any(map(self._node.count_publishers, self._silent))
            or not self._node.count_publishers('joint_states'))

    @property
    def known(self) -> Inhibition | None:
        """What acts, as far as it is certain: 0 is the stamp of oscillators that were restarted
        too, and as long as somebody may know more, nothing follows from that.
        """
        if self.newest is None or (self.newest[0] <= 0 and self.more_may_tell):
            return None
        return self.newest[1]

    def hear(self, topic: str, stamp_ns: int, inhibition: Inhibition) -> None:
        """Take what is told on a topic."""
        self._silent.discard(topic)
        if self.newest is None or stamp_ns >= self.newest[0]:
            self.newest = stamp_ns, inhibition
            self._news(stamp_ns, inhibition)
