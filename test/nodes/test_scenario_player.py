# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scenario player: a service that refuses is asked again in real time, for a moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pytest

pytest.importorskip('rclpy')

import rclpy
import ros_processes
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future
from ros_processes import wait_until
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.core.suite_parameters import INHIBITION
from dmp_cpg_ros.nodes import scenario_player
from dmp_cpg_ros.nodes.framework.execution import make_executor
from dmp_cpg_ros.nodes.messages.interfaces import Interface, interface
from dmp_cpg_ros.nodes.messages.joint_targets import DRIVE_MODES
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.nodes.scenario_player import REPEAT_NS, REPEATED_NS, PlayerError, ScenarioPlayer
from dmp_cpg_ros.suite_table import ROBOT

ros_domain = ros_processes.ros_domain

TICK_NS = 4_000_000
SCENARIO = Scenario.from_mapping(
    {'name': 'start', 'duration': 10.0, 'events': [{'at': 0.1, 'inhibit': False}]}, 'test')


@pytest.fixture
def context(ros_domain: int) -> Iterator[None]:
    rclpy.init(args=[], domain_id=ros_domain)
    try:
        yield
    finally:
        rclpy.try_shutdown()


def asked_at(monkeypatch: pytest.MonkeyPatch, refusals: int, said: list[str]
             ) -> tuple[ScenarioPlayer, list[int]]:
    """Player at the end of a scenario in real time, and when it has asked a service that refuses
    so often [ns].
    """
    asked: list[int] = []

    def ask(client: Any, request: Any, done: Callable[[bool, str], None]) -> None:
        asked.append(player.time_ns)
        done(len(asked) > refusals, 'walking' if len(asked) > refusals else 'not yet')

    monkeypatch.setattr(scenario_player, 'ask', ask)
    player = ScenarioPlayer(SCENARIO, TICK_NS, False, lambda _, text: said.append(text))
    player.begin()
    for tick in range(SCENARIO.ticks(TICK_NS) + 1):
        clock = Clock()
        set_stamp(clock.clock, tick * TICK_NS)
        player._on_clock(clock)
    return player, asked


def gains(stamp: int) -> JointState:
    message = JointState()
    set_stamp(message.header.stamp, stamp)
    return message


def test_it_asks_again_until_the_service_agrees(
        context: None, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    player, asked = asked_at(monkeypatch, 2, said)
    assert asked == [100_000_000 + k * REPEAT_NS for k in range(3)]
    assert player.finished.done() and player.finished.exception() is None
    assert len([text for text in said if text.startswith('> ')]) == 1  # told once
    assert '  inhibit: walking' in said


def test_what_is_refused_for_good_ends_the_run_with_the_reason(
        context: None, monkeypatch: pytest.MonkeyPatch) -> None:
    player, asked = asked_at(monkeypatch, 10**6, [])
    assert isinstance(player.finished.exception(), PlayerError)
    assert 'not yet' in str(player.finished.exception())
    assert REPEATED_NS <= asked[-1] - asked[0] < REPEATED_NS + 2 * REPEAT_NS


def test_who_else_serves_what_has_answered_is_named(
        context: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def warnings() -> list[str]:
        said: list[str] = []
        asked_at(monkeypatch, 0, said)[0].destroy_node()
        return [text for text in said if 'served by' in text]

    nodes = [Node(name, use_global_arguments=False) for name in (INHIBITION, 'stranger')]
    service = interface('inhibit')
    nodes[0].create_service(service.type, service.name, lambda _, response: response)
    wait_until(lambda: nodes[0].count_services(service.name) == 1)
    assert not warnings()
    nodes[1].create_service(service.type, service.name, lambda _, response: response)
    wait_until(lambda: nodes[0].count_services(service.name) == 2)
    assert warnings() == [
        'inhibit is not only of the suite; served by /stranger: whoever is faster answers']
    for node in nodes:
        node.destroy_node()


@pytest.mark.parametrize('lock_step', [False, True])
def test_the_ends_of_commands_and_votes_are_told(context: None, lock_step: bool) -> None:
    said: list[str] = []
    player = ScenarioPlayer(Scenario.from_mapping({'duration': 1.0, 'events': [
        {'at': 0.1, 'command': 'silence'}, {'at': 0.1, 'votes': {}, 'label': 'no votes'}]},
        'test'), TICK_NS, lock_step, lambda _, text: said.append(text))
    player.begin()
    player._on_gains(gains(100_000_000 - TICK_NS))
    (player._on_holding if lock_step else player._on_clock)(clock(100_000_000))
    assert said == ['> silence', '> no votes']
    assert not player.busy and 'votes' not in player._topics
    player.destroy_node()


def test_in_lock_step_who_is_restarted_before_it_has_answered_is_asked_again(
        context: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once its ticks go on; what the one before might still answer does not count."""
    asked: list[Callable[[bool, str], None]] = []
    monkeypatch.setattr(scenario_player, 'ask', lambda client, request, done: asked.append(done))
    said: list[str] = []
    player = ScenarioPlayer(SCENARIO, TICK_NS, True, lambda _, text: said.append(text))
    player.begin()
    player._on_gains(gains(100_000_000 - TICK_NS))
    holding = Clock()
    set_stamp(holding.clock, 100_000_000)
    player._on_holding(holding)
    assert len(asked) == 1 and player.busy
    player.renew(['posture_control'])
    player._on_gains(gains(100_000_000 - TICK_NS))
    assert len(asked) == 1
    player.renew(['inhibition'])
    assert len(asked) == 1
    player._on_gains(gains(100_000_000 - TICK_NS))
    assert len(asked) == 2 and player.busy
    asked[0](False, 'of before')
    assert player.busy and not player.finished.done()
    asked[1](True, 'walking')
    assert not player.busy and '  inhibit: walking' in said
    player._on_gains(gains(100_000_000 - TICK_NS))
    assert len(asked) == 2


# What strangers say of the suite -----------------------------------------------------------------


class Neighbours:
    """Nodes of the suite's names that say what the player reads, and an intruder who does too."""

    def __init__(self, player: ScenarioPlayer, topics: Sequence[str]) -> None:
        self._executor, self._player = make_executor('events'), player
        self._executor.add_node(player)
        self._nodes: dict[str, Node] = {}
        self._own = {name: self._publisher(interface(name).publishers[0], interface(name))
                     for name in topics}
        self._forged: dict[str, Publisher] = {}

    def _publisher(self, owner: str, topic: Interface) -> Publisher:
        """Publisher that the player and the graph know."""
        if owner not in self._nodes:
            self._nodes[owner] = Node(owner)
        qos, ends = topic.publisher_qos, self._player.get_publishers_info_by_topic
        qos.depth = 100  # so that nothing is lost
        publisher = self._nodes[owner].create_publisher(topic.type, topic.name, qos)
        wait_until(lambda: publisher.get_subscription_count() > 0 and owner in {
            end.node_name for end in ends(publisher.topic_name)})
        return publisher

    def tell(self, name: str, *messages: Any) -> None:
        for message in messages:
            self._own[name].publish(message)

    def join(self) -> None:
        """The intruder comes."""
        self._forged = {name: self._publisher('intruder', interface(name)) for name in self._own}

    def forge(self, name: str, message: Any) -> None:
        for _ in range(9):
            self._forged[name].publish(message)

    def until(self, condition: Callable[[], bool], meanwhile: Callable[[], object] = lambda: None
              ) -> None:
        def spin() -> None:
            meanwhile()
            self._executor.spin_until_future_complete(Future(), timeout_sec=0.01)

        wait_until(condition, between=spin)

    def end(self) -> None:
        for node in self._nodes.values():
            node.destroy_node()


def clock(stamp: int) -> Clock:
    message = Clock()
    set_stamp(message.clock, stamp)
    return message


def state(word: str) -> DiagnosticArray:
    return DiagnosticArray(status=[DiagnosticStatus(name=INHIBITION, message=word)])


@pytest.mark.parametrize('lock_step', [False, True])
def test_nobody_else_makes_events_come_early_or_ends_the_scenario(
        context: None, monkeypatch: pytest.MonkeyPatch, lock_step: bool) -> None:
    """A forged clock, gate and end of a tick, and what the robot would do, of somebody who came
    after the suite; each is told once.
    """
    asked, said, gate = list[int](), list[str](), f'{ROBOT}/holding_at'

    def ask(client: Any, request: Any, done: Callable[[bool, str], None]) -> None:
        asked.append(player.time_ns)
        done(True, 'it is asked')

    monkeypatch.setattr(scenario_player, 'ask', ask)
    scenario = Scenario.from_mapping(
        {'name': 'late', 'duration': 10.0, 'events': [{'at': 5.0, 'inhibit': False}]}, 'test')
    player = ScenarioPlayer(scenario, TICK_NS, lock_step, lambda _, text: said.append(text))
    topics = ('body_mode', 'drive_mode', 'inhibition_state', 'inhibition_gains',
              gate if lock_step else '/clock')
    suite, due_ns, end_ns = Neighbours(player, topics), 5_000_000_000, 10_000_000_000
    now_ns = 0

    def tick(time_ns: int) -> None:
        nonlocal now_ns
        now_ns = time_ns
        suite.tell('inhibition_gains', gains(time_ns - TICK_NS))
        suite.tell(topics[-1], clock(time_ns))

    def ticks(until_ns: int) -> None:
        """In real time all of them, for a clock does not jump."""
        for time_ns in range(now_ns + 100 * TICK_NS, until_ns, 100 * TICK_NS):
            tick(time_ns)
        tick(until_ns)

    def go_on() -> None:
        tick(now_ns if lock_step else now_ns + TICK_NS)

    suite.tell('body_mode', String(data='standing'))
    suite.tell('drive_mode', String(data=DRIVE_MODES[0]))
    suite.tell('inhibition_state', state('walking'))
    for _ in range(20):  # nothing tells apart who has sent as many messages
        go_on()
    suite.until(lambda: bool(player.mode) and 'walking' in said, go_on)
    player.begin()
    suite.join()
    go_on()
    for name, message in zip(topics, (
            String(data='lying'), String(data=DRIVE_MODES[1]), state('at_rest'), gains(end_ns),
            clock(end_ns)), strict=True):
        suite.forge(name, message)
    suite.until(lambda: sum('by /intruder too' in text for text in said) == len(topics), go_on)
    assert (player.mode, player.drive) == ('standing', DRIVE_MODES[0])
    assert player.time_ns < due_ns and not asked and not player.finished.done()
    ticks(due_ns)
    suite.until(lambda: bool(asked))
    assert asked == [due_ns]
    ticks(end_ns)
    suite.until(player.finished.done)
    assert player.time_ns == end_ns and player.finished.exception() is None
    assert not {'at rest', 'lying'}.intersection(said)
    assert sum('intruder' in text for text in said) == len(topics)
    suite.end()
