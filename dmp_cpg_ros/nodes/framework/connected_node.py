# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Topics and services of a node, within its process and to others, which end with a clean-up."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from dmp_cpg_ros.nodes.framework.commands import Commands
from dmp_cpg_ros.nodes.framework.judging import Later
from dmp_cpg_ros.nodes.framework.lifecycle import GuardedLifecycleNode
from dmp_cpg_ros.nodes.framework.local_delivery import LocalDelivery, SuitePublisher
from dmp_cpg_ros.nodes.framework.ticks import drain
from dmp_cpg_ros.nodes.framework.writers import TopicWriters
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader
from dmp_cpg_ros.nodes.messages.interfaces import (
    PUBLISHER_DEPTH,
    REPEATED,
    SELDOM,
    Interface,
    expected_count,
    interface,
    partners,
)

WATCH_EVERY_S = 0.5
"""How often strangers are looked for [s]."""


REMEMBERED = 4
"""In lock-step: how many of the last messages of a latched topic that tells something at every
tick are read by who comes late.
"""

HEARD_WITHIN_S = 1.0
"""How long all readers together may take to hear the last that a node has said [s]; one that was
killed has not acknowledged anything."""


class ConnectedNode(GuardedLifecycleNode):
    """A lifecycle node with interfaces of the table.

    Attributes
    ----------
    local : LocalDelivery or None
        How it reaches nodes of the same process; None where it is alone.
    lossy : bool
        Whether messages come over a link that loses some, and in any order.
    writers : TopicWriters
        Who writes its topics.
    """

    local: LocalDelivery | None = None
    lossy = False

    def __init__(self, name: str, **options: Any) -> None:
        """Create the node."""
        super().__init__(name, **options)
        self._undo: list[Callable[[], object]] = []
        self._said: list[Callable[[], None]] = []
        self._late: list[Callable[[], None]] = []
        self._not_waking: dict[str, Subscription] = {}
        self._inputs: list[tuple[Interface, Subscription]] = []
        self._outputs: list[tuple[Interface, Publisher]] = []
        self.writers, self._commands = TopicWriters(self), Commands(self)
        self.create_steady_timer(WATCH_EVERY_S, lambda: self.writers.watch(
            dict.fromkeys(topic for topic, _ in (*self._inputs, *self._outputs))))

    def readers(self, topic: Interface) -> tuple[str, ...]:
        """Kinds of nodes that read one of this node's topics, and are waited for."""
        return self.outside(partners(topic, readers=True))

    def leg_of(self, joint: str) -> str:
        """Leg that a joint belongs to, for a node that reads what the legs send."""
        return joint.partition('_')[0]

    def outside(self, kinds: Iterable[str]) -> tuple[str, ...]:
        """Those of some kinds of nodes that are not in this process."""
        inside = self.local.kinds if self.local is not None else ()
        return tuple(kind for kind in kinds if kind not in inside)

    def publisher(self, name: str) -> SuitePublisher:
        """Create a publisher of an interface of the table."""
        topic = interface(name)
        qos = topic.publisher_qos
        repeated = topic.name in REPEATED and self.lock_step
        if topic.latched and repeated:  # it tells at every tick, and the recorder may lag
            qos.depth = PUBLISHER_DEPTH
        publisher = self.create_publisher(topic.type, topic.name, qos)
        self._undo.append(partial(self.destroy_publisher, publisher))
        self._outputs.append((topic, publisher))
        if topic.latched and self.local is not None and not topic.name.startswith('~'):
            self.local.latch(topic.name)
            self._undo.append(partial(self.local.unlatch, topic.name))
        # In real time nobody waits for a recorder that lags.
        waits = topic.latched and self.lock_step and name in SELDOM
        return SuitePublisher(publisher, topic.name, self.local, self._said if repeated else None,
                              HEARD_WITHIN_S if waits else 0.0)

    def listen(self, topic: str | Interface, callback: Callable[[Any], None], *,
               command: bool = False, raw: bool = False, wakes: bool = True,
               qos: QoSProfile | None = None) -> Subscription | None:
        """Create a subscription whose callback runs while the node is active.

        Messages that cannot be read, or that the callback refuses by raising
        :class:`~dmp_cpg_ros.core.errors.DataError`, are dropped and counted
        (:class:`~dmp_cpg_ros.nodes.framework.lifecycle.GuardedLifecycleNode`). So the bytes are
        read here: what the middleware cannot read it would drop without a word.

        Parameters
        ----------
        topic : str or Interface
            Interface of the table, or its name.
        callback : callable (message)
            Latched topics are also delivered while the node is configured and not active. Kinds
            that :mod:`~dmp_cpg_ros.nodes.messages.cdr` reads come as its classes from
            other processes, unless ``command``.
        command : bool
            Whether the queue is emptied at the start of every tick, and what was taken counted on
            ``~/commands_taken``.
        raw : bool
            Whether the callback takes serialized bytes.
        wakes : bool
            Whether a message wakes the node; else it waits for :meth:`look_after`.
        qos : QoSProfile, optional
            Default: the profile of the interface for the suite's nodes.

        Returns
        -------
        Subscription or None
            None when all publishers are in this process.
        """
        topic = topic if isinstance(topic, Interface) else interface(topic)
        local = self.local
        inside = local if local is not None and local.kinds.issuperset(topic.publishers) else None
        latched, read = topic.latched, serialized_reader(topic.type, as_message=command)

        def take(message: Any) -> None:
            if self.active or (latched and self.configured):
                callback(message if raw or inside else read(message))

        if inside is not None:
            guarded = self.guarded(topic.name, take)
            inside.attach(topic.name, guarded)
            self._undo.append(partial(inside.detach, guarded))
            if latched:
                self._late.append(partial(inside.catch_up, topic.name, guarded))
            return None
        receive: Callable[..., None] = take
        informed = command or expected_count(topic.publishers) > 0
        if command:
            receive = self._commands.counted(topic.name, take)
        elif informed:
            receive = self.writers.all_of(topic, take) if raw else (
                self.writers.only(topic, callback, read))
        usual = topic.lossy_qos if self.lossy else topic.reader_qos
        if topic.latched and topic.name in REPEATED and self.lock_step:
            usual.depth = REMEMBERED  # a node that is restarted goes on from one of these ticks
        subscription = self.create_subscription(
            topic.type, topic.name, receive, qos or usual, raw=True)
        if informed:
            subscription._callback_type = type(subscription).CallbackType.WithMessageInfo
        self._undo.append(partial(self.destroy_subscription, subscription))
        self._inputs.append((topic, subscription))
        if command:
            self._commands.add(topic, subscription)
        if not wakes:
            self._not_waking[topic.name] = subscription
        return subscription

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Subscriptions whose messages wake the node, for the executor."""
        quiet = self._not_waking.values()
        return (entry for entry in super().subscriptions if entry not in quiet)

    def look_after(self) -> None:
        """Take what waits of the topics that do not wake the node."""
        for subscription in list(self._not_waking.values()):
            drain(subscription)

    def look_every(self, period_s: float, look: Callable[[], None] | None = None) -> None:
        """Call :meth:`look_after`, or something else, with a period of wall time [s]."""
        self._undo.append(partial(self.destroy_timer, self.create_steady_timer(
            period_s, look or self.look_after)))

    def serve(self, name: str, take: Callable[[Any], tuple[bool, str] | Later]) -> None:
        """Create a service of the table; while the node is active, what takes its requests tells,
        now or later, whether they are accepted, and what will happen or why not.
        """
        def answer(request: Any, response: Any) -> Any:
            def filled(told: tuple[bool, str]) -> Any:
                response.success, response.message = told
                return response

            told = take(request) if self.active else (
                False, f'{self.get_name()} is {self.state_label}, not active')
            return told.made_by(filled) if isinstance(told, Later) else filled(told)

        service = interface(name)
        served = self.create_service(service.type, service.name, answer)
        self._undo.append(partial(self.destroy_service, served))

    def leave(self, subscription: Subscription) -> None:
        """Destroy a subscription that nobody needs any more."""
        self._inputs = [entry for entry in self._inputs if entry[1] is not subscription]
        self.destroy_subscription(subscription)

    def destroy_entities(self) -> None:
        """Destroy the publishers, subscriptions and services of :meth:`configure`, once what was
        said has been heard: what a reader has to be sent again goes with its publisher.
        """
        end_s = time.monotonic() + HEARD_WITHIN_S
        for _, publisher in self._outputs[1:] if self.context.ok() else ():
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, end_s - time.monotonic())))
        for undo in reversed(self._undo):
            undo()
        self._undo, self._inputs, self._not_waking = [], [], {}
        self._commands.forget()
        self.writers.forget()
        self._outputs = self._outputs[:1]
