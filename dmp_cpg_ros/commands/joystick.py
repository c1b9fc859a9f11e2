# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A joystick as Linux gives it to every program: events of eight bytes (``linux/joystick.h``)."""

from __future__ import annotations

import os
import struct
from pathlib import Path

from dmp_cpg_ros.core.errors import DmpCpgError

EVENT = struct.Struct('=IhBB')
"""Time [ms], value, kind, number of the axis or button."""

BUTTON, AXIS, INITIAL = 0x01, 0x02, 0x80
"""Kinds; the last is added to what is told of the state in which a device is opened."""

FULL = 32767
"""Value of an axis that is pushed all the way."""

STILL = 0.08
"""Deflection below which an axis counts as released."""


class JoystickError(DmpCpgError):
    """There is no such joystick, or it is gone."""


class Joystick:
    """Axes and buttons of a device, as of its last events.

    Parameters
    ----------
    path : str
        Of the device, such as ``/dev/input/js0``.

    Attributes
    ----------
    held : set of int
        Buttons that are held.

    Raises
    ------
    JoystickError
        If it cannot be opened; names those that are there.
    """

    def __init__(self, path: str) -> None:
        """Open without waiting for events."""
        try:
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            there = ', '.join(sorted(map(str, Path('/dev/input').glob('js*')))) or 'none'
            raise JoystickError(f'{path}: {error.strerror}; joysticks here: {there}') from None
        self._path, self._rest, self._axes = path, b'', dict[int, float]()
        self.held: set[int] = set()

    def close(self) -> None:
        """Close the device."""
        os.close(self._file)

    def axis(self, number: int) -> float:
        """Deflection of an axis, -1 to 1; to the right and down are positive."""
        value = self._axes.get(number, 0.0)
        return value if abs(value) > STILL else 0.0

    def read(self) -> list[int]:
        """Take the events that have come; returns the buttons that were pressed, in order.

        Raises
        ------
        JoystickError
            If it is unplugged.
        """
        pressed: list[int] = []
        while True:
            try:
                data = os.read(self._file, 64 * EVENT.size)
            except BlockingIOError:
                return pressed
            except OSError as error:
                raise JoystickError(f'{self._path}: {error.strerror}') from None
            if not data:
                raise JoystickError(f'{self._path} has ended')
            pressed += self._taken(self._rest + data)

    def _taken(self, data: bytes) -> list[int]:
        pressed, whole = [], len(data) // EVENT.size * EVENT.size
        self._rest = data[whole:]
        for _, value, kind, number in EVENT.iter_unpack(data[:whole]):
            if kind & ~INITIAL == AXIS:
                self._axes[number] = max(-1.0, value / FULL)
            elif kind & ~INITIAL == BUTTON and value:
                self.held.add(number)
                if not kind & INITIAL:
                    pressed.append(number)
            elif kind & ~INITIAL == BUTTON:
                self.held.discard(number)
        return pressed
