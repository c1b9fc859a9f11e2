# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the study of long walks reads and plays."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ros_processes import wait_until

from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.studies.long_walk import MINUTE, events, growth, table
from dmp_cpg_ros.studies.process_usage import pid_of


def test_growth_is_that_of_the_second_half_for_an_hour() -> None:
    begin = np.linspace(0.0, 80.0, 60)
    later = 80.0 + 0.2 * np.arange(60)
    assert growth([*begin, *later], 2.0) == pytest.approx(0.2 * 60)
    assert growth([*begin, *later[:1] * np.ones(60)], 2.0) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize('readings', [1, 2, 3])
def test_few_readings_are_told_as_they_are(readings: int) -> None:
    row = table({'inhibition': [30.0] * readings}, 1.0).splitlines()[-1]
    cells = [cell.strip() for cell in row.strip('|').split('|')]
    assert cells[:4] == ['inhibition', '30.0', '30.0', '30.0']
    assert float(cells[4]) == 0.0


def test_a_walk_that_ends_before_the_first_reading_has_none() -> None:
    assert table({'inhibition': []}, 1.0).splitlines()[-1].split()[1:-1:2] == [
        'inhibition', *'----']


def test_the_process_of_a_node_is_found_beside_commands_that_are_no_text() -> None:
    sleep, walk = [sys.executable, '-c', 'import time; time.sleep(60)'], os.getpid()
    arguments = ([b'\xff'], [str(walk), 'fl', 'fr'], [str(walk), '__node:=inhibition'])
    processes = [subprocess.Popen([*sleep, *more]) for more in arguments]
    try:
        wait_until(lambda: all(Path(f'/proc/{process.pid}/cmdline').read_bytes()
                               for process in processes))  # the last one has just begun
        assert pid_of(walk, ['fl', 'fr']) == processes[1].pid
        assert pid_of(walk, ['inhibition']) == processes[2].pid
        assert pid_of(walk, ['fl', 'inhibition']) == 0
    finally:
        for process in processes:
            process.kill()
            process.wait()


def test_every_minute_walks_stops_and_starts_in_order() -> None:
    played = list(events(3))
    Scenario.from_mapping({'name': 'long', 'duration': 3 * MINUTE, 'events': played})
    times = [event['at'] for event in played]
    assert times == sorted(times) and times[-1] < 3 * MINUTE
    assert [event['inhibit'] for event in played if 'inhibit' in event] == [True, False] * 3
    assert len({event['gait'] for event in played if 'gait' in event}) == 2
