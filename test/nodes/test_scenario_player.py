# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scenario player: a service that refuses is asked again in real time, for a moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest.importorskip('rclpy')

import rclpy
import ros_processes
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.nodes import scenario_player
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.nodes.scenario_player import (
    REPEAT_NS,
    REPEATED_NS,
    PlayerError,
    ScenarioPlayer,
)

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
