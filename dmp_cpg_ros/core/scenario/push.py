# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pushes: a force on the base for a while, in the frame of its heading or of the world.

A force acts from its time until the next one, and for ``HOLD_NS`` at most, as a velocity command
does: whoever falls silent stops pushing. A longer push is renewed.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from math import cos, isfinite, sin

import numpy as np

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths.rotations import Array, roll_pitch_yaw

HOLD_NS = 100_000_000
"""How long a force acts that is not renewed [ns]."""

LONGEST_PUSH_S = 10.0
"""Longest push of a scenario [s], which is sent as a whole."""

FARTHEST_NS = round(1e9 * LONGEST_PUSH_S) + 1_000_000_000
"""How far ahead of the clock the time of a force may be [ns]."""

MOST_WAITING = 1000
"""Forces that may wait for their time: those of ten pushes of the longest."""

FRAMES = ('base_footprint', 'odom', 'world')
"""Frames of a force: x along the base's heading and z up, or the world's; the simulator,
which knows of no drift, takes ``odom`` as the world.
"""

LARGEST_FORCE = 15_000.0
"""Largest component of a force [N]: a hundred times a robot's weight, which a simulation bears."""

LARGEST_MEAN_FORCE = LARGEST_FORCE / 1.5
"""Largest component of an impulse over its duration [N], which whole ticks round by half at most.
"""


@dataclass(frozen=True)
class PushForce:
    """A force on the base's centre of mass.

    Attributes
    ----------
    time_ns : int
        Stamp of the tick at which it begins, or any earlier time for at once [ns].
    force : tuple of float
        [N]
    frame : str
        One of ``FRAMES``; the heading is that at the beginning.
    """

    time_ns: int
    force: tuple[float, float, float]
    frame: str = FRAMES[0]

    def __post_init__(self) -> None:
        """Validate; raises DataError that says what is valid."""
        if self.frame not in FRAMES:
            raise DataError(f"push in frame '{self.frame}'; valid are {', '.join(FRAMES)}")
        if len(self.force) != 3 or not all(isfinite(value) for value in self.force):
            raise DataError(f'push: the force {self.force} must be three finite numbers [N]')
        if max(map(abs, self.force)) > LARGEST_FORCE:
            raise DataError(
                f'push: the force {self.force} must be at most {LARGEST_FORCE:g} N on each axis')

    def in_world(self, base_quaternion: Array) -> Array:
        """Force in the world, ndarray (3,) [N], for a base orientation x, y, z, w."""
        f_x, f_y, f_z = self.force
        if self.frame != FRAMES[0]:
            return np.array((f_x, f_y, f_z))
        yaw = roll_pitch_yaw(base_quaternion)[2]
        c, s = cos(yaw), sin(yaw)
        return np.array((c * f_x - s * f_y, s * f_x + c * f_y, f_z))


@dataclass(frozen=True)
class Push:
    """A push of a scenario.

    Attributes
    ----------
    impulse : tuple of float
        [N s]
    duration_s : float
        Time over which it is spread evenly [s].
    frame : str
        One of ``FRAMES``.
    """

    impulse: tuple[float, float, float]
    duration_s: float = 0.1
    frame: str = FRAMES[0]

    def forces(self, start_ns: int, tick_ns: int) -> tuple[PushForce, ...]:
        """Forces that make up the push, each with its time; the last one is zero.

        The duration is rounded to whole ticks, at least one, and the impulse kept.
        """
        ticks = max(1, round(self.duration_s * 1e9 / tick_ns))
        f_x, f_y, f_z = (value / (ticks * tick_ns * 1e-9) for value in self.impulse)
        renewed = range(start_ns, start_ns + ticks * tick_ns, max(HOLD_NS // tick_ns, 1) * tick_ns)
        return (*(PushForce(at, (f_x, f_y, f_z), self.frame) for at in renewed),
                PushForce(start_ns + ticks * tick_ns, (0.0, 0.0, 0.0), self.frame))


class PushQueue:
    """Forces that wait for their time."""

    def __init__(self) -> None:
        self._waiting: list[PushForce] = []

    def add(self, force: PushForce, now_ns: int) -> None:
        """Take a force at a time [ns]; one for the same time as an earlier one replaces it.

        Raises
        ------
        DataError
            If its time is too far ahead, or too many wait; those that wait stay.
        """
        waiting, at = self._waiting, force.time_ns
        if at > now_ns + FARTHEST_NS:
            raise DataError(f'push: the stamp {at * 1e-9:.3f} s must be at most '
                            f'{FARTHEST_NS * 1e-9:g} s ahead of the clock, {now_ns * 1e-9:.3f} s')
        place = bisect_left(waiting, at, key=_time)
        end = bisect_right(waiting, at, key=_time)
        if place == end and len(waiting) >= MOST_WAITING:
            raise DataError(f'push: {MOST_WAITING} forces wait for their time, and no more can')
        waiting[place:end] = [force]

    def due(self, now_ns: int) -> PushForce | None:
        """The newest force whose time has come since the last call, or None."""
        if not self._waiting:
            return None
        count = bisect_right(self._waiting, now_ns, key=_time)
        due, self._waiting = self._waiting[:count], self._waiting[count:]
        return due[-1] if due else None


def _time(force: PushForce) -> int:
    return force.time_ns
