# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``joint_targets``: what a leg asks of its joints; ``drive_mode``: whether the drive follows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from std_msgs.msg import String

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import (
    JOINT_NAMES,
    JOINTS_OF_LEG,
    LEGS,
    JointTargets,
    LegTargets,
)
from dmp_cpg_ros.nodes.messages import cdr
from dmp_cpg_ros.nodes.messages.joint_states import AnyJoints, JointStateReader, JointStateWriter

DRIVE_MODES = ('following', 'stand', 'lie', 'damp')
"""What ``drive_mode`` can say."""


def joints_of(leg: str, names: Sequence[str]) -> tuple[str, ...]:
    """Names of one leg's joints out of those of all."""
    first = len(JOINTS_OF_LEG) * LEGS.index(leg)
    return tuple(names[first:first + len(JOINTS_OF_LEG)])


class JointTargetsWriter:
    """Writes the ``joint_targets`` of one leg, with its own out of the names of all joints."""

    def __init__(self, leg: str, names: Sequence[str] = JOINT_NAMES) -> None:
        """Lay the message of a leg out."""
        self._writer = JointStateWriter(joints_of(leg, names))

    def fill(self, time_ns: int, targets: LegTargets) -> cdr.SerializedJointState:
        """Refill with the targets of the leg's joints; raises DataError."""
        return self._writer.fill(time_ns, *np.array(targets))


class JointTargetsReader:
    """Reads ``joint_targets`` of whichever leg sent them.

    Attributes
    ----------
    leg_of : dict of str to str
        Leg of each joint by its name.
    """

    def __init__(self, names: Sequence[str] = JOINT_NAMES) -> None:
        """Prepare the order of the joints of every leg."""
        self._names = names
        self._readers = {leg: JointStateReader(joints_of(leg, names)) for leg in LEGS}
        self.leg_of = {name: leg for leg in LEGS for name in joints_of(leg, names)}

    def read(self, message: AnyJoints) -> tuple[str, JointTargets]:
        """Name of the leg and its targets; raises DataError, also for names of no leg."""
        names = message.name
        leg = self.leg_of.get(names[0], '') if names else ''
        if not leg or len(names) != len(JOINTS_OF_LEG):
            raise DataError(f"names {names} must be the {len(JOINTS_OF_LEG)} joints of one leg of "
                            f"{', '.join(LEGS)}, such as {', '.join(self._names[:3])}")
        return leg, JointTargets(*self._readers[leg].read(message))


def read_drive_mode(message: String) -> str:
    """Mode in ``drive_mode``; raises DataError when it is none."""
    if message.data not in DRIVE_MODES:
        raise DataError(
            f"drive mode '{message.data[:40]}' must be one of {', '.join(DRIVE_MODES)}")
    return str(message.data)
