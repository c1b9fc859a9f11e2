# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whoever floods a topic is not received any more, and its own writer is."""

from __future__ import annotations

import sys
from collections.abc import Collection, Hashable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip('rclpy')

import ros_processes
from rclpy.node import Node
from ros_processes import Processes, Ros
from sensor_msgs.msg import JointState

from dmp_cpg_ros.nodes.framework import floods
from dmp_cpg_ros.nodes.framework.floods import MANY, OWN_MOST, WITHIN_NS, Floods
from dmp_cpg_ros.nodes.framework.packet_filter import GUID
from dmp_cpg_ros.nodes.framework.strangers import UNNAMED
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.nodes.reference_filter import ReferenceFilter

processes, ros, ros_domain = (
    ros_processes.processes,
    ros_processes.ros,
    ros_processes.ros_domain,
)

TOPIC, TICK_NS = interface('joint_states'), 4_000_000

INTRUDER = """
import itertools, rclpy
from dmp_cpg_ros.nodes.framework.middleware import prepare_middleware
from dmp_cpg_ros.nodes.messages.interfaces import interface
prepare_middleware()
rclpy.init()
node, topic = rclpy.create_node('intruder'), interface('joint_states')
publisher = node.create_publisher(topic.type, topic.name, topic.publisher_qos)
while not publisher.get_subscription_count():
    rclpy.spin_once(node, timeout_sec=0.01)
try:
    for count in itertools.count():
        publisher.publish({message})
        if count % 1000 == 0:
            print(count // 1000, 'thousand', flush=True)
except KeyboardInterrupt:
    pass
node.destroy_node()
rclpy.try_shutdown()
"""


class Graph:
    """What a graph tells, and whom sockets were told to shut out."""

    def __init__(self, own: Collection[str], strangers: Collection[str]) -> None:
        self.own, self.strangers = list(own), list(strangers)
        self.out, self.asked, self.told = frozenset[bytes](), 0, list[str]()

    def ends(self, _: Any) -> tuple[list[Any], list[Any]]:
        """As of Publishers."""
        self.asked += 1
        return tuple([SimpleNamespace(node_name=name, node_namespace='/',
                                      endpoint_gid=[*guid(name), *bytes(8)])
                      for name in names] for names in (self.own, self.strangers))

    def shut_out(self, _: Hashable, writers: Collection[bytes]) -> bool:
        """As of PacketFilter."""
        self.out = frozenset(writers)
        return True


def guid(name: str) -> bytes:
    """Of the publisher of a node."""
    return name.encode().ljust(GUID, b'.')[:GUID]


@pytest.fixture
def graph(monkeypatch: pytest.MonkeyPatch) -> Graph:
    made = Graph(['mujoco_robot'], ['intruder', 'tool'])
    monkeypatch.setattr(floods, 'OWN_SOCKETS', made)
    return made


def noticing(graph: Graph) -> Floods:
    return Floods(graph, lambda _, text: graph.told.append(text))


def flood(noticed: Floods, count: int = MANY, **options: bool) -> None:
    for k in range(count):
        noticed.note(TOPIC, k * (WITHIN_NS // (2 * MANY)), **options)


def test_all_who_should_not_write_a_flooded_topic_are_shut_out(graph: Graph) -> None:
    noticed = noticing(graph)
    flood(noticed)
    assert graph.out == {guid('intruder'), guid('tool')}
    assert graph.told == ['joint_states is flooded by /intruder, /tool: nothing of that is '
                          'received any more']
    graph.strangers.remove('intruder')
    noticed.look(TOPIC)
    assert graph.out == {guid('tool')} and 'is flooded by /tool:' in graph.told[1]
    noticed.look(TOPIC)
    assert len(graph.told) == 2
    graph.strangers.clear()
    noticed.look(TOPIC)
    assert not graph.out and graph.told[2:] == ['']
    flood(noticed)
    assert not graph.out and len(graph.told) == 3  # by whom nobody knows


def test_who_floods_is_named_once_its_name_is_known(
        graph: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    graph.strangers = [UNNAMED]
    noticed = noticing(graph)
    flood(noticed)
    assert 'is flooded by a node of no name yet:' in graph.told[0]
    writer = guid(UNNAMED)
    monkeypatch.setattr(sys.modules[__name__], 'guid', lambda name: writer)
    graph.strangers = ['intruder']
    noticed.look(TOPIC)
    assert graph.out == {guid('intruder')} and 'is flooded by /intruder:' in graph.told[1]


@given(st.lists(st.integers(WITHIN_NS // MANY + 1, 10 * WITHIN_NS), max_size=3 * MANY))
def test_what_comes_slowly_is_no_flood(gaps: list[int]) -> None:
    """Not even asked for in the graph, which takes time."""
    graph, now_ns = Graph([], ['tool']), 0
    noticed = noticing(graph)
    for gap in gaps:
        now_ns += gap
        noticed.note(TOPIC, now_ns)
    assert not graph.asked and not graph.told


def test_where_all_messages_are_counted_those_of_the_writer_are_no_flood(graph: Graph) -> None:
    noticed = noticing(graph)
    for k in range(10 * OWN_MOST):
        noticed.note(TOPIC, k * (WITHIN_NS // OWN_MOST), of_all=True)
    assert not graph.asked
    flood(noticed, 4 * MANY, of_all=True)
    assert graph.out == {guid('intruder'), guid('tool')}


def test_who_has_no_name_yet_may_be_the_writer(graph: Graph) -> None:
    """A node of the suite is in the graph before its name is known."""
    graph.own, graph.strangers = [], [UNNAMED, 'intruder']
    flood(noticing(graph))
    assert graph.out == {guid('intruder')}
    graph.own = ['mujoco_robot']
    flood(noticing(graph))
    assert graph.out == {guid('intruder'), guid(UNNAMED)}


def test_who_forgets_its_topics_receives_everybody(graph: Graph) -> None:
    noticed = noticing(graph)
    flood(noticed)
    assert graph.out
    noticed.forget()
    assert not graph.out


@pytest.fixture
def follower(ros: Ros) -> Iterator[ReferenceFilter]:
    node = ReferenceFilter('follower', context=ros.context)
    node.start()
    ros.executor.add_node(node)
    yield node
    node.close()
    node.destroy_entities()
    ros.executor.remove_node(node)
    node.destroy_node()


@pytest.mark.skipif(sys.platform != 'linux', reason='such filters are those of Linux')
@pytest.mark.parametrize('message', ['topic.type()', "b'\\0\\1\\0\\0' + bytes(range(200))"],
                         ids=['old', 'garbage'])
def test_a_flood_from_another_process_ends_at_the_socket(
        ros: Ros, processes: Processes, follower: ReferenceFilter, message: str) -> None:
    """While it goes on, nothing of it comes in any more; each tick of the robot does."""
    ticks: list[int] = []
    follower.on_tick = lambda stamp_ns, values: ticks.append(stamp_ns // TICK_NS)
    robot = Node('mujoco_robot', context=ros.context)
    ros.nodes.append(robot)
    publisher = robot.create_publisher(TOPIC.type, TOPIC.name, TOPIC.publisher_qos)
    ros.spin_until(lambda: publisher.get_subscription_count() > 0)

    def walk_on(count: int) -> None:
        for _ in range(count):
            told = JointState()
            set_stamp(told.header.stamp, TICK_NS * (len(ticks) + 100))
            publisher.publish(told)
            before = len(ticks)
            ros.spin_until(lambda before=before: len(ticks) > before)

    walk_on(100)  # the writer is known
    intruder = processes.python('-c', INTRUDER.format(message=message))
    ros.spin_until(lambda: follower.health.has_problem('flood of joint_states'),
                   what=lambda: f'{intruder} {follower.health.rejected}')
    # its name may come to be known after its first thousand messages
    ros.spin_until(lambda: 'joint_states is flooded by /intruder:' in follower.health.status(
        '', {}, periodic=False).status[0].message)

    intruder.wait_for_output('thousand')

    def sent() -> int:
        return int(intruder.output.split()[-2])

    def nothing_comes_in() -> bool:
        rejected, begin = dict(follower.health.rejected), sent()
        ros.spin_until(lambda: sent() > begin + 5)
        return rejected == follower.health.rejected

    ros.spin_until(nothing_comes_in, what=lambda: str(follower.health.rejected))
    walk_on(250)
    assert ticks == list(range(100, 450))
    assert nothing_comes_in()
    intruder.interrupt()
    ros.spin_until(lambda: not follower.health.has_problem('flood of joint_states'))
