# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Makes sound copies of MCAP recordings that the usual readers refuse.

They refuse a file that was not closed, for it has no summary, and one with channels that are not
ROS's. Such a file is read as a stream, record by record, up to where it breaks off, and written
anew. The file itself stays as it is.
"""

from __future__ import annotations

import fcntl
import filecmp
import logging
import os
import struct
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC, Writer

from dmp_cpg_ros.configuration import numbered
from dmp_cpg_ros.core.errors import DataError

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
                        if known or not ros_only:
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
    except (McapError, EOFError, struct.error, UnicodeDecodeError):
        return
