# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Opening a rosbag2 recording: sound, damaged or none at all. Nothing that is read is changed.

The usual readers refuse an MCAP file that was not closed, for it has no summary, and one with
channels that are not ROS's. Such a file is read as a stream, record by record, up to where it
breaks off, and written anew. The file itself stays as it is.
"""

from __future__ import annotations

import fcntl
import filecmp
import hashlib
import logging
import os
import re
import struct
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC, Writer
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from dmp_cpg_ros.configuration import naming, numbered
from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.core.parameters import LONGEST_SHOWN, shown
from dmp_cpg_ros.core.robot_model.state import LEGS

STORE = get_typestore(Stores.ROS2_JAZZY)
"""Definitions of the messages that are read; those in a bag are not trusted."""

STORAGE_SUFFIXES = ('.mcap', '.db3')

DIGESTED = ('canonical_state', 'joint_states', 'joint_targets')
"""Topics whose payloads have digests."""


def find_bag(path: Path | str) -> Path:
    """Recording that a path names: a file of one, a bag's folder, or a run's folder around it.

    Raises
    ------
    MissingFileError
        If the path does not exist.
    DataError
        If there is no bag.
    """
    path = Path(path)
    if not path.exists():
        raise MissingFileError(f"'{path}' does not exist; name a bag's or a run's folder")
    if path.is_file():
        if path.suffix in STORAGE_SUFFIXES:
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
        try:
            reader = _reader([bag])
        except DataError as damage:
            files = [closed(file, bag, stack) for file in _parts(bag, damage)]
            try:
                reader = _reader(files)
            except DataError:
                reader = _reader([ros_part(file, stack) for file in files])
        stack.callback(reader.close)
        yield reader


def base_name(topic: str) -> str:
    """Topic without namespace."""
    return topic.rsplit('/', 1)[-1]


def recorded(reader: AnyReader, connections: Collection[Connection]
             ) -> Iterator[tuple[Connection, int, bytes]]:
    """Messages of some connections with their record times [ns], as they were recorded; raises
    DataError where the bag is damaged.
    """
    try:
        yield from reader.messages(connections) if connections else ()
    except Exception as error:
        raise DataError(f'the bag is damaged: {told(error)}') from error


def decoded(reader: AnyReader, connections: Collection[Connection], skipped: Counter[str],
            ) -> Iterator[tuple[Connection, int, Any]]:
    """Messages of some connections with their record times [ns], in the order of these.

    Parameters
    ----------
    reader : AnyReader
        Open.
    connections : collection of Connection
        Those that are wanted.
    skipped : Counter
        Gets by topic how many messages were left out because they could not be decoded; a warning
        names them at the end.
    """
    for connection, bag_ns, raw in recorded(reader, connections):
        message = _message(raw, connection)
        if message is None:
            skipped[connection.topic] += 1
        else:
            yield connection, bag_ns, message
    if skipped:
        listed = ', '.join(f'{count} on {topic}' for topic, count in sorted(skipped.items()))
        logging.getLogger(__name__).warning('left out what cannot be decoded: %s', listed)


def _message(raw: bytes, connection: Connection) -> Any | None:
    """Message that some bytes are; None when they are none."""
    try:
        return STORE.deserialize_cdr(raw, connection.msgtype)
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


def told(error: Exception) -> str:
    """What an error of a library says, or is."""
    return shown(error) if len(str(error)) > LONGEST_SHOWN else str(error) or repr(error)


def _parts(bag: Path, damage: DataError) -> list[Path]:
    """Files of a bag whose metadata are of no help."""
    files = [bag] if bag.is_file() else _storage_files(bag)
    if not files:
        raise damage
    split = re.compile(rf'{re.escape(bag.resolve().name)}_(\d+)')
    numbers = [split.fullmatch(file.stem) for file in files]
    if len(files) > 1 and not all(numbers):
        raise DataError(
            f"'{bag}' holds {len(files)} recordings and no usable metadata.yaml that makes them "
            f'one; name one of them: {", ".join(file.name for file in files)}')
    return files


def _storage_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.suffix in STORAGE_SUFFIXES)


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
            message = None if key == 'joint_states' else _message(raw, connection)
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


_LOG = logging.getLogger(__name__)

ROS_SCHEMAS = ('ros2msg', 'ros2idl', 'omgidl')
"""Encodings of definitions that readers of ROS know."""


def closed(file: Path, bag: Path, stack: ExitStack) -> Path:
    """Return a file that was closed, or a copy of every complete record of one that was not.

    The copy of an MCAP file lies in ``BAG.rescued/``, beside the bag. Where that cannot be written
    the copy is temporary. A copy that is there already is never overwritten: when it differs, the
    next free name is taken.

    Parameters
    ----------
    file : Path
        The file.
    bag : Path
        The bag that it belongs to: itself or its folder.
    stack : ExitStack
        Removes what is temporary.

    Raises
    ------
    DataError
        If it holds no complete message, is still being recorded, or cannot be copied.
    """
    if file.suffix != '.mcap' or _is_closed(file):
        return file
    bag = bag.resolve()
    try:
        scratch, lasting = _scratch(bag.parent, stack), True
    except OSError:
        scratch, lasting = _scratch(None, stack), False
    copy = scratch / file.name
    count = _copy(file, copy, ros_only=False)
    if lasting:
        copy = _settled(copy, bag.with_name(f'{bag.stem if bag.is_file() else bag.name}.rescued'))
    _LOG.warning(
        "'%s' was not closed: reading its %d complete messages from the %scopy '%s'",
        file, count, '' if lasting else 'temporary ', copy)
    return copy


def ros_part(file: Path, stack: ExitStack) -> Path:
    """Return a temporary copy of an MCAP file without the channels that are not ROS's; other files
    as they are.

    Raises
    ------
    DataError
        If it holds no message of ROS, or cannot be copied.
    """
    if file.suffix != '.mcap':
        return file
    copy = _scratch(None, stack) / file.name
    _copy(file, copy, ros_only=True)
    _LOG.warning("'%s': leaving out what is not of ROS", file)
    return copy


def _is_closed(file: Path) -> bool:
    """Whether an MCAP file ends as one that was closed."""
    with file.open('rb') as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(0, size - len(MCAP0_MAGIC)))
        return stream.read() == MCAP0_MAGIC


def _scratch(folder: Path | None, stack: ExitStack) -> Path:
    return Path(stack.enter_context(TemporaryDirectory(prefix='.rescue_', dir=folder)))


def _settled(copy: Path, folder: Path) -> Path:
    """Move a copy into the first of the numbered folders where it or nothing of its name is."""
    target = next(of for of in (place / copy.name for place in numbered(folder))
                  if not of.exists() or filecmp.cmp(copy, of, shallow=False))
    target.parent.mkdir(exist_ok=True)
    return copy.replace(target)


def _copy(source: Path, target: Path, *, ros_only: bool) -> int:
    """Write what is complete in a file into a new one; returns the number of messages."""
    count = 0
    schemas, channels = {0: 0}, dict[int, int]()  # numbers in the copy by those in the file
    try:
        with source.open('rb') as file, target.open('wb') as copy:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            writer = Writer(copy)
            for record in _complete_records(file):
                match record:
                    case Header():
                        writer.start('ros2' if ros_only else record.profile)
                    case Schema() if record.id not in schemas:
                        if record.encoding in ROS_SCHEMAS or not ros_only:
                            schemas[record.id] = writer.register_schema(
                                record.name, record.encoding, record.data)
                    case Channel() if record.id not in channels:
                        known = record.message_encoding == 'cdr' and record.schema_id in schemas
                        if known or not ros_only and record.schema_id in schemas:
                            channels[record.id] = writer.register_channel(
                                record.topic, record.message_encoding, schemas[record.schema_id],
                                record.metadata)
                    case Message() if record.channel_id in channels:
                        writer.add_message(channels[record.channel_id], record.log_time,
                                           record.data, record.publish_time, record.sequence)
                        count += 1
                    case Attachment():
                        writer.add_attachment(record.create_time, record.log_time, record.name,
                                              record.media_type, record.data)
                    case Metadata():
                        writer.add_metadata(record.name, record.metadata)
            writer.finish()
    except BlockingIOError:
        raise DataError(f"'{source}' is still being recorded; stop its recorder first") from None
    except OSError as error:
        raise DataError(f"'{source}' cannot be rescued: {error}") from error
    if count == 0:
        raise DataError(f"'{source}' holds no complete message")
    return count


def _complete_records(file: BinaryIO) -> Iterator[McapRecord]:
    """Records up to where the file breaks off."""
    try:
        yield from StreamReader(file).records
    except (McapError, EOFError, MemoryError, OverflowError, ValueError, struct.error):
        return
