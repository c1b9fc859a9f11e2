# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MuJoCo robot under the plain loop, and what it did as a recording: studies need no bag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Generic, TypeVar

import numpy as np

from dmp_cpg_ros.analysis import recording
from dmp_cpg_ros.core.gait.known_gaits import shares_of
from dmp_cpg_ros.core.loop import Array, Tick, WalkingLoop
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

PUSH_DURATION = 0.1
"""Time over which the impulse of a push is spread [s]."""

Loop = TypeVar('Loop', bound=WalkingLoop)


class LoopRun(Generic[Loop]):
    """Robot and loop, and the states since they were last cleared.

    A ``copy.deepcopy`` goes on bit for bit as the original would have.

    Parameters
    ----------
    robot : MujocoRobot
        Is reset.
    loop : WalkingLoop
        At its start.

    Attributes
    ----------
    state : RobotState
        The newest.
    states : list of RobotState
        Those that ticks gave.
    tick_s : float
        Control tick [s].
    """

    def __init__(self, robot: MujocoRobot, loop: Loop) -> None:
        self.robot, self.loop = robot, loop
        self.state: RobotState = robot.reset()
        self.states: list[RobotState] = []
        self.tick_s = robot.tick_ns * 1e-9

    def fell(self) -> bool:
        """Whether the robot lies on the ground."""
        return self.robot.fallen

    def tick(self, seconds: float) -> None:
        """Tick for a time [s], upright or not."""
        for _ in range(round(seconds / self.tick_s)):
            self.state = self.robot.step(self.loop.tick(self.state).targets)
            self.states.append(self.state)

    def walk(self, seconds: float) -> bool:
        """Tick for a time [s], or until the robot falls; return whether it is on its feet."""
        for _ in range(round(seconds / self.tick_s)):
            if self.fell():
                return False
            self.tick(self.tick_s)
        return not self.fell()

    def push(self, impulse: Array) -> None:
        """Push the base by an impulse in the world (3,) [N s], from the next tick on."""
        self.robot.apply_push(impulse / PUSH_DURATION, round(PUSH_DURATION * 1e9))


def recording_of(states: Sequence[RobotState], ticks: Sequence[Tick] = ()) -> recording.Recording:
    """Make a recording of the robot's states and, when they are given, of the loop's ticks.

    Parameters
    ----------
    states : sequence of RobotState
        In order of time.
    ticks : sequence of Tick
        In order of time; none for a recording of the robot alone.

    Returns
    -------
    Recording
    """
    work_is_known = all(state.joint_work is not None for state in states)
    robot = recording.Recording(
        joints=recording.JointSeries(*_columns(
            states, 'time_ns', 'joint_position', 'joint_velocity', 'joint_effort')),
        odometry=recording.OdometrySeries(*_columns(
            states, 'time_ns', 'base_position_in_world', 'base_quaternion',
            'base_velocity_in_base', 'base_rate_in_base')),
        feet=recording.FootForceSeries(*_columns(states, 'time_ns', 'foot_force')),
        work=recording.WorkSeries(*_columns(states, 'time_ns', 'joint_work', 'joint_peak_effort')
                                  if work_is_known else ()))
    if not ticks:
        return robot
    time, r, x, x_dot = _columns(ticks, 'time_ns', 'r', 'x', 'x_dot')
    targets = _columns([tick.targets for tick in ticks], 'position', 'velocity', 'effort')
    shares = tuple(shares_of(tick.gait) for tick in ticks)
    return replace(
        robot, targets=recording.JointSeries(time, *targets),
        canonical=recording.CanonicalSeries(time, x, x_dot, shares),
        reference=recording.VelocitySeries(time, r),
        inhibition=_changes(time, [(tick.supervisor.state, {}) for tick in ticks]),
        modes=_changes(time, [(tick.mode.mode, {'reason': tick.mode.reason}) for tick in ticks]))


def _columns(rows: Sequence[object], *names: str) -> list[Array]:
    """Arrays of some attributes; times in seconds."""
    return [np.array([getattr(row, name) for row in rows]) * (1e-9 if name == 'time_ns' else 1)
            for name in names]


def _changes(time: Array, states: Sequence[tuple[str, dict[str, str]]]
             ) -> tuple[recording.StatusEvent, ...]:
    """Words and values where the word changed."""
    return tuple(recording.StatusEvent(float(at), 0, word, values)
                 for k, (at, (word, values)) in enumerate(zip(time, states, strict=True))
                 if k == 0 or word != states[k - 1][0])
