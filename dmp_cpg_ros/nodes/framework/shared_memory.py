# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shared memory that Fast DDS leaves behind where a process is killed.

Each participant has a segment of half a megabyte in ``/dev/shm`` and removes it when it is
destroyed. Nobody else does, so that it stays for good where a node dies. Its port and the mutex of
that, a tenth of the size, are not touched: the next participant of the domain takes their names.
"""

from __future__ import annotations

import fcntl
import os
import re
import time
from collections import defaultdict
from pathlib import Path

FOLDER = Path('/dev/shm')

SEGMENT = re.compile(r'(fast(?:rtps|dds)_[0-9a-f]{16})(_el)?')
"""A segment, of a name that nobody has twice, and the file that its owner holds locked."""

NEW_S = 5.0
"""Age below which a file may be of a participant that has not locked it yet [s]."""


def remove_left_behind(folder: Path = FOLDER) -> list[str]:
    """Remove what no living process has locked or mapped.

    Parameters
    ----------
    folder : Path
        Where shared memory is.

    Returns
    -------
    list of str
        Names of the files that were removed.
    """
    groups = defaultdict[str, list[Path]](list)
    if folder.is_dir():
        for path in folder.iterdir():
            if found := SEGMENT.fullmatch(path.name):
                groups[found[1]].append(path)
    mapped = _mapped(folder) if groups else set()
    return [path.name for paths in groups.values() if mapped.isdisjoint(paths)
            for path in _removed(sorted(paths))]


def _removed(paths: list[Path]) -> list[Path]:
    """Remove a segment and its lock, if both are there, ours, old, and without an owner."""
    if len(paths) != 2:
        return []
    try:
        if any(path.stat().st_ctime > time.time() - NEW_S for path in paths):
            return []
        with paths[1].open('rb') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            for path in paths:
                path.unlink(missing_ok=True)
    except OSError:  # locked, of another user, or gone meanwhile
        return []
    return paths


def _mapped(folder: Path) -> set[Path]:
    """Files of a folder that a process of this user has mapped."""
    found = set[Path]()
    for maps in Path('/proc').glob('[0-9]*/maps'):
        try:
            lines = maps.read_text(encoding='utf-8', errors='replace').splitlines()
        except OSError:  # of another user, or ended
            continue
        found.update(Path(line[line.index(str(folder)):]) for line in lines
                     if f' {folder}{os.sep}' in line)
    return found
