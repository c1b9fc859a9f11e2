# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pace of ``low_level_robot`` on a clock of the test's: what it makes up for, loses, and waits
for, and what it says of that.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

from dmp_cpg_ros.commands import low_level_robot
from dmp_cpg_ros.commands.low_level_robot import AT_ONCE, BEHIND_NS, PERIOD_S, Pace, told
from dmp_cpg_ros.robot.low_level import PERIOD_NS


class Bench:
    """A pace, a clock, and a robot that counts its periods."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, lag_s: float = 0.0) -> None:
        self.now = 100.0
        monkeypatch.setattr(low_level_robot.time, 'monotonic', lambda: self.now)
        self.state = SimpleNamespace(time_ns=0, base_position_in_world=np.zeros(3))
        robot = SimpleNamespace(state=self.state, step=self.step, timeouts=0)
        self.topics: Any = SimpleNamespace(
            robot=robot, taken=0, refused=0, targets_ns=[-1] * 4, publish=lambda: None)
        self.pace = Pace(self.topics, lag_s)

    def step(self) -> None:
        self.state.time_ns += PERIOD_NS

    @property
    def periods(self) -> int:
        return self.state.time_ns // PERIOD_NS

    def after(self, seconds: float) -> int:
        """Let time pass; returns how many periods are made then."""
        self.now += seconds
        before = self.periods
        self.pace.go_on()
        return self.periods - before

    def answer(self) -> None:
        self.topics.taken += 1
        self.topics.on_command()


def test_what_was_missed_is_made_up_for_and_beyond_some_periods_lost(
        monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    assert bench.after(0.0) == 1 and bench.after(0.5 * PERIOD_S) == 0
    assert bench.after(0.6 * PERIOD_S) == 1 and bench.after(3.0 * PERIOD_S) == 3
    bench.answer()
    assert bench.after(20.0 * PERIOD_S) == AT_ONCE
    lost_s = bench.pace.lost_s
    assert lost_s == pytest.approx((20 - AT_ONCE) * PERIOD_S, abs=1.1 * PERIOD_S)
    assert bench.after(1.01 * PERIOD_S) <= 2 and bench.after(PERIOD_S) == 1
    bench.answer()
    results = bench.pace.results()
    assert results['lost_s'] == lost_s and results['real_time_factor'] < 0.5
    assert results['state_period_ms_max'] == pytest.approx(20e3 * PERIOD_S)


def test_a_robot_that_keeps_real_time_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    assert bench.pace.results() == {} and 'not commanded' in told({})
    bench.after(0.0)
    bench.answer()
    for k in range(500):
        assert bench.after(PERIOD_S * (1.0 + 1e-9)) == 1
        bench.now += 1e-4
        if k % 10:
            bench.answer()
        bench.now -= 1e-4
    results = bench.pace.results()
    assert results['real_time_factor'] == pytest.approx(1.0, abs=1e-3)
    assert results['states_hz'] == pytest.approx(500.0, rel=1e-3)
    assert results['commands_hz'] == pytest.approx(450.0, rel=0.01)
    assert results['unanswered_share'] == pytest.approx(0.1, abs=0.01)
    assert results['answer_ms_p50'] == pytest.approx(0.1, rel=0.1)
    assert results['command_gap_ms_max'] == pytest.approx(4.0, abs=0.11)
    assert results['lost_s'] == 0.0
    assert '500.0 states and 450' in told(results)


def test_a_patient_robot_waits_for_an_answer_and_not_for_one_that_does_not_come(
        monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, lag_s=1.0)
    assert bench.after(0.0) == 1 and bench.after(PERIOD_S) == 1   # before the first command
    bench.answer()
    assert bench.after(PERIOD_S) == 1
    assert bench.after(0.5) == bench.after(0.4) == 0
    bench.answer()
    assert bench.after(PERIOD_S) == 1 and bench.pace.lost_s == 0.0
    assert bench.after(0.9) == 0
    assert bench.after(0.2) > 0 and bench.after(PERIOD_S) > 0     # nobody answers any more
    bench.answer()
    bench.after(0.0)
    assert bench.after(0.5) <= 1 and bench.after(0.4) == 0        # it is waited for again


def test_a_patient_robot_waits_for_a_suite_that_is_behind(
        monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, lag_s=1.0)
    bench.after(0.0)
    bench.topics.targets_ns = [0] * 4
    made = 0
    for _ in range(50):
        bench.answer()
        made += bench.after(PERIOD_S)
    assert bench.state.time_ns <= BEHIND_NS + PERIOD_NS and 0 < made < 20
    bench.topics.targets_ns = [bench.state.time_ns] * 3 + [0]
    assert bench.after(PERIOD_S) == 0                            # one leg is
    bench.topics.targets_ns = [bench.state.time_ns] * 4
    assert bench.after(PERIOD_S) == 1
