# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Demonstrations from files: CSV, NumPy and rosbag2 recordings."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.bag import decoded, find_bag, opened
from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.core.primitives.demonstration import Demonstration

Array = NDArray[np.float64]

_TIME_NAMES = ('t', 'time', 'time_s', 'timestamp', 'stamp')
_ORDERS = {'': 0, '_velocity': 1, '_acceleration': 2}
_ARRAYS = ('times', 'positions', 'velocities', 'accelerations')
_JOINT_STATE = 'sensor_msgs/msg/JointState'


def read_demonstration(
    path: Path,
    joints: Sequence[str] = (),
    topic: str = 'joint_states',
    start: float | None = None,
    end: float | None = None,
) -> Demonstration:
    """Read a demonstration of any kind.

    Parameters
    ----------
    path : Path
        CSV file, NumPy file (.npy, .npz), rosbag2 folder, or a run's folder with ``bag/`` inside.
    joints : sequence of str
        Names that are wanted, in this order; all without.
    topic : str
        Topic of a bag, of type JointState.
    start, end : float, optional
        Part that is taken, from the first sample on [s].

    Returns
    -------
    Demonstration

    Raises
    ------
    MissingFileError
        If there is no such file.
    DataError
        If it cannot be read; the text says what is valid.
    """
    if not path.exists():
        raise MissingFileError(f"'{path}' does not exist; name a CSV, .npy or .npz file or a bag")
    suffix = path.suffix.lower()
    if suffix == '.csv':
        whole = _from_csv(path)
    elif suffix in ('.npy', '.npz'):
        whole = _from_numpy(path)
    elif path.is_dir() or suffix in ('.mcap', '.db3'):
        whole = _from_bag(path, topic, joints)
    else:
        raise DataError(f"'{path}' is of no known kind; valid are .csv, .npy, .npz and bags")
    return _part(_chosen(whole, joints, path), start, end)


def _from_csv(path: Path) -> Demonstration:
    """Columns by name: time, NAME, and NAME_velocity, NAME_acceleration where they exist."""
    try:
        text = path.read_text(encoding='utf-8-sig')
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"'{path}' cannot be read as text: {error}") from error
    rows = [row for row in csv.reader(io.StringIO(text)) if any(cell.strip() for cell in row)]
    if not rows:
        raise DataError(f"'{path}' is empty; its first column must be time [s]")
    header = [cell.strip() for cell in rows[0]]
    if all(_is_number(cell) for cell in header):
        header = ['time', *(f'joint_{i + 1}' for i in range(len(header) - 1))]
    else:
        rows = rows[1:]
    if len(header) < 2 or header[0].lower() not in _TIME_NAMES:
        raise DataError(
            f"'{path}' must have the time in its first column, named {', '.join(_TIME_NAMES)}, "
            f'and positions in the others; its columns are {", ".join(header)}'
        )
    try:
        data = np.array([[float(cell) for cell in row] for row in rows], dtype=float)
    except ValueError as error:
        raise DataError(f"'{path}' holds something that is no number: {error}") from error
    if data.ndim != 2 or data.shape[1] != len(header):
        raise DataError(f"'{path}' must have {len(header)} numbers in every row")
    columns = dict(zip(header[1:], data.T[1:], strict=True))
    return _of_columns(data[:, 0], columns)


def _of_columns(times: Array, columns: dict[str, Array]) -> Demonstration:
    derived = {
        base + ending
        for base in columns
        for ending in _ORDERS
        if ending and base + ending in columns
    }
    names = tuple(name for name in columns if name not in derived)
    parts: list[Array | None] = []
    for ending in _ORDERS:
        there = all(name + ending in columns for name in names)
        parts.append(np.stack([columns[n + ending] for n in names], axis=1) if there else None)
    positions, velocities, accelerations = parts
    if positions is None:
        raise DataError('a demonstration needs positions')
    return Demonstration(times, positions, velocities, accelerations, names)


def _from_numpy(path: Path) -> Demonstration:
    try:
        content = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise DataError(f"'{path}' is no NumPy file of plain arrays: {error}") from error
    if isinstance(content, np.ndarray):
        if content.ndim != 2 or content.shape[1] < 2 or not np.isrealobj(content):
            raise DataError(
                f"'{path}' must hold an array (m, 1 + n) with the time [s] in its first column, "
                f'not one of shape {content.shape}'
            )
        return Demonstration(content[:, 0], content[:, 1:])
    with content:
        for needed in _ARRAYS[:2]:
            if needed not in content.files:
                raise DataError(
                    f"'{path}' has no array '{needed}'; needed are {', '.join(_ARRAYS[:2])}, "
                    f'possible {", ".join(_ARRAYS[2:])}, names'
                )
        try:
            arrays: list[Any] = [
                np.asarray(content[a]) if a in content.files else None for a in _ARRAYS
            ]
            names = tuple(map(str, content['names'])) if 'names' in content.files else ()
        except ValueError as error:
            raise DataError(f"'{path}' holds more than plain arrays: {error}") from error
    times, positions, velocities, accelerations = arrays
    return Demonstration(times, positions, velocities, accelerations, names)


def _from_bag(path: Path, topic: str, joints: Sequence[str]) -> Demonstration:
    """Positions by joint name at every stamp at which all wanted joints are known."""
    samples: dict[int, dict[str, tuple[float, float | None]]] = {}
    with opened(find_bag(path)) as reader:
        kinds = {c.topic: c.msgtype for c in reader.connections}
        full = next((t for t in kinds if t == topic or t.endswith('/' + topic.lstrip('/'))), None)
        usable = sorted(t for t, kind in kinds.items() if kind == _JOINT_STATE)
        if full is None or full not in usable:
            raise DataError(
                f"'{path}' has no topic '{topic}' of joint states; valid are "
                f'{", ".join(usable) or "none in this bag"}'
            )
        chosen = [c for c in reader.connections if c.topic == full]
        for _, bag_ns, message in decoded(reader, chosen, Counter()):
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            row = samples.setdefault(stamp or bag_ns, {})
            for i, name in enumerate(message.name):
                if i < len(message.position):
                    speed = float(message.velocity[i]) if i < len(message.velocity) else None
                    row[name] = (float(message.position[i]), speed)
    names = tuple(joints) or tuple(dict.fromkeys(n for row in samples.values() for n in row))
    unknown = [n for n in names if not any(n in row for row in samples.values())]
    if unknown:
        known = dict.fromkeys(n for row in samples.values() for n in row)
        raise DataError(f"'{path}' has no joint '{unknown[0]}'; valid are {', '.join(known)}")
    stamps = sorted(stamp for stamp, row in samples.items() if all(n in row for n in names))
    if not stamps:
        raise DataError(f"'{path}': no message on '{full}' holds all of {', '.join(names)}")
    rows = [[samples[stamp][name] for name in names] for stamp in stamps]
    times = np.array([stamp - stamps[0] for stamp in stamps]) * 1e-9
    speeds = [[speed for _, speed in row] for row in rows]
    complete = all(speed is not None for row in speeds for speed in row)
    velocities = np.array(speeds, dtype=float) if complete else None
    return Demonstration(
        times, np.array([[p for p, _ in r] for r in rows]), velocities, None, names
    )


def _chosen(demonstration: Demonstration, joints: Sequence[str], path: Path) -> Demonstration:
    if not joints or tuple(joints) == demonstration.names:
        return demonstration
    for name in joints:
        if name not in demonstration.names:
            valid = ', '.join(demonstration.names) or 'none, for the file names no joints'
            raise DataError(f"'{path}' has no joint '{name}'; valid are {valid}")
    index = [demonstration.names.index(name) for name in joints]
    v, a = demonstration.velocities, demonstration.accelerations
    return Demonstration(
        demonstration.times,
        demonstration.positions[:, index],
        None if v is None else v[:, index],
        None if a is None else a[:, index],
        tuple(joints),
    )


def _part(demonstration: Demonstration, start: float | None, end: float | None) -> Demonstration:
    since = demonstration.times - demonstration.times[0]
    keep = (since >= (start or 0.0)) & (since <= (np.inf if end is None else end))
    v, a = demonstration.velocities, demonstration.accelerations
    return Demonstration(
        demonstration.times[keep],
        demonstration.positions[keep],
        None if v is None else v[keep],
        None if a is None else a[keep],
        demonstration.names,
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
