# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a bag to the data model: which topic goes into which array."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros import layouts
from dmp_cpg_ros.analysis import recording
from dmp_cpg_ros.analysis.bag import base_name, decoded, find_bag, opened
from dmp_cpg_ros.analysis.recording import Array, Recording, StatusEvent
from dmp_cpg_ros.configuration import naming
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import GaitShares
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS

TOPICS = {
    'sensor_msgs/msg/JointState': ('joint_states', 'joint_targets', 'joint_work',
                                   'canonical_state', 'foot_contacts', 'posture_feedback'),
    'nav_msgs/msg/Odometry': ('ground_truth', 'odom', 'estimated_odom'),
    'geometry_msgs/msg/TwistStamped': ('reference', 'cmd_vel'),
    'geometry_msgs/msg/Twist': ('cmd_vel',),
    'diagnostic_msgs/msg/DiagnosticArray': ('inhibition_state', 'body_mode', 'diagnostics'),
    'rosgraph_msgs/msg/Clock': ('clock',),
    'std_msgs/msg/String': ('robot_description',),
}
"""Topics without namespace that are read, by their types of message."""


class Received(NamedTuple):
    """A message with its record time and its stamp [ns], which is 0 where it has none."""

    bag_ns: int
    stamp: int
    message: Any


Messages = Sequence[Received]


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
    with naming(path):
        return _loaded(find_bag(path))


def _loaded(bag: Path) -> Recording:
    messages: dict[str, list[Received]] = defaultdict(list)
    skipped = Counter[str]()
    with opened(bag) as reader:
        robots = sorted(topic for topic in reader.topics if base_name(topic) == 'joint_states')
        if len(robots) > 1:
            raise DataError(f'the bag holds {", ".join(robots)}; record one robot per bag')
        used = [c for c in reader.connections if base_name(c.topic) in TOPICS.get(c.msgtype, ())]
        for connection, bag_ns, message in decoded(reader, used, skipped):
            received = Received(bag_ns, _stamp_ns(message), message)
            messages[base_name(connection.topic)].append(received)
        counts = {topic: info.msgcount for topic, info in sorted(reader.topics.items())}
    # Bags of others have one odometry, and in old ones of this suite it is the truth.
    truth, estimate = (('ground_truth', 'odom') if messages['ground_truth']
                       else ('odom', 'estimated_odom'))
    joints = _joint_names(messages['robot_description'])
    time, work, _, peak_effort = _table(messages['joint_work'], joints)
    return Recording(
        joints=recording.JointSeries(*_table(messages['joint_states'], joints)),
        targets=recording.JointSeries(*_table(messages['joint_targets'], joints)),
        work=recording.WorkSeries(time, work, peak_effort),
        canonical=_canonical(messages['canonical_state']),
        reference=recording.VelocitySeries(*_rows(messages['reference'], _velocity, (3,))),
        commands=recording.VelocitySeries(*_rows(_on_robot_clock(messages), _velocity, (3,))),
        odometry=_odometry(messages[truth]), estimate=_odometry(messages[estimate]),
        feet=_feet(messages['foot_contacts']),
        inhibition=_changes(messages['inhibition_state'], lambda e: (e.message, e.values)),
        modes=_modes(messages), statuses=_by_name(messages['diagnostics']),
        arrivals=_arrivals(messages['joint_states'], messages['joint_targets']),
        counts=counts, undecodable=dict(skipped))


def _joint_names(descriptions: Messages) -> tuple[str, ...]:
    """Names of our joints in a recording, as ``robot/urdf.py`` says them."""
    named = {usual: name for of in descriptions[-1:] for name, usual in re.findall(
        r'<dmp_cpg_ros_joint name="([^"]+)" usual="([^"]+)"', of.message.data)}
    return tuple(named.get(usual, usual) for usual in JOINT_NAMES)


def _stamp_ns(message: Any) -> int:
    stamp = message.header.stamp if hasattr(message, 'header') else getattr(message, 'clock', None)
    return 0 if stamp is None else int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _velocity(message: Any) -> tuple[float, ...]:
    twist = getattr(message, 'twist', message)
    return twist.linear.x, twist.linear.y, twist.angular.z


def _odometry(messages: Messages) -> recording.OdometrySeries:
    return recording.OdometrySeries(*_rows(messages, _motion, (3, 4, 3, 3)))


def _motion(message: Any) -> tuple[float, ...]:
    place, turn = message.pose.pose.position, message.pose.pose.orientation
    v, omega = message.twist.twist.linear, message.twist.twist.angular
    return (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w, v.x, v.y, v.z,
            omega.x, omega.y, omega.z)


def _on_robot_clock(messages: Mapping[str, Messages]) -> Messages:
    """Commands with stamps of the robot's clock: a sender's may be of another clock.

    The bag's record time may be wall time: each command gets the stamp of the tick that was
    recorded last before it. A bag without ticks keeps its own time.
    """
    ticks = messages['joint_states'] or messages['clock']
    commands = [command._replace(stamp=command.bag_ns) for command in messages['cmd_vel']]
    if not ticks:
        return commands
    before = np.searchsorted([tick.bag_ns for tick in ticks],
                             [command.bag_ns for command in commands], side='right') - 1
    return [command._replace(stamp=ticks[max(row, 0)].stamp)
            for command, row in zip(commands, before, strict=True)]


def _rows(messages: Messages, row: Callable[[Any], tuple[float, ...]], widths: Sequence[int],
          ) -> list[Array]:
    """Times and columns in the order of the stamps; of one stamp the last counts."""
    rows = {of.stamp: row(of.message) for of in sorted(messages, key=lambda of: of.stamp)}
    values = np.array(list(rows.values()), dtype=float).reshape(-1, sum(widths))
    stamps = np.array(list(rows), dtype=np.int64)
    return [stamps / 1e9, *np.split(values, np.cumsum(widths)[:-1], axis=1)]


def _table(messages: Messages, names: Sequence[str]) -> list[Array]:
    """Increasing stamps (n,) [s], and the positions, velocities and efforts (n, k).

    The columns are the k names; others in the messages are ignored. Messages of several publishers
    that each bear some of the names (the four legs on ``joint_targets``) are merged where their
    stamps agree. NaN stands where no message held a value; of messages with one stamp and one name
    the last counts.
    """
    groups: dict[tuple[str, ...], list[Received]] = defaultdict(list)
    for received in messages:
        groups[tuple(received.message.name)].append(received)
    groups = {held: group for held, group in groups.items() if set(names) & set(held)}
    stamps = np.unique(np.array([of.stamp for group in groups.values() for of in group], np.int64))
    table = {field: np.full((len(stamps), len(names)), np.nan)
             for field in ('position', 'velocity', 'effort')}
    for held, group in groups.items():
        rows = np.searchsorted(stamps, [of.stamp for of in group])
        sources = [source for source, name in enumerate(held) if name in names]
        columns = [names.index(held[source]) for source in sources]
        missing = np.full(len(held), np.nan)  # a message may leave a field out
        for field, values in table.items():
            arrays = (getattr(of.message, field) for of in group)
            block = np.array([a if len(a) == len(held) else missing for a in arrays], dtype=float)
            values[rows[:, None], columns] = block[:, sources]
    return [stamps / 1e9, *table.values()]


def _canonical(messages: Messages) -> recording.CanonicalSeries:
    time, x, x_dot, _ = _table(messages, layouts.OSCILLATOR_ROWS)
    gaits, shape = _gaits(messages), (-1, len(LEGS), 2)
    return recording.CanonicalSeries(
        time, x.reshape(shape), x_dot.reshape(shape), gaits if len(gaits) == len(time) else ())


def _gaits(messages: Messages) -> tuple[GaitShares, ...]:
    """Gait in force of each canonical state, in the order of the stamps."""
    rows = [name for name in dict.fromkeys(name for of in messages for name in of.message.name)
            if name.startswith(layouts.GAIT_PREFIX)]
    if not rows:
        texts = {of.stamp: of.message.header.frame_id for of in messages}
        return tuple(_former_gait(texts[stamp]) for stamp in sorted(texts)) if all(
            texts.values()) else ()
    _, shares, rates, _ = _table(messages, [*rows, layouts.CADENCE_ROW])
    return tuple(layouts.read_gait_rows(rows, *of)
                 for of in zip(shares.tolist(), rates.tolist(), strict=True))


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


def _feet(messages: Messages) -> recording.FootForceSeries:
    time, *_, force = _table(messages, LEGS)
    if not time.size:
        time, *_, force = _table(messages, [f'{leg}_foot' for leg in LEGS])
    return recording.FootForceSeries(time, force)


def _arrivals(states: Messages, targets: Messages) -> recording.ArrivalSeries:
    last = {target.stamp: target.bag_ns for target in targets}
    times = [(state.stamp, state.bag_ns, last.get(state.stamp, np.nan)) for state in states]
    return recording.ArrivalSeries(*np.array(times, dtype=float).reshape(-1, 3).T / 1e9)


def _statuses(messages: Messages) -> Iterator[tuple[str, StatusEvent]]:
    """Every status with its name."""
    for received in messages:
        for status in received.message.status:
            yield status.name, StatusEvent(
                received.stamp / 1e9, int(status.level), status.message,
                {pair.key: pair.value for pair in status.values})


def _by_name(messages: Messages) -> dict[str, tuple[StatusEvent, ...]]:
    histories: dict[str, list[StatusEvent]] = defaultdict(list)
    for name, event in _statuses(messages):  # robot/node, where the robot has a namespace
        histories[base_name(name)].append(event)
    return {name: tuple(history) for name, history in histories.items()}


def _changes(messages: Messages, what: Callable[[StatusEvent], Any]) -> tuple[StatusEvent, ...]:
    """The first of the events in a row that say the same."""
    events = (event for _, event in _statuses(messages))
    return tuple(next(same) for _, same in groupby(events, what))


def _modes(messages: Mapping[str, Messages]) -> tuple[StatusEvent, ...]:
    """When which mode of the body began."""
    time, position, *_ = _table(messages['posture_feedback'], layouts.MODE_ROWS)
    if not time.size:  # a recording from before modes were states
        return _changes(messages['body_mode'], lambda event: event.message)
    modes = position.argmax(axis=1)
    first = np.flatnonzero(np.diff(modes, prepend=-1))
    return tuple(StatusEvent(float(time[k]), 0, layouts.MODE_ROWS[modes[k]].partition('/')[2], {})
                 for k in first)
