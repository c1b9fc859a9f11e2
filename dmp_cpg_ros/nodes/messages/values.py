# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stamps, numbers and texts of messages, checked where they enter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import hypot
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths import Array

NS = 1_000_000_000
"""Nanoseconds of a second."""

LARGEST = 1e6
"""Numbers beyond this are a fault of the sender; nothing about a walking robot is as large."""


def stamp_ns(stamp: Time) -> int:
    """Read a stamp as nanoseconds; raises DataError when it is not a valid time."""
    return stamp_in_ns(stamp.sec, stamp.nanosec)


def stamp_in_ns(seconds: int, rest: int) -> int:
    """Join the two parts of a stamp to nanoseconds; raises DataError as :func:`stamp_ns`."""
    if seconds < 0 or rest >= NS:
        raise DataError(f'stamp {seconds} s + {rest} ns must have sec >= 0 and nanosec < 1e9')
    return seconds * NS + rest


def header_ns(message: Any) -> int:
    """Stamp of a message's header [ns]; raises DataError when it is not valid."""
    known: int | None = getattr(message, 'stamp_ns', None)  # of what was read from bytes
    return stamp_ns(message.header.stamp) if known is None else known


def stamped(read: Callable[[Any], Any]) -> Callable[[Any], tuple[int, Any]]:
    """Return a reader that keeps the stamp too, so that old readings are told from new ones."""
    return lambda message: (header_ns(message), read(message))


def told_at(stamp_ns: int, reading: tuple[int, Any] | None, missing: Any) -> Any:
    """What a stamped reading tells of a time [ns]; what is missing where it is of another one."""
    return reading[1] if reading is not None and reading[0] == stamp_ns else missing


def set_stamp(stamp: Time, time_ns: int) -> None:
    """Write nanoseconds into a stamp."""
    stamp.sec, stamp.nanosec = divmod(time_ns, NS)


def text(value: Any) -> str:
    """Value as text that reads back to it: floats in full, booleans as true and false."""
    if isinstance(value, (bool, np.bool_)):
        return 'true' if value else 'false'
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    return str(value)


def status_message(name: str, time_ns: int, message: str, values: Mapping[str, Any], *,
                   level: bytes = DiagnosticStatus.OK, robot: str = '') -> DiagnosticArray:
    """Status of a node of a robot at a time [ns]; numbers become text that reads back to the same
    float.
    """
    array = DiagnosticArray(status=[DiagnosticStatus(
        name=f'{robot}/{name}'.strip('/'), hardware_id=robot or 'dmp_cpg_ros',
        level=level, message=message,
        values=[KeyValue(key=key, value=text(value)) for key, value in values.items()])])
    set_stamp(array.header.stamp, time_ns)
    return array


def counts_message(counts: Mapping[str, int]) -> JointState:
    """Counts as positions by their names."""
    return JointState(name=list(counts), position=list(map(float, counts.values())))


def read_counts(message: JointState) -> dict[str, float]:
    """Counts by their names; raises DataError where a name has none."""
    if len(message.name) != len(message.position):
        raise DataError(f'{len(message.position)} counts for {len(message.name)} names')
    return dict(zip(message.name, message.position, strict=True))


def checked(values: Array, what: str) -> Array:
    """Return an array, or raise DataError when a number is not finite or beyond ``LARGEST``.

    Parameters
    ----------
    values : ndarray (n,)
        Numbers.
    what : str
        What they are, for the message.
    """
    if not hypot(*values.tolist()) <= LARGEST:  # quicker than NumPy, and does not overflow
        bad = ~(np.abs(values) <= LARGEST)
        if bad.any():
            where = int(np.argmax(bad))
            raise DataError(
                f'{what}[{where}] = {values[where]} must be finite and at most {LARGEST:g}')
    return values


def sensed(values: Array) -> Array:
    """Return a sensor's numbers, NaN in place of those that :func:`checked` would refuse."""
    if hypot(*values.tolist()) <= LARGEST:
        return values
    return np.where(np.abs(values) <= LARGEST, values, np.nan)


def checked_numbers(values: tuple[float, ...], what: str) -> tuple[float, ...]:
    """Return numbers, or raise DataError when one is not finite or beyond ``LARGEST``."""
    for value in values:
        if not -LARGEST <= value <= LARGEST:
            raise DataError(f'{what} = {values} must be finite and at most {LARGEST:g}')
    return values
