# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Opening a rosbag2 recording: sound, damaged or none at all. Nothing that is read is changed."""

from __future__ import annotations

import hashlib
import heapq
import logging
import os
import re
import struct
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from operator import itemgetter
from pathlib import Path, PurePath
from typing import Any, BinaryIO, NamedTuple
from zlib import crc32

import zstandard
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from dmp_cpg_ros.analysis.rescue import PACKED_SUFFIX, Unpacker, closed, ros_part, told, unpacked
from dmp_cpg_ros.core.errors import DataError, DmpCpgError, MissingFileError
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.files import readable
from dmp_cpg_ros.strict_yaml import load_yaml, naming

STORE = get_typestore(Stores.ROS2_JAZZY)
"""Definitions of the messages that are read; those in a bag are not trusted."""

STORAGE_SUFFIXES = ('.mcap', '.db3')

Received = tuple[Connection, int, bytes]
"""Connection, record time [ns] and bytes of a message."""

DIGESTED = ('canonical_state', 'joint_states', 'joint_targets')
"""Topics whose payloads have digests."""

_LOG = logging.getLogger(__name__)


def find_bag(path: Path | str) -> Path:
    """Recording that a path names: a file of one, a bag's folder, or a run's folder around it.

    Raises
    ------
    MissingFileError
        If the path does not exist, or is a pipe or a device.
    DataError
        If there is no bag.
    """
    path = Path(path)
    if not path.exists():
        raise MissingFileError(f"'{path}' does not exist; name a bag's or a run's folder")
    if not path.is_dir():
        readable(path)
        if _is_storage(path):
            return path
        if path.suffix == '.yaml':
            path = path.parent
    for folder in (path, path / 'bag'):
        if folder.is_dir() and (_storage_files(folder) or (folder / 'metadata.yaml').is_file()):
            return folder
    raise DataError(
        f"'{path}' holds no rosbag2 recording; valid are a folder with *.mcap or *.db3, such a "
        "file, or a run's folder with such a folder bag/ inside")


@contextmanager
def opened(bag: Path) -> Iterator[AnyReader]:
    """Reader over a bag; what was not closed is read from a copy of all that is complete in it.

    Parameters
    ----------
    bag : Path
        As from :func:`find_bag`.

    Raises
    ------
    DataError
        If the bag cannot be read, also later, or a folder holds several that do not belong
        together.
    """
    with ExitStack() as stack, naming(bag):
        files = [closed(unpacked(file, stack), bag, stack) for file in _parts(bag)]
        try:
            reader = _reader(files)
        except DataError:
            reader = _reader([ros_part(file, stack) for file in files])
        stack.callback(reader.close)
        yield reader


def base_name(topic: str) -> str:
    """Topic without namespace."""
    return topic.rsplit('/', 1)[-1]


def recorded(reader: AnyReader, connections: Collection[Connection]) -> Iterator[Received]:
    """Messages of some connections with their record times [ns], as they were recorded; raises
    DataError where the bag is damaged or unpacks into too much.
    """
    try:
        parts = [_of_storage(of.storage, connections) for of in reader.readers]
        yield from parts[0] if len(parts) == 1 else heapq.merge(*parts, key=_TIME)
    except Exception as error:
        raise DataError(f'the bag is damaged: {told(error)}') from error


_TIME = itemgetter(1)


def _of_storage(storage: Any, connections: Collection[Connection]) -> Iterator[Received]:
    """Messages of one file."""
    wanted = {(of.topic, of.msgtype): of for of in connections}
    known = {of.id: wanted[of.topic, of.msgtype] for of in storage.connections
             if (of.topic, of.msgtype) in wanted}
    if not known:
        return
    unpack = Unpacker(storage.path)
    if storage.path.suffix == '.mcap':
        for messages in _of_mcap(storage.bio, known, unpack):
            yield from messages
        return
    for of, time, raw in storage.messages([of for of in storage.connections if of.id in known]):
        yield known[of.id], time, unpack(raw, 'zstd') if raw[:1] == _PACKED else raw


def _of_mcap(file: BinaryIO, known: dict[int, Connection], unpack: Unpacker
             ) -> Iterator[list[Received]]:
    """Messages of an MCAP file by record time; those of one time as they lie there."""
    waiting: list[Received] = []
    blocks = sorted(_blocks(file), key=lambda block: block.start_ns)
    for number, block in enumerate(blocks):
        file.seek(block.offset)
        data = file.read(block.size)
        if block.packing:
            data = unpack(data, block.packing)
        if len(data) != block.unpacked_size or block.crc not in (0, crc32(data)):
            raise DataError(f'the chunk at byte {block.offset} is not what was written')
        waiting += _messages(data, known, unpack)
        waiting.sort(key=_TIME)
        count = len(waiting)
        if number + 1 < len(blocks):
            while count and waiting[count - 1][1] >= blocks[number + 1].start_ns:
                count -= 1
        yield waiting[:count]
        waiting = waiting[count:]


def _messages(records: bytes, known: Mapping[int, Connection], unpack: Unpacker
              ) -> list[Received]:
    """Messages among some records."""
    found: list[Received] = []
    at, end, read = 0, len(records), _RECORD.unpack_from
    while at + _RECORD.size <= end:  # no message is shorter
        kind, size, channel, _, time, _ = read(records, at)
        past = at + 9 + size
        if past > end:
            raise DataError('a record is longer than its chunk')
        if kind == _MESSAGE and channel in known:
            raw = records[at + _RECORD.size : past]
            found.append((known[channel], time,
                          unpack(raw, 'zstd') if raw[:1] == _PACKED else raw))
        at = past
    return found


_MESSAGE = Opcode.MESSAGE.value

_PACKED = zstandard.FRAME_HEADER[:1]
"""A message that is packed does not begin with the 0 of CDR."""


class _Block(NamedTuple):
    """Place of consecutive records in a file, which may be packed."""

    start_ns: int
    offset: int
    size: int
    unpacked_size: int
    crc: int
    packing: str


_RECORD = struct.Struct('<BQHIQQ')
"""Kind and length of any record; channel, number, record time, publish time of a message."""


def _blocks(file: BinaryIO) -> Iterator[_Block]:
    """Chunks of an MCAP file, and messages that are in none."""
    at, end = len(MCAP0_MAGIC), file.seek(0, os.SEEK_END)
    while at + _RECORD.size <= end:
        file.seek(at)
        kind, size, _, _, time, _ = _RECORD.unpack(file.read(_RECORD.size))
        if kind == Opcode.DATA_END:
            return
        if kind == Opcode.MESSAGE:
            yield _Block(time, at, 9 + size, 9 + size, 0, '')
        elif kind == Opcode.CHUNK:
            file.seek(at + 9)
            start, _, unpacked_size, crc, length = struct.unpack('<QQQII', file.read(32))
            packing = file.read(length).decode()
            packed, = struct.unpack('<Q', file.read(8))
            yield _Block(start, file.tell(), packed, unpacked_size, crc, packing)
        at += 9 + size


def warn_of(skipped: Counter[str]) -> None:
    """Name the topics of messages that were left out, if there are any."""
    if skipped:
        listed = ', '.join(f'{count} on {topic}' for topic, count in sorted(skipped.items()))
        _LOG.warning('left out what cannot be decoded: %s', listed)


def message_of(raw: bytes, kind: str) -> Any | None:
    """Message of a type that some bytes are; None when they are none."""
    try:
        return STORE.deserialize_cdr(raw, kind)
    except (SerdeError, ArithmeticError, LookupError, MemoryError, ValueError, struct.error):
        return None


def _reader(paths: Sequence[Path]) -> AnyReader:
    try:
        reader = AnyReader(paths, default_typestore=STORE)
        reader.open()
        try:
            assert all(of.msgcount >= 0 for of in reader.topics.values()), 'less than no message'
        except BaseException:
            reader.close()
            raise
    except Exception as error:
        raise DataError(f"the bag '{paths[0]}' cannot be read: {told(error)}") from error
    return reader


def _parts(bag: Path) -> list[Path]:
    """Files of a bag: those that its metadata name, or that are named as parts are."""
    files = [bag] if bag.is_file() else _storage_files(bag)
    if not files:
        raise DataError(f"'{bag}' cannot be read: it has metadata, but no *.mcap and no *.db3")
    for file in files:
        readable(file)
    with suppress(DmpCpgError, LookupError, TypeError):
        described = load_yaml(bag / 'metadata.yaml')['rosbag2_bagfile_information']
        named = [bag / PurePath(name).name for name in described['relative_file_paths']]
        if named and set(named) <= set(files):
            return named
    split = re.compile(rf'{re.escape(bag.resolve().name)}_(\d+)')
    numbers = [split.fullmatch(file.name.split('.', 1)[0]) for file in files]
    if len(files) > 1 and not all(numbers):
        raise DataError(
            f"'{bag}' holds {len(files)} recordings and no usable metadata.yaml that makes them "
            f'one; name one of them: {", ".join(file.name for file in files)}')
    return files


def _storage_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if _is_storage(file))


def _is_storage(file: Path) -> bool:
    return file.name.removesuffix(PACKED_SUFFIX).endswith(STORAGE_SUFFIXES)


def payload_digests(path: Path | str) -> dict[str, str]:
    """One SHA-256 per publisher over the message payloads as recorded, in their order.

    Equal digests mean that every byte that was published is equal.

    Parameters
    ----------
    path : path-like
        Bag or run's folder.

    Returns
    -------
    dict of str to str
        Hexadecimal digests of ``joint_states``, ``canonical_state``, and ``joint_targets/fl``, …,
        whose publisher is known by the leg that its first joint's name begins with, or by that
        name.

    Raises
    ------
    MissingFileError, DataError
        If there is no readable bag.
    """
    hashes: dict[str, hashlib._Hash] = {}
    with opened(find_bag(path)) as reader:
        used = [c for c in reader.connections if base_name(c.topic) in DIGESTED]
        for connection, _, raw in recorded(reader, used):
            key = base_name(connection.topic)
            message = (None if key == 'joint_states'
                       else message_of(raw, connection.msgtype))
            # One publisher per leg; they interleave as they like.
            if message is not None and key == 'joint_targets':
                first = message.name[0] if message.name else 'unnamed'
                leg = first.split('_', 1)[0]
                key += f'/{leg if leg in LEGS else first}'
            elif message is not None:
                # Its texts change their length, and then the middleware leaves pieces of earlier
                # messages in the alignment bytes; written anew they are zeros.
                raw = bytes(STORE.serialize_cdr(message, connection.msgtype))
            hashes.setdefault(key, hashlib.sha256()).update(raw)
    return {key: value.hexdigest() for key, value in sorted(hashes.items())}
