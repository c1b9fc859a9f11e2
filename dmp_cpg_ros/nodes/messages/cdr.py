# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the suite needs of the messages of every tick, read from their serialized bytes.

rclpy builds a Python object for every part of a message: 30 objects for a ``JointState`` of
twelve joints, of which a node needs the stamp and three arrays. The readers of this module take
these from the bytes: CDR in little-endian order as of OMG DDSI-RTPS 2.5, section 10, with every
primitive aligned to its size, counted from behind the four bytes that name the encoding. What is
encoded otherwise is left to rclpy.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.messages.values import NS, Array, checked, stamp_in_ns

CDR_LITTLE_ENDIAN = b'\x00\x01'
"""First two bytes of a message that this module reads itself."""

LONGEST = 100_000
"""Bytes of a message that are read at most; the suite's own are a few thousand long."""

BODY = 4
"""Where a message begins: behind the bytes that say how it is encoded."""


FIELDS = ('position', 'velocity', 'effort')
"""The arrays of a ``JointState``, in the order of its definition."""

_STAMP, _HEADER, _COUNT = struct.Struct('<iI'), struct.Struct('<iII'), struct.Struct('<I')
_TWIST, _IMU = struct.Struct('<6d'), struct.Struct('<5d64x3d72x3d72x')


class Serialized:
    """A message known by its bytes; raises struct.error or ValueError when they are cut short.

    Attributes
    ----------
    serialized : bytes
        The message.
    stamp_ns : int
        Stamp of its header [ns].
    """

    __slots__ = ('serialized', 'stamp_ns')
    KIND: ClassVar[type]

    def __init__(self, data: bytes) -> None:
        """Read the bytes."""
        seconds, rest, length = _HEADER.unpack_from(data, BODY)
        self.serialized, self.stamp_ns = data, stamp_in_ns(seconds, rest)
        self._read(BODY + _HEADER.size + length)

    def _read(self, at: int) -> None:
        """Read what follows the header."""


class SerializedJointState(Serialized):
    """Stamp, names and arrays of a serialized ``JointState``.

    Attributes
    ----------
    name : list of str
        Names; the same list object for the same names.
    position, velocity, effort : ndarray
        Made when they are asked for.
    """

    __slots__ = ('_places', '_sound', '_trusted', 'effort', 'name', 'position', 'velocity')
    KIND = JointState

    def _read(self, at: int) -> None:
        self.name, at = _names(self.serialized, at)
        self._places, self._sound, self._trusted = {}, dict[str, Array](), False
        for field in FIELDS:
            self._places[field] = _, at = _doubles(self.serialized, at)

    def refilled(self, data: bytes, stamp_ns: int, *, sound: bool) -> SerializedJointState:
        """Return a message of the same layout, without reading that again; its numbers too where
        they are known to be sound.
        """
        message = SerializedJointState.__new__(SerializedJointState)
        message.serialized, message.stamp_ns = data, stamp_ns
        message.name, message._places, message._sound = self.name, self._places, {}
        message._trusted = sound
        return message

    def __getattr__(self, field: str) -> Array:
        if field not in FIELDS:
            raise AttributeError(field)
        array = self._array(field)
        setattr(self, field, array)
        return array

    def _array(self, field: str) -> Array:
        begin, end = self._places[field]
        return np.frombuffer(self.serialized[begin:end])

    def checked(self, fields: Sequence[str]) -> list[Array]:
        """Arrays whose numbers are finite, checked once for all readers; raises DataError."""
        sound = self._sound
        for field in fields:
            if field not in sound:
                array = self._array(field)  # without __getattr__'s price, a failed look-up
                sound[field] = array if self._trusted else checked(array, field)
        return [sound[field] for field in fields]


class SerializedTwist(Serialized):
    """A serialized ``TwistStamped``.

    Attributes
    ----------
    numbers : tuple of float
        Linear x, y, z [m/s], angular x, y, z [rad/s].
    """

    __slots__ = ('numbers',)
    KIND = TwistStamped

    def _read(self, at: int) -> None:
        self.numbers: tuple[float, ...] = _TWIST.unpack_from(self.serialized, aligned(at, 8))


class SerializedImu(Serialized):
    """A serialized ``Imu``.

    Attributes
    ----------
    orientation : tuple of float
        Quaternion x, y, z, w, and the first entry of its covariance: -1 where it is not known.
    rate, force : tuple of float
        Angular velocity [rad/s] and linear acceleration [m/s^2].
    """

    __slots__ = ('force', 'orientation', 'rate')
    KIND = Imu

    def _read(self, at: int) -> None:
        numbers = _IMU.unpack_from(self.serialized, aligned(at, 8))
        self.orientation, self.rate, self.force = numbers[:5], numbers[5:8], numbers[8:]


class SerializedOdometry(Serialized):
    """A serialized ``Odometry``, of which the suite reads no part by itself."""

    __slots__ = ()
    KIND = Odometry


_READERS: dict[type, Callable[[bytes], Any]] = {
    kind.KIND: kind for kind in (SerializedJointState, SerializedTwist, SerializedImu)
}


def serialized_reader(kind: type, *, as_message: bool = False) -> Callable[[bytes], Any]:
    """How to read the bytes of a kind of message.

    Parameters
    ----------
    kind : type
        Message class.
    as_message : bool
        Whether to return the message class itself whatever it is.

    Returns
    -------
    callable (bytes) → message
        Returns one of this module's classes, or the message itself where this module does not read
        its kind or its encoding; raises DataError for a stamp that is no time, for bytes that are
        no such message, and for more than ``LONGEST`` of them.
    """
    own = None if as_message else _READERS.get(kind)

    def reader(data: bytes) -> Any:
        if len(data) > LONGEST:
            raise DataError(f'{len(data)} bytes of {kind.__name__}; at most {LONGEST} are read')
        try:
            if own is None or data[:2] != CDR_LITTLE_ENDIAN:
                return deserialize_message(data, kind)
            return own(data)
        except (struct.error, ValueError, MemoryError, rclpy_implementation.RMWError) as error:
            raise DataError(f'{len(data)} bytes are no {kind.__name__}: {error}') from None

    return reader


def serialized_stamp(data: bytes) -> int:
    """Stamp [ns] with which little-endian bytes of a message with a header begin, whatever
    follows; raises DataError where there is no room for one.
    """
    if len(data) < BODY + _STAMP.size:
        raise DataError(f'{len(data)} bytes are no message with a stamp')
    seconds, rest = _STAMP.unpack_from(data, BODY)
    return int(seconds * NS + rest)


def aligned(at: int, size: int) -> int:
    """Place of the next primitive of a size of 4 or 8 bytes, at or behind a place."""
    return at + (BODY - at) % size


_KEY = 16
"""Bytes by which names are looked up: their number and the begin of the first one."""

_MOST_NAMES, _LONGEST_NAMES = 256, 4096
"""Sequences of names that are known at a time, and bytes of the longest of them."""

_known_names: dict[bytes, tuple[bytes, list[str]]] = {}
"""Bytes of what was read, and what they say, by the first bytes."""


def _names(data: bytes, at: int) -> tuple[list[str], int]:
    """Sequence of texts and where what follows it begins.

    Senders repeat their names in every message, so these are compared with known ones. The bytes
    that align texts are arbitrary: where they differ, the names are read again.
    """
    at = aligned(at, 4)
    key = data[at:at + _KEY]
    raw, names = _known_names.get(key, (b'', []))
    end = at + len(raw)
    if raw and data[at:end] == raw:
        return names, end
    (count,) = _COUNT.unpack_from(data, at)
    end, names = at + 4, []
    for _ in range(count):
        begin = aligned(end, 4) + 4
        end = begin + _COUNT.unpack_from(data, begin - 4)[0]
        if end > len(data):
            raise ValueError('a name is cut short')
        # As rclpy reads them: up to a zero, and with a mark in place of what is no UTF-8.
        names.append(data[begin:end].partition(b'\0')[0].decode(errors='replace'))
    if end - at <= _LONGEST_NAMES:
        if len(_known_names) >= _MOST_NAMES:
            _known_names.clear()
        _known_names[key] = data[at:end], names
    return names, end


def _doubles(data: bytes, at: int) -> tuple[int, int]:
    """Begin and end of a sequence of doubles."""
    at = aligned(at, 4)
    (count,) = _COUNT.unpack_from(data, at)
    at += 4
    if not count:
        return at, at
    at = aligned(at, 8)
    end = at + 8 * count
    if end > len(data):
        raise ValueError('an array is cut short')
    return at, end


class RefilledMessage:
    """Bytes of a message that is laid out once, in the order of its definition, and refilled.

    Parameters
    ----------
    *texts : str
        Texts that follow the stamp, the frame of the header first.
    """

    def __init__(self, *texts: str) -> None:
        """Begin with the encoding, a stamp of zero and the texts."""
        self.data = bytearray(CDR_LITTLE_ENDIAN + bytes(BODY - 2 + _STAMP.size))
        self._places: list[tuple[str, slice]] = []
        for value in texts:
            self.text(value)

    def text(self, value: str) -> None:
        """Append a text."""
        raw = value.encode() + b'\0'
        self.count(len(raw))
        self.data += raw

    def count(self, number: int) -> None:
        """Append the length of a sequence."""
        self._align(4)
        self.data += _COUNT.pack(number)

    def constant(self, *numbers: float) -> None:
        """Append numbers that stay."""
        self._align(8)
        self.data += struct.pack(f'<{len(numbers)}d', *numbers)

    def refilled(self, **sizes: int) -> None:
        """Append runs of numbers that are refilled, by the names that errors give them."""
        for name, size in sizes.items():
            self._align(8)
            self._places.append((name, slice(len(self.data), len(self.data) + 8 * size)))
            self.data += bytes(8 * size)

    def _align(self, size: int) -> None:
        self.data += bytes(aligned(len(self.data), size) - len(self.data))

    def filled(self, time_ns: int, *runs: Array, sound: bool = True) -> bytes:
        """Return the message with a stamp [ns] and an array for each run, of any shape.

        Raises
        ------
        DataError
            If a number is not finite: nothing of that kind leaves a node, but for what a robot
            with injected failures tells, which is not ``sound``.
        ValueError
            If a run has another length than its place, or there are more or fewer runs.
        """
        data = self.data
        _STAMP.pack_into(data, BODY, *divmod(time_ns, NS))
        for (name, place), run in zip(self._places, runs, strict=True):
            if 8 * run.size != place.stop - place.start:
                raise ValueError(f'{run.size} numbers of {name} for '
                                 f'{(place.stop - place.start) // 8} places')
            data[place] = (checked(run.reshape(-1), name) if sound else run).tobytes()
        return bytes(data)
