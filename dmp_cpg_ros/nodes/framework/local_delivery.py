# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Delivery between nodes of one process, past the middleware.

rclpy has no intra-process communication: a message to a node of the same process would be
serialized, sent, and deserialized again. Here the readers' callbacks get the very message, in the
order of publication, one after the other; it is published to the world outside all the same.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable
from functools import partial
from typing import Any

from rclpy.duration import Duration
from rclpy.publisher import Publisher

from dmp_cpg_ros.nodes.messages.cdr import Serialized


class LocalDelivery:
    """Readers by topic, and the queue of what is under way.

    A writer refills its message only at its next tick, so readers must have used it by then. The
    queue is worked off within the first :meth:`publish`; a lock-step robot must therefore wait now
    and then, or the executor would never have its turn.

    Parameters
    ----------
    kinds : collection of str
        Kinds of nodes in this process.
    """

    def __init__(self, kinds: Collection[str]) -> None:
        """Start without readers."""
        self.kinds = frozenset(kinds)
        self._readers: dict[str, list[Callable[[Any], None]]] = {}
        self._latched: dict[str, Any] = {}
        self._queue: deque[tuple[Callable[[Any], None], Any]] = deque()
        self._busy = False

    def attach(self, topic: str, callback: Callable[[Any], None]) -> None:
        """Let a callback have all messages of a topic."""
        self._readers.setdefault(topic, []).append(callback)

    def detach(self, callback: Callable[[Any], None]) -> None:
        """Let a callback have no more messages."""
        for readers in self._readers.values():
            if callback in readers:
                readers.remove(callback)

    def latch(self, topic: str) -> None:
        """Keep the last message of a topic for readers that come late, until :meth:`unlatch`.

        It is the very message: what its writer refills it publishes.
        """
        self._latched[topic] = None

    def unlatch(self, topic: str) -> None:
        """Keep nothing of a topic whose writer has gone."""
        del self._latched[topic]

    def catch_up(self, topic: str, callback: Callable[[Any], None]) -> None:
        """Deliver the message that is kept of a topic, if there is one."""
        message = self._latched.get(topic)
        if message is not None:
            self._deliver(message, [callback])

    def publish(self, topic: str, message: Any) -> None:
        """Deliver a message, after those that are under way."""
        if topic in self._latched:
            self._latched[topic] = message
        self._deliver(message, self._readers.get(topic, ()))

    def _deliver(self, message: Any, callbacks: Iterable[Callable[[Any], None]]) -> None:
        queue = self._queue
        queue.extend([(callback, message) for callback in callbacks])
        if self._busy:
            return
        self._busy = True
        try:
            while queue:
                callback, waiting = queue.popleft()
                callback(waiting)
        finally:
            self._busy = False
            queue.clear()


class SuitePublisher:
    """A publisher of messages and of serialized ones, also to the readers in this process.

    Parameters
    ----------
    publisher : Publisher
        Publishes to the world outside.
    topic : str
        Name of the topic in the table of interfaces.
    local : LocalDelivery, optional
        The process's delivery, where several nodes share it.
    said : list of callable (), optional
        Where to put what publishes a message once more.
    patience_s : float
        How long all readers outside may take to hear the last message before there is another
        one: a latched topic keeps one only, and has nothing to repeat for who lags [s].
    """

    def __init__(self, publisher: Publisher, topic: str, local: LocalDelivery | None,
                 said: list[Callable[[], None]] | None = None, patience_s: float = 0.0) -> None:
        """Keep the parts."""
        self._publisher, self._topic, self._local, self._said = publisher, topic, local, said
        self._patience = Duration(seconds=patience_s) if patience_s else None

    def publish(self, message: Any) -> None:
        """Publish outside, then inside."""
        if self._said is not None:
            self._said.append(partial(self._publish, message))
        self._publish(message)

    def _publish(self, message: Any) -> None:
        if self._patience is not None:
            self._publisher.wait_for_all_acked(self._patience)
        self._publisher.publish(message.serialized if isinstance(message, Serialized) else message)
        if self._local is not None:
            self._local.publish(self._topic, message)
