# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two robots in one domain, each in its namespace: neither hears the other."""

from __future__ import annotations

import json
import os
from contextlib import ExitStack
from pathlib import Path

import pytest
import yaml

pytest.importorskip('rclpy')

from ros_processes import SHARED_HZ, Processes, reserved_domain

from dmp_cpg_ros.analysis.bag import payload_digests

RUN_S = 600.0
"""How long a walk in lock-step may take on a loaded machine [s]."""

WALKS = {
    'robot1': """\
name: one
duration: 6.5
events:
  - {at: 0.3, inhibit: false}
  - {at: 0.3, command: {v_x: 0.5}}
  - {at: 1.3, inhibit: true}
  - {at: 3.0, inhibit: false}
  - {at: 3.5, command: {v_x: 0.3, gamma: 0.4}}
  - {at: 4.2, push: {impulse: [0, 3, 0]}}
  - {at: 5.0, inhibit: true}
""",
    'robot2': """\
name: two
duration: 7.0
parameters: {gait: trot}
events:
  - {at: 0.5, inhibit: false}
  - {at: 0.5, command: {v_x: 0.8, v_y: -0.1}}
  - {at: 1.2, gait: amble}
  - {at: 2.2, lie_down: true}
  - {at: 6.0, stand_up: true}
""",
}
"""What two robots do, each something else, with requests at other times."""


A_MINUTE = pytest.param(7, marks=pytest.mark.skipif(
    'LONG_WALKS' not in os.environ, reason='takes minutes: make test-extras'), id='a minute')
"""As often in turn they do it in a minute."""


PAUSE_S = 2.0
"""After one time, for what it has begun [s]."""


def repeated(text: str, times: int) -> str:
    """A scenario that is done several times, one after the other."""
    scenario = yaml.safe_load(text)
    every, events = scenario['duration'] + PAUSE_S, scenario['events']
    return json.dumps(scenario | {'duration': times * every - PAUSE_S, 'events': [
        event | {'at': round(event['at'] + number * every, 3)}
        for number in range(times) for event in events]})


def digests(folder: Path, domains: dict[str, int]) -> dict[str, dict[str, str]]:
    """Let both walk at the same time; returns what each has published."""
    started = {name: Processes(domain) for name, domain in domains.items()}
    try:
        walks = {name: processes.executable(
            'walk', str(folder / f'{name}.yaml'), '--composed', '--lock-step', '--no-report',
            '--rate', str(SHARED_HZ), '--namespace', name,
            '--out', str(folder / f'{name} in {processes.domain}'))
            for name, processes in started.items()}
        for walk in walks.values():
            walk.wait_for_output('  walking\n', RUN_S)
        assert all(walk.running for walk in walks.values()), walks
        for walk in walks.values():
            assert walk.wait(RUN_S) == 0, walk
    finally:
        for processes in started.values():
            processes.end()
    return {name: payload_digests(folder / f'{name} in {domain}')
            for name, domain in domains.items()}


@pytest.mark.parametrize('times', [1, A_MINUTE])
def test_two_robots_in_one_domain_walk_as_each_does_alone(tmp_path: Path, times: int) -> None:
    for name, text in WALKS.items():
        (tmp_path / f'{name}.yaml').write_text(repeated(text, times), encoding='utf-8')
    with ExitStack() as stack:
        one, other, both = (stack.enter_context(reserved_domain()) for _ in range(3))
        alone = digests(tmp_path, {'robot1': one, 'robot2': other})
        together = digests(tmp_path, {'robot1': both, 'robot2': both})
    assert alone == together
    first, second = alone.values()
    assert len(first) == len(second) == 6 and not set(first.values()) & set(second.values())
