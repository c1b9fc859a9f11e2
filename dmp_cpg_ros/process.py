# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a process asks of Python, the C library and Linux for itself: when it ends, what it is
called, whose parent it becomes, which memory it gives back, and when it looks for garbage.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import os
from collections.abc import Sequence
from pathlib import Path

_PR_SET_PDEATHSIG, _PR_SET_NAME, _PR_SET_CHILD_SUBREAPER = 1, 15, 36
"""Options of prctl(2)."""

YOUNG_OBJECTS = 20_000
"""New objects after which the garbage collector looks for cycles; Python's own figure is 700."""

_M_MMAP_THRESHOLD = -3
"""Option of mallopt(3)."""


def end_with_parent(number: int) -> None:
    """Get a signal when the thread that is the parent of this process ends. Linux only."""
    _prctl(_PR_SET_PDEATHSIG, number)


def adopt_orphans() -> None:
    """Become the parent of what descendants leave behind when they end. Linux only."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def show_name(name: str) -> None:
    """Let ``ps`` and ``top`` show a name, or its first 15 bytes. Linux only."""
    _prctl(_PR_SET_NAME, name.encode()[:15])


def show_command(words: Sequence[str]) -> None:
    """Let ``ps`` show a command line, as far as there is room, in the place of this program's."""
    with contextlib.suppress(OSError, ValueError):
        status = Path('/proc/self/stat').read_text(encoding='utf-8')
        begin, end = map(int, status.rpartition(')')[2].split()[45:47])
        if begin:
            shown = b'\0'.join(map(os.fsencode, words))[:end - begin - 1]
            ctypes.memmove(begin, shown.ljust(end - begin, b'\0'), end - begin)


def _prctl(option: int, value: int | bytes) -> None:
    ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def give_back_memory(size: int) -> None:
    """Give blocks back to the system when they are freed, where the C library is that of GNU.

    It otherwise learns from the largest one to keep as much and some more for ever.

    Parameters
    ----------
    size : int
        From which size on [bytes].
    """
    # another C library has no such function, and Windows none by this name
    with contextlib.suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, size)


def collect_seldom() -> None:
    """Look for garbage now, keep what is left, and look seldom from now on: the collector would go
    through it in the midst of a tick or a verdict, which leave no cycles behind.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(YOUNG_OBJECTS)
