# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who writes the topics that a node reads: the suite's own writers are heard, others are named.

A :class:`~dmp_cpg_ros.nodes.framework.writer_watch.WriterWatch` tells the messages of a topic's
writer from those of others, and the graph tells who these are.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosgraph_msgs.msg import Clock

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.framework.floods import Floods
from dmp_cpg_ros.nodes.framework.strangers import full_name
from dmp_cpg_ros.nodes.framework.writer_watch import WriterWatch
from dmp_cpg_ros.nodes.messages.cdr import serialized_stamp
from dmp_cpg_ros.nodes.messages.interfaces import SHARED, Interface, expected_count
from dmp_cpg_ros.suite_table import KINDS

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.connected_node import ConnectedNode

LOOK_EVERY_S = 0.2
"""How often the graph is asked for the publishers of a topic at most [s]."""

SEVERAL_S = 2.0
"""Time within which commands of several publishers take turns [s]."""

STALE_NS = 250_000_000
"""In real time: age from which messages of ticks are not worth being worked through [ns]."""

LONGEST_WAIT_NS = 1_000_000_000
"""What seems to have waited longer in a queue was received before the time of day was set [ns]."""


class Publishers:
    """Who publishes topics of the suite, as the graph tells a node; not asked at every message.

    Parameters
    ----------
    node : Node
        Any node, in the namespace of the suite.
    """

    def __init__(self, node: Node) -> None:
        """Know nobody yet."""
        self._node = node
        self._looked: dict[str, tuple[float, bool | None]] = {}
        self._own: set[str] = set()

    def ends(self, topic: Interface) -> tuple[list[TopicEndpointInfo], list[TopicEndpointInfo]]:
        """Publishers of a topic that are of the suite's own nodes, and those that should not be.

        A driver of another name may stand for the suite's node where that has not been there.
        """
        node = self._node
        ends = node.get_publishers_info_by_topic(node.resolve_topic_name(topic.name))
        space, names = node.get_namespace(), {
            name for kind in topic.publishers if kind in KINDS for name in KINDS[kind].instances}
        own = [end for end in ends if end.node_name in names and end.node_namespace == space]
        others = [end for end in ends if end not in own]
        if own and not others:
            self._own.add(topic.name)
        few = len(ends) <= expected_count(topic.publishers)
        return own, [] if few and topic.name not in self._own else others

    def found(self, topic: Interface) -> tuple[bool, list[str]]:
        """Whether the suite's own node publishes a topic, and names of those that should not."""
        own, others = self.ends(topic)
        return bool(own), sorted({full_name(end.node_name, end.node_namespace) for end in others})

    def may_take_over(self, topic: Interface) -> bool | None:
        """For a :class:`WriterWatch`."""
        now_s, (then_s, known) = time.monotonic(), self._looked.get(topic.name, (-inf, False))
        if now_s > then_s + LOOK_EVERY_S:
            own, strangers = self.found(topic)
            known = None if own and strangers else not strangers
            self._looked[topic.name] = now_s, known
        return known


def with_number(message: Any, information: Mapping[str, Any] | None
                ) -> tuple[Any, int | None, int]:
    """A message, its number among those of its publisher, and when it was received [ns], from
    what an executor hands to a callback: the events executor hands both over as one.

    The middleware tells the time of day, which may be set at any time; it is taken to the
    monotonic clock.
    """
    if information is None:
        message, information = message
    waited_ns = time.time_ns() - information['received_timestamp']
    return (message, information['publication_sequence_number'],
            time.monotonic_ns() - max(0, min(waited_ns, LONGEST_WAIT_NS)))


def is_ticked(topic: Interface) -> bool:
    """Whether a topic has one stamped message for every tick; else one for every change."""
    return not topic.latched and (topic.type is Clock or hasattr(topic.type(), 'header'))


def only_taken(topic: Interface, who: str) -> str:
    """Sentence that tells who publishes a topic beside its writers."""
    return (f'{topic.name} is published by {who} too; only the messages of '
            f'{" and ".join(topic.publishers)} are taken')


class TopicWriters:
    """Who writes the topics of a node: its readers hear the suite's own writers only.

    Strangers are refused, counted and named. Of commands, which several may send, the newest acts.

    Parameters
    ----------
    node : ConnectedNode
        The node whose topics these are.
    """

    def __init__(self, node: ConnectedNode) -> None:
        """Know no topic yet."""
        self._node = node
        self._publishers = Publishers(node)
        self._floods = Floods(self._publishers, self._tell_flood)
        self._watches: dict[str, list[WriterWatch]] = {}
        self._several: dict[str, float] = {}

    def forget(self) -> None:
        """Forget the writers that were read, with the readers."""
        self._watches = {}
        self._floods.forget()

    def only(self, topic: Interface, callback: Callable[[Any], None],
             read: Callable[[bytes], Any]) -> Callable[..., None]:
        """Return a callback that takes the messages of a topic's own writers only.

        Where each leg has a writer, its messages name the leg.

        Parameters
        ----------
        topic : Interface
            The topic.
        callback : callable (message)
            What takes them.
        read : callable bytes → message
            What reads them.

        Returns
        -------
        callable (bytes, information)
        """
        node, lock_step = self._node, self._node.lock_step
        several = expected_count(topic.publishers) > 1
        ticked, latched = is_ticked(topic), topic.latched
        may_take_over = partial(self._publishers.may_take_over, topic)
        by_leg = {leg: WriterWatch(may_take_over, ticked=ticked, lock_step=lock_step)
                  for leg in (LEGS if several else ('',))}
        alone, watches = by_leg.get(''), list(by_leg.values())
        self._watches[topic.name] = watches

        def receive(data: Any, information: Any = None) -> None:
            if not (node.active or (latched and node.configured)):
                return
            data, number, now_ns = with_number(data, information)
            try:
                stamp_ns = serialized_stamp(data) if ticked else 0
                if not any(watch.may_admit(number, stamp_ns, now_ns) for watch in watches):
                    self._refuse(topic, now_ns)
                    return
                if ticked and not lock_step and time.monotonic_ns() > now_ns + STALE_NS:
                    return
                message = read(data)  # only what can be read makes its sender the writer
                watch = alone or by_leg.get(node.leg_of((message.name or ('',))[0]))
                if watch is None or watch.admits(number, stamp_ns, now_ns):  # no leg: is refused
                    callback(message)
                else:
                    self._refuse(topic, now_ns)
            except DataError:
                self._floods.note(topic, now_ns)
                raise

        return receive

    def all_of(self, topic: Interface, callback: Callable[[bytes], None]) -> Callable[..., None]:
        """Return a callback that takes everybody's bytes on a topic, until somebody floods it."""
        def receive(data: Any, information: Any = None) -> None:
            data, _, now_ns = with_number(data, information)
            if topic.name not in SHARED:
                self._floods.note(topic, now_ns, of_all=True)
            callback(data)

        return receive

    def numbered(self, topic: str, callback: Callable[[Any], None]) -> Callable[..., None]:
        """Return a callback that takes everybody's commands, and notices that several send."""
        former, changed_s = 0, -inf

        def receive(message: Any, information: Any = None) -> None:
            nonlocal former, changed_s
            message, number, _ = with_number(message, information)
            number = number or 0
            if number <= former:  # larger steps are losses
                now_s, then_s = time.monotonic(), changed_s
                changed_s = now_s
                if now_s < then_s + SEVERAL_S:
                    self._several[topic] = now_s
            former = number
            callback(message)

        return receive

    def watch(self, topics: Iterable[Interface]) -> None:
        """Name strangers among the publishers of topics that have their own writers, and tell
        where several command; to be called now and then.
        """
        node, now_ns, now_s = self._node, time.monotonic_ns(), time.monotonic()
        for topic in topics:
            count = expected_count(topic.publishers)
            if not count or topic.name.startswith('~') or topic.name in SHARED:
                continue
            too_many = node.count_publishers(node.resolve_topic_name(topic.name)) > count
            if (too_many and self._publishers.found(topic)[1]) or any(
                    watch.has_strangers(now_ns) for watch in self._watches.get(topic.name, ())):
                self._name_strangers(topic)
            else:
                node.clear(f'writer of {topic.name}')
            self._floods.look(topic)
        for name, then_s in self._several.items():
            if now_s < then_s + SEVERAL_S:
                ends = node.get_publishers_info_by_topic(node.resolve_topic_name(name))
                who = ', '.join(sorted({end.node_name for end in ends}))
                node.warn(f'writers of {name}', f'several publish {name} ({who}): the newest acts')
            else:
                node.clear(f'writers of {name}')

    def _refuse(self, topic: Interface, now_ns: int) -> None:
        """Count a message of a stranger, and say who it is."""
        self._floods.note(topic, now_ns)
        health, key = self._node.health, f'writer of {topic.name}'
        health.rejected[topic.name] = health.rejected.get(topic.name, 0) + 1
        if not health.has_problem(key):
            self._name_strangers(topic)

    def _tell_flood(self, topic: Interface, text: str) -> None:
        key = f'flood of {topic.name}'
        if text:
            self._node.warn(key, text)
        else:
            self._node.clear(key)

    def _name_strangers(self, topic: Interface) -> None:
        who = ', '.join(self._publishers.found(topic)[1]) or 'another node of the same name'
        self._node.warn(f'writer of {topic.name}', only_taken(topic, who))
