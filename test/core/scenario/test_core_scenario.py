# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios: events of every kind at their ticks, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from checkout import ROOT
from played_scenario import play

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.scenario.scenario import COMMAND_PERIOD_NS, EVENT_KINDS, Scenario
from dmp_cpg_ros.suite import load_gaits

SCENARIOS = ROOT / 'config' / 'scenarios'
TICK_NS = 4_000_000


def scenario(*events: Any, duration: float = 2.0) -> Scenario:
    return Scenario.from_mapping({'duration': duration, 'events': list(events)})


def test_every_event_acts_at_the_first_tick_that_is_not_before_its_time() -> None:
    played = scenario(
        {'at': 0.0015, 'inhibit': False},
        {'at': 0.5, 'gait': 'trot', 'label': 'faster'},
        {'at': 0.5011, 'gait': 'walk'},
    )
    actions = played.timeline(TICK_NS)
    assert [(action.time_ns, action.kind, action.value) for action in actions] == [
        (TICK_NS, 'inhibit', False), (500_000_000, 'gait', 'trot'), (504_000_000, 'gait', 'walk')]
    assert [action.label for action in actions] == ['resume', 'faster', 'gait walk']


def test_nodes_are_asked_from_their_second_tick_on_and_told_before_their_first() -> None:
    """Before its first tick a node refuses what it is asked."""
    at_once = [{'at': 0.0, kind: value} for kind, value in (
        ('inhibit', False), ('command', {'v_x': 0.5}), ('set', {'cadence_scale': 1.5}),
        ('gait', 'trot'), ('stand_up', True))]
    actions = scenario(*at_once, duration=0.1).timeline(TICK_NS)
    assert [(action.kind, action.time_ns) for action in actions] == [
        ('command', 0), ('inhibit', TICK_NS), ('set', TICK_NS), ('gait', TICK_NS),
        ('stand_up', TICK_NS)]


@pytest.mark.parametrize('at', [0.0975, 0.1])
def test_an_event_for_which_no_tick_is_left_is_refused(at: float) -> None:
    events = [{'at': 0.096, 'inhibit': False}, {'at': at, 'gait': 'trot'}]
    assert len(scenario(events[0], duration=0.1).timeline(TICK_NS)) == 1
    with pytest.raises(DataError, match=r'event 2, gait trot: at = .* the last is at 0.096 s'):
        scenario(*events, duration=0.1).timeline(TICK_NS)


@pytest.mark.parametrize('last', [{'command': 'silence'}, {'command': {'v_x': 0.1}},
                                  {'votes': {}}])
def test_what_would_last_for_nothing_is_not_refused(last: Any) -> None:
    assert scenario({'at': 0.0, 'inhibit': False}, {'at': 0.1, **last},
                    duration=0.1).timeline(TICK_NS)


def test_a_command_is_repeated_until_the_next_one_and_silence_is_silent() -> None:
    played = scenario({'at': 0.0, 'command': {'v_x': 0.5}}, {'at': 0.3, 'gait': 'trot'},
                      {'at': 1.0, 'command': 'silence'})
    commands = [action for action in played.timeline(TICK_NS) if action.kind == 'command']
    assert [action.time_ns for action in commands] == [k * COMMAND_PERIOD_NS for k in range(11)]
    assert [action.label for action in commands].count('') == 9
    assert (commands[-1].value, commands[-1].label) == (None, 'silence')


def test_what_ends_is_told_and_nothing_is_sent() -> None:
    log: list[Any] = []
    played = scenario({'at': 0.0, 'votes': {'fl': 1.0}}, {'at': 0.004, 'command': 'silence'},
                      {'at': 0.008, 'votes': {}, 'label': 'enough'}, duration=0.016)
    assert [action.label for action in played.timeline(TICK_NS)] == [
        'votes fl 1', 'silence', 'enough']
    takers = {kind: lambda value, kind=kind: log.append((kind, value)) for kind in EVENT_KINDS}
    play(played, TICK_NS, lambda: None, takers)
    assert log == [('votes', {'fl': 1.0})]


def test_play_gives_each_kind_to_its_taker_before_the_tick() -> None:
    log: list[Any] = []
    played = scenario({'at': 0.004, 'gait': 'trot'}, {'at': 0.008, 'inhibit': True},
                      duration=0.016)
    takers = {kind: lambda value, kind=kind: log.append((kind, value)) for kind in EVENT_KINDS}
    play(played, TICK_NS, lambda: log.append('tick'), takers)
    assert log == ['tick', ('gait', 'trot'), 'tick', ('inhibit', True), 'tick', 'tick']
    del takers['gait']
    with pytest.raises(DataError, match='nobody takes gait; taken are'):
        play(played, TICK_NS, lambda: None, takers)


@pytest.mark.parametrize('file', sorted(SCENARIOS.glob('*.yaml')), ids=lambda path: path.stem)
def test_the_scenarios_of_the_package_can_be_played(file: Path) -> None:
    pytest.importorskip('rosbags')
    from dmp_cpg_ros.commands.walk import load_scenario

    played = load_scenario(file)
    assert played.name == file.stem and played.timeline(TICK_NS) is not None
    assert {event.value for event in played.events if event.kind == 'gait'} <= set(load_gaits())


@pytest.mark.parametrize(('event', 'text'), [
    ({'at': 1.0}, f'exactly one of {", ".join(EVENT_KINDS)}'),
    ({'gait': 'trot'}, "needs 'at'"),
    ({'at': 1.0, 'gait': 'trot', 'inhibit': True}, 'exactly one of'),
    ({'at': 1.0, 'jump': True}, "'jump' is not known; valid are at, command"),
    ({'at': 'soon', 'gait': 'trot'}, 'must be numbers'),
    ({'at': float('nan'), 'gait': 'trot'}, 'must be finite, at least 0'),
    ({'at': 1.0, 'gait': 3}, 'name of a gait'),
    ({'at': 1.0, 'inhibit': 'yes'}, 'true or false'),
    ({'at': 1.0, 'command': {'v_z': 1.0}}, "'v_z' is not known"),
    ({'at': 1.0, 'command': None}, 'must be silence, or a mapping with v_x, v_y, gamma, not None'),
    ({'at': 1.0, 'command': {'v_x': float('nan')}}, 'finite'),
    ({'at': 3.0, 'gait': 'trot'}, 'event 1: at = 3 s must not be .* the duration: 0 to 2 s'),
])
def test_bad_events_are_refused_with_what_is_valid(event: dict[str, Any], text: str) -> None:
    with pytest.raises(DataError, match=text):
        scenario(event)


def test_an_event_that_comes_too_late_in_the_list_is_named() -> None:
    once = {'at': 1.0, 'gait': 'trot'}
    assert len(scenario(once, once).events) == 2
    with pytest.raises(DataError, match='event 3: at = 0.5 s .*: 1 to 2 s'):
        scenario(once, once, {'at': 0.5, 'inhibit': True})
