# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Storage files that the usual readers refuse: packed as a whole, not closed, or not of ROS alone.

An MCAP file that was not closed has no summary. It is read as a stream, record by record, up to
where it breaks off, and written anew; the file itself stays as it is. What is packed may be
hostile: all that is unpacked of a file is bounded by its size.
"""

from __future__ import annotations

import filecmp
import logging
import os
import struct
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import lz4.frame
import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC, Writer

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.parameters import LONGEST_SHOWN, shown
from dmp_cpg_ros.files import numbered

try:
    import fcntl
except ImportError:  # Windows, where no recorder of ours runs
    fcntl = None  # type: ignore[assignment]

_LOG = logging.getLogger(__name__)

PACKED_SUFFIX = '.zstd'
"""Of storage files that are compressed as a whole."""

PACKINGS: dict[str, Callable[[BinaryIO], Any]] = {
    'zstd': lambda file: zstandard.ZstdDecompressor().stream_reader(
        file, read_across_frames=True, closefd=False),
    'lz4': lz4.frame.LZ4FrameFile}
"""Readers of packed bytes, by the names that MCAP has for them."""

DAMAGE = (zstandard.ZstdError, EOFError, MemoryError, OverflowError, RuntimeError, ValueError)
"""What is raised by packed bytes that are damaged."""

MOST_UNPACKED = 2**26, 100
"""Bytes that a file may unpack into: so many, and so many for each of its own."""


class Unpacker:
    """Unpacks what is packed in one file, all in all no more than ``MOST_UNPACKED``.

    Parameters
    ----------
    file : Path
        The file.
    """

    def __init__(self, file: Path) -> None:
        """Nothing is unpacked yet."""
        some, times = MOST_UNPACKED
        self._most = self._left = some + times * file.stat().st_size

    def __call__(self, packed: bytes, packing: str) -> bytes:
        """Unpacked bytes; raises as :meth:`copy` does."""
        target = BytesIO()
        self.copy(BytesIO(packed), target, packing)
        return target.getvalue()

    def copy(self, source: BinaryIO, target: BinaryIO, packing: str) -> None:
        """Unpack into a file; raises DataError when it is too much, and ``DAMAGE``."""
        if packing not in PACKINGS:
            raise ValueError(f"packing '{packing}' is not known; valid are {', '.join(PACKINGS)}")
        with PACKINGS[packing](source) as stream:
            while piece := stream.read(2**20):
                self._left -= len(piece)
                if self._left < 0:
                    raise DataError(f'it unpacks into more than {self._most} bytes, which are '
                                    'more than a recording of its size holds')
                target.write(piece)


def told(error: Exception) -> str:
    """What an error of a library says, or is."""
    return shown(error) if len(str(error)) > LONGEST_SHOWN else str(error) or repr(error)


ROS_SCHEMAS = ('ros2msg', 'ros2idl', 'omgidl')
"""Encodings of definitions that readers of ROS know."""


def unpacked(file: Path, stack: ExitStack) -> Path:
    """Return a file that is not packed, or a temporary copy that is not; raises DataError."""
    if file.suffix != PACKED_SUFFIX:
        return file
    copy = _scratch(None, stack) / file.stem
    try:
        with file.open('rb') as source, copy.open('wb') as target:
            Unpacker(file).copy(source, target, 'zstd')
    except (OSError, *DAMAGE) as error:
        raise DataError(f"'{file}' cannot be unpacked: {told(error)}") from error
    return copy


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
    if _is_whole(file):
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


_FOOTER = struct.Struct('<BQQQI8s')
_INDEX = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS}


def _is_whole(file: Path) -> bool:
    """Whether a storage file is not packed and, if it is of MCAP, has what readers look for at
    its end; without, they would unpack it.
    """
    if file.suffix != '.mcap':
        return file.suffix != PACKED_SUFFIX
    with file.open('rb') as stream:
        end = max(0, stream.seek(0, os.SEEK_END) - _FOOTER.size)
        stream.seek(end)
        footer = stream.read()
        if len(footer) < _FOOTER.size or not footer.endswith(MCAP0_MAGIC):
            return False
        at, kinds = _FOOTER.unpack(footer)[2], set[int]()
        while 0 < at < end:
            stream.seek(at)
            kind, size = struct.unpack('<BQ', stream.read(9))
            kinds.add(kind)
            at += 9 + size
    return kinds >= _INDEX and Opcode.CHUNK not in kinds


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
            if fcntl is not None:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            writer = Writer(copy)
            for record in _complete_records(file, Unpacker(source)):
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


def _complete_records(file: BinaryIO, unpack: Unpacker) -> Iterator[McapRecord]:
    """Records up to where the file breaks off."""
    try:
        for record in StreamReader(file, emit_chunks=True).records:
            if not isinstance(record, Chunk):
                yield record
                continue
            if record.compression:
                record = replace(record, data=unpack(record.data, record.compression),
                                 compression='')
            yield from breakup_chunk(record)
    except DataError:  # unpacks into too much
        raise
    except (McapError, struct.error, *DAMAGE):
        return
