# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Interface of a robot to the suite: simulated, perfectly tracking, or real."""

from __future__ import annotations

from typing import Protocol

from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState


class RobotError(DmpCpgError):
    """The robot (or its simulation) cannot go on."""


class Robot(Protocol):
    """A robot that advances by one control tick at a time.

    Attributes
    ----------
    description : RobotDescription
        What the controllers may know of it.
    tick_ns : int
        Length of a control tick [ns].
    without_power : tuple of str
        Legs whose drives are cut off, and give no torque whatever they are told.
    """

    without_power: tuple[str, ...]

    @property
    def description(self) -> RobotDescription:
        """What the controllers may know of the robot."""

    @property
    def tick_ns(self) -> int:
        """Length of a control tick [ns]."""

    def reset(self, time_ns: int = 0) -> RobotState:
        """Stand in the home pose at a time, whole ticks from 0 [ns], and return that state."""

    def step(self, targets: JointTargets) -> RobotState:
        """Advance by one tick under targets (12,) and return the state at its end.

        Raises
        ------
        DataError
            If the targets have another shape or are not finite.
        RobotError
            If the robot cannot go on.
        """


def steps_per_tick(tick_ns: int, step_ns: int) -> int:
    """Return how many physics steps make one control tick.

    Raises
    ------
    ParameterError
        If the tick is not a positive whole multiple of the step: times would drift apart.
    """
    if tick_ns <= 0 or step_ns <= 0 or tick_ns % step_ns:
        raise ParameterError(
            f'a tick of {tick_ns} ns is not a positive whole multiple of the physics step of '
            f'{step_ns} ns; control_rate may be {1e9 / step_ns:g} Hz, a half of it, a third ...')
    return tick_ns // step_ns
