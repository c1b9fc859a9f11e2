# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``JointState`` messages as arrays, by name.

Values pass bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.messages.cdr import RefilledMessage, SerializedDraft, SerializedJointState
from dmp_cpg_ros.nodes.messages.values import Array, checked, sensed

FIELDS = ('position', 'velocity', 'effort')
"""The arrays of a ``JointState``."""


class NameOrder:
    """Puts the entries of messages into our order, by name.

    Parameters
    ----------
    names : sequence of str
        Names in our order; messages may hold more.
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Remember the order; the last list of names that was seen is cached."""
        self.names = list(names)
        self._seen: list[str] = list(names)
        self._index: NDArray[np.intp] | None = None

    def index(self, names: list[str]) -> NDArray[np.intp] | None:
        """Where our entries are in a message with these names; None when its order is ours.

        Raises
        ------
        DataError
            If a name is missing or doubled.
        """
        if names == self._seen:
            return self._index
        places = {name: place for place, name in enumerate(names)}
        missing = [name for name in self.names if name not in places]
        if missing or len(places) != len(names):
            problem = f"lack {', '.join(missing)}" if missing else 'are not unique'
            raise DataError(f"names {names} {problem}; needed are {', '.join(self.names)}")
        self._index = None if names == self.names else np.array(
            [places[name] for name in self.names], dtype=np.intp)
        self._seen = list(names)
        return self._index


class JointStateReader:
    """Reads some arrays of ``JointState`` messages.

    Parameters
    ----------
    names : sequence of str
        Names in our order.
    fields : sequence of str
        Which of ``position``, ``velocity``, ``effort`` are needed.
    strict : bool
        Whether numbers that cannot be are refused; else they are NaN, and the caller judges them.
    """

    def __init__(
        self, names: Sequence[str], fields: Sequence[str], *, strict: bool = True
    ) -> None:
        """Remember what is needed."""
        self._order, self._fields = NameOrder(names), tuple(fields)
        self._strict = strict

    def read(self, message: JointState | SerializedJointState) -> list[Array]:
        """Arrays (n,) of the needed fields in our order; raises DataError."""
        names = message.name
        index, size = self._order.index(names), len(names)
        if index is None and self._strict and isinstance(message, SerializedJointState):
            found = [message.checked(field) for field in self._fields]
            if all(values.shape[0] == size for values in found):
                return found
        arrays = []
        for field in self._fields:
            values = np.frombuffer(getattr(message, field)) if size else np.empty(0)
            if values.shape[0] != size:
                raise DataError(f'{field} has {values.shape[0]} entries for {size} names')
            if index is not None:
                values = values[index]
            arrays.append(checked(values, field) if self._strict else sensed(values))
        return arrays


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

    def __init__(self, names: Sequence[str], fields: Sequence[str], frame: str = '') -> None:
        """Lay the message out."""
        self._names, self._fields = tuple(names), tuple(fields)
        self._lay_out(frame)

    def fill(self, time_ns: int, *values: Array, frame: str | None = None) -> SerializedJointState:
        """Refill the message.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        *values : ndarrays
            One per field, of any shape, entries in the order of the names.
        frame : str, optional
            Frame of the header from now on.

        Returns
        -------
        SerializedJointState

        Raises
        ------
        DataError
            If a number is not finite: nothing of that kind leaves a node.
        """
        if frame is not None and frame != self._frame:
            self._lay_out(frame)
        return self._like.refilled(self._message.filled(time_ns, [
            checked(new.reshape(-1), field).tobytes()
            for new, field in zip(values, self._fields, strict=True)]), time_ns)

    def _lay_out(self, frame: str) -> None:
        self._frame, draft, places = frame, SerializedDraft(), []
        draft.text(frame)
        draft.count(len(self._names))
        for name in self._names:
            draft.text(name)
        for field in FIELDS:
            number = len(self._names) if field in self._fields else 0
            draft.count(number)
            if number:
                places.append(draft.doubles(number))
        self._message = RefilledMessage(draft, places)
        self._like = SerializedJointState(bytes(draft.data))
