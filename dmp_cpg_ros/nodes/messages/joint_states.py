# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``JointState`` messages as arrays, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.messages.cdr import FIELDS, RefilledMessage, SerializedJointState
from dmp_cpg_ros.nodes.messages.values import Array, checked, sensed

AnyJoints: TypeAlias = JointState | SerializedJointState
"""As rclpy reads it, or as this package does."""


class JointStateReader:
    """Reads some arrays of ``JointState`` messages.

    Parameters
    ----------
    names : sequence of str
        Names in our order; messages may hold more.
    fields : sequence of str
        Which of ``position``, ``velocity``, ``effort`` are needed.
    strict : bool
        Whether numbers that cannot be are refused; else they are NaN, and the caller judges them.
    """

    def __init__(
        self, names: Sequence[str], fields: Sequence[str] = FIELDS, *, strict: bool = True
    ) -> None:
        """Remember what is needed; the order of the last list of names that was seen is cached."""
        self._names, self._fields, self._strict = list(names), tuple(fields), strict
        self._seen: list[str] = list(names)
        self._index: NDArray[np.intp] | None = None

    def read(self, message: AnyJoints) -> list[Array]:
        """Arrays (n,) of the needed fields in our order; raises DataError."""
        names = message.name
        size = len(names)
        if names != self._seen:
            self._index, self._seen = self._order_of(names), list(names)
        index = self._index
        if index is None and self._strict and isinstance(message, SerializedJointState):
            found = message.checked(self._fields)
            if all([len(values) == size for values in found]):
                return found
        arrays = []
        for field in self._fields:
            values = np.frombuffer(getattr(message, field)) if size else np.empty(0)
            if values.shape[0] != size:
                raise DataError(f'{field} has {values.shape[0]} entries for {size} names')
            values = values if index is None else values[index]
            arrays.append(checked(values, field) if self._strict else sensed(values))
        return arrays

    def _order_of(self, names: list[str]) -> NDArray[np.intp] | None:
        """Where our entries are in a message with these names; None when its order is ours."""
        places = {name: place for place, name in enumerate(names)}
        missing = [name for name in self._names if name not in places]
        if missing or len(places) != len(names):
            problem = f"lack {', '.join(missing)}" if missing else 'are not unique'
            raise DataError(f"names {names} {problem}; needed are {', '.join(self._names)}")
        return None if names == self._names else np.array(
            [places[name] for name in self._names], dtype=np.intp)


class JointStateWriter:
    """A ``JointState`` whose arrays are refilled.

    Parameters
    ----------
    names : sequence of str
        Names of the entries.
    fields : sequence of str
        Which of ``position``, ``velocity``, ``effort`` are filled; the others stay empty.
    frame : str
        Frame of the header.
    """

    def __init__(self, names: Sequence[str], fields: Sequence[str] = FIELDS, frame: str = ''
                 ) -> None:
        """Lay the message out."""
        self._message = RefilledMessage(frame)
        self._message.count(len(names))
        for name in names:
            self._message.text(name)
        for field in FIELDS:
            self._message.count(len(names) if field in fields else 0)
            if field in fields:
                self._message.refilled(**{field: len(names)})
        self._like = SerializedJointState(bytes(self._message.data))

    def fill(self, time_ns: int, *values: Array, sound: bool = True) -> SerializedJointState:
        """Refill the message.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        *values : ndarrays
            One per field, of any shape, entries in the order of the names.
        sound : bool
            Whether numbers that are not finite are refused.

        Raises
        ------
        DataError
            If a number is not finite.
        """
        data = self._message.filled(time_ns, *values, sound=sound)
        return self._like.refilled(data, time_ns, sound=sound)
