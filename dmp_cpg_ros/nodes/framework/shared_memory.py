# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shared memory that Fast DDS leaves behind where a process is killed.

Each participant has a segment and a port with a mutex in ``/dev/shm``, and removes them when it
is destroyed. Nobody else does, so that every node that dies leaves half a megabyte for good.
"""

from __future__ import annotations

import fcntl
import os
import re
import time
from collections import defaultdict
from contextlib import ExitStack
from pathlib import Path

FOLDER = Path('/dev/shm')

OF_FAST_DDS = re.compile(
    r'(?:sem\.)?(fast(?:rtps|dds)_(?:port\d+|[0-9a-f]{16}))(?:_el|_sl|_mutex)?')
"""Files of one participant; the group is what they have in common."""

LOCKS = ('_el', '_sl')
"""Ends of the files that its owner holds locked."""

NEW_S = 1.0
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
            if found := OF_FAST_DDS.fullmatch(path.name):
                groups[found[1]].append(path)
    mapped = _mapped(folder) if groups else set()
    return [path.name for paths in groups.values() if mapped.isdisjoint(paths)
            for path in _removed(paths)]


def _removed(paths: list[Path]) -> list[Path]:
    """Remove the files of a participant, if it has no owner any more and they are ours."""
    with ExitStack() as held:
        try:
            if any(path.stat().st_ctime > time.time() - NEW_S
                   for path in paths if path.name.endswith(LOCKS)):
                return []
            for path in paths:
                if path.name.endswith(LOCKS):
                    lock = held.enter_context(path.open('rb'))
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
