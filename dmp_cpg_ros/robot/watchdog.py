# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Command watchdog: the newest joint targets, or the fallback when a leg sends none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS, JointTargets, RobotState
from dmp_cpg_ros.robot.fallback import Fallback, FallbackController

CARRIED_NS = 24_000_000
"""Age up to which late targets are carried on by their own velocity [ns]."""


class CommandWatchdog:
    """The newest targets of the four legs, or a fallback when one of them is too old.

    Targets hold at their stamp. Those that act later are carried on by their own velocity to the
    time at which they act, as the joint would have moved if they had come in time; otherwise every
    late message would hold the feet, and with them the body, back.

    Parameters
    ----------
    controller : FallbackController
        What takes over.
    timeout_ns : int
        Age of a leg's targets from which the robot falls back [ns].
    """

    def __init__(self, controller: FallbackController, timeout_ns: int) -> None:
        """Start without targets."""
        self._controller, self._timeout_ns = controller, timeout_ns
        self._position, self._velocity, self._effort = (np.zeros(12) for _ in range(3))
        self.stamps: list[int | None] = [None] * len(LEGS)
        self._fallback: Fallback | None = None

    @property
    def fallback(self) -> str:
        """``stand``, ``lie`` or ``damp`` while the robot falls back; else empty."""
        return '' if self._fallback is None else self._fallback.what

    def accept(self, leg: str, stamp_ns: int, targets: JointTargets) -> None:
        """Take a leg's targets; older ones than the newest are ignored."""
        i = LEGS.index(leg)
        newest = self.stamps[i]
        if newest is not None and stamp_ns < newest:
            return
        self.stamps[i] = stamp_ns
        joints = slice(len(JOINTS_OF_LEG) * i, len(JOINTS_OF_LEG) * (i + 1))
        self._position[joints], self._velocity[joints] = targets.position, targets.velocity
        self._effort[joints] = targets.effort

    def silent(self, now_ns: int) -> list[str]:
        """Legs whose targets are missing or too old."""
        return [
            leg
            for leg, stamp in zip(LEGS, self.stamps, strict=True)
            if stamp is None or now_ns - stamp > self._timeout_ns
        ]

    def age_ns(self, now_ns: int) -> int:
        """Age of the oldest leg's targets [ns]; 0 while a leg has never sent any."""
        known = [stamp for stamp in self.stamps if stamp is not None]
        return now_ns - min(known) if len(known) == len(self.stamps) else 0

    def targets(self, state: RobotState) -> JointTargets:
        """Targets of all joints, (12,) each, at a state of the robot."""
        if not self.silent(state.time_ns):
            self._fallback = None
            return JointTargets(
                self._carried(state.time_ns), self._velocity.copy(), self._effort.copy())
        if self._fallback is None:
            self._fallback = self._controller.begin(state)
        self._fallback, targets = self._controller.step(self._fallback, state)
        return targets

    def _carried(self, now_ns: int) -> NDArray[np.float64]:
        """Target angles (12,) at a time [rad]."""
        ages = [max(0, now_ns - stamp) for stamp in self.stamps if stamp is not None]
        if not any(ages):
            return self._position.copy()
        late = np.repeat([1e-9 * min(age, CARRIED_NS) for age in ages], len(JOINTS_OF_LEG))
        return self._position + late * self._velocity
