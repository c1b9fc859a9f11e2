# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node that is none of the suite's reads of it: the messages of the suite's own writers.

Who looks on, drives or plays a scenario would otherwise believe whatever is on a topic. Nodes of
the suite do the same, with diagnostics and ticks
(:class:`~dmp_cpg_ros.nodes.framework.writers.TopicWriters`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from functools import partial
from math import inf
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.framework.floods import Floods
from dmp_cpg_ros.nodes.framework.strangers import UNNAMED
from dmp_cpg_ros.nodes.framework.writer_watch import WriterWatch
from dmp_cpg_ros.nodes.framework.writers import (
    LOOK_EVERY_S,
    Publishers,
    is_ticked,
    only_taken,
    with_number,
)
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader, serialized_stamp
from dmp_cpg_ros.nodes.messages.interfaces import READER_DEPTH, Interface
from dmp_cpg_ros.suite_table import KINDS


class OwnMessages:
    """Readers of a plain node that take the messages of the suite's own writers only.

    Each topic has one writer; those of the legs are not for these readers.

    Parameters
    ----------
    node : Node
        Who reads.
    tell : callable (text)
        Told once who else publishes a topic, and whether that makes a difference.
    lock_step : bool
        Whether no message is lost and robot's time does not keep to the clock.
    """

    def __init__(self, node: Node, tell: Callable[[str], None], *, lock_step: bool = False
                 ) -> None:
        """Read nothing yet."""
        self._node, self._tell, self._lock_step = node, tell, lock_step
        self._publishers = Publishers(node)
        self._floods = Floods(self._publishers, lambda topic, text: None)  # named they are anyhow
        self._watches: list[tuple[Interface, WriterWatch]] = []
        self._told: dict[str, str] = {}
        self._looked: dict[str, float] = {}

    def listen(self, topic: Interface, callback: Callable[[Any], object]) -> Subscription:
        """Subscribe to a topic; what cannot be read, or what the callback refuses by raising
        DataError, is dropped.
        """
        read, ticked = serialized_reader(topic.type, as_message=True), is_ticked(topic)
        watch = self._watched(WriterWatch(
            partial(self._publishers.may_take_over, topic), ticked=ticked,
            lock_step=self._lock_step), topic)

        def receive(data: Any, information: Any = None) -> None:
            data, number, now_ns = with_number(data, information)
            with suppress(DataError):
                stamp_ns = serialized_stamp(data) if ticked else 0
                if not watch.may_admit(number, stamp_ns, now_ns):
                    self._refuse(topic, now_ns)
                    return
                message = read(data)  # only what can be read makes its sender the writer
                if not watch.admits(number, stamp_ns, now_ns):
                    self._refuse(topic, now_ns)
                    return
                if not watch.known:
                    self._name(topic, _all_taken)
                callback(message)

        qos = topic.reader_qos
        qos.depth = max(qos.depth, READER_DEPTH)  # whoever floods it pushes out no other's message
        subscription = self._node.create_subscription(
            topic.type, topic.name, receive, qos, raw=True)
        subscription._callback_type = type(subscription).CallbackType.WithMessageInfo
        return subscription

    def admitting(self, topic: Interface) -> Callable[[int, Mapping[str, Any]], bool]:
        """For messages of ticks that are taken now and then: what tells from its stamp [ns] and
        its information whether one is the writer's. Those in between count as lost.
        """
        watch = self._watched(WriterWatch(
            partial(self._publishers.may_take_over, topic), most_lost=inf), topic)

        def admits(stamp_ns: int, information: Mapping[str, Any]) -> bool:
            _, number, now_ns = with_number(None, information)
            own = watch.admits(number, stamp_ns, now_ns)
            if not own:
                self._refuse(topic, now_ns)
            return own

        return admits

    def forget(self, nodes: Collection[str]) -> None:
        """Take up the writers among nodes that were restarted at once, however lately the ones
        before were heard.
        """
        for topic, watch in self._watches:
            if any(name in nodes for kind in topic.publishers for name in KINDS[kind].instances):
                watch.forget()

    def _watched(self, watch: WriterWatch, topic: Interface) -> WriterWatch:
        self._watches.append((topic, watch))
        return watch

    def _refuse(self, topic: Interface, now_ns: int) -> None:
        self._floods.note(topic, now_ns)
        self._name(topic, only_taken)

    def _name(self, topic: Interface, sentence: Callable[[Interface, str], str]) -> None:
        """Tell who else publishes a topic; nobody does where a writer was only started again."""
        now_s = time.monotonic()
        if now_s < self._looked.get(topic.name, -inf) + LOOK_EVERY_S:
            return
        self._looked[topic.name] = now_s
        who = ', '.join(self._publishers.found(topic)[1])
        if who and UNNAMED not in who and who != self._told.get(topic.name):
            self._told[topic.name] = who
            self._tell(sentence(topic, who))


def _all_taken(topic: Interface, who: str) -> str:
    """Where a stranger was there before the writer of a topic was heard."""
    return (f'{topic.name} is published by {who} too; nothing tells their messages from those of '
            f'{" and ".join(topic.publishers)}')
