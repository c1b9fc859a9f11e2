# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of what a bag holds and no metric reads: sensors, feedback, and what others sent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.bag import base_name, message_of, opened, recorded, warn_of
from dmp_cpg_ros.analysis.loading import rows_of, table_of
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.analysis.topics import ALL_FIELDS, IMU, ROWS_OF, TEXT, Topic, in_batches

TOPICS = {ROWS_OF: ('posture_feedback', 'inhibition_gains', 'votes'), IMU: ('imu',),
          TEXT: ('drive_mode',), 'geometry_msgs/msg/WrenchStamped': ('push',)}
"""Topics without namespace that have such a table, by their types of message."""

SENT = ('votes', 'push', 'drive_mode')
"""Those whose stamps are of a sender's clock, or that have none: the tick counts that was recorded
last before.
"""

OTHER_TABLES = tuple(sorted(name for names in TOPICS.values() for name in names))


def other_tables(bag: Path, recording: Recording) -> dict[str, dict[str, Any]]:
    """Columns of the topics of ``TOPICS`` of which something was recorded.

    Parameters
    ----------
    bag : Path
        As from :func:`~dmp_cpg_ros.analysis.bag.find_bag`.
    recording : Recording
        What was read of it, for the times of its ticks.

    Returns
    -------
    dict of str to dict of str to ndarray (n,) or list of str
        As :meth:`~dmp_cpg_ros.analysis.recording.Recording.tables`. Rows of joint states are
        columns ``position_ROW``, ``velocity_ROW``, ``effort_ROW``, in the units of the topic; the
        last two where they are not 0 throughout.
    """
    topics = {name: Topic('', ALL_FIELDS) for name in OTHER_TABLES if name not in SENT}
    sent: dict[str, list[tuple[int, Any]]] = {name: [] for name in SENT}
    skipped = Counter[str]()
    with opened(bag) as reader:
        used = [of for of in reader.connections if base_name(of.topic) in TOPICS.get(
            of.msgtype, ())]
        for (topic, kind), times, raws in in_batches(recorded(reader, used)):
            name = base_name(topic)
            if name in topics:
                topics[name].take(topic, kind, times, raws)
            else:
                read = [(at, message) for at, raw in zip(times, raws, strict=True)
                        if (message := message_of(raw, kind)) is not None]
                skipped[topic] += len(raws) - len(read)
                sent[name] += read
    warn_of(sum((of.skipped for of in topics.values()), +skipped))
    found = {'imu': _imu(topics.pop('imu')),
             **{name: _rows(topic) for name, topic in topics.items()},
             **{name: _sent(name, messages, recording) for name, messages in sent.items()}}
    return {name: columns for name, columns in sorted(found.items()) if len(columns['time_s'])}


def _imu(topic: Topic) -> dict[str, Array]:
    time, rate, force = rows_of(topic.joined(6), (3, 3))
    return {'time_s': time,
            **{f'rate_{axis}_rad_s': of for axis, of in zip('xyz', rate.T, strict=True)},
            **{f'specific_force_{axis}_m_s2': of
               for axis, of in zip('xyz', force.T, strict=True)}}


def _rows(topic: Topic) -> dict[str, Array]:
    names = list(dict.fromkeys(name for names, _ in topic.blocks for name in names))
    time, *values = table_of(topic, names)
    return {'time_s': time, **{
        f'{what}_{name}': column for what, table in zip(ALL_FIELDS, values, strict=True)
        for name, column in zip(names, table.T, strict=True)
        if what == 'position' or np.nan_to_num(column).any()}}


def _sent(name: str, messages: Sequence[tuple[int, Any]], recording: Recording) -> dict[str, Any]:
    """Columns of messages with their record times [ns]."""
    time = _times(np.array([at for at, _ in messages], np.int64), recording)
    of = [message for _, message in messages]
    if name == 'drive_mode':
        return {'time_s': time, 'message': [message.data for message in of]}
    if name == 'votes':
        rows = [(at, *row) for at, message in zip(time.tolist(), of, strict=True)
                for row in zip(message.name, message.effort, strict=False)]
        return {'time_s': np.array([row[0] for row in rows]), 'name': [row[1] for row in rows],
                'weight_per_s': np.array([row[2] for row in rows])}
    return {'time_s': time, 'frame': [message.header.frame_id for message in of], **{
        f'{what}_{axis}_{unit}': np.array([
            getattr(getattr(message.wrench, what), axis) for message in of])
        for what, unit in (('force', 'n'), ('torque', 'n_m')) for axis in 'xyz'}}


def _times(bag_ns: NDArray[np.int64], recording: Recording) -> Array:
    """Stamps [s] of the ticks that were recorded last before; without ticks the record times."""
    ticks, times = recording.arrivals, bag_ns / 1e9
    if not ticks.time.size:
        return times
    return ticks.time[np.maximum(np.searchsorted(ticks.state, times, side='right') - 1, 0)]
