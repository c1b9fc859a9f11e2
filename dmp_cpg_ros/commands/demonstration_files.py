# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Demonstrations from files: CSV, NumPy and rosbag2 recordings."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.bag import decoded, find_bag, opened
from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.core.primitives.demonstration import Demonstration

Array = NDArray[np.float64]

_TIME_NAMES = ('t', 'time', 'time_s', 'timestamp', 'stamp')
_ENDINGS = ('', '_velocity', '_acceleration')
_ARRAYS = ('positions', 'velocities', 'accelerations')
_JOINT_STATE = 'sensor_msgs/msg/JointState'


def read_demonstration(path: Path, joints: Sequence[str] = (), topic: str = 'joint_states',
                       start: float | None = None, end: float | None = None) -> Demonstration:
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
    unknown = [name for name in joints if name not in whole.names]
    if unknown:
        valid = ', '.join(whole.names) or 'none, for the file names no joints'
        raise DataError(f"'{path}' has no joint '{unknown[0]}'; valid are {valid}")
    names = tuple(joints) or whole.names
    columns = [whole.names.index(name) for name in names] if names else slice(None)
    since = whole.times - whole.times[0]
    rows = (since >= (start or 0.0)) & (since <= (np.inf if end is None else end))
    parts: dict[str, Any] = {field: values[rows][:, columns] for field in _ARRAYS
                             if (values := getattr(whole, field)) is not None}
    return replace(whole, times=whole.times[rows], names=names, **parts)


def _from_csv(path: Path) -> Demonstration:
    """Columns by name: time, NAME, and NAME_velocity, NAME_acceleration where they exist."""
    try:
        text = path.read_text(encoding='utf-8-sig')
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"'{path}' cannot be read as text: {error}") from error
    rows = [row for row in csv.reader(text.splitlines()) if ''.join(row).strip()]
    if not rows:
        raise DataError(f"'{path}' is empty; its first column must be time [s]")
    try:
        np.array(rows[0], dtype=float)
        header = ['time', *(f'joint_{i}' for i in range(1, len(rows[0])))]
    except ValueError:
        header, rows = [cell.strip() for cell in rows[0]], rows[1:]
    if len(header) < 2 or header[0].lower() not in _TIME_NAMES:
        raise DataError(
            f"'{path}' must have the time in its first column, named {', '.join(_TIME_NAMES)}, "
            f'and positions in the others; its columns are {", ".join(header)}')
    try:
        data = np.array([[float(cell) for cell in row] for row in rows], dtype=float)
    except ValueError as error:
        raise DataError(f"'{path}' holds something that is no number: {error}") from error
    if data.ndim != 2 or data.shape[1] != len(header):
        raise DataError(f"'{path}' must have {len(header)} numbers in every row")
    columns = dict(zip(header[1:], data.T[1:], strict=True))
    derived = {base + ending for base in columns for ending in _ENDINGS[1:]}
    names = tuple(name for name in columns if name not in derived)
    parts: dict[str, Any] = {
        field: np.stack([columns[name + ending] for name in names], axis=1)
        for field, ending in zip(_ARRAYS, _ENDINGS, strict=True)
        if all(name + ending in columns for name in names)}
    return Demonstration(data[:, 0], **parts, names=names)


def _from_numpy(path: Path) -> Demonstration:
    try:
        content = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise DataError(f"'{path}' is no NumPy file of plain arrays: {error}") from error
    if isinstance(content, np.ndarray):
        if content.ndim != 2 or content.shape[1] < 2 or not np.isrealobj(content):
            raise DataError(
                f"'{path}' must hold an array (m, 1 + n) with the time [s] in its first column, "
                f'not one of shape {content.shape}')
        return Demonstration(content[:, 0], content[:, 1:])
    with content:
        for needed in ('times', 'positions'):
            if needed not in content.files:
                raise DataError(f"'{path}' has no array '{needed}'; needed are times, positions, "
                                'possible velocities, accelerations, names')
        try:
            arrays: dict[str, Any] = {
                name: content[name] for name in ('times', *_ARRAYS, 'names')
                if name in content.files}
        except ValueError as error:
            raise DataError(f"'{path}' holds more than plain arrays: {error}") from error
    names = tuple(map(str, arrays.pop('names', ())))
    return Demonstration(**arrays, names=names)


def _from_bag(path: Path, topic: str, joints: Sequence[str]) -> Demonstration:
    """Positions by joint name at every stamp at which all wanted joints are known."""
    samples: dict[int, dict[str, tuple[float, float | None]]] = {}
    with opened(find_bag(path)) as reader:
        kinds = {c.topic: c.msgtype for c in reader.connections}
        full = next((t for t in kinds if t == topic or t.endswith('/' + topic.lstrip('/'))), None)
        usable = sorted(t for t, kind in kinds.items() if kind == _JOINT_STATE)
        if full not in usable:
            raise DataError(f"'{path}' has no topic '{topic}' of joint states; valid are "
                            f'{", ".join(usable) or "none in this bag"}')
        chosen = [c for c in reader.connections if c.topic == full]
        for _, bag_ns, message in decoded(reader, chosen, Counter()):
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            samples.setdefault(stamp or bag_ns, {}).update(
                (name, (position, speed)) for name, position, speed
                in zip_longest(message.name, message.position, message.velocity)
                if name is not None and position is not None)
    known = dict.fromkeys(name for row in samples.values() for name in row)
    names = tuple(joints or known)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise DataError(f"'{path}' has no joint '{unknown[0]}'; valid are {', '.join(known)}")
    stamps = sorted(stamp for stamp, row in samples.items() if row.keys() >= set(names))
    if not stamps:
        raise DataError(f"'{path}': no message on '{full}' holds all of {', '.join(names)}")
    rows = [[samples[stamp][name] for name in names] for stamp in stamps]
    complete = all(speed is not None for row in rows for _, speed in row)
    values = np.array(rows, dtype=float)  # (m, n, 2)
    times = np.array([stamp - stamps[0] for stamp in stamps]) * 1e-9
    return Demonstration(times, values[..., 0], values[..., 1] if complete else None, None, names)
