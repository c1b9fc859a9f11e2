# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pushes: the impulse arrives whole, at its tick, in its frame, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from played_scenario import play, robot_takers

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.core.scenario.push import (
    FARTHEST_NS,
    HOLD_NS,
    LONGEST_PUSH_S,
    MOST_WAITING,
    Push,
    PushForce,
    PushQueue,
)
from dmp_cpg_ros.core.scenario.scenario import EVENT_KINDS, Scenario
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

TICK_NS = 4_000_000
ZERO = np.zeros(12)


@pytest.mark.parametrize('duration', [0.001, 0.004, 0.1, 0.1017, 0.25, 1.0])
@pytest.mark.parametrize('tick_ns', [1_000_000, 4_000_000, 150_000_000])
def test_the_forces_of_a_push_add_up_to_its_impulse(duration, tick_ns):
    impulse = np.array((3.0, -5.0, 1.0))
    forces = Push(tuple(impulse), duration).forces(8 * tick_ns, tick_ns)
    total = np.zeros(3)
    for force, following in zip(forces, forces[1:], strict=False):
        lasts = following.time_ns - force.time_ns
        assert lasts % tick_ns == 0 and lasts <= max(HOLD_NS, tick_ns)
        total += np.array(force.force) * lasts * 1e-9
    np.testing.assert_allclose(total, impulse)
    assert forces[0].time_ns == 8 * tick_ns and forces[-1].force == (0.0, 0.0, 0.0)


def test_the_heading_turns_a_force_and_the_tilt_does_not():
    yaw, roll = 0.7, 0.3
    turned = np.array((np.sin(roll / 2), 0.0, 0.0, np.cos(roll / 2)))
    quaternion = np.array((
        np.cos(yaw / 2) * turned[0], np.sin(yaw / 2) * turned[0], np.sin(yaw / 2) * turned[3],
        np.cos(yaw / 2) * turned[3]))
    ahead = PushForce(0, (10.0, 0.0, 2.0)).in_world(quaternion)
    np.testing.assert_allclose(ahead, (10.0 * np.cos(yaw), 10.0 * np.sin(yaw), 2.0), atol=1e-12)
    np.testing.assert_allclose(PushForce(0, (1.0, 2.0, 3.0), 'odom').in_world(quaternion),
                               (1.0, 2.0, 3.0))


def test_a_queue_gives_each_force_once_and_of_late_ones_the_newest():
    queue = PushQueue()
    for at in (30, 10, 20):
        queue.add(PushForce(at, (float(at), 0.0, 0.0)), 0)
    assert queue.due(5) is None
    assert queue.due(20).force[0] == 20.0
    assert queue.due(20) is None
    assert queue.due(99).force[0] == 30.0


def test_the_longest_push_waits_and_no_more_than_some_seconds_and_forces():
    queue, now = PushQueue(), 1_000_000_000_000
    *_, last = forces = Push((1.0, 0.0, 0.0), LONGEST_PUSH_S).forces(now, TICK_NS)
    for force in forces:
        queue.add(force, now)
    with pytest.raises(DataError, match='must be at most 11 s ahead of the clock, 1000.000 s'):
        queue.add(PushForce(now + FARTHEST_NS + 1, (5.0, 0.0, 0.0)), now)
    with pytest.raises(DataError, match='1000 forces wait'):
        for at in range(MOST_WAITING):
            queue.add(PushForce(now + 1 + at, (5.0, 0.0, 0.0)), now)
    queue.add(PushForce(last.time_ns, (7.0, 0.0, 0.0)), now)  # takes the place of another one
    assert queue.due(now + FARTHEST_NS).force[0] == 7.0


def flying(scenario, ticks):
    """Momentum of the whole robot after every tick of a fall through the air."""
    robot = MujocoRobot(initial_height=60.0)
    home, momenta = robot.reset().joint_position, []

    def step():
        robot.step(JointTargets(home, ZERO, ZERO))
        mujoco.mj_subtreeVel(robot.model, robot.data)
        momenta.append(robot.description.mass * robot.data.subtree_linvel[1].copy())

    play(Scenario.from_mapping({'duration': ticks * 0.004, 'events': scenario}), TICK_NS, step,
         robot_takers(robot))
    return np.array(momenta)


@pytest.mark.parametrize('duration', [0.02, 0.3])
def test_the_robot_gains_the_impulse_of_a_scenarios_push_from_its_tick_on(duration):
    impulse = np.array((1.0, -2.0, 0.5))
    event = {'at': 0.1, 'push': {'impulse': impulse.tolist(), 'duration': duration,
                                 'frame': 'odom'}}
    gained = flying([event], 110) - flying([], 110)
    start, end = 25, 25 + round(duration / 0.004)
    np.testing.assert_allclose(gained[:start], 0.0, atol=1e-9)
    assert np.linalg.norm(gained[start]) > 0.5 * np.linalg.norm(impulse) * 0.004 / duration
    np.testing.assert_allclose(gained[end:] - impulse, 0.0, atol=2e-3)


def test_a_force_that_is_not_renewed_ends():
    robot = MujocoRobot(initial_height=60.0)
    home = robot.reset().joint_position
    robot.take_push(PushForce(0, (50.0, 0.0, 0.0), 'odom'))
    speeds = []
    for _ in range(60):
        robot.step(JointTargets(home, ZERO, ZERO))
        mujoco.mj_subtreeVel(robot.model, robot.data)
        speeds.append(robot.data.subtree_linvel[1, 0])
    assert speeds[25] == pytest.approx(50.0 * 0.1 / robot.description.mass, rel=1e-3)
    assert speeds[59] == pytest.approx(speeds[25], abs=1e-3)


@pytest.mark.parametrize(('value', 'text'), [
    (5.0, 'must be a mapping with impulse'),
    ({'duration': 0.1}, 'push needs impulse'),
    ({'impulse': [1, 2]}, 'push needs impulse'),
    ({'impulse': [1, 'a', 2]}, 'must be numbers'),
    ({'impulse': [0, float('nan'), 0]}, 'must be finite'),
    ({'impulse': [0, 5, 0], 'duration': 0}, 'duration of the push must be'),
    ({'impulse': [0, 5, 0], 'frame': 'base'}, 'valid are base_footprint, odom'),
    ({'impulse': [0, 5, 0], 'force': 3}, "'force' is not known; valid are impulse"),
])
def test_a_bad_push_is_refused_with_what_is_valid(value, text):
    with pytest.raises(DataError, match=text):
        EVENT_KINDS['push'](value, 'event 1')
