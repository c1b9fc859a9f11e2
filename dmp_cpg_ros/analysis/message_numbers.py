# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers out of messages."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.recording import StatusEvent

Array = NDArray[np.float64]
Rows = tuple[list[int], list[list[float]]]


def stamp_ns(stamp: Any) -> int:
    """Stamp as whole nanoseconds."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def xyz(vector: Any) -> tuple[float, float, float]:
    """First three components of a vector, point or quaternion."""
    return vector.x, vector.y, vector.z


def twist(message: Any) -> list[float]:
    """Return v_x, v_y and γ of a Twist."""
    return [message.linear.x, message.linear.y, message.angular.z]


def events(message: Any) -> dict[str, StatusEvent]:
    """Statuses of a DiagnosticArray by name."""
    time = stamp_ns(message.header.stamp) / 1e9
    return {
        status.name: StatusEvent(
            time, int(status.level), status.message,
            {pair.key: pair.value for pair in status.values})
        for status in message.status
    }


def stacked(rows: Rows, width: int) -> tuple[Array, Array]:
    """Rows in the order of their stamps; of rows with one stamp the last counts."""
    stamps = np.array(rows[0], dtype=np.int64)
    values = np.array(rows[1], dtype=float).reshape(-1, width)
    _, last = np.unique(stamps[::-1], return_index=True)
    keep = len(stamps) - 1 - last
    return stamps[keep] / 1e9, values[keep]


def robot_clock(bag_ns: list[int], clock: tuple[list[int], list[int]]) -> list[int]:
    """Stamps on the robot's clock for messages whose own stamps are not of it.

    The bag's record time may be wall time: each message gets the stamp of the tick that was
    recorded last before it. A bag without ticks keeps its own time.
    """
    if not bag_ns or not clock[0]:
        return bag_ns
    before = np.searchsorted(np.array(clock[0]), np.array(bag_ns), side='right') - 1
    return [clock[1][max(index, 0)] for index in before]
