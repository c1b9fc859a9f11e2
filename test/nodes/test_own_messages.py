# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who looks on, drives or plays a scenario hears the suite's own writers and names others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip('rclpy')

import ros_processes
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from ros_processes import Ros
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from dmp_cpg_ros.commands.live_view import Polled
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.framework.own_messages import OwnMessages
from dmp_cpg_ros.nodes.messages.interfaces import READER_DEPTH, interface, private
from dmp_cpg_ros.nodes.messages.posture_feedback import read_body_mode
from dmp_cpg_ros.nodes.messages.values import header_ns, read_counts, set_stamp, stamp_ns
from dmp_cpg_ros.suite_table import POSTURE, ROBOT

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain

MODES, TICK_NS = interface('body_mode'), 4_000_000

INTRUDER = 'intruder'


class Listener:
    """A plain node that reads what only nodes of the suite should write.

    Attributes
    ----------
    modes : list of str
        Modes of the body that it has heard.
    told : list of str
        What it was told of others.
    """

    def __init__(self, ros: Ros, *, lock_step: bool = False) -> None:
        self._ros, self.modes, self.told = ros, list[str](), list[str]()
        self.node = self.join('listener')
        self.heard = OwnMessages(self.node, self.told.append, lock_step=lock_step)

    def join(self, name: str) -> Node:
        """Another node in the graph."""
        node = Node(name, context=self._ros.context)
        self._ros.nodes.append(node)
        self._ros.executor.add_node(node)
        return node

    def writer(self, name: str, topic: Any = MODES) -> Publisher:
        """Publisher of a node of that name, which its readers and the graph know."""
        node = self.join(name)
        qos = topic.publisher_qos
        if name == INTRUDER:  # nothing of what it floods gets lost
            qos.depth = READER_DEPTH
        publisher = node.create_publisher(topic.type, topic.name, qos)
        self._ros.spin_until(lambda: publisher.get_subscription_count() > 0 and name in {
            end.node_name for end in self.node.get_publishers_info_by_topic(publisher.topic_name)})
        return publisher

    def leave(self, publisher: Publisher, name: str, topic: Any = MODES) -> None:
        """The node of a publisher ends."""
        (node,) = (entry for entry in self._ros.nodes if publisher in entry.publishers)
        self._ros.executor.remove_node(node)
        self._ros.nodes.remove(node)
        node.destroy_node()
        self._ros.spin_until(lambda: name not in {
            end.node_name for end in self.node.get_publishers_info_by_topic(topic.name)})

    def listen(self) -> None:
        """Hear the modes of the body."""
        self.heard.listen(MODES, lambda message: self.modes.append(read_body_mode(message)))

    def until(self, condition: Callable[[], bool]) -> None:
        self._ros.spin_until(condition, what=lambda: f'{self.modes}, {self.told}')


@pytest.fixture
def listener(ros: Ros) -> Listener:
    return Listener(ros)


def test_only_the_writer_of_a_latched_topic_is_heard_and_who_else_sends_is_told_once(
        listener: Listener) -> None:
    """A flood between two looks pushes out nothing; a writer that was started again is taken up
    as soon as nobody else is there.
    """
    listener.listen()
    own = listener.writer(POSTURE)
    own.publish(String(data='standing'))
    listener.until(lambda: listener.modes == ['standing'])
    intruder, ((_, watch),) = listener.writer(INTRUDER), listener.heard._watches
    for mode in ('damped', 'nonsense', 'lying'):
        intruder.publish(String(data=mode))
    listener.until(lambda: watch._stranger == 3)  # of equal numbers nothing tells whose they are
    own.publish(String(data='lowering'))
    for _ in range(READER_DEPTH - 1):
        intruder.publish(String(data='lying'))
    listener.until(lambda: len(listener.modes) > 1)
    assert listener.modes == ['standing', 'lowering']
    assert listener.told == ['body_mode is published by /intruder too; only the messages of '
                             'posture_control are taken']
    listener.leave(own, POSTURE)
    again = listener.writer(POSTURE)
    again.publish(String(data='standing'))
    listener.leave(intruder, INTRUDER)

    def tell() -> bool:
        again.publish(String(data='lying'))
        return listener.modes[-1] == 'lying'

    listener.until(tell)
    assert listener.modes[:2] == ['standing', 'lowering'] and len(listener.told) == 1


def test_in_lock_step_a_restarted_writer_is_heard_at_once_if_its_restart_is_known(
        ros: Ros) -> None:
    listener = Listener(ros, lock_step=True)
    listener.listen()
    own = listener.writer(POSTURE)
    for mode in ('standing', 'lowering'):
        own.publish(String(data=mode))
    listener.until(lambda: listener.modes == ['standing', 'lowering'])
    listener.heard.forget(['inhibition'])
    again = listener.writer(POSTURE)
    listener.heard.forget(['inhibition', POSTURE])
    again.publish(String(data='lying'))
    listener.until(lambda: len(listener.modes) > 2)
    assert listener.modes[2:] == ['lying'] and not listener.told


def test_where_a_stranger_was_there_first_that_is_told(listener: Listener) -> None:
    """Nothing tells a latched topic's writer from others then: both are heard."""
    listener.node.create_subscription(
        MODES.type, MODES.name, lambda _: None, MODES.reader_qos)  # whom the writers find
    for name, mode in ((POSTURE, 'standing'), (INTRUDER, 'lying')):
        listener.writer(name).publish(String(data=mode))
    listener.listen()
    listener.until(lambda: len(listener.modes) == 2)
    assert listener.told == ['body_mode is published by /intruder too; nothing tells their '
                             'messages from those of posture_control']


def test_the_clock_of_the_robot_is_heard_also_after_losses_while_others_send(
        listener: Listener) -> None:
    topic, heard = interface('/clock'), list[int]()
    listener.heard.listen(topic, lambda message: heard.append(stamp_ns(message.clock)))
    own = listener.writer(ROBOT, topic)

    def tell(publisher: Publisher, time_ns: int) -> None:
        message = Clock()
        set_stamp(message.clock, time_ns)
        publisher.publish(message)

    for tick in range(1, 101):
        tell(own, tick * TICK_NS)
    listener.until(lambda: len(heard) == 100)
    intruder = listener.writer(INTRUDER, topic)
    for tick in range(101, 101 + READER_DEPTH):  # more than there is room for
        tell(own, tick * TICK_NS)
        tell(intruder, 10**12)
    last_ns = (101 + READER_DEPTH) * TICK_NS
    tell(own, last_ns)
    listener.until(lambda: bool(listener.told) and heard[-1] == last_ns)
    assert heard == sorted(heard) and len(heard) < 101 + READER_DEPTH


def test_of_what_is_taken_now_and_then_only_the_writers_counts(listener: Listener) -> None:
    """As the live view takes the newest joint angles."""
    topic, newest = interface('joint_states'), QoSProfile(depth=1)
    subscription = listener.node.create_subscription(
        topic.type, topic.name, lambda _: None, newest, callback_group=Polled())
    admits, own = listener.heard.admitting(topic), listener.writer(ROBOT, topic)
    message, taken = JointState(), list[Any]()

    def tell(publisher: Publisher, time_ns: int) -> bool:
        """Send, and take it; whether it is believed."""
        set_stamp(message.header.stamp, time_ns)
        publisher.publish(message)
        taken.clear()

        def arrived() -> bool:
            with subscription.handle:
                taken.append(subscription.handle.take_message(topic.type, False))
            return taken[-1] is not None

        listener.until(arrived)
        return admits(header_ns(taken[-1][0]), taken[-1][1])

    tick = 0
    for lost in (30, *range(10), *60 * (8,)):
        for _ in range(lost):
            own.publish(JointState())
        with subscription.handle:
            subscription.handle.take_message(topic.type, False)
        tick += 1 + lost
        assert tell(own, tick * TICK_NS)
    intruder = listener.writer(INTRUDER, topic)
    for _ in range(20):
        tick += 1
        assert not tell(intruder, tick * TICK_NS)
        assert tell(own, tick * TICK_NS)
    assert len(listener.told) == 1 and '/intruder' in listener.told[0]


def test_counts_without_names_are_refused() -> None:
    with pytest.raises(DataError):
        read_counts(JointState(name=['push'], position=[1.0, 2.0]))
    topic = private('~/commands_taken', ROBOT)
    assert (topic.name, topic.publishers) == ('mujoco_robot/commands_taken', (ROBOT,))


@pytest.mark.parametrize('data', [
    b'', b'\x00\x00\x00\x00\x01\x02\x03', b'\x00\x01\x00\x00\xff\xff\xff\x7f',
    serialize_message(String(data='nonsense')), serialize_message(String(data=''))])
def test_what_cannot_be_read_or_is_refused_ends_nothing(ros: Ros, data: bytes) -> None:
    """Bytes as the middleware hands them over, of a writer or of somebody else."""
    listener, received = Listener(ros), list[Any]()
    create = listener.node.create_subscription
    listener.node.create_subscription = lambda kind, name, take, *rest, **more: (  # type: ignore
        received.append(take), create(kind, name, take, *rest, **more))[1]
    listener.listen()
    for number, content in enumerate((data, serialize_message(String(data='lying'))), 1):
        received[0](content, {'publication_sequence_number': number,
                              'received_timestamp': 10**18 + number})
    assert listener.modes == ['lying']
