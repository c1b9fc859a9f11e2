# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pushes: a force on the base for a while, in the frame of its heading or of the world.

A force acts from its time until the next one, and for ``HOLD_NS`` at most, as a velocity command
does: whoever falls silent stops pushing. A longer push is renewed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, cos, isfinite, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import DataError

HOLD_NS = 100_000_000
"""How long a force acts that is not renewed [ns]."""

FRAMES = ('base_footprint', 'odom')
"""Frames of a force: x along the base's heading and z up, or the world's."""

LARGEST_IMPULSE = 1000.0
"""Largest component of an impulse [N s]."""

LARGEST_FORCE = 15_000.0
"""Largest component of a force [N]: a hundred times a robot's weight, which a simulation bears."""

LARGEST_MEAN_FORCE = LARGEST_FORCE / 1.5
"""Largest component of an impulse over its duration [N], which whole ticks round by half at most.
"""

LONGEST_S = 10.0
"""Longest push [s]."""


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

    def in_world(self, base_quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
        """Force in the world, ndarray (3,) [N], for a base orientation x, y, z, w."""
        f_x, f_y, f_z = self.force
        if self.frame == 'odom':
            return np.array((f_x, f_y, f_z))
        x, y, z, w = base_quaternion.tolist()
        yaw = atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
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
        pushing = (PushForce(at, (f_x, f_y, f_z), self.frame) for at in renewed)
        end = PushForce(start_ns + ticks * tick_ns, (0.0, 0.0, 0.0), self.frame)
        return (*pushing, end)


class PushQueue:
    """Forces that wait for their time."""

    def __init__(self) -> None:
        """Start without any."""
        self._waiting: list[PushForce] = []

    def add(self, force: PushForce) -> None:
        """Take a force; one for the same time replaces an earlier one."""
        kept = [other for other in self._waiting if other.time_ns != force.time_ns]
        self._waiting = sorted([*kept, force], key=lambda entry: entry.time_ns)

    def due(self, now_ns: int) -> PushForce | None:
        """The newest force whose time has come since the last call, or None."""
        due = [force for force in self._waiting if force.time_ns <= now_ns]
        self._waiting = self._waiting[len(due):]
        return due[-1] if due else None


def read_push(value: Any, where: str) -> tuple[Push, str]:
    """Read a scenario's ``push``, such as ``{impulse: [0, 5, 0], duration: 0.1, frame: odom}``.

    Returns
    -------
    push : Push
    label : str
        What to tell the user.

    Raises
    ------
    DataError
        That says what is valid.
    """
    valid = 'impulse: [x, y, z] in N s, and perhaps duration [s] and frame'
    if not isinstance(value, Mapping) or not {'impulse'} <= set(value) <= {
            'impulse', 'duration', 'frame'}:
        raise DataError(f'{where}: push must be a mapping with {valid}, not {value!r}')
    try:
        x, y, z = (float(number) for number in value['impulse'])
        duration = float(value.get('duration', Push.duration_s))
    except (TypeError, ValueError) as error:
        raise DataError(f'{where}: push must have numbers for {valid}, not {value}') from error
    if not all(abs(number) <= LARGEST_IMPULSE for number in (x, y, z)):
        raise DataError(f'{where}: the impulse {[x, y, z]} must be finite and at most '
                        f'{LARGEST_IMPULSE:g} N s')
    if not 0.0 < duration <= LONGEST_S:
        raise DataError(f'{where}: the duration {duration} s of the push must be positive and at '
                        f'most {LONGEST_S:g} s')
    if max(abs(x), abs(y), abs(z)) > LARGEST_MEAN_FORCE * duration:
        raise DataError(f'{where}: the impulse {[x, y, z]} over {duration:g} s must be at most '
                        f'{LARGEST_MEAN_FORCE * duration:g} N s: {LARGEST_MEAN_FORCE:g} N')
    frame = value.get('frame', FRAMES[0])
    if frame not in FRAMES:
        raise DataError(f"{where}: push in frame '{frame}'; valid are {', '.join(FRAMES)}")
    label = f'push of ({x:g}, {y:g}, {z:g}) N s over {duration:g} s in {frame}'
    return Push((x, y, z), duration, frame), label
