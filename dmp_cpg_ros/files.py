# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files that a user names: what can be read or written to its end, and what takes the place of
another one only when it is whole.
"""

from __future__ import annotations

import glob
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

from dmp_cpg_ros.core.errors import MissingFileError

_PROCESSES = Path('/proc')
"""Where Linux has a folder for every process that runs."""

_FOLDER, _PIPE = 'is a folder', 'is a pipe'
_KINDS = ((stat.S_ISDIR, _FOLDER), (stat.S_ISFIFO, _PIPE), (stat.S_ISSOCK, 'is a socket'),
          (stat.S_ISCHR, 'is a device'), (stat.S_ISBLK, 'is a device'))


def other_than_file(path: str | Path) -> str:
    """What a path is that is no file, such as ``is a folder``; empty where there is nothing."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return ''
    return next((kind for holds, kind in _KINDS if holds(mode)), '')


def readable(path: str | Path) -> Path:
    """Path of a file that a user names, which is about to be read to its end.

    A pipe without a writer is waited for, and a device such as ``/dev/zero`` has no end.

    Parameters
    ----------
    path : str or Path
        Need not exist: to open it then fails by itself.

    Raises
    ------
    MissingFileError
        If it is, or links to, a folder, a pipe, a socket or a device.
    """
    if kind := other_than_file(path):
        raise MissingFileError(f"'{path}' {kind}, not a file")
    return Path(path)


def writable(path: str | Path) -> Path:
    """Path that a user names, which is about to be written.

    What is open already may be: ``/dev/stdout``, also into a pipe, and the shell's ``>(...)``.

    Parameters
    ----------
    path : str or Path
        Need not exist.

    Raises
    ------
    MissingFileError
        If it is, or links to, a folder, or a pipe by name: to open that waits for a reader.
    """
    kind = other_than_file(path)
    if kind == _FOLDER or kind == _PIPE and os.path.exists(os.path.realpath(path)):
        raise MissingFileError(f"'{path}' {kind}, not a file to write")
    return Path(path)


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """File to write that takes the place of a path when it is whole; what is there stays until
    then. What is no file, such as ``/dev/stdout``, is written itself; errors are as of
    :func:`writable`. What a process that was killed has left of the same file is removed.
    """
    path = writable(path)
    if path.exists() and not path.is_file():
        yield path
        return
    path = path.resolve()
    new = path.with_name(f'.{os.getpid()}.{path.name}')  # its ending may say what it is to be
    _remove_left(path)
    try:
        yield new
        os.replace(new, path)
    finally:
        new.unlink(missing_ok=True)


def _remove_left(path: Path) -> None:
    """Remove what processes that do not run any more have begun instead of a file."""
    for left in path.parent.glob(f'.*.{glob.escape(path.name)}'):
        writer = left.name[1:-len(path.name) - 1]
        if writer.isdecimal() and _PROCESSES.is_dir() and not (_PROCESSES / writer).exists():
            left.unlink(missing_ok=True)


def numbered(path: Path) -> Iterator[Path]:
    """A path, then the same with ``_1``, ``_2``, … at its end, without an end."""
    yield path
    for number in count(1):
        yield path.with_name(f'{path.name}_{number}')


def first_free(path: Path) -> Path:
    """The first of :func:`numbered` that does not exist."""
    return next(name for name in numbered(path) if not name.exists())
