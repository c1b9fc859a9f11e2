# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a bag to the data model: which topic goes into which array."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.bag import base_name, decoded, find_bag, opened
from dmp_cpg_ros.analysis.recording import (
    ArrivalSeries,
    CanonicalSeries,
    FootForceSeries,
    JointSeries,
    OdometrySeries,
    Recording,
    StatusEvent,
    VelocitySeries,
    WorkSeries,
)
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import GaitShares
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.layouts import (
    CADENCE_ROW,
    GAIT_PREFIX,
    MODE_ROWS,
    OSCILLATOR_ROWS,
    read_gait_rows,
)

Array = NDArray[np.float64]
Pairs = list[tuple[int, int]]

FIELDS = ('position', 'velocity', 'effort')


def load_recording(path: Path | str) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path : path-like
        A rosbag2 folder (MCAP or SQLite), one file of it, or a run's folder with ``bag/`` inside.

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
    collector, skipped = _Collector(), Counter[str]()
    with opened(find_bag(path)) as reader:
        robots = sorted(topic for topic in reader.topics if base_name(topic) == 'joint_states')
        if len(robots) > 1:
            raise DataError(f'the bag holds {len(robots)} robots ({", ".join(robots)}); '
                            'record one robot per bag')
        handlers = {(c.topic, c.msgtype): handler for c in reader.connections
                    if (handler := collector.handler(base_name(c.topic), c.msgtype))}
        used = [c for c in reader.connections if (c.topic, c.msgtype) in handlers]
        for connection, bag_ns, message in decoded(reader, used, skipped):
            handlers[connection.topic, connection.msgtype](bag_ns, message)
        counts = {topic: info.msgcount for topic, info in sorted(reader.topics.items())}
    return collector.recording(counts, dict(skipped))


def stamp_ns(stamp: Any) -> int:
    """Stamp as whole nanoseconds."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _twist(message: Any) -> tuple[float, ...]:
    return message.linear.x, message.linear.y, message.angular.z


def _odometry(message: Any) -> tuple[float, ...]:
    pose, twist = message.pose.pose, message.twist.twist
    return (*_xyz(pose.position), *_xyz(pose.orientation), pose.orientation.w,
            *_xyz(twist.linear), *_xyz(twist.angular))


NAMED = ('joint_states', 'joint_targets', 'canonical_state', 'foot_contacts', 'posture_feedback',
         'joint_work')
"""Topics of ``JointState``."""

ROWS: dict[tuple[str, str], Callable[[Any], tuple[float, ...]]] = {
    ('reference', 'geometry_msgs/msg/TwistStamped'): lambda message: _twist(message.twist),
    ('odom', 'nav_msgs/msg/Odometry'): _odometry,
    ('estimated_odom', 'nav_msgs/msg/Odometry'): _odometry,
    ('cmd_vel', 'geometry_msgs/msg/TwistStamped'): lambda message: _twist(message.twist),
    ('cmd_vel', 'geometry_msgs/msg/Twist'): _twist,
}
"""Numbers of a message of a topic and type."""

CHANGES: dict[str, Callable[[StatusEvent], Any] | None] = {
    'inhibition_state': lambda event: (event.message, event.values),
    'body_mode': lambda event: event.message,
    'diagnostics': None,
}
"""Topics of statuses, and what must change for a status to be kept; all are where it is None."""


class _Collector:
    """Takes messages by topic; rows are stacked once, at the end."""

    def __init__(self) -> None:
        self._named = {topic: _NamedValues() for topic in NAMED}
        self._rows: dict[str, tuple[list[int], list[tuple[float, ...]]]] = defaultdict(
            lambda: ([], []))
        self._clock: Pairs = []  # bag time, robot's clock [ns]
        self._statuses: dict[str, dict[str, list[StatusEvent]]] = {topic: {} for topic in CHANGES}
        self._handlers: dict[tuple[str, str], Callable[[int, Any], None]] = {
            **{(topic, 'sensor_msgs/msg/JointState'): self._named[topic].take for topic in NAMED},
            **{key: partial(self._take_row, key[0], row) for key, row in ROWS.items()},
            **{(topic, 'diagnostic_msgs/msg/DiagnosticArray'): partial(self._take_statuses, topic)
               for topic in CHANGES},
            ('clock', 'rosgraph_msgs/msg/Clock'): lambda bag_ns, message: self._clock.append(
                (bag_ns, stamp_ns(message.clock))),
        }

    def handler(self, topic: str, msgtype: str) -> Callable[[int, Any], None] | None:
        """Function that takes bag time [ns] and message of a topic, None for unused topics.

        The topic is without namespace, the type is such as ``sensor_msgs/msg/JointState``.
        """
        return self._handlers.get((topic, msgtype))

    def recording(self, counts: dict[str, int], undecodable: dict[str, int]) -> Recording:
        """Stack everything that was taken."""
        return Recording(
            joints=self._joints('joint_states'),
            targets=self._joints('joint_targets'),
            work=self._work(),
            canonical=self._canonical(),
            reference=VelocitySeries(*self._stacked('reference', (3,))),
            commands=VelocitySeries(*self._stacked('cmd_vel', (3,))),
            odometry=OdometrySeries(*self._stacked('odom', (3, 4, 3, 3))),
            estimate=OdometrySeries(*self._stacked('estimated_odom', (3, 4, 3, 3))),
            feet=self._feet(),
            inhibition=self._changes('inhibition_state'),
            modes=self._modes(),
            statuses={name: tuple(history)
                      for name, history in self._statuses['diagnostics'].items()},
            arrivals=self._arrivals(),
            counts=counts,
            undecodable=undecodable)

    def _joints(self, topic: str) -> JointSeries:
        time, values = self._named[topic].table(JOINT_NAMES)
        return JointSeries(time, values['position'], values['velocity'], values['effort'])

    def _work(self) -> WorkSeries:
        time, values = self._named['joint_work'].table(JOINT_NAMES)
        return WorkSeries(time, values['position'], values['effort'])

    def _canonical(self) -> CanonicalSeries:
        named = self._named['canonical_state']
        time, values = named.table(OSCILLATOR_ROWS)
        x, x_dot = (values[name].reshape(-1, len(LEGS), 2) for name in FIELDS[:2])
        gaits = self._gaits()
        return CanonicalSeries(time, x, x_dot, gaits if len(gaits) == len(time) else ())

    def _gaits(self) -> tuple[GaitShares, ...]:
        """Gait in force of each canonical state, in the order of the stamps."""
        named = self._named['canonical_state']
        rows = [name for name in named.names if name.startswith(GAIT_PREFIX)]
        if not rows:
            texts = [text for _, text in sorted(named.frames.items())]
            return tuple(map(_former_gait, texts)) if all(texts) else ()
        _, values = named.table([*rows, CADENCE_ROW])
        position, velocity = (values[name].tolist() for name in FIELDS[:2])
        return tuple(read_gait_rows(rows, *row) for row in zip(position, velocity, strict=True))

    def _modes(self) -> tuple[StatusEvent, ...]:
        """When which mode of the body began."""
        time, values = self._named['posture_feedback'].table(MODE_ROWS)
        if not time.size:  # a recording from before modes were states
            return self._changes('body_mode')
        modes = values['position'].argmax(axis=1)
        first = np.flatnonzero(np.diff(modes, prepend=-1))
        return tuple(StatusEvent(float(time[k]), 0, MODE_ROWS[modes[k]].partition('/')[2], {})
                     for k in first)

    def _feet(self) -> FootForceSeries:
        time, values = self._named['foot_contacts'].table(LEGS)
        if not time.size:
            time, values = self._named['foot_contacts'].table([f'{leg}_foot' for leg in LEGS])
        return FootForceSeries(time, values['effort'])

    def _arrivals(self) -> ArrivalSeries:
        bag_ns, stamps = np.array(self._named['joint_states'].arrivals, dtype=np.int64
                                  ).reshape(-1, 2).T
        last = {stamp: bag_ns for bag_ns, stamp in self._named['joint_targets'].arrivals}
        targets = np.array([last.get(stamp, np.nan) for stamp in stamps.tolist()], dtype=float)
        return ArrivalSeries(stamps / 1e9, bag_ns / 1e9, targets / 1e9)

    def _stacked(self, topic: str, widths: Sequence[int]) -> list[Array]:
        """Times and columns of a topic in the order of the stamps; of one stamp the last counts.

        Commands are put at the time when they were received: a sender's stamps may be of another
        clock.
        """
        times, rows = self._rows[topic]
        if topic == 'cmd_vel':
            times = _robot_clock(times, self._named['joint_states'].arrivals or self._clock)
        stamps = np.array(times, dtype=np.int64)
        values = np.array(rows, dtype=float).reshape(-1, sum(widths))
        _, last = np.unique(stamps[::-1], return_index=True)
        keep = len(stamps) - 1 - last
        return [stamps[keep] / 1e9, *np.split(values[keep], np.cumsum(widths)[:-1], axis=1)]

    def _changes(self, topic: str) -> tuple[StatusEvent, ...]:
        return tuple(self._statuses[topic].get('', ()))

    def _take_row(self, topic: str, row: Callable[[Any], tuple[float, ...]], bag_ns: int,
                  message: Any) -> None:
        times, rows = self._rows[topic]
        times.append(bag_ns if topic == 'cmd_vel' else stamp_ns(message.header.stamp))
        rows.append(row(message))

    def _take_statuses(self, topic: str, _: int, message: Any) -> None:
        """Keep every status of ``/diagnostics`` by its name, of the other topics the changes."""
        time, what = stamp_ns(message.header.stamp) / 1e9, CHANGES[topic]
        for status in message.status:
            event = StatusEvent(time, int(status.level), status.message,
                                {pair.key: pair.value for pair in status.values})
            history = self._statuses[topic].setdefault('' if what else status.name, [])
            if what is None or not history or what(history[-1]) != what(event):
                history.append(event)


def _robot_clock(bag_ns: list[int], clock: Pairs) -> list[int]:
    """Stamps on the robot's clock for messages whose own stamps are not of it.

    The bag's record time may be wall time: each message gets the stamp of the tick that was
    recorded last before it. A bag without ticks keeps its own time.
    """
    if not clock:
        return bag_ns
    recorded, stamps = zip(*clock, strict=True)
    before = np.searchsorted(recorded, bag_ns, side='right') - 1
    return [stamps[max(index, 0)] for index in before]


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


class _NamedValues:
    """Collects JointState messages and lays them out as one table: columns by name, rows by stamp.

    Messages of several publishers that each bear some of the names (the four legs on
    ``joint_targets``) are merged where their stamps agree.
    """

    def __init__(self) -> None:
        self._messages: dict[tuple[str, ...], tuple[list[int], list[Any]]] = defaultdict(
            lambda: ([], []))
        self.names: dict[str, None] = {}  # in the order of their first message
        self.arrivals: Pairs = []  # bag time, stamp [ns]
        self.frames: dict[int, str] = {}  # by stamp [ns]

    def take(self, bag_ns: int, message: Any) -> None:
        """Take one message."""
        stamp = stamp_ns(message.header.stamp)
        self.arrivals.append((bag_ns, stamp))
        self.frames[stamp] = message.header.frame_id
        names = tuple(message.name)
        if names not in self._messages:
            self.names.update(dict.fromkeys(names))
        stamps, messages = self._messages[names]
        stamps.append(stamp)
        messages.append(message)

    def table(self, names: Sequence[str]) -> tuple[Array, dict[str, Array]]:
        """Increasing stamps (n,) [s], and the values (n, k) of each of ``FIELDS``.

        The columns are the k names; others in the messages are ignored. NaN stands where no
        message held a value; of messages with one stamp and one name the last counts.
        """
        column = {name: index for index, name in enumerate(names)}
        groups = {
            held: group for held, group in self._messages.items() if column.keys() & set(held)}
        stamps = np.unique(np.array(
            [stamp for of, _ in groups.values() for stamp in of], dtype=np.int64))
        values = {name: np.full((len(stamps), len(names)), np.nan) for name in FIELDS}
        for held, (own, messages) in groups.items():
            rows = np.searchsorted(stamps, own)
            sources = [index for index, name in enumerate(held) if name in column]
            columns = [column[held[index]] for index in sources]
            for name in FIELDS:
                block = _block((getattr(message, name) for message in messages), len(held))
                values[name][rows[:, None], columns] = block[:, sources]
        return stamps / 1e9, values


def _block(arrays: Iterable[Any], width: int) -> Array:
    """Rows of equal width; a message may leave a field out, which makes a row of NaN."""
    missing = np.full(width, np.nan)
    return np.array([array if len(array) == width else missing for array in arrays], dtype=float)
