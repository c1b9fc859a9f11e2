# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many messages of one type at once: their numbers lie at the same bytes in most of them.

Of messages of one length, those whose texts and lengths of arrays equal those of the first have
their numbers where it has them. So one message is decoded field by field, and of all others that
are like it the columns of a table of bytes are taken.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype

from dmp_cpg_ros.analysis.bag import STORE, message_of
from dmp_cpg_ros.core.maths import Array

BODY = 4
"""A message begins behind the bytes that say how it is encoded."""

SIZES = {'bool': 'u1', 'octet': 'u1', 'byte': 'u1', 'char': 'u1',
         **{f'{"u" * (k == "u")}int{8 * n}': f'{k}{n}' for k in 'iu' for n in (1, 2, 4, 8)},
         'float32': 'f4', 'float64': 'f8'}
"""Types of NumPy by those of ROS."""


@dataclass(frozen=True)
class Alike:
    """Messages that differ in their numbers only.

    Attributes
    ----------
    rows : ndarray (n,)
        Which of those that were given they are, in this order.
    first : message
        The first of them.
    """

    rows: NDArray[np.int64]
    first: Any
    _bytes: NDArray[np.uint8]
    _fields: dict[str, tuple[int, str, int]]

    def has(self, field: str) -> bool:
        """Whether there is a field of numbers of this name."""
        return field in self._fields

    def numbers(self, field: str) -> Array:
        """Values of a field such as ``twist.linear.x``: (n, k) of k in each message, k = 1 for one
        number.
        """
        at, kind, count = self._fields[field]
        size = count * int(kind[-1])
        return np.ascontiguousarray(self._bytes[:, at : at + size]).view(kind)


def alike(raws: Sequence[bytes], kind: str) -> Iterator[Alike]:
    """Sort messages of a type into groups of those that are alike; leaves out what is no message.

    Parameters
    ----------
    raws : sequence of bytes
        Serialized messages.
    kind : str
        Their type.
    """
    lengths: dict[int, list[int]] = defaultdict(list)
    for row, raw in enumerate(raws):
        lengths[len(raw)].append(row)
    for length, of_length in lengths.items():
        rows = np.array(of_length)
        table = np.frombuffer(b''.join(raws[row] for row in of_length), np.uint8).reshape(
            len(rows), length)
        while len(rows):
            raw = table[0].tobytes()
            first = message_of(raw, kind)
            if first is None:
                table, rows = table[1:], rows[1:]
                continue
            layout = _Layout(raw)
            layout.walk(kind, '')
            same = (table[:, layout.fixed] == table[0, layout.fixed]).all(axis=1)
            yield Alike(rows[same], first, table if same.all() else table[same], layout.fields)
            table, rows = table[~same], rows[~same]


class _Layout:
    """Where the numbers of a message lie, and which bytes say so.

    Attributes
    ----------
    fields : dict of str to (int, str, int)
        Offset, type and count of the numbers of each field.
    fixed : list of int
        Bytes that other messages with this layout share.
    """

    def __init__(self, raw: bytes) -> None:
        self._raw, self._at, self._order = raw, BODY, '<' if raw[1] & 1 else '>'
        self.fields: dict[str, tuple[int, str, int]] = {}
        self.fixed = [0, 1]

    def walk(self, kind: str, path: str) -> None:
        """Walk through a message of a type."""
        for name, (node, what) in STORE.fielddefs[kind][1]:
            if node in (Nodetype.NAME, Nodetype.BASE):
                self._value(node, what, path + name)
                continue
            (inner, of), count = what
            if node == Nodetype.SEQUENCE:
                count = self._count()
            if inner == Nodetype.BASE and of[0] in SIZES:
                self._numbers(SIZES[of[0]], count, path + name)
            else:
                for number in range(count):
                    self._value(inner, of, f'{path}{name}.{number}')

    def _value(self, node: Nodetype, what: Any, path: str) -> None:
        if node == Nodetype.NAME:
            self.walk(what, f'{path}.')
        elif what[0] in SIZES:
            self._numbers(SIZES[what[0]], 1, path)
        else:
            count = self._count()
            self.fixed += range(self._at, self._at + count)
            self._at += count

    def _numbers(self, kind: str, count: int, path: str) -> None:
        size = int(kind[-1])
        if count:
            self._at += (BODY - self._at) % size
        self.fields[path] = self._at, self._order + kind, count
        self._at += size * count

    def _count(self) -> int:
        self._numbers('u4', 1, '')
        begin, kind, _ = self.fields.pop('')
        self.fixed += range(begin, self._at)
        return int(np.frombuffer(self._raw[begin : self._at], kind)[0])

