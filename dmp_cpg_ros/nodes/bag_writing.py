# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A rosbag2 recording that stays readable when its process is killed.

MCAP files consist of chunks; what lies in closed chunks survives. :meth:`BagWriter.flush` closes
the chunk and hands it to the operating system, so that a killed recorder loses no more than what
came after the last flush; :func:`~dmp_cpg_ros.analysis.rescue.rescue` makes a sound bag of the
file. SQLite recordings are one transaction, which is committed when the bag is closed: a killed
recorder leaves an empty one.

Time of a record: the stamp of the message. A recording then does not depend on when its messages
happened to arrive, and in lock-step not on the machine. Messages without a stamp (``cmd_vel``, or
stamp zero from a node that knows no time yet) bear the newest time of the robot's clock; those
that arrive before the clock is known wait for it.
"""

from __future__ import annotations

import fcntl
import struct
import time
from collections.abc import Callable
from pathlib import Path

from rclpy.qos import QoSProfile
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.typesys import Stores, get_typestore

from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError

STORAGES = ('mcap', 'sqlite3')

_STAMP_LITTLE, _STAMP_BIG = struct.Struct('<iI'), struct.Struct('>iI')
_STAMP_AT = 4
"""A stamp that begins a message lies behind the four bytes that say how it is encoded."""

_UNSET = QosTime(9223372036, 854775807)


class RecordingError(DmpCpgError):
    """The recording cannot go on, for example because the disk is full."""


class BagWriter:
    """Writes serialized messages into a new rosbag2 folder.

    Parameters
    ----------
    folder : Path
        Must not exist; parents are made.
    storage : str
        ``mcap`` or ``sqlite3``.

    Attributes
    ----------
    counts : dict of str to int
        Messages per topic.
    flushed : int
        Messages that survive a kill.

    Raises
    ------
    ParameterError
        If the folder exists or cannot be made.
    """

    def __init__(self, folder: Path, storage: str = 'mcap') -> None:
        """Open the bag."""
        self.folder, self.flushed = folder, 0
        self.counts: dict[str, int] = {}
        self.newest_ns: int | None = None
        self._waiting: list[tuple[Connection, bytes]] = []
        self._store = get_typestore(Stores.ROS2_JAZZY)
        try:
            self._writer = Writer(folder, version=9, storage_plugin=StoragePlugin[storage.upper()])
            self._writer.open()
        except (WriterError, OSError) as error:
            raise ParameterError(f"output '{folder}' must be a folder that does not exist and "
                                 f'can be made: {error}') from error
        self._file = getattr(self._writer.storage, 'bio', None)
        if self._file is not None:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def add_topic(self, topic: str, type_name: str, qos: QoSProfile, *, stamped: bool,
                  clock: bool) -> Callable[[bytes], None]:
        """Add a topic.

        Parameters
        ----------
        topic : str
            Full name.
        type_name : str
            Such as ``sensor_msgs/msg/JointState``.
        qos : QoSProfile
            Profile that its publishers offer.
        stamped : bool
            Whether its messages begin with a stamp.
        clock : bool
            Whether their stamps are the robot's clock.

        Returns
        -------
        callable (bytes)
            Writes one serialized message of the topic.
        """
        connection = self._writer.add_connection(topic, type_name, typestore=self._store,
                                                 offered_qos_profiles=[offered_qos(qos)])
        self.counts[topic] = 0

        def write(data: bytes) -> None:
            self.counts[topic] += 1
            time_ns = _leading_stamp(data) if stamped else 0
            if clock:
                self._set_clock(time_ns)
            elif time_ns == 0:
                if self.newest_ns is None:
                    self._waiting.append((connection, data))
                    return
                time_ns = self.newest_ns
            self._write(connection, time_ns, data)

        return write

    def flush(self) -> None:
        """Hand what was written to the operating system (MCAP; nothing to do for SQLite)."""
        storage = self._writer.storage
        chunk, close_chunk = getattr(storage, 'chunk', None), getattr(storage, 'close_chunk', None)
        if self._file is None or chunk is None or close_chunk is None:
            return
        try:
            if chunk.msgs:
                close_chunk()
            self._file.flush()
        except OSError as error:
            raise RecordingError(f"cannot write to '{self.folder}': {error}") from error
        self.flushed = sum(self.counts.values()) - len(self._waiting)

    def close(self) -> None:
        """Write what still waits for a clock with the time of the day, and complete the bag."""
        if self._waiting:
            self._set_clock(time.time_ns())
        try:
            if not any(self._writer.counts.values()):
                self._writer.min_timestamp = 0
            self._writer.close()
        except OSError as error:
            raise RecordingError(f"cannot complete '{self.folder}': {error}") from error

    def _set_clock(self, time_ns: int) -> None:
        waiting, self._waiting = self._waiting, []
        self.newest_ns = time_ns
        for connection, data in waiting:
            self._write(connection, time_ns, data)

    def _write(self, connection: Connection, time_ns: int, data: bytes) -> None:
        try:
            self._writer.write(connection, time_ns, data)
        except OSError as error:
            raise RecordingError(f"cannot write to '{self.folder}': {error}") from error


def offered_qos(profile: QoSProfile) -> Qos:
    """Profile of rclpy as rosbags stores it; unset times are rosbag2's infinity."""
    return Qos(QosHistory(int(profile.history)), profile.depth,
               QosReliability(int(profile.reliability)), QosDurability(int(profile.durability)),
               _UNSET, _UNSET, QosLiveliness.SYSTEM_DEFAULT, _UNSET, False)


def _leading_stamp(data: bytes) -> int:
    """Stamp that a serialized message begins with [ns]; 0 when it is absent or negative."""
    if len(data) < _STAMP_AT + 8:
        return 0
    seconds, rest = (_STAMP_LITTLE if data[1] & 1 else _STAMP_BIG).unpack_from(data, _STAMP_AT)
    return max(0, seconds * 1_000_000_000 + rest)
