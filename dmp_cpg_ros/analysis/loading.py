# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a bag to the data model: which topic goes into which array."""

from __future__ import annotations

import mmap
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros import layouts
from dmp_cpg_ros.analysis import recording
from dmp_cpg_ros.analysis.bag import base_name, find_bag, message_of, opened, recorded, warn_of
from dmp_cpg_ros.analysis.decoding import Alike, alike
from dmp_cpg_ros.analysis.recording import Array, Recording, StatusEvent
from dmp_cpg_ros.configuration import naming
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import GaitShares
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS

ROWS_OF, WORDS = 'sensor_msgs/msg/JointState', 'diagnostic_msgs/msg/DiagnosticArray'
TEXT = 'std_msgs/msg/String'

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
    'rosgraph_msgs/msg/Clock': ()}
"""Numbers of the other messages that are read."""

Statuses = Sequence[tuple[str, StatusEvent]]
"""Names and statuses, as they came."""

AT_ONCE = 2048
"""Messages of a topic that are decoded together."""


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
        for key, of in parts.items():
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


def _changes_of(block: Block) -> Block:
    """Messages of a block whose numbers differ from those before."""
    bits = np.ascontiguousarray(block.values).view(np.int64)  # tells -0.0 from 0.0
    kept = (np.diff(bits, axis=0, prepend=~bits[:1]) != 0).any(axis=(1, 2))
    if (np.diff(block.stamp) < 0).any():
        return block
    return _cut(block, kept)


def load_recording(path: Path | str, *, only: Mapping[str, Sequence[str]] | None = None,
                   tell: Callable[[str], None] = lambda text: None) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path : path-like
        A rosbag2 folder (MCAP or SQLite), one file of it, or a run's folder with ``bag/`` inside.
    only : mapping of str to sequence of str, optional
        Fields that are read of a topic of joint states, where that is not all of them; the others
        are NaN and take no memory.
    tell : callable (str), optional
        Is told how far it is.

    Returns
    -------
    Recording

    Raises
    ------
    MissingFileError
        If the path does not exist.
    DataError
        If it is not a readable bag, or holds the topics of more than one robot. Single messages
        that cannot be decoded are no error: they are left out, counted and warned of.
    """
    with naming(path):
        return _loaded(find_bag(path), {**FIELDS, **(only or {})}, tell)


def _loaded(bag: Path, fields: Mapping[str, Sequence[str]], tell: Callable[[str], None]
            ) -> Recording:
    with opened(bag) as reader:
        robots = sorted(topic for topic in reader.topics if base_name(topic) == 'joint_states')
        if len(robots) > 1:
            raise DataError(f'the bag holds {", ".join(robots)}; record one robot per bag')
        used = [c for c in reader.connections if base_name(c.topic) in TOPICS.get(c.msgtype, ())]
        topics = {name: Topic(name, fields.get(name, ALL_FIELDS))
                  for names in TOPICS.values() for name in names}
        waiting: dict[tuple[str, str], tuple[list[int], list[bytes]]] = {
            (of.topic, of.msgtype): ([], []) for of in used}
        taken, total = 0, sum(of.msgcount for of in used)
        for connection, bag_ns, raw in recorded(reader, used):
            key = connection.topic, connection.msgtype
            times, raws = waiting[key]
            times.append(bag_ns)
            raws.append(raw)
            if len(raws) == AT_ONCE:
                topics[base_name(key[0])].take(*key, times, raws)
                waiting[key] = [], []
                taken += AT_ONCE
                tell(f'reading: {taken:,} of {total:,} messages')
        for key, of in waiting.items():
            topics[base_name(key[0])].take(*key, *of)
        counts = {topic: info.msgcount for topic, info in sorted(reader.topics.items())}
    skipped = Counter[str]()
    for topic in topics.values():
        skipped += topic.skipped
    warn_of(skipped)
    commands, arrivals = _on_robot_clock(topics), _arrivals(topics)
    modes, names = _modes(topics), _joint_names(topics['robot_description'].text)
    # Bags of others have one odometry, and in old ones of this suite it is the truth.
    truth, estimate = (('ground_truth', 'odom') if topics['ground_truth'].blocks
                       else ('odom', 'estimated_odom'))
    return Recording(
        joints=_joints(topics.pop('joint_states'), names),
        targets=_joints(topics.pop('joint_targets'), names),
        work=recording.WorkSeries(*_table(topics['joint_work'], names)),
        canonical=_canonical(topics['canonical_state']),
        reference=recording.VelocitySeries(*_rows(topics['reference'].joined(3), (3,))),
        commands=recording.VelocitySeries(*_rows(commands, (3,))),
        odometry=recording.OdometrySeries(*_rows(topics.pop(truth).joined(13), (3, 4, 3, 3))),
        estimate=recording.OdometrySeries(*_rows(topics[estimate].joined(13), (3, 4, 3, 3))),
        feet=_feet(topics['foot_contacts']),
        inhibition=_changes(topics['inhibition_state'].statuses, lambda e: (e.message, e.values)),
        modes=modes, statuses=_by_name(topics['diagnostics'].statuses),
        arrivals=arrivals, counts=counts, undecodable=dict(skipped))


def _joint_names(description: str) -> tuple[str, ...]:
    """Names of our joints in a recording, as ``robot/urdf.py`` says them."""
    named = {usual: name for name, usual in re.findall(
        r'<dmp_cpg_ros_joint name="([^"]+)" usual="([^"]+)"', description)}
    return tuple(named.get(usual, usual) for usual in JOINT_NAMES)


def _stamps(group: Alike) -> NDArray[np.int64]:
    """Stamps (n,) [ns], 0 where the type has none."""
    path = next((path for path in ('header.stamp', 'clock') if group.has(f'{path}.sec')), None)
    if path is None:
        return np.zeros(len(group.rows), np.int64)
    seconds, rest = (group.numbers(f'{path}.{part}')[:, 0].astype(np.int64)
                     for part in ('sec', 'nanosec'))
    return seconds * 1_000_000_000 + rest


def _on_robot_clock(topics: Mapping[str, Topic]) -> Block:
    """Commands with stamps of the robot's clock: a sender's may be of another clock.

    The bag's record time may be wall time: each command gets the stamp of the tick that was
    recorded last before it. A bag without ticks keeps its own time.
    """
    commands, ticks = topics['cmd_vel'].joined(3), topics['joint_states'].joined()
    if not ticks.stamp.size:
        ticks = topics['clock'].joined()
    if not ticks.stamp.size:
        return commands._replace(stamp=commands.bag_ns)
    before = np.searchsorted(ticks.bag_ns, commands.bag_ns, side='right') - 1
    return commands._replace(stamp=ticks.stamp[np.maximum(before, 0)])


def _rows(block: Block, widths: Sequence[int]) -> list[Array]:
    """Times and columns in the order of the stamps; of one stamp the last counts."""
    stamps, values = block.stamp, block.values.reshape(-1, sum(widths))
    if (np.diff(stamps) <= 0).any():
        stamps, last = np.unique(stamps[::-1], return_index=True)
        values = values[::-1][last]
    return [stamps / 1e9, *np.split(values, np.cumsum(widths)[:-1], axis=1)]


def _table(topic: Topic, names: Sequence[str]) -> list[Array]:
    """Increasing stamps (n,) [s], and the fields of the topic (n, k).

    The columns are the k names; others in the messages are ignored. Messages of several publishers
    that each bear some of the names (the four legs on ``joint_targets``) are merged where their
    stamps agree. NaN stands where no message held a value; of messages with one stamp and one name
    the last counts.
    """
    groups = {key: topic.blocks.pop(key).all() for key in list(topic.blocks)
              if set(names) & set(key[0])}
    stamps = np.empty(0, np.int64)
    for blocks in groups.values():
        own = np.concatenate([of.stamp for of in blocks])
        if not (np.diff(own) > 0).all():
            own = np.unique(own)
        if not np.array_equal(own, stamps):
            stamps = np.union1d(stamps, own) if stamps.size else own
    is_whole = len(groups) == 1 and set(names) <= set(next(iter(groups))[0])
    held_fields = next((blocks[0].values.shape[1] for blocks in groups.values()),
                       len(topic.fields))
    table = [np.empty((len(stamps), len(names))) for _ in range(held_fields)]
    for values in table:
        if not is_whole:
            values[:] = np.nan
    for (held, _), blocks in groups.items():
        sources = [source for source, name in enumerate(held) if name in names]
        columns = [names.index(held[source]) for source in sources]
        while blocks:  # what is in the table is given back at once
            block = blocks.pop(0)
            rows = np.searchsorted(stamps, block.stamp)
            for k, values in enumerate(table):
                values[rows[:, None], columns] = block.values[:, k, sources]
    return [stamps / 1e9, *table]


def _joints(topic: Topic, names: Sequence[str]) -> recording.JointSeries:
    time, *values = _table(topic, names)
    unread = np.broadcast_to(np.nan, (len(time), len(names)))
    return recording.JointSeries(
        time, **{**dict.fromkeys(ALL_FIELDS, unread), **dict(zip(topic.fields, values,
                                                                 strict=True))})


def _canonical(topic: Topic) -> recording.CanonicalSeries:
    frames = {stamp: frame for (names, frame), blocks in topic.blocks.items() if frame
              for block in blocks.all() for stamp in (block.stamp / 1e9).tolist()}
    time, x, *rates = _table(topic, layouts.OSCILLATOR_ROWS)
    shape = (-1, len(LEGS), 2)
    x_dot = rates[0] if rates else np.broadcast_to(np.nan, x.shape)
    return recording.CanonicalSeries(time, x.reshape(shape), x_dot.reshape(shape),
                                     _gaits(topic, time, frames))


def _gaits(topic: Topic, time: Array, frames: Mapping[float, str]) -> tuple[GaitShares, ...]:
    """Gait in force at each time, by rows or, in former recordings, by frames; or none."""
    rows = [name for name in dict.fromkeys(name for names, _ in topic.blocks for name in names)
            if name.startswith(layouts.GAIT_PREFIX)]
    if not rows:
        known = all(frames.get(of) for of in time.tolist())
        return tuple(_former_gait(frames[of]) for of in time.tolist()) if known else ()
    changed, *numbers = _table(topic, [*rows, layouts.CADENCE_ROW])
    gaits = [layouts.read_gait_rows(rows, *of)
             for of in zip(*(part.tolist() for part in numbers), strict=True)]
    return tuple(gaits[row] for row in
                 (np.searchsorted(changed, time, side='right') - 1).clip(0).tolist())


@cache
def _former_gait(text: str) -> GaitShares:
    """Gait in force by the text that former recordings have: ``trot *1.25``, or
    ``amble>trot 0.35 0.61``.
    """
    gait, _, factor = text.partition(' *')
    names, *numbers = gait.split(' ')
    before, _, after = names.partition('>')
    try:
        share, rate = map(float, numbers) if after else (0.0, 0.0)
        return GaitShares(before, after, share, rate, float(factor or 1.0))
    except ValueError as error:
        raise DataError(f"gait '{text}' of a canonical state cannot be read: {error}") from None


def _feet(topic: Topic) -> recording.FootForceSeries:
    time, force = _table(topic, LEGS)
    if not time.size:
        time, force = _table(topic, [f'{leg}_foot' for leg in LEGS])
    return recording.FootForceSeries(time, force)


def _arrivals(topics: Mapping[str, Topic]) -> recording.ArrivalSeries:
    states = topics['joint_states'].joined()
    known, row = np.unique(states.stamp, return_inverse=True)
    last = np.full(len(known) + 1, -np.inf)  # the last is of targets without a state
    for blocks in topics['joint_targets'].blocks.values():
        for of in blocks.all() if known.size else ():
            at = np.searchsorted(known, of.stamp)
            at[known[np.minimum(at, len(known) - 1)] != of.stamp] = -1
            np.maximum.at(last, at, of.bag_ns)
    for topic in ('joint_states', 'joint_targets'):
        for blocks in topics[topic].blocks.values():
            blocks.forget_record_times()
    answer = np.where(np.isfinite(last), last, np.nan)[row]
    return recording.ArrivalSeries(states.stamp / 1e9, states.bag_ns / 1e9, answer / 1e9)


def _statuses(message: Any) -> Iterator[tuple[str, StatusEvent]]:
    """Every status of a message with its name."""
    stamp = message.header.stamp
    for status in message.status:
        yield sys.intern(status.name), StatusEvent(
            (int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)) / 1e9, int(status.level),
            sys.intern(status.message),
            {sys.intern(pair.key): pair.value for pair in status.values})


def _by_name(statuses: Statuses) -> dict[str, tuple[StatusEvent, ...]]:
    histories: dict[str, list[StatusEvent]] = defaultdict(list)
    for name, event in statuses:  # robot/node, where the robot has a namespace
        histories[base_name(name)].append(event)
    return {name: tuple(history) for name, history in histories.items()}


def _changes(statuses: Statuses, what: Callable[[StatusEvent], Any],
             ) -> tuple[StatusEvent, ...]:
    """The first of the events in a row that say the same."""
    return tuple(next(same) for _, same in groupby((event for _, event in statuses), what))


def _modes(topics: Mapping[str, Topic]) -> tuple[StatusEvent, ...]:
    """When which mode of the body began."""
    time, position = _table(topics['posture_feedback'], layouts.MODE_ROWS)
    if not time.size:  # a recording from before modes were states
        return _changes(topics['body_mode'].statuses, lambda event: event.message)
    modes = position.argmax(axis=1)
    first = np.flatnonzero(np.diff(modes, prepend=-1))
    return tuple(StatusEvent(float(time[k]), 0, layouts.MODE_ROWS[modes[k]].partition('/')[2], {})
                 for k in first)
