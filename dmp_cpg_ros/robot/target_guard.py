# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the joints are told when legs fall silent: the robot holds a stand and does not fall."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.robot_state import JOINTS_OF_LEG, LEGS, JointTargets

Array = NDArray[np.float64]

RAMP_NS = 600_000_000
"""Time in which a stand is taken up from wherever the joints are [ns]."""


class TargetGuard:
    """The newest targets of the four legs, or a stand when one of them is too old.

    Parameters
    ----------
    stand : ndarray (12,)
        Joint angles of the stand [rad].
    timeout_ns : int
        Age of a leg's targets from which the robot holds the stand [ns].
    """

    def __init__(self, stand: Array, timeout_ns: int) -> None:
        """Start without targets: hold the stand."""
        self._stand, self._timeout_ns = stand.copy(), timeout_ns
        self._position, self._velocity, self._effort = stand.copy(), np.zeros(12), np.zeros(12)
        self.stamps: list[int | None] = [None] * len(LEGS)
        self._hold_from: tuple[int, Array] | None = (-RAMP_NS, stand.copy())

    def accept(self, leg: str, stamp_ns: int, targets: JointTargets) -> None:
        """Take a leg's targets; older ones than the newest are ignored."""
        place = LEGS.index(leg)
        newest = self.stamps[place]
        if newest is not None and stamp_ns < newest:
            return
        self.stamps[place] = stamp_ns
        joints = slice(len(JOINTS_OF_LEG) * place, len(JOINTS_OF_LEG) * (place + 1))
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

    def targets(self, now_ns: int, joint_position: Array) -> JointTargets:
        """Targets of all joints at a time.

        Parameters
        ----------
        now_ns : int
            Stamp of the robot's state [ns].
        joint_position : ndarray (12,)
            Measured angles [rad]; where the way to the stand begins.

        Returns
        -------
        JointTargets
            (12,) each.
        """
        if not self.silent(now_ns):
            self._hold_from = None
            return JointTargets(self._position.copy(), self._velocity.copy(), self._effort.copy())
        if self._hold_from is None:
            self._hold_from = (now_ns, joint_position.copy())
        since, start = self._hold_from
        share = min(max((now_ns - since) / RAMP_NS, 0.0), 1.0)
        smooth = share * share * (3.0 - 2.0 * share)
        return JointTargets(start + smooth * (self._stand - start), np.zeros(12), np.zeros(12))
