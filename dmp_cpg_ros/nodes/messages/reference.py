# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``reference``: velocity and turn rate after the first-order reference system."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import TwistStamped

from dmp_cpg_ros.nodes.messages import cdr
from dmp_cpg_ros.nodes.messages.commands import read_twist
from dmp_cpg_ros.nodes.messages.robot_state import BASE_FRAME
from dmp_cpg_ros.nodes.messages.values import Array, checked_numbers


class ReferenceWriter:
    """Writes ``reference``."""

    def __init__(self) -> None:
        """Lay the message out."""
        self._message = cdr.RefilledMessage(BASE_FRAME)
        self._message.refilled(reference=6)
        self._numbers = np.zeros(6)

    def fill(self, time_ns: int, r: Array) -> cdr.SerializedTwist:
        """Refill with r = (v_x, v_y, γ), ndarray (3,); raises DataError when it is not finite."""
        self._numbers[:2], self._numbers[5] = r[:2], r[2]
        return cdr.SerializedTwist(self._message.filled(time_ns, self._numbers))


def read_reference(message: TwistStamped | cdr.SerializedTwist) -> Array:
    """Reference r = (v_x, v_y, γ), ndarray (3,) [m/s, m/s, rad/s]; raises DataError."""
    if isinstance(message, cdr.SerializedTwist):
        numbers = checked_numbers(message.numbers, 'velocity')
        return np.array((numbers[0], numbers[1], numbers[5]))
    return np.array(read_twist(message.twist))
