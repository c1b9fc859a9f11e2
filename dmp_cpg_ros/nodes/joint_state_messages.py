# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``JointState`` messages as arrays, by name.

Writers keep one message and refill its arrays, because building a message costs more than all
else. Values pass bit for bit.
"""

from __future__ import annotations

import array
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.message_values import Array, checked, set_stamp

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
        Whether numbers that are not finite are refused; else the caller judges them.
    """

    def __init__(
        self, names: Sequence[str], fields: Sequence[str], *, strict: bool = True
    ) -> None:
        """Remember what is needed."""
        self._order, self._fields = NameOrder(names), tuple(fields)
        self._strict = strict

    def read(self, message: JointState) -> list[Array]:
        """Arrays (n,) of the needed fields in our order; raises DataError."""
        names = message.name
        index, size = self._order.index(names), len(names)
        arrays = []
        for field in self._fields:
            values = np.frombuffer(getattr(message, field)) if size else np.empty(0)
            if values.shape[0] != size:
                raise DataError(f'{field} has {values.shape[0]} entries for {size} names')
            if index is not None:
                values = values[index]
            arrays.append(checked(values, field) if self._strict else values)
        return arrays


class JointStateWriter:
    """One ``JointState`` message whose arrays are refilled.

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
        """Build the message; values are zero until the first fill."""
        self.message = JointState(name=list(names))
        self.message.header.frame_id = frame
        self._fields = tuple(fields)
        self._views: list[Array] = []
        for field in self._fields:
            setattr(self.message, field, array.array('d', bytes(8 * len(names))))
            self._views.append(np.frombuffer(getattr(self.message, field)))

    def fill(self, time_ns: int, *values: Array) -> JointState:
        """Refill the message.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        *values : ndarrays
            One per field, of any shape, entries in the order of the names.

        Returns
        -------
        JointState
            The same message at every call.

        Raises
        ------
        DataError
            If a number is not finite: nothing of that kind leaves a node.
        """
        for view, new, field in zip(self._views, values, self._fields, strict=True):
            view[:] = checked(new.reshape(-1), field)
        set_stamp(self.message.header.stamp, time_ns)
        return self.message
