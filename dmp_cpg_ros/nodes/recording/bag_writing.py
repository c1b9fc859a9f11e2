# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A rosbag2 recording that stays readable when its process is killed.

MCAP files consist of chunks; what lies in closed chunks survives. :meth:`BagWriter.flush` closes
the chunk and hands it to the operating system, so that a killed recorder loses no more than what
came after the last flush; :mod:`~dmp_cpg_ros.analysis.rescue` makes a sound copy of the file.
SQLite recordings are one transaction, which is committed when the bag is closed: a killed recorder
leaves an empty one.

Time of a record: when the message was received, on the robot's clock, which is the newest stamp
among the robot's own topics. Topics of the suite bear stamps of that clock: there the stamp itself
is the time, so that a lock-step recording does not depend on when its messages happened to arrive.
A message that comes before the clock has reached its stamp waits for it. All others get the time
that the clock shows: those of users, who may stamp with the time of the day; those without a
stamp (stamp zero of a latched topic comes from a node that knows no time yet, of others it is the
robot's first tick); and those whose stamp is before the recording or more than ``AHEAD_NS`` ahead.
Nothing lies outside the time of the robot; where none of its topics is recorded, that is the time
of the day. A recorder that is starved of processor time hears one topic seconds before another; no
time of a record depends on that.
"""

from __future__ import annotations

import fcntl
import struct
import tempfile
import time
from collections.abc import Callable, Iterator
from heapq import heappop, heappush
from io import BytesIO
from itertools import count
from operator import itemgetter
from pathlib import Path

from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags import interfaces as bags
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.typesys import Stores, get_typestore

from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.files import first_free

STORAGES = ('mcap', 'sqlite3')

_STAMP_LITTLE, _STAMP_BIG = struct.Struct('<iI'), struct.Struct('>iI')
_LENGTH = struct.Struct('<I')
_STAMP_AT = 4
"""A stamp that begins a message lies behind the four bytes that say how it is encoded."""

AHEAD_NS = 30_000_000_000
"""How far one topic may be ahead of the clock on its way to the recorder [ns]."""

NO_STAMP = -1
"""Of a message that gets the time that the clock shows."""

ANEW_NS = 1_000_000_000
"""A topic whose stamps go back by more comes from a clock that has begun anew [ns]."""

_UNSET = bags.QosTime(9223372036, 854775807)


class RecordingError(DmpCpgError):
    """The recording cannot go on, for example because the disk is full."""


class ChunkIndex:
    """Entries of the index of an MCAP file, one for each chunk, which the end of the file repeats:
    on disk until then, in a file without a name, so that the memory of a recorder does not grow.

    Parameters
    ----------
    folder : Path
        Folder of the recording, on whose disk it lies.
    """

    def __init__(self, folder: Path) -> None:
        """Begin without any."""
        self._file, self._count = tempfile.TemporaryFile(dir=folder), 0

    def append(self, entry: BytesIO) -> None:
        """Add an entry; raises OSError when the disk is full."""
        self._file.write(_LENGTH.pack(entry.getbuffer().nbytes))
        self._file.write(entry.getbuffer())
        self._count += 1

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[BytesIO]:
        self._file.seek(0)
        for _ in range(self._count):
            (length,) = _LENGTH.unpack(self._file.read(_LENGTH.size))
            entry = BytesIO()
            entry.write(self._file.read(length))  # and stands at its end, as what was added
            yield entry

    def close(self) -> None:
        """Forget all."""
        self._file.close()


class BagWriter:
    """Writes serialized messages into a new rosbag2 folder.

    Parameters
    ----------
    folder : Path
        Where there is something already, the next free of ``NAME_1``, ``NAME_2``, …; parents are
        made.
    storage : str
        ``mcap`` or ``sqlite3``.

    Attributes
    ----------
    folder : Path
        The folder that was made.
    counts : dict of str to int
        Messages per topic.
    newest_ns : int or None
        Time on the robot's clock [ns].
    flushed : int
        Messages that survive a kill.

    Raises
    ------
    ParameterError
        If the folder cannot be made.
    """

    def __init__(self, folder: Path, storage: str = 'mcap') -> None:
        """Open the bag."""
        self.flushed = 0
        self.counts: dict[str, int] = {}
        self.newest_ns: int | None = None
        self._first_ns = 0
        # Stamp, number and the rest of what waits for the clock; a heap.
        self._waiting: list[tuple[int, int, bags.Connection, bytes]] = []
        self._numbers = count()
        self._store = get_typestore(Stores.ROS2_JAZZY)
        try:
            self.folder = first_free(folder)
            self._writer = Writer(
                self.folder, version=9, storage_plugin=StoragePlugin[storage.upper()])
            self._writer.open()
        except (WriterError, OSError, ValueError) as error:  # ValueError: it has no name
            raise ParameterError(
                f"output '{folder}' must be a folder that can be made: {error}") from error
        self._file = getattr(self._writer.storage, 'bio', None)
        self._index = ChunkIndex(self.folder)
        if self._file is not None:
            self._writer.storage.chunks = self._index
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
            Whether its messages begin with a stamp of the robot's clock.
        clock : bool
            Whether these stamps are what makes that clock.

        Returns
        -------
        callable (bytes)
            Writes one serialized message of the topic.
        """
        connection = self._writer.add_connection(topic, type_name, typestore=self._store,
                                                 offered_qos_profiles=[offered_qos(qos)])
        self.counts[topic] = last = 0
        latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL

        def write(data: bytes) -> None:
            nonlocal last
            stamp = _leading_stamp(data) if stamped else NO_STAMP
            if stamp == 0 and latched:
                stamp = NO_STAMP
            self.counts[topic] += 1
            if clock:
                self.advance(stamp, anew=stamp < last - ANEW_NS)
                last = stamp
            self._take(stamp, connection, data)

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
        if self.newest_ns is None:
            self.advance(time.time_ns())
        for stamp, _, connection, data in sorted(self._waiting, key=itemgetter(1)):
            self._write(stamp, connection, data)
        try:
            if not any(self._writer.counts.values()):
                self._writer.min_timestamp = 0
            self._writer.close()
            self._index.close()
        except OSError as error:
            raise RecordingError(f"cannot complete '{self.folder}': {error}") from error

    def advance(self, stamp: int, *, anew: bool = False) -> None:
        """Set the clock [ns]; write what waited for this time."""
        waiting = self._waiting
        if self.newest_ns is None or anew:
            self._first_ns = stamp if self.newest_ns is None else min(stamp, self._first_ns)
            self.newest_ns, self._waiting = stamp, []
            for entry in sorted(waiting, key=itemgetter(1)):
                self._take(entry[0], *entry[2:])
            return
        self.newest_ns = max(self.newest_ns, stamp)
        while waiting and waiting[0][0] <= self.newest_ns:
            due, _, connection, data = heappop(waiting)
            self._write(due, connection, data)

    def _take(self, stamp: int, connection: bags.Connection, data: bytes) -> None:
        """Write a message, or let it wait for a clock that is about to reach its stamp, or that is
        not known yet.
        """
        if self.newest_ns is None or self.newest_ns < stamp <= self.newest_ns + AHEAD_NS:
            heappush(self._waiting, (stamp, next(self._numbers), connection, data))
        else:
            self._write(stamp, connection, data)

    def _write(self, stamp: int, connection: bags.Connection, data: bytes) -> None:
        """Write a message with its stamp, or with the time of the clock where that is no time of
        this recording.
        """
        assert self.newest_ns is not None
        in_recording = self._first_ns <= stamp <= self.newest_ns
        time_ns = stamp if in_recording else self.newest_ns
        try:
            self._writer.write(connection, time_ns, data)
        except OSError as error:
            raise RecordingError(f"cannot write to '{self.folder}': {error}") from error


def offered_qos(profile: QoSProfile) -> bags.Qos:
    """Profile of rclpy as rosbags stores it; unset times are rosbag2's infinity."""
    return bags.Qos(
        bags.QosHistory(int(profile.history)), profile.depth,
        bags.QosReliability(int(profile.reliability)), bags.QosDurability(int(profile.durability)),
        _UNSET, _UNSET, bags.QosLiveliness.SYSTEM_DEFAULT, _UNSET, False)


def _leading_stamp(data: bytes) -> int:
    """Stamp that a serialized message begins with [ns]; 0 when it is absent or negative."""
    if len(data) < _STAMP_AT + 8:
        return 0
    seconds, rest = (_STAMP_LITTLE if data[1] & 1 else _STAMP_BIG).unpack_from(data, _STAMP_AT)
    return max(0, seconds * 1_000_000_000 + rest)
