# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that come late or get lost are no joints that jump: the robot feels again at once."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

pytest.importorskip('mujoco')
pytest.importorskip('rclpy')

from dmp_cpg_ros.core.estimation.frozen import SensorWatch, first_watch, without_frozen
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.nodes.framework.ticks import TickInputs
from dmp_cpg_ros.nodes.posture_control import FORGOTTEN_NS, sensor_readings
from dmp_cpg_ros.studies.failures import FailingWalk

INPUTS = ('joint_states', 'imu', 'foot_contacts', 'canonical_state')
WALKS_S, STOPS_S, SOUND = 1.6, 0.8, 60
"""Times of walking and of stopping, and ticks at the end in which nothing gets lost."""


@cache
def walked(gait: str, speed: float) -> list[RobotState]:
    """States of a walk that speeds up and is stopped again, in which the way of moving changes."""
    walk, states = FailingWalk(gait, 'robots/mini_quadruped.yaml'), list[RobotState]()
    walk.loop.request(False)
    for seconds, stop in ((WALKS_S, False), (STOPS_S, True)):
        if stop:
            walk.loop.request(True)
        for k in range(round(seconds * 1e9 / walk.robot.tick_ns)):
            if k % 25 == 0:
                walk.loop.command(speed)
            walk.tick()
            states.append(walk.state)
    return states


def arriving(states: list[RobotState], seed: int) -> Iterator[tuple[str, RobotState]]:
    """Messages of all topics in the order of their arrival: each topic stalls a few times, what
    it was about to tell comes at once or is lost, and the last ticks come in time.
    """
    random, sound = np.random.default_rng(seed), len(states) - SOUND
    messages = list[tuple[int, int, int]]()
    for topic in range(len(INPUTS)):
        late, lost = np.zeros(len(states), int), np.zeros(len(states), bool)
        for _ in range(random.integers(6)):
            begin, length = random.integers(sound), random.integers(2, 60)
            end = min(begin + length, sound)
            late[begin:end] = np.maximum(late[begin:end], end - np.arange(begin, end))
            lost[begin:min(begin + random.integers(length + 1), end)] = random.random() < 0.7
        messages += [(k + late[k], topic, k) for k in range(len(states)) if not lost[k]]
    for _, topic, k in sorted(messages):
        yield INPUTS[topic], states[k]


def told(name: str, state: RobotState) -> Any:
    """What a reader of a topic returns."""
    return {'joint_states': (state.time_ns, (
                state.joint_position, state.joint_velocity, state.joint_effort)),
            'imu': (state.time_ns, (state.measured_rate_in_base, state.acceleration_in_base)),
            'foot_contacts': (state.time_ns, state.foot_force)}.get(name)


@pytest.mark.parametrize('seed', range(16))
@pytest.mark.parametrize('gait, speed', [('amble', 0.5), ('trot', 1.0)])
def test_late_and_lost_messages_put_no_leg_in_doubt(gait: str, speed: float, seed: int) -> None:
    watch: SensorWatch | None = None
    felt: list[bool] = []

    def on_tick(stamp_ns: int, values: dict[str, Any]) -> None:
        nonlocal watch
        readings = sensor_readings(stamp_ns, values)
        if watch is None or not 0 < stamp_ns - watch.readings.time_ns <= FORGOTTEN_NS:
            watch = first_watch(readings)  # as the estimator begins anew
            return
        watch, passed = without_frozen(watch, readings, 100.0)
        assert not any(watch.doubt.legs), f'at {stamp_ns * 1e-9:.3f} s'
        felt.append(all(passed.usable_legs) and passed.imu_is_usable)

    ticks = TickInputs(on_tick, INPUTS, 'canonical_state', optional=('imu', 'foot_contacts'))
    for name, state in arriving(walked(gait, speed), seed):
        ticks.add(name, state.time_ns, told(name, state))  # some are too late to be taken
    assert all(felt[-SOUND // 2:])
