# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""JointState messages as one table: columns by name, rows by stamp."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FIELDS = ('position', 'velocity', 'effort')


class NamedValues:
    """Collects JointState messages and lays them out by name.

    Messages of several publishers that each bear some of the names (the four legs on
    ``joint_targets``) are merged where their stamps agree.
    """

    def __init__(self) -> None:
        """Start empty."""
        self._messages: dict[tuple[str, ...], tuple[list[int], list[Any]]] = {}

    def add(self, stamp_ns: int, message: Any) -> None:
        """Take one message."""
        stamps, messages = self._messages.setdefault(tuple(message.name), ([], []))
        stamps.append(stamp_ns)
        messages.append(message)

    def table(self, names: Sequence[str]) -> tuple[Array, dict[str, Array]]:
        """Lay the values out.

        Parameters
        ----------
        names : sequence of str
            The k columns; other names in the messages are ignored.

        Returns
        -------
        time : ndarray (n,)
            Increasing stamps [s].
        values : dict of ndarray (n, k)
            ``position``, ``velocity`` and ``effort``; NaN where no message held a value. Of
            messages with one stamp and one name the last counts.
        """
        column = {name: index for index, name in enumerate(names)}
        groups = {
            held: group for held, group in self._messages.items() if column.keys() & set(held)
        }
        all_stamps = np.unique(
            np.concatenate(
                [
                    np.array([], dtype=np.int64),
                    *(np.array(stamps) for stamps, _ in groups.values()),
                ]
            )
        )
        values = {name: np.full((len(all_stamps), len(names)), np.nan) for name in FIELDS}
        for held, (stamps, messages) in groups.items():
            rows = np.searchsorted(all_stamps, stamps)
            sources = [index for index, name in enumerate(held) if name in column]
            columns = [column[held[index]] for index in sources]
            for name in FIELDS:
                block = _block([getattr(message, name) for message in messages], len(held))
                values[name][rows[:, None], columns] = block[:, sources]
        return all_stamps / 1e9, values


def _block(arrays: list[Any], width: int) -> Array:
    """Rows of equal width; a message may leave a field out, which makes a row of NaN."""
    missing = np.full(width, np.nan)
    return np.array([array if len(array) == width else missing for array in arrays], dtype=float)
