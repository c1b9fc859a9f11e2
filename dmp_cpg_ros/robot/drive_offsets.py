# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""By how much drives are off the angles that they are told, and what to tell them instead.

A drive whose zero has moved by δ gives the torque τ = τ* + kp δ in place of the τ* that the drive
law asks for, whatever the leg does. So (τ − τ*) / kp is the same at every tick for all joints of
the leg that do not give all they can. Drives that are stuck, late or give anything are off by
something else at each tick. A weak drive, or one without power, gives a share of what it is asked
for: that is no torque that nobody asks for, and without any torque no joint keeps up with targets
that move. A leg that is off pushes with kp δ, of a heavy robot with a large part of its weight,
until the body tips over, or yields until it gives no torque, as one without power. Told δ less it
does what it should.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, JOINTS_OF_LEG, LEGS

STEADY_NS, LONGEST_NS = 30_000_000, 60_000_000
"""Time for which the joints of a leg must have been off by the same, and over which that is looked
at most [ns].
"""

STEADY, SHARE, OFF = 0.015, 0.3, 0.05
"""Within which it is the same [rad], and the share of what targets have moved meanwhile; and by
how much one of the joints must be off at least [rad].
"""

MOVED, LITTLE = 0.08, 0.2
"""By how much a joint must have moved that gives less than such a share of kp δ [rad]."""

FULL = 0.98
"""Share of its torque limit from which a torque tells nothing."""

MOST = 0.3
"""Largest offset that is made up for [rad]."""


class DriveOffsets:
    """Offsets of twelve drives, by the torques that they report.

    Parameters
    ----------
    description : RobotDescription
        Gains and limits of the drives.

    Attributes
    ----------
    offset : ndarray (12,)
        By how much the drives are off [rad]; 0 where nothing is known.
    known : bool
        Whether any is.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Nothing is known."""
        stiffness = np.tile(description.kp, len(LEGS))
        limit = np.concatenate([leg.torque_limit for leg in description.legs])
        self._angle = np.where(stiffness > 0.0, limit / np.maximum(stiffness, 1e-9), 0.0)
        self._last: deque[tuple[int, Array]] = deque()
        self.offset, self.known = np.zeros(len(limit)), False

    def forget(self, legs: Sequence[str] = ()) -> None:
        """What was seen of the last ticks is no sign; of some legs nothing is known."""
        self._last.clear()
        if legs and self.known:
            self.offset = np.where(np.repeat([leg in legs for leg in LEGS], len(JOINTS_OF_LEG)),
                                   0.0, self.offset)
            self.known = bool(self.offset.any())

    def see(self, time_ns: int, given: Array, asked: Array, position: Array,
            wanted: Array) -> None:
        """Compare the torques of a tick, as shares of their limits, with what is asked of drives
        that are off as it is known.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        given : ndarray (12,)
            τ.
        asked : ndarray (n, 12)
            τ* by each law that the drives may have.
        position, wanted : ndarray (12,)
            Measured angles, and those of the targets [rad].
        """
        nearest = asked[np.abs(given - asked).argmin(axis=0), _ALL]
        off = self._angle * (given - nearest)
        if not np.abs(off).max() > OFF:
            self.forget()
            return
        self._last.append((time_ns, np.array(
            (off, self._angle * given, position, wanted, given, nearest))))
        if time_ns - self._last[0][0] < STEADY_NS:
            return
        while time_ns - self._last[0][0] > LONGEST_NS:
            self._last.popleft()
        part, found = _same(np.array([values for _, values in self._last]))
        if part.any():
            offset = self.offset + np.where(part, found, 0.0)
            offset = np.where(np.abs(offset) < STEADY, 0.0, np.clip(offset, -MOST, MOST))
            self.offset, self.known = offset, bool(offset.any())
            self.forget()


def _same(seen: Array) -> tuple[Array, Array]:
    """Which drives (12,) of some ticks (n, 6, 12) are off by the same all the time, and by how
    much [rad].
    """
    off, torque, position, wanted, *shares = seen.transpose(1, 0, 2)
    tells = (np.abs(shares) < FULL).all(axis=(0, 1))
    found, by_leg = off.mean(axis=0), (len(LEGS), len(JOINTS_OF_LEG))
    moved = np.where(tells, np.ptp(wanted, axis=0), 0.0).reshape(by_leg).max(axis=1)
    most = np.minimum(STEADY, SHARE * np.repeat(moved, len(JOINTS_OF_LEG)))
    same = tells & (np.ptp(off, axis=0) < most)
    asked = torque - off
    alone = np.abs(torque - np.clip(torque, np.minimum(asked, 0.0), np.maximum(asked, 0.0)))
    follows = (np.ptp(position, axis=0) > MOVED) & (
        np.abs(torque) < LITTLE * np.abs(found)).all(axis=0)
    known = same & (np.abs(found) > OFF) & ((alone.min(axis=0) > OFF) | follows)
    legs = (known.reshape(by_leg).any(axis=1) & (same | ~tells).reshape(by_leg).all(axis=1)
            & (tells.reshape(by_leg).sum(axis=1) > 1))
    return same & np.repeat(legs, len(JOINTS_OF_LEG)), found


_ALL = np.arange(len(JOINT_NAMES))
