# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Makes a sound rosbag2 folder of an MCAP recording that was not closed.

The usual readers refuse a file without its summary. The file is therefore read as a stream, record
by record, up to where it breaks off, and written anew.
"""

from __future__ import annotations

import fcntl
import shutil
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.metadata import parse_qos
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from dmp_cpg_ros.core.errors import DataError, MissingFileError


def rescue(bag: Path | str) -> Path:
    """Rewrite an MCAP bag from every record of it that is complete.

    The damaged file is replaced only when its replacement is complete, so that an interrupted
    rescue can be repeated.

    Parameters
    ----------
    bag : path-like
        Folder of the bag.

    Returns
    -------
    Path
        The same folder, now with a sound file and ``metadata.yaml``.

    Raises
    ------
    MissingFileError
        If there is no such folder.
    DataError
        If it holds no MCAP file or no message, is still being recorded, or cannot be written.
    """
    bag = Path(bag)
    if not bag.is_dir():
        raise MissingFileError(f"'{bag}' is no folder; name the folder of a rosbag2 recording")
    bag = bag.resolve()
    sources = sorted(bag.glob('*.mcap'))
    if not sources:
        raise DataError(f"'{bag}' holds no *.mcap file; only MCAP recordings can be rescued")
    work = bag / '.rescue'
    try:
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir()
        count = _rewrite(sources, work / bag.name)
        if count == 0:
            raise DataError(f"'{bag}' holds no complete message")
        _replace(bag, work / bag.name, sources)
    except OSError as error:
        raise DataError(f"'{bag}' cannot be rescued: {error}") from error
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return bag


def _rewrite(sources: list[Path], target: Path) -> int:
    """Write every complete message of some files into a new bag; returns their number."""
    count = 0
    with Writer(target, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        copier = _Copier(writer)
        for source in sources:
            with _unlocked(source) as file:
                copier.start_file()
                for record in _complete_records(file):
                    count += copier.copy(record)
    return count


class _Copier:
    """Copies schemas, channels and messages into a writer."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._by_topic: dict[tuple[str, str], Connection] = {}

    def start_file(self) -> None:
        """Forget the numbers of schemas and channels; every file has its own."""
        self._schemas: dict[int, Schema] = {}
        self._connections: dict[int, Connection] = {}

    def copy(self, record: McapRecord) -> int:
        """Copy a record; returns 1 for a message, 0 for everything else."""
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._connections[record.id] = self._connection(
                record, self._schemas[record.schema_id])
        elif isinstance(record, Message):
            self._writer.write(self._connections[record.channel_id], record.log_time, record.data)
            return 1
        return 0

    def _connection(self, channel: Channel, schema: Schema) -> Connection:
        key = (channel.topic, schema.name)
        if key not in self._by_topic:
            if schema.name not in self._store.types:
                self._store.register(get_types_from_msg(schema.data.decode(), schema.name))
            self._by_topic[key] = self._writer.add_connection(
                channel.topic, schema.name, typestore=self._store,
                serialization_format=channel.message_encoding,
                offered_qos_profiles=parse_qos(channel.metadata.get('offered_qos_profiles', '')))
        return self._by_topic[key]


def _complete_records(file: BinaryIO) -> Iterator[McapRecord]:
    """Records up to where the file breaks off."""
    try:
        yield from StreamReader(file).records
    except (McapError, EOFError, struct.error, UnicodeDecodeError):
        return


@contextmanager
def _unlocked(path: Path) -> Iterator[BinaryIO]:
    """Open a file that nobody is recording into; raises DataError when somebody is."""
    with path.open('rb') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DataError(f"'{path}' is still being recorded; stop its recorder first") from None
        yield file


def _replace(bag: Path, rescued: Path, sources: list[Path]) -> None:
    """Put the new file in the place of the old ones, then the metadata."""
    new = rescued / f'{rescued.name}.mcap'
    new.replace(bag / new.name)
    (rescued / 'metadata.yaml').replace(bag / 'metadata.yaml')
    for source in sources:
        if source.name != new.name:
            source.unlink()
