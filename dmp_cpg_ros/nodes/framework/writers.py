# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One writer per topic: its messages are told from those of others by their numbers and stamps.

The middleware numbers the messages of every publisher from 1 on. rclpy of Jazzy hands that number
to callbacks and keeps the publisher's identity to itself, so a reader knows the writer of a topic
by a run of numbers that goes on, by no more than one for each tick of the robot's time. Somebody
else's message is behind it, or ahead of it, or has the stamp of a tick that has been written
already. Who the others are, the graph tells. Another publisher becomes the writer when the former
one is silent and nobody else is in the graph. In lock-step a writer repeats its last message for a
node that was restarted; that changes nothing for the others.

Who has sent exactly as many messages as the writer and is quicker at every tick passes: numbers
protect from mistakes and from what does not know them, DDS Security from the rest.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any

from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.messages.cdr import serialized_stamp
from dmp_cpg_ros.nodes.messages.interfaces import SHARED, Interface, expected_count
from dmp_cpg_ros.suite_table import KINDS

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

SILENT_NS = 500_000_000
"""Time without a message of the writer after which another one may take over [ns]."""

REMEMBERED_NS = 2_000_000_000
"""Time for which a stranger is remembered after its last message [ns]."""

LEARNING = 50
"""Messages of a writer from which the length of a tick is learned."""

SHORTEST_TICK_NS = 500_000
"""Stamps of two ticks differ by so much at least [ns]."""

MADE_UP_NS, FASTEST = 500_000_000, 4
"""In real time: robot's time between two messages beyond that of the clock [ns], and how much
faster than the clock a robot's time may go.
"""

PROVEN = 5
"""Messages in a row, of nobody else, from which one of several publishers is the writer."""

LOST = 20
"""Messages in a row that may be lost of a writer that sends on change, or is not known yet."""

LOOK_EVERY_S = 0.2
"""How often the graph is asked for the publishers of a topic at most [s]."""

SEVERAL_S = 2.0
"""Time within which commands of several publishers take turns [s]."""

STALE_NS = 250_000_000
"""In real time: age from which messages of ticks are not worth being worked through [ns]."""


class WriterWatch:
    """Which messages of a topic are its writer's.

    Parameters
    ----------
    may_take_over : callable () → bool or None
        Whether the graph knows nobody who should not write this topic; None when it knows the
        writer too. Whoever sends some messages while all others are silent is the writer then.
    ticked : bool
        Whether the topic has one stamped message for every tick; else one for every change.
    lock_step : bool
        Whether no message is lost and robot's time does not keep to the clock.
    """

    __slots__ = ('_heard_ns', '_last', '_learned', '_lock_step', '_may_take_over', '_stamp_ns',
                 '_repeats', '_stranger', '_stranger_ns', '_tick_ns', '_ticked', '_tried')

    def __init__(self, may_take_over: Callable[[], bool | None], *, ticked: bool = True,
                 lock_step: bool = False) -> None:
        """Know no writer yet."""
        self._may_take_over, self._ticked, self._lock_step = may_take_over, ticked, lock_step
        self._stranger, self._stranger_ns = -1, -REMEMBERED_NS
        self._begin(0, 0, -SILENT_NS)

    def _begin(self, number: int, stamp_ns: int, now_ns: int) -> None:
        self._last, self._stamp_ns, self._heard_ns = number, stamp_ns, now_ns
        self._tick_ns, self._learned, self._repeats = 0, 0, 0
        self._tried = (0, 0, 0)

    def admits(self, number: int | None, stamp_ns: int, now_ns: int) -> bool:
        """Whether a message is the writer's; True where the middleware does not number.

        Parameters
        ----------
        number : int or None
            Number that the message has among those of its publisher.
        stamp_ns : int
            Its stamp [ns]; of no meaning unless ticked.
        now_ns : int
            Time of its reception [ns].
        """
        ahead, passed_ns = (number or 0) - self._last, stamp_ns - self._stamp_ns
        if self._is_repeat(ahead, passed_ns):
            self._repeats = ahead
            return True
        silent = now_ns - self._heard_ns > SILENT_NS
        stranger = number is not None and number == self._stranger + 1
        if number is None or (self._continues(ahead, passed_ns, now_ns)
                              and not (silent and stranger)):
            if ahead > 0 and (self._learned < LEARNING or passed_ns < ahead * self._tick_ns):
                self._learned += 1
                own_ns = passed_ns // max(1, ahead - self._repeats)
                self._tick_ns = min(self._tick_ns or own_ns, own_ns)
            self._repeats = 0
            self._last, self._stamp_ns = number or 0, stamp_ns
            # What is sent again after a loss is received later than what waited behind it.
            self._heard_ns = max(self._heard_ns, now_ns)
            return True
        if silent:
            alone = self._may_take_over()
            if alone is None and not self._ticked and self._stranger < 0:
                return True  # nothing tells the writer from others before its topic has one
            if alone or (alone is None and self._ticked and not stranger):
                goes_on = number == self._tried[0] + 1 and stamp_ns > self._tried[1]
                self._tried = number, stamp_ns, 1 + (self._tried[2] if goes_on else 0)
                if alone or self._lock_step or self._tried[2] >= PROVEN:
                    self._begin(number, stamp_ns, now_ns)
                    return True
                return False
        self._tried, self._stranger_ns = (0, 0, 0), now_ns
        if stranger or not (silent and self._ticked):
            self._stranger = number
        return False

    @property
    def known(self) -> bool:
        """Whether the topic has had a writer."""
        return self._last > 0

    def may_admit(self, number: int | None, stamp_ns: int, now_ns: int) -> bool:
        """Whether :meth:`admits` can be true: False for most of what is not the writer's."""
        return (number is None or now_ns - self._heard_ns > SILENT_NS
                or self._is_repeat(number - self._last, stamp_ns - self._stamp_ns)
                or self._continues(number - self._last, stamp_ns - self._stamp_ns, now_ns))

    def has_strangers(self, now_ns: int) -> bool:
        """Whether strangers have been heard lately."""
        return now_ns - self._stranger_ns < REMEMBERED_NS

    def _is_repeat(self, ahead: int, passed_ns: int) -> bool:
        return (self._lock_step and self._ticked and self._last > 0 and passed_ns == 0
                and ahead == self._repeats + 1)

    def _continues(self, ahead: int, passed_ns: int, now_ns: int) -> bool:
        """Whether a message can be the writer's next one, with losses before it perhaps."""
        if ahead < 1 or not self._last:
            return False
        if not self._ticked:
            # In lock-step a latched topic begins with what was told before its reader came, of
            # which the reader's queue keeps the newest.
            return self._last + ahead != self._stranger + 1 and (ahead == 1 or (
                self._stranger < 0 and (self._lock_step or ahead <= LOST)))
        if self._learned < LEARNING:
            return ahead <= LOST and passed_ns >= (ahead - self._repeats) * SHORTEST_TICK_NS
        if self._lock_step:
            return ahead <= self._repeats + 1 and passed_ns == self._tick_ns
        # A clock that is set back must not make the writer a stranger.
        # Ticks may all have been lost between those from which their length was learned.
        shorter = ahead == 1 and not self.has_strangers(now_ns)
        return (SHORTEST_TICK_NS if shorter else ahead * self._tick_ns) <= passed_ns <= (
            FASTEST * max(0, now_ns - self._heard_ns) + MADE_UP_NS)


class TopicWriters:
    """Who writes the topics of a node: its readers hear the suite's own writers only.

    Strangers are refused, counted and named. Of commands, which several may send, the newest acts.

    Parameters
    ----------
    node : SuiteNode
        The node whose topics these are.
    """

    def __init__(self, node: SuiteNode) -> None:
        """Know no topic yet."""
        self._node = node
        self._watches: dict[str, list[WriterWatch]] = {}
        self._looked: dict[str, tuple[float, bool | None]] = {}
        self._own: set[str] = set()
        self._several: dict[str, float] = {}

    def forget(self) -> None:
        """Forget the writers that were read, with the readers."""
        self._watches = {}

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
        ticked, latched = hasattr(topic.type(), 'header') and not topic.latched, topic.latched
        may_take_over = partial(self._may_take_over, topic)
        by_leg = {leg: WriterWatch(may_take_over, ticked=ticked, lock_step=lock_step)
                  for leg in (LEGS if several else ('',))}
        alone, watches = by_leg.get(''), list(by_leg.values())
        self._watches[topic.name] = watches

        def receive(data: Any, information: Any = None) -> None:
            if not (node.active or latched):
                return
            if information is None:  # the events executor hands both over as one
                data, information = data
            number, now_ns = (information['publication_sequence_number'],
                              information['received_timestamp'])
            stamp_ns = serialized_stamp(data) if ticked else 0
            if not any(watch.may_admit(number, stamp_ns, now_ns) for watch in watches):
                self._refuse(topic)
                return
            if ticked and not lock_step and time.time_ns() > now_ns + STALE_NS:
                return
            message = read(data)  # only what can be read makes its sender the writer
            watch = alone or by_leg.get(node.leg_of((message.name or ('',))[0]))
            if watch is None or watch.admits(number, stamp_ns, now_ns):  # no leg: it is refused
                callback(message)
            else:
                self._refuse(topic)

        return receive

    def numbered(self, topic: str, callback: Callable[[Any], None]) -> Callable[..., None]:
        """Return a callback that takes everybody's commands, and notices that several send."""
        former, changed_s = 0, -inf

        def receive(message: Any, information: Any = None) -> None:
            nonlocal former, changed_s
            if information is None:  # as in only
                message, information = message
            number = information['publication_sequence_number'] or 0
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
        node, now_ns, now_s = self._node, time.time_ns(), time.monotonic()
        for topic in topics:
            count = expected_count(topic.publishers)
            if not count or topic.name.startswith('~') or topic.name in SHARED:
                continue
            too_many = node.count_publishers(node.resolve_topic_name(topic.name)) > count
            if (too_many and self._publishers(topic)[1]) or any(
                    watch.has_strangers(now_ns) for watch in self._watches.get(topic.name, ())):
                self._name_strangers(topic)
            else:
                node.clear(f'writer of {topic.name}')
        for name, then_s in self._several.items():
            if now_s < then_s + SEVERAL_S:
                ends = node.get_publishers_info_by_topic(node.resolve_topic_name(name))
                who = ', '.join(sorted({end.node_name for end in ends}))
                node.warn(f'writers of {name}', f'several publish {name} ({who}): the newest acts')
            else:
                node.clear(f'writers of {name}')

    def _publishers(self, topic: Interface) -> tuple[bool, list[str]]:
        """Whether the suite's own node publishes a topic, and names of those that should not.

        A driver of another name may stand for the suite's node where that has not been there.
        """
        node = self._node
        ends = node.get_publishers_info_by_topic(node.resolve_topic_name(topic.name))
        space, names = node.get_namespace(), {
            name for kind in topic.publishers if kind in KINDS for name in KINDS[kind].instances}
        own = {end.node_name for end in ends
               if end.node_name in names and end.node_namespace == space}
        others = {f'{end.node_namespace.rstrip("/")}/{end.node_name}' for end in ends
                  if end.node_name not in own or end.node_namespace != space}
        if own and not others:
            self._own.add(topic.name)
        few = len(ends) <= expected_count(topic.publishers)
        return bool(own), [] if few and topic.name not in self._own else sorted(others)

    def _may_take_over(self, topic: Interface) -> bool | None:
        """For a :class:`WriterWatch`; the graph is not asked at every message."""
        now_s, (then_s, known) = time.monotonic(), self._looked.get(topic.name, (-inf, False))
        if now_s > then_s + LOOK_EVERY_S:
            own, strangers = self._publishers(topic)
            known = None if own and strangers else not strangers
            self._looked[topic.name] = now_s, known
        return known

    def _refuse(self, topic: Interface) -> None:
        """Count a message of a stranger, and say who it is."""
        health, key = self._node.health, f'writer of {topic.name}'
        health.rejected[topic.name] = health.rejected.get(topic.name, 0) + 1
        if not health.has_problem(key):
            self._name_strangers(topic)

    def _name_strangers(self, topic: Interface) -> None:
        who = ', '.join(self._publishers(topic)[1]) or 'another node of the same name'
        self._node.warn(f'writer of {topic.name}', f'{topic.name} is published by {who} too; only '
                        f'the messages of {" and ".join(topic.publishers)} are taken')
