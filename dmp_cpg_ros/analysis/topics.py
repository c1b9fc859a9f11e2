# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is read of each topic of a bag, as its messages come: numbers in blocks, and words."""

from __future__ import annotations

import mmap
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros import layouts
from dmp_cpg_ros.analysis.bag import Received, message_of
from dmp_cpg_ros.analysis.decoding import Alike, alike
from dmp_cpg_ros.analysis.recording import Array, StatusEvent

ROWS_OF, WORDS = 'sensor_msgs/msg/JointState', 'diagnostic_msgs/msg/DiagnosticArray'
TEXT, IMU = 'std_msgs/msg/String', 'sensor_msgs/msg/Imu'

TOPICS = {
    ROWS_OF: ('joint_states', 'joint_targets', 'joint_work', 'canonical_state', 'foot_contacts',
              'posture_feedback'),
    'nav_msgs/msg/Odometry': ('ground_truth', 'odom', 'estimated_odom'),
    'geometry_msgs/msg/TwistStamped': ('reference', 'cmd_vel'),
    'geometry_msgs/msg/Twist': ('cmd_vel',),
    WORDS: ('inhibition_state', 'body_mode', 'diagnostics'),
    'rosgraph_msgs/msg/Clock': ('clock',),
    TEXT: ('robot_description',),
}
"""Topics without namespace that are read, by their types of message."""


FIELDS = {'joint_work': ('position', 'effort'), 'canonical_state': ('position', 'velocity'),
          'foot_contacts': ('effort',), 'posture_feedback': ('position',)}
"""Fields of joint states that are read; of all others all."""

ALL_FIELDS = ('position', 'velocity', 'effort')

RARE = (layouts.GAIT_PREFIX, layouts.CADENCE_ROW, layouts.MODE_ROWS[0].partition('/')[0])
"""Beginnings of names of states that seldom change: only their changes are kept."""

ROWS = {'canonical_state': (*layouts.OSCILLATOR_ROWS, *RARE), 'posture_feedback': RARE}
"""Beginnings of the names that are read of joint states; of all others all."""

_POSE, _TWIST = 'pose.pose.', 'twist.twist.'
COLUMNS = {
    'nav_msgs/msg/Odometry': (
        *(f'{_POSE}position.{axis}' for axis in 'xyz'),
        *(f'{_POSE}orientation.{axis}' for axis in 'xyzw'),
        *(f'{_TWIST}{part}.{axis}' for part in ('linear', 'angular') for axis in 'xyz')),
    'geometry_msgs/msg/TwistStamped': (
        'twist.linear.x', 'twist.linear.y', 'twist.angular.z'),
    'geometry_msgs/msg/Twist': ('linear.x', 'linear.y', 'angular.z'),
    IMU: tuple(f'{part}.{axis}' for part in ('angular_velocity', 'linear_acceleration')
               for axis in 'xyz'),
    'rosgraph_msgs/msg/Clock': ()}
"""Numbers of the other messages that are read."""

AT_ONCE = 2048
"""Messages of a topic that are decoded together."""


def in_batches(received: Iterable[Received],
               ) -> Iterator[tuple[tuple[str, str], list[int], list[bytes]]]:
    """At most ``AT_ONCE`` messages of a topic and a type, their record times [ns] and bytes."""
    waiting: dict[tuple[str, str], tuple[list[int], list[bytes]]] = defaultdict(lambda: ([], []))
    for connection, bag_ns, raw in received:
        key = connection.topic, connection.msgtype
        times, raws = waiting[key]
        times.append(bag_ns)
        raws.append(raw)
        if len(raws) == AT_ONCE:
            yield key, *waiting.pop(key)
    for key, of in waiting.items():
        yield key, *of


class Block(NamedTuple):
    """Messages of a topic: record times and stamps (n,) [ns], 0 without; numbers (n, k), or
    (n, fields, k) of k names.
    """

    bag_ns: NDArray[np.int64]
    stamp: NDArray[np.int64]
    values: Array


class Blocks:
    """Blocks of like messages, kept in few large ones that give their memory back."""

    def __init__(self) -> None:
        """There are none."""
        self._kept: list[Block] = []
        self._count = 0

    def add(self, block: Block) -> None:
        """Copy a block of at most ``AT_ONCE`` messages."""
        past = self._count + len(block.stamp)
        if not self._kept or past > len(self._kept[-1].stamp):
            self._trim()
            rows = AT_ONCE << min(len(self._kept), 4)
            self._kept.append(Block(*(_mapped(rows, of) for of in block)))
            self._count, past = 0, len(block.stamp)
        for mine, of in zip(self._kept[-1], block, strict=True):
            mine[self._count : past] = of
        self._count = past

    def all(self) -> list[Block]:
        """Return the large blocks."""
        self._trim()
        return self._kept

    def forget_record_times(self) -> None:
        """Give their memory back."""
        self._kept = [of._replace(bag_ns=of.bag_ns[:0].copy()) for of in self.all()]

    def _trim(self) -> None:
        if self._kept:
            self._kept[-1] = _cut(self._kept[-1], slice(self._count))


def _cut(block: Block, rows: Any) -> Block:
    """Some rows of a block."""
    return Block(block.bag_ns[rows], block.stamp[rows], block.values[rows])


def _mapped(rows: int, like: Any) -> Any:
    """Array with so many rows like some, on pages that go when it does."""
    shape = (rows, *like.shape[1:])
    pages = mmap.mmap(-1, max(1, like.itemsize * int(np.prod(shape))))
    return np.frombuffer(pages, like.dtype, int(np.prod(shape))).reshape(shape)


class Topic:
    """What is read from a topic, as it comes.

    Parameters
    ----------
    name : str
        Without namespace.
    fields : sequence of str
        Of joint states, those that are read.

    Attributes
    ----------
    blocks : dict of (tuple of str, str) to Blocks
        By the names that are read and, for former gaits, the frame.
    statuses : list of (str, StatusEvent)
        Names and statuses.
    text : str
        The last text.
    skipped : Counter
        Messages that could not be decoded, by topics with namespace.
    """

    def __init__(self, name: str, fields: Sequence[str]) -> None:
        """Nothing has come."""
        self.fields, self._rows = fields, ROWS.get(name, '')
        self._read = FIELDS[name] if self._rows else fields  # all of what seldom changes
        self.blocks: dict[tuple[tuple[str, ...], str], Blocks] = defaultdict(Blocks)
        self.statuses: list[tuple[str, StatusEvent]] = []
        self.text = ''
        self.skipped = Counter[str]()

    def take(self, topic: str, kind: str, times: Sequence[int], raws: Sequence[bytes]) -> None:
        """Take messages of one type, of a topic with namespace, and their record times [ns]."""
        count = len(raws)
        if kind in (WORDS, TEXT):
            messages = [of for raw in raws if (of := message_of(raw, kind)) is not None]
            count -= len(messages)
            for of in messages:
                if kind == TEXT:
                    self.text = of.data
                else:
                    self.statuses += _statuses(of)
        else:
            count -= self._take_numbers(kind, np.array(times, np.int64), raws)
        if count:
            self.skipped[topic] += count

    def joined(self, values: int = 0) -> Block:
        """All messages in the order of their record times; with so many numbers of each, which
        the topic then has no more.
        """
        blocks = [block for of in self.blocks.values() for block in of.all()]
        bag_ns, stamp = (np.concatenate([np.empty(0, np.int64), *(of[k] for of in blocks)])
                         for k in (0, 1))
        numbers = np.empty((len(stamp), values))
        if values:
            self.blocks.clear()
            row = 0
            while blocks:  # what is copied is given back at once
                of = blocks.pop(0).values
                numbers[row : row + len(of)] = of
                row += len(of)
        if (np.diff(bag_ns) >= 0).all():
            return Block(bag_ns, stamp, numbers)
        return _cut(Block(bag_ns, stamp, numbers), np.argsort(bag_ns, kind='stable'))

    def _take_numbers(self, kind: str, bag_ns: NDArray[np.int64], raws: Sequence[bytes]) -> int:
        """Take numbers; returns of how many messages."""
        parts: dict[tuple[tuple[str, ...], str], list[tuple[Any, ...]]] = defaultdict(list)
        taken = 0
        for group in alike(raws, kind):
            key, values = self._numbers(kind, group)
            parts[key].append((group.rows, _stamps(group), values))
            taken += len(group.rows)
        for key, of in sorted(parts.items(), key=_first_row):
            rows, stamp, values = (np.concatenate(part) for part in zip(*of, strict=True))
            order = np.argsort(rows)
            block = _cut(Block(bag_ns[rows], stamp, values), order)
            names = key[0]
            rare = np.array([self._rows != '' and of.startswith(RARE) for of in names], bool)
            if rare.any():
                self.blocks[tuple(np.array(names)[rare]), ''].add(
                    _changes_of(block._replace(values=block.values[..., rare])))
                block = block._replace(values=block.values[..., ~rare])
                key = tuple(np.array(names)[~rare]), ''
            if len(self.fields) < len(self._read):
                fields = [self._read.index(of) for of in self.fields]
                block = block._replace(values=block.values[:, fields])
            if key[0] or not names:
                self.blocks[key].add(block)
        return taken

    def _numbers(self, kind: str, group: Alike) -> tuple[tuple[tuple[str, ...], str], Array]:
        """Names, frame and numbers of some messages."""
        count = len(group.rows)
        if kind != ROWS_OF:
            columns = [group.numbers(name).astype(float) for name in COLUMNS[kind]]
            return ((), ''), np.concatenate(columns or [np.empty((count, 0))], axis=1)
        names = group.first.name
        kept = [k for k, name in enumerate(names) if name.startswith(self._rows)]
        values = np.full((count, len(self._read), len(kept)), np.nan)
        for k, field in enumerate(self._read):
            if len(getattr(group.first, field)) == len(names):  # a message may leave a field out
                values[:, k] = group.numbers(field)[:, kept]
        return (tuple(names[k] for k in kept), group.first.header.frame_id), values


def _first_row(part: tuple[Any, list[tuple[Any, ...]]]) -> int:
    """Which message was the first of a key, so that keys keep the order in which they came."""
    return min(int(rows[0]) for rows, _, _ in part[1])


def _changes_of(block: Block) -> Block:
    """Messages of a block whose numbers differ from those before."""
    bits = np.ascontiguousarray(block.values).view(np.int64)  # tells -0.0 from 0.0
    kept = (np.diff(bits, axis=0, prepend=~bits[:1]) != 0).any(axis=(1, 2))
    if (np.diff(block.stamp) < 0).any():
        return block
    return _cut(block, kept)


def _stamps(group: Alike) -> NDArray[np.int64]:
    """Stamps (n,) [ns], 0 where the type has none."""
    path = next((path for path in ('header.stamp', 'clock') if group.has(f'{path}.sec')), None)
    if path is None:
        return np.zeros(len(group.rows), np.int64)
    seconds, rest = (group.numbers(f'{path}.{part}')[:, 0].astype(np.int64)
                     for part in ('sec', 'nanosec'))
    return seconds * 1_000_000_000 + rest


def _statuses(message: Any) -> Iterator[tuple[str, StatusEvent]]:
    """Every status of a message with its name."""
    stamp = message.header.stamp
    for status in message.status:
        yield sys.intern(status.name), StatusEvent(
            (int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)) / 1e9, int(status.level),
            sys.intern(status.message),
            {sys.intern(pair.key): pair.value for pair in status.values})
