# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a rosbag2 folder to a :class:`~dmp_cpg_ros.analysis.recording.Recording`."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag2 import ReaderError

from dmp_cpg_ros.analysis.bag import decoded, find_bag, opened
from dmp_cpg_ros.analysis.collecting import Collector
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.errors import DataError


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
    bag = find_bag(path)
    collector, skipped = Collector(), Counter[str]()
    try:
        with opened(bag) as reader:
            _check_one_robot(reader)
            handlers = {
                (connection.topic, connection.msgtype): handler
                for connection in reader.connections
                if (handler := collector.handler(_base_name(connection.topic), connection.msgtype))
            }
            used = [c for c in reader.connections if (c.topic, c.msgtype) in handlers]
            for connection, bag_ns, message in decoded(reader, used, skipped):
                handlers[connection.topic, connection.msgtype](bag_ns, message)
            counts = {topic: info.msgcount for topic, info in sorted(reader.topics.items())}
    except (AnyReaderError, ReaderError, OSError) as error:
        raise DataError(f"the bag '{bag}' is damaged: {error}") from error
    return collector.recording(counts, dict(skipped))


def _base_name(topic: str) -> str:
    return topic.rsplit('/', 1)[-1]


def _check_one_robot(reader: AnyReader) -> None:
    robots = sorted(topic for topic in reader.topics if _base_name(topic) == 'joint_states')
    if len(robots) > 1:
        raise DataError(
            f'the bag holds {len(robots)} robots ({", ".join(robots)}); record one robot per bag'
        )
