# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a bag to the data model: which topic goes into which array."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from dmp_cpg_ros import layouts
from dmp_cpg_ros.analysis import recording
from dmp_cpg_ros.analysis.bag import base_name, find_bag, opened, recorded, warn_of
from dmp_cpg_ros.analysis.recording import Array, Recording, StatusEvent
from dmp_cpg_ros.analysis.topics import ALL_FIELDS, FIELDS, TOPICS, Block, Topic, in_batches
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import GaitShares
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.strict_yaml import naming

Statuses = Sequence[tuple[str, StatusEvent]]
"""Names and statuses, as they came."""


def load_recording(path: Path | str, *, joint_names: Sequence[str] = JOINT_NAMES,
                   only: Mapping[str, Sequence[str]] | None = None,
                   tell: Callable[[str], None] = lambda text: None) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path : path-like
        A rosbag2 folder (MCAP or SQLite), one file of it, or a run's folder with ``bag/`` inside.
    joint_names : sequence of str, optional
        What messages call the twelve joints if neither a ``robot_description`` in the recording
        says it nor they have their usual names.
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
        return _loaded(find_bag(path), {**FIELDS, **(only or {})}, joint_names, tell)


def _read(bag: Path, fields: Mapping[str, Sequence[str]], tell: Callable[[str], None]
          ) -> tuple[dict[str, Topic], dict[str, int]]:
    """Topics of a bag, and how many messages it has of each topic."""
    with opened(bag) as reader:
        robots = sorted(topic for topic in reader.topics if base_name(topic) == 'joint_states')
        if len(robots) > 1:
            raise DataError(f'the bag holds {", ".join(robots)}; record one robot per bag')
        used = [c for c in reader.connections if base_name(c.topic) in TOPICS.get(c.msgtype, ())]
        topics = {name: Topic(name, fields.get(name, ALL_FIELDS))
                  for names in TOPICS.values() for name in names}
        taken, total = 0, sum(of.msgcount for of in used)
        for (topic, kind), times, raws in in_batches(recorded(reader, used)):
            topics[base_name(topic)].take(topic, kind, times, raws)
            taken += len(raws)
            tell(f'reading: {taken:,} of {total:,} messages')
        counts = {topic: info.msgcount for topic, info in sorted(reader.topics.items())}
    return topics, counts


def _loaded(bag: Path, fields: Mapping[str, Sequence[str]], joint_names: Sequence[str],
            tell: Callable[[str], None]) -> Recording:
    topics, counts = _read(bag, fields, tell)
    skipped = Counter[str]()
    for topic in topics.values():
        skipped += topic.skipped
    warn_of(skipped)
    commands, arrivals = _on_robot_clock(topics), _arrivals(topics)
    modes, (names, foreign) = _modes(topics), _joint_names(topics, joint_names)
    # Bags of others have one odometry, and in old ones of this suite it is the truth.
    truth, estimate = (('ground_truth', 'odom') if topics['ground_truth'].blocks
                       else ('odom', 'estimated_odom'))
    return Recording(
        joints=_joints(topics.pop('joint_states'), names),
        targets=_joints(topics.pop('joint_targets'), names),
        work=_work(topics['joint_work'], names),
        canonical=_canonical(topics['canonical_state']),
        reference=recording.VelocitySeries(*rows_of(topics['reference'].joined(3), (3,))),
        commands=recording.VelocitySeries(*rows_of(commands, (3,))),
        odometry=recording.OdometrySeries(*rows_of(topics.pop(truth).joined(13), (3, 4, 3, 3))),
        estimate=recording.OdometrySeries(*rows_of(topics[estimate].joined(13), (3, 4, 3, 3))),
        feet=_feet(topics['foot_contacts']),
        inhibition=_changes(topics['inhibition_state'].statuses, lambda e: (e.message, e.values)),
        modes=modes, statuses=_by_name(topics['diagnostics'].statuses),
        arrivals=arrivals, counts=counts, undecodable=dict(skipped), foreign_joints=foreign)


def _joint_names(topics: Mapping[str, Topic], given: Sequence[str],
                 ) -> tuple[Sequence[str], dict[str, tuple[str, ...]]]:
    """Names of our joints in a recording: of those that ``robot/urdf.py`` says, the usual ones and
    those given, what most are called; and names of others, of topics that lack some of ours.
    """
    described = {usual: name for name, usual in re.findall(
        r'<dmp_cpg_ros_joint name="([^"]+)" usual="([^"]+)"', topics['robot_description'].text)}
    held = {topic: dict.fromkeys(name for names, _ in topics[topic].blocks for name in names)
            for topic in recording.OF_JOINTS}
    every = {name for names in held.values() for name in names}
    ours = max(([described.get(usual, usual) for usual in JOINT_NAMES], JOINT_NAMES, given),
               key=lambda names: len(every.intersection(names)))
    return ours, {topic: others for topic, names in held.items() if set(ours) - names.keys()
                  and (others := tuple(name for name in names if name not in ours))}


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


def rows_of(block: Block, widths: Sequence[int]) -> list[Array]:
    """Times [s] and columns in the order of the stamps; of one stamp the last counts."""
    stamps, values = block.stamp, block.values.reshape(-1, sum(widths))
    if (np.diff(stamps) <= 0).any():
        stamps, last = np.unique(stamps[::-1], return_index=True)
        values = values[::-1][last]
    return [stamps / 1e9, *np.split(values, np.cumsum(widths)[:-1], axis=1)]


def _work(topic: Topic, names: Sequence[str]) -> recording.WorkSeries:
    """Work and losses of the joints."""
    time, energy, peak = table_of(topic, layouts.work_rows(names))
    count = len(names)
    return recording.WorkSeries(time, energy[:, :count], peak[:, :count], energy[:, count:])


def table_of(topic: Topic, names: Sequence[str]) -> list[Array]:
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
    time, *values = table_of(topic, names)
    unread = np.broadcast_to(np.nan, (len(time), len(names)))
    return recording.JointSeries(
        time, **{**dict.fromkeys(ALL_FIELDS, unread), **dict(zip(topic.fields, values,
                                                                 strict=True))})


def _canonical(topic: Topic) -> recording.CanonicalSeries:
    frames = {stamp: frame for (names, frame), blocks in topic.blocks.items() if frame
              for block in blocks.all() for stamp in (block.stamp / 1e9).tolist()}
    time, x, *rates = table_of(topic, layouts.OSCILLATOR_ROWS)
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
    changed, *numbers = table_of(topic, [*rows, layouts.CADENCE_ROW])
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
    time, force = table_of(topic, LEGS)
    if not time.size:
        time, force = table_of(topic, [f'{leg}_foot' for leg in LEGS])
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


def _by_name(statuses: Statuses) -> dict[str, tuple[StatusEvent, ...]]:
    histories: dict[str, list[StatusEvent]] = defaultdict(list)
    for name, event in statuses:  # robot/node, where the robot has a namespace
        histories[base_name(name)].append(event)
    return {name: tuple(history) for name, history in histories.items()}


def _changes(statuses: Statuses, what: Callable[[StatusEvent], Any],
             ) -> tuple[StatusEvent, ...]:
    """The first of the events in a row that say the same, in the order of their stamps: a recorder
    that joins gets what a latched topic has told before after what it tells then.
    """
    events = sorted((event for _, event in statuses), key=lambda event: event.time)
    return tuple(next(same) for _, same in groupby(events, what))


def _modes(topics: Mapping[str, Topic]) -> tuple[StatusEvent, ...]:
    """When which mode of the body began."""
    time, position = table_of(topics['posture_feedback'], layouts.MODE_ROWS)
    if not time.size:  # a recording from before modes were states
        return _changes(topics['body_mode'].statuses, lambda event: event.message)
    modes = position.argmax(axis=1)
    first = np.flatnonzero(np.diff(modes, prepend=-1))
    return tuple(StatusEvent(float(time[k]), 0, layouts.MODE_ROWS[modes[k]].partition('/')[2], {})
                 for k in first)
