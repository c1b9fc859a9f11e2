# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mutated bytes of messages: the suite's reader against rclpy's ``deserialize_message``.

``python -m dmp_cpg_ros.studies.fuzz_bytes --count N --seed S`` changes, cuts and stretches
serialized messages and reads them both ways. Whatever one of the two refuses the other must
refuse, and what both read must be the same; everything else is printed, made as short as it can
be, and makes the exit status 1. A refusal of ours must be a
:class:`~dmp_cpg_ros.core.errors.DataError`; stamps that are no time are refused by us alone.
"""

from __future__ import annotations

import argparse
import os
import random
import struct
import sys
import time
from array import array
from collections import Counter
from collections.abc import Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import TwistStamped
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu, JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.messages.cdr import FIELDS, serialized_reader
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.studies.output import at_least_one, markdown_table
from dmp_cpg_ros.studies.workers import Workers

KINDS = (JointState, TwistStamped, Imu)
"""Messages that have a reader of their own."""

REFUSED = 'refused'

BATCH = 2000
"""Buffers that a worker takes at a time."""

LENGTHS = (0, 1, 2, 3, 4, 7, 8, 9, 255, 2**16, 2**31 - 1, 2**31, 2**32 - 1)
"""What is written where a length or a count may stand."""


def example(draw: random.Random, kind: type) -> bytes:
    """A message of a kind with random content, serialized."""
    message = kind()
    message.header.frame_id = draw.choice(('', 'a', 'base_link', 'ä€𝄞'))
    message.header.stamp.sec, message.header.stamp.nanosec = draw.randrange(2**31), 5
    if kind is JointState:
        message.name = [draw.choice(('', 'fl_hip', 'é', 'x' * 9)) + str(k)
                        for k in range(draw.randrange(6))]
        for field in FIELDS:
            setattr(message, field, array('d', (
                draw.choice((0.0, -1.5, float('nan'), 1e300)) for _ in range(draw.randrange(6)))))
    return bytes(serialize_message(message))


def mutated(draw: random.Random, data: bytes) -> bytes:
    """The bytes with one to four changes."""
    buffer = bytearray(data)
    for _ in range(draw.randrange(1, 5)):
        at = draw.randrange(len(buffer) + 1)
        word = 4 * (at // 4)
        how = draw.randrange(8)
        if how == 0:
            buffer[at:at + 1] = bytes([draw.randrange(256)])
        elif how == 1:
            del buffer[at:]
        elif how == 2:
            del buffer[at:at + draw.randrange(1, 9)]
        elif how == 3:
            buffer[at:at] = draw.randbytes(draw.randrange(1, 9))
        elif how == 4:
            buffer[word:word + 4] = struct.pack('<I', draw.choice(LENGTHS))
        elif how == 5:
            buffer[word:word + 4] = struct.pack('<I', draw.randrange(40))
        elif how == 6:
            buffer[at:at + 1] = draw.choice((b'\0', b'\xff', b'\x80', b'\xc3'))
        elif draw.random() < 0.2:
            buffer[:2] = draw.choice((b'\0\0', b'\0\2', b'\0\3', b'\0\7', draw.randbytes(2)))
    return bytes(buffer)


def content(message: Any) -> tuple[Any, ...]:
    """What the suite takes of a message, bit for bit."""
    stamp = header_ns(message)
    if isinstance(message, JointState) or hasattr(message, 'name'):
        return stamp, *message.name, *(bytes(getattr(message, field)) for field in FIELDS)
    if isinstance(message, TwistStamped):
        vectors = message.twist.linear, message.twist.angular
    elif isinstance(message, Imu):
        vectors = message.angular_velocity, message.linear_acceleration
    else:
        numbers = message.numbers if hasattr(message, 'numbers') else (
            *message.rate, *message.force)
        return stamp, struct.pack('<6d', *numbers)
    return stamp, struct.pack('<6d', *(
        number for vector in vectors for number in (vector.x, vector.y, vector.z)))


def ours(kind: type, data: bytes) -> Any:
    """What the suite makes of bytes: content, a refusal, or an exception, which is a failure."""
    try:
        return content(serialized_reader(kind)(data))
    except DataError:
        return REFUSED
    except Exception as error:  # noqa: BLE001 - that is what is looked for
        return f'{type(error).__name__}: {error}'


def theirs(kind: type, data: bytes) -> Any:
    """What rclpy makes of them."""
    try:
        return content(deserialize_message(data, kind))
    except (rclpy_implementation.RMWError, DataError, MemoryError):
        return REFUSED


def disagree(kind: type, data: bytes) -> bool:
    """Whether the two readers differ."""
    return bool(ours(kind, data) != theirs(kind, data))


def shrunk(kind: type, data: bytes) -> bytes:
    """A short buffer about which the two still disagree."""
    size = len(data)
    while size:
        at = 0
        while at + size <= len(data):
            less = data[:at] + data[at + size:]
            data, at = (less, at) if disagree(kind, less) else (data, at + size)
        size //= 2
    return data


def fuzz(batch: int, seed: int, count: int) -> tuple[Counter[str], list[tuple[str, str]], float]:
    """Read mutated buffers both ways; returns counts, shrunk disagreements, and the longest time
    of one reading of ours [s].
    """
    draw = random.Random(f'{seed} {batch}')
    counts: Counter[str] = Counter()
    failures, worst = list[tuple[str, str]](), 0.0
    pool = [(kind, example(draw, kind)) for kind in KINDS for _ in range(20)]
    for _ in range(count):
        kind, data = draw.choice(pool)
        data = mutated(draw, data)
        begin = time.perf_counter()
        mine = ours(kind, data)
        worst = max(worst, time.perf_counter() - begin)
        if mine != theirs(kind, data):
            counts['disagreements'] += 1
            if len(failures) < 5:
                failures.append((kind.__name__, shrunk(kind, data).hex()))
        else:
            counts[f'both {"refuse" if mine == REFUSED else "read"} {kind.__name__}'] += 1
    return counts, failures, worst


def _quiet() -> None:
    """Send what the middleware says of every buffer that it cannot read nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = argparse.ArgumentParser(prog='fuzz_bytes',
                                     description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--count', type=at_least_one, default=1_000_000, metavar='N')
    parser.add_argument('--workers', type=at_least_one, default=2, metavar='W')
    parser.add_argument('--seed', type=int, default=1, metavar='S')
    options = parser.parse_args(arguments)
    counts: Counter[str] = Counter()
    failures, worst = set[tuple[str, str]](), 0.0
    batches = -(-options.count // BATCH)
    with Workers(options.workers, prepare=_quiet) as workers:
        for found, failed, slowest in workers.map(
                partial(fuzz, seed=options.seed, count=BATCH), range(batches)):
            counts += found
            failures |= set(failed)
            worst = max(worst, slowest)
    print(markdown_table(('outcome', 'buffers'), [
        (name, str(number)) for name, number in sorted(counts.items())]))
    print(f'{sum(counts.values())} buffers, seed {options.seed}; longest reading {worst:.3f} s')
    by_name = {kind.__name__: kind for kind in KINDS}
    for name, text in sorted(failures)[:20]:
        data, kind = bytes.fromhex(text), by_name[name]
        print(f'{name} {text}: {ours(kind, data)} / {theirs(kind, data)}')
    return int(bool(counts['disagreements']))


if __name__ == '__main__':
    sys.exit(main())
