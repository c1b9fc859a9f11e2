# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``canonical_state`` and ``gait_memory``: the oscillators and the gait in force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dmp_cpg_ros import layouts
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits, shares_of
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.messages import cdr
from dmp_cpg_ros.nodes.messages.joint_states import AnyJoints, JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.messages.values import Array

_OSCILLATORS = slice(0, len(layouts.OSCILLATOR_ROWS))
_GAITS = slice(_OSCILLATORS.stop, None)


class CanonicalStateWriter:
    """Writes ``canonical_state``.

    Parameters
    ----------
    gaits : sequence of str
        Names of all gaits that are known.
    """

    def __init__(self, gaits: Sequence[str]) -> None:
        """Lay the message out."""
        self._gaits, rows = tuple(gaits), layouts.canonical_rows(gaits)
        self._writer = JointStateWriter(rows, cdr.FIELDS[:2])
        self._position, self._velocity = np.zeros((2, len(rows)))

    def fill(self, time_ns: int, x: Array, x_dot: Array, gait: GaitInForce,
             cadence_rate: float = 0.0) -> cdr.SerializedJointState:
        """Refill.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        x, x_dot : ndarray (4, 2)
            States and rates [1/s].
        gait : Gait or BlendedGait
            In which the phases are to be read.
        cadence_rate : float
            Rate of the factor on the cadence [1/s].

        Raises
        ------
        DataError
            If a number is not finite.
        """
        self._position[_OSCILLATORS] = x.reshape(-1)
        self._velocity[_OSCILLATORS] = x_dot.reshape(-1)
        self._position[_GAITS], self._velocity[_GAITS] = layouts.gait_rows(
            shares_of(gait), cadence_rate, self._gaits)
        return self._writer.fill(time_ns, self._position, self._velocity)


class CanonicalStateReader:
    """Reads ``canonical_state``.

    Parameters
    ----------
    gaits : KnownGaits
        All gaits that are known.
    """

    def __init__(self, gaits: KnownGaits) -> None:
        """Prepare the order."""
        rows = layouts.canonical_rows(gaits.gaits)
        self._gaits, self._names = gaits, rows[_GAITS]
        self._reader = JointStateReader(rows, cdr.FIELDS[:2])
        self._last: tuple[bytes, GaitInForce] | None = None

    def read(self, message: AnyJoints) -> tuple[Array, Array, GaitInForce]:
        """States x and rates ẋ [1/s], ndarrays (4, 2), and the gait in force, the same object
        while it stays; raises DataError.
        """
        position, velocity = self._reader.read(message)
        shares, rates = position[_GAITS], velocity[_GAITS]
        content = shares.tobytes() + rates.tobytes()
        if self._last is None or content != self._last[0]:
            given = layouts.read_gait_rows(self._names, shares.tolist(), rates.tolist())
            self._last = content, self._gaits.in_force(given)
        x, x_dot = (values[_OSCILLATORS].reshape(len(LEGS), 2) for values in (position, velocity))
        return x, x_dot, self._last[1]


class GaitMemoryWriter:
    """Writes ``gait_memory``.

    Parameters
    ----------
    gaits : sequence of str
        Names of all gaits that are known.
    """

    def __init__(self, gaits: Sequence[str]) -> None:
        """Lay the message out."""
        self._gaits = tuple(gaits)
        self._writer = JointStateWriter(
            (*layouts.canonical_rows(gaits), *layouts.REFERENCE_ROWS), cdr.FIELDS[:2])

    def fill(self, time_ns: int, x: Array, x_dot: Array, gait: GaitInForce, r: Array
             ) -> cdr.SerializedJointState:
        """Refill with what :class:`CanonicalStateReader` read, and r, ndarray (3,)."""
        shares, rates = layouts.gait_rows(shares_of(gait), 0.0, self._gaits)
        return self._writer.fill(time_ns, np.concatenate((x.ravel(), shares, r)),
                                 np.concatenate((x_dot.ravel(), rates, np.zeros(3))))


class GaitMemoryReader:
    """Reads ``gait_memory``.

    Parameters
    ----------
    gaits : KnownGaits
        All gaits that are known.
    """

    def __init__(self, gaits: KnownGaits) -> None:
        """Prepare the order."""
        self._canonical = CanonicalStateReader(gaits)
        self._r = JointStateReader(layouts.REFERENCE_ROWS, cdr.FIELDS[:1])

    def read(self, message: AnyJoints) -> tuple[Array, Array, GaitInForce, Array]:
        """States x and rates ẋ, ndarrays (4, 2), the gait in force, and r, ndarray (3,); raises
        DataError.
        """
        (r,) = self._r.read(message)
        return *self._canonical.read(message), r
