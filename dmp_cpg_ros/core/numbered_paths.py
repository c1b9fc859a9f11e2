# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names for what must not replace what is there already."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from pathlib import Path


def numbered(path: Path) -> Iterator[Path]:
    """A path, then the same with ``_1``, ``_2``, … at its end, without an end."""
    yield path
    for number in count(1):
        yield path.with_name(f'{path.name}_{number}')


def first_free(path: Path) -> Path:
    """The first of :func:`numbered` that does not exist."""
    return next(name for name in numbered(path) if not name.exists())
