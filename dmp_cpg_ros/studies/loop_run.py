# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A MuJoCo robot under the plain loop, ticked by the studies; it can be copied at any tick."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

Array = NDArray[np.float64]

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

    def walk(self, duration: float) -> bool:
        """Tick for a time [s], or until the robot falls; return whether it is on its feet."""
        for _ in range(round(duration / self.tick_s)):
            if self.fell():
                return False
            self.state = self.robot.step(self.loop.tick(self.state).targets)
            self.states.append(self.state)
        return not self.fell()

    def push(self, impulse: Array) -> None:
        """Push the base by an impulse in the world (3,) [N s], from the next tick on."""
        self.robot.apply_push(impulse / PUSH_DURATION, round(PUSH_DURATION * 1e9))

    def walk_until(self, time: float) -> bool:
        """Tick until a time from the start [s]; keep no states."""
        done = self.state.time_ns // self.robot.tick_ns
        upright = self.walk((round(time / self.tick_s) - done) * self.tick_s)
        self.states.clear()
        return upright
