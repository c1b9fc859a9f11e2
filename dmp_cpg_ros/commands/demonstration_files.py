# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Demonstrations from files: CSV, NumPy and rosbag2 recordings."""

from __future__ import annotations

import csv
import io
import math
import zipfile
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from dmp_cpg_ros.analysis import bag
from dmp_cpg_ros.analysis.loading import table_of
from dmp_cpg_ros.analysis.topics import AT_ONCE, Block, Topic
from dmp_cpg_ros.core.errors import DataError, DmpCpgError, MissingFileError
from dmp_cpg_ros.core.parameters import shown
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.files import readable
from dmp_cpg_ros.strict_yaml import naming

_TIME_NAMES = ('t', 'time', 'time_s', 'timestamp', 'stamp')
_ARRAYS = {'positions': '', 'velocities': '_velocity', 'accelerations': '_acceleration'}
_JOINT_STATE = 'sensor_msgs/msg/JointState'

LARGEST_TABLE, LARGEST_ARRAY = 2**24, 2**25
"""Longest CSV file and largest array that are read [B]."""

LARGEST_VALUE = 1e12
"""Largest number in a demonstration."""


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
    with naming(path):
        return _read(path, joints, topic, start, end)


def _read(path: Path, joints: Sequence[str], topic: str, start: float | None, end: float | None
          ) -> Demonstration:
    if not path.exists():
        raise MissingFileError(f"'{path}' does not exist; name a CSV, .npy or .npz file or a bag")
    suffix = path.suffix.lower()
    if suffix == '.csv':
        whole = _from_csv(readable(path))
    elif suffix in ('.npy', '.npz'):
        whole = _from_numpy(readable(path))
    elif path.is_dir() or suffix in ('.mcap', '.db3'):
        whole = _from_bag(path, topic, joints)
    else:
        raise DataError(f"'{path}' is of no known kind; valid are .csv, .npy, .npz and bags")
    _check_joints(path, joints, whole.names)
    names = tuple(joints) or whole.names
    columns = [whole.names.index(name) for name in names] if names else slice(None)
    for values in (whole.times, *(getattr(whole, field) for field in _ARRAYS)):
        if values is not None and not np.abs(values).max(initial=0.0) <= LARGEST_VALUE:
            raise DataError(f'{np.abs(values).max():.3g} is no number of a movement; valid are '
                            f'numbers up to {LARGEST_VALUE:g}')
    since = whole.times - whole.times[0]
    rows = (since >= (start or 0.0)) & (since <= (np.inf if end is None else end))
    if not np.any(rows):
        raise DataError(f'no sample is between {start or 0.0:g} s and '
                        f'{since[-1] if end is None else end:g} s; it lasts {since[-1]:g} s')
    parts: dict[str, Any] = {field: values[rows][:, columns] for field in _ARRAYS
                             if (values := getattr(whole, field)) is not None}
    return replace(whole, times=whole.times[rows], names=names, **parts)


def _check_joints(path: Path, joints: Iterable[str], known: Collection[str]) -> None:
    for name in joints:
        if name not in known:
            valid = ', '.join(known) or 'none, for the file names no joints'
            raise DataError(f"'{path}' has no joint '{name}'; valid are {valid}")


def _check_named_once(path: Path, names: Sequence[str]) -> None:
    """Raise DataError for a name that is empty or stands twice: its numbers would be no one's."""
    for place, name in enumerate(names):
        if not name:
            raise DataError(f"'{path}' has no name for column {place + 1}; every column needs one")
        if name in names[:place]:
            raise DataError(f"'{path}' names two columns {shown(name)}; every column needs a name "
                            'of its own')


def _from_csv(path: Path) -> Demonstration:
    """Columns by name: time, NAME, and NAME_velocity, NAME_acceleration where they exist."""
    try:
        text = _bytes(path.open('rb'), LARGEST_TABLE).decode('utf-8-sig')
        rows = [row for row in csv.reader(text.splitlines()) if ''.join(row).strip()]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"'{path}' cannot be read as text: {error}") from error
    if not rows:
        raise DataError(f"'{path}' is empty; its first column must be time [s]")
    try:
        np.array(rows[0], dtype=float)
        header = ['time', *(f'joint_{i}' for i in range(1, len(rows[0])))]
    except ValueError:
        header, rows = [cell.strip() for cell in rows[0]], rows[1:]
    _check_named_once(path, header)
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
    derived = {base + ending for base in columns for ending in _ARRAYS.values() if ending}
    names = tuple(name for name in columns if name not in derived)
    parts: dict[str, Any] = {
        field: np.stack([columns[name + ending] for name in names], axis=1)
        for field, ending in _ARRAYS.items() if all(name + ending in columns for name in names)}
    return Demonstration(data[:, 0], **parts, names=names)


def _from_numpy(path: Path) -> Demonstration:
    """Arrays that are no larger than they say, and hold numbers or names."""
    try:
        if not zipfile.is_zipfile(path):
            table = _array(path.open('rb'))
            if table.ndim != 2 or table.shape[1] < 2 or table.dtype.kind == 'U':
                raise DataError(
                    f"'{path}' must hold an array (m, 1 + n) with the time [s] in its first "
                    f'column, not one of shape {table.shape}')
            return Demonstration(table[:, 0], table[:, 1:])
        with zipfile.ZipFile(path) as archive:
            held = {name: f'{name}.npy' for name in ('times', *_ARRAYS, 'names')
                    if f'{name}.npy' in archive.namelist()}
            arrays: dict[str, Any] = {name: _array(archive.open(file))
                                      for name, file in held.items()}
    except DmpCpgError:
        raise
    except Exception as error:
        raise DataError(
            f"'{path}' is no NumPy file of plain arrays: {error or 'it ends early'}") from error
    for needed in ('times', 'positions'):
        if needed not in arrays:
            raise DataError(f"'{path}' has no array '{needed}'; needed are times, positions, "
                            'possible velocities, accelerations, names')
    names = tuple(map(str, arrays.pop('names', np.array([])).ravel()))
    _check_named_once(path, names)
    return Demonstration(**arrays, names=names)


def _array(file: IO[bytes]) -> NDArray[Any]:
    """One array; nothing is unpickled, and no memory is taken on a header's word."""
    data = io.BytesIO(_bytes(file, LARGEST_ARRAY))
    head = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    shape, _, kind = head[npy.read_magic(data)](data)
    size = math.prod(shape) * kind.itemsize
    if kind.kind not in 'biufU' or min(shape, default=0) < 0 or math.prod(shape) > LARGEST_ARRAY:
        raise DataError(f'an array of {kind} and shape {shape} is no demonstration; valid are '
                        'numbers, and words for names')
    if size != len(data.getvalue()) - data.tell():
        raise DataError(f'an array says that it has {size} bytes, and has '
                        f'{len(data.getvalue()) - data.tell()}')
    data.seek(0)
    array: NDArray[Any] = np.load(data, allow_pickle=False)
    return array


def _bytes(file: IO[bytes], most: int) -> bytes:
    with file:
        data = file.read(most + 1)
    if len(data) > most:
        raise DataError(f'it is larger than the {most / 2**20:g} MiB that are read')
    return data


def _from_bag(path: Path, topic: str, joints: Sequence[str]) -> Demonstration:
    """Positions by joint name at every stamp at which all wanted joints are known."""
    wanted = Topic('', ('position', 'velocity'))
    with bag.opened(bag.find_bag(path)) as reader:
        kinds = {c.topic: c.msgtype for c in reader.connections}
        full = next((t for t in kinds if t == topic or t.endswith('/' + topic.lstrip('/'))), None)
        usable = sorted(t for t, kind in kinds.items() if kind == _JOINT_STATE)
        if full is None or full not in usable:
            raise DataError(f"'{path}' has no topic '{topic}' of joint states; valid are "
                            f'{", ".join(usable) or "none in this bag"}')
        chosen = [c for c in reader.connections if c.topic == full]
        messages = bag.recorded(reader, chosen)
        while some := list(islice(messages, AT_ONCE)):
            _, times, raws = zip(*some, strict=True)
            wanted.take(full, _JOINT_STATE, times, raws)
    bag.warn_of(wanted.skipped)
    known = dict.fromkeys(name for names, _ in wanted.blocks for name in names)
    names = tuple(joints or known)
    _check_joints(path, names, known)
    _begin_at_zero([block for blocks in wanted.blocks.values() for block in blocks.all()])
    time, positions, velocities = table_of(wanted, names)
    rows = ~np.isnan(positions).any(axis=1)
    if not names or not rows.any():
        raise DataError(f"'{path}': no message on '{full}' holds all of {', '.join(names)}")
    time, positions, velocities = time[rows], positions[rows], velocities[rows]
    complete = not np.isnan(velocities).any()
    return Demonstration(
        time - time[0], positions, velocities if complete else None, None, names)


def _begin_at_zero(blocks: Sequence[Block]) -> None:
    """Let stamps, or record times where there are none, begin at zero: as seconds since 1970 they
    would be rounded.
    """
    for block in blocks:
        np.copyto(block.stamp, block.bag_ns, where=block.stamp == 0)
    first = min((block.stamp.min() for block in blocks), default=0)
    for block in blocks:
        block.stamp[:] -= first
