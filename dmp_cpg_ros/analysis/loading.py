# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a rosbag2 folder to a :class:`~dmp_cpg_ros.analysis.recording.Recording`."""

from __future__ import annotations

from pathlib import Path

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag2 import ReaderError

from dmp_cpg_ros.analysis.bag import bag_folder, opened
from dmp_cpg_ros.analysis.collecting import Collector
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.errors import DataError


def load_recording(path: Path | str) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path : path-like
        A rosbag2 folder (MCAP or SQLite) or a run's folder with ``bag/`` inside.

    Returns
    -------
    Recording

    Raises
    ------
    MissingFileError
        If the path does not exist.
    DataError
        If it is not a readable bag, or holds the topics of more than one robot.
    """
    folder = bag_folder(path)
    collector = Collector()
    try:
        with opened(folder) as reader:
            _check_one_robot(reader)
            handlers = {}
            for connection in reader.connections:
                handler = collector.handler(_base_name(connection.topic), connection.msgtype)
                if handler is not None:
                    handlers[connection.id] = handler
            used = [connection for connection in reader.connections if connection.id in handlers]
            for connection, bag_ns, raw in reader.messages(used) if used else ():
                handlers[connection.id](bag_ns, reader.deserialize(raw, connection.msgtype))
            counts = {topic: info.msgcount for topic, info in sorted(reader.topics.items())}
    except (AnyReaderError, ReaderError, OSError) as error:
        raise DataError(f"the bag '{folder}' is damaged: {error}") from error
    return collector.recording(counts)


def _base_name(topic: str) -> str:
    return topic.rsplit('/', 1)[-1]


def _check_one_robot(reader: AnyReader) -> None:
    robots = sorted(topic for topic in reader.topics if _base_name(topic) == 'joint_states')
    if len(robots) > 1:
        raise DataError(
            f'the bag holds {len(robots)} robots ({", ".join(robots)}); record one robot per bag'
        )
