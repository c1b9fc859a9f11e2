# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whoever floods a topic of the suite is not received any more, until it leaves the graph.

To refuse each message is not enough: 16,000 a second fill sockets and queues that the topic's own
writer needs too, and take the time in which ticks should be computed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from dmp_cpg_ros.nodes.framework.packet_filter import GUID, OWN_SOCKETS
from dmp_cpg_ros.nodes.framework.strangers import UNNAMED, full_name
from dmp_cpg_ros.nodes.messages.interfaces import Interface, expected_count

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.writers import Publishers

MANY, WITHIN_NS = 100, 100_000_000
"""Messages that are not the writer's, and time of their reception within which so many are a flood
[ns]: four times as many as the suite's own writers send at 250 Hz.
"""

OWN_MOST = 50
"""Messages that one writer of the suite sends within that time at most."""


class Floods:
    """Notices floods on topics that have their own writers.

    Parameters
    ----------
    publishers : Publishers
        Who publishes a topic, as the graph tells.
    tell : callable (topic, text)
        Told who is not received any more; again when its name is known, and with an empty text
        when it has left.
    """

    def __init__(self, publishers: Publishers, tell: Callable[[Interface, str], object]) -> None:
        """Know of no flood."""
        self._publishers, self._tell = publishers, tell
        self._counts: dict[str, tuple[int, int]] = {}
        self._out: dict[str, frozenset[bytes]] = {}
        self._told: dict[str, str] = {}

    def note(self, topic: Interface, now_ns: int, *, of_all: bool = False) -> None:
        """Count a message; when there are many, shut out who should not write the topic.

        Parameters
        ----------
        topic : Interface
            Its topic.
        now_ns : int
            Time of its reception [ns].
        of_all : bool
            Whether those of its writers are counted too; else only what is not theirs.
        """
        name = topic.name
        count, since_ns = self._counts.get(name, (0, now_ns))
        many = MANY + (OWN_MOST * expected_count(topic.publishers) if of_all else 0)
        if count + 1 < many:
            self._counts[name] = count + 1, since_ns
            return
        self._counts[name] = 0, now_ns
        if now_ns - since_ns < WITHIN_NS:
            self._shut_out(topic)

    def look(self, topic: Interface) -> None:
        """Forget who has left the graph, and name who has a name now; called now and then."""
        if out := self._out.get(topic.name):
            strangers = self._strangers(topic)
            left = {writer: strangers[writer] for writer in out if writer in strangers}
            if len(left) < len(out):
                self._ask(topic, frozenset(left))
            self._name(topic, left)

    def forget(self) -> None:
        """Receive everybody again."""
        for name in self._out:
            OWN_SOCKETS.shut_out((self, name), ())
        self._counts, self._out, self._told = {}, {}, {}

    def _strangers(self, topic: Interface) -> dict[bytes, str]:
        """Names by GUID. Who has no name may be a writer of the suite, unless all are there."""
        own, strangers = self._publishers.ends(topic)
        complete = len(own) >= expected_count(topic.publishers)
        return {bytes(end.endpoint_gid[:GUID]): full_name(end.node_name, end.node_namespace)
                for end in strangers if complete or end.node_name != UNNAMED}

    def _shut_out(self, topic: Interface) -> None:
        strangers = self._strangers(topic)
        if strangers and self._ask(topic, frozenset(strangers)):
            self._name(topic, strangers)

    def _name(self, topic: Interface, writers: dict[bytes, str]) -> None:
        """Tell who is not received, unless that is what was told last."""
        who = ', '.join(sorted({'a node of no name yet' if UNNAMED in name else name
                                for name in writers.values()}))
        if who != self._told.get(topic.name, ''):
            self._told[topic.name] = who
            self._tell(topic, who and f'{topic.name} is flooded by {who}: nothing of that is '
                       'received any more')

    def _ask(self, topic: Interface, writers: frozenset[bytes]) -> bool:
        self._out[topic.name] = writers
        return OWN_SOCKETS.shut_out((self, topic.name), writers)
