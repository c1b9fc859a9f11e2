# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a joint is asked for at most: its limits of angle, speed and torque, and no jumps."""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.robot_model.description import LegGeometry
from dmp_cpg_ros.core.robot_model.state import LegTargets


class TargetLimits:
    """Keeps the targets of one leg within the limits of its joints, whatever they come from.

    Parameters
    ----------
    leg : LegGeometry
        The leg.
    rate : float
        Largest speed of a target angle from tick to tick over the joint's own limit.
    """

    def __init__(self, leg: LegGeometry, rate: float) -> None:
        """Keep the limits as numbers: nearly always none is reached."""
        self._leg, self._rate = leg, rate
        self._each = list(zip(*(limit.tolist() for limit in (
            leg.position_lower, leg.position_upper, leg.velocity_limit, leg.torque_limit)),
            strict=True))

    def limited(self, targets: LegTargets, last: LegTargets | None, dt: float) -> LegTargets:
        """The targets, or the nearest that the joints can have; the same object where they can.

        Parameters
        ----------
        targets : LegTargets
            A number that is not finite stays so.
        last : LegTargets or None
            What was sent one tick before; after None there is no jump.
        dt : float
            Time since then [s].
        """
        position, velocity, effort = targets
        before, step = (last.position, self._rate * dt) if last else (position, 0.0)
        for i, (low, high, speed, torque) in enumerate(self._each):
            at = position[i]
            if not (low <= at <= high and -speed <= velocity[i] <= speed
                    and -torque <= effort[i] <= torque
                    and -step * speed <= at - before[i] <= step * speed):
                break
        else:
            return targets
        leg, place = self._leg, np.array(position)
        if last:
            way = step * leg.velocity_limit
            place = np.clip(place, last.position - way, last.position + way)
        return LegTargets(
            np.clip(place, leg.position_lower, leg.position_upper).tolist(),
            np.clip(velocity, -leg.velocity_limit, leg.velocity_limit).tolist(),
            np.clip(effort, -leg.torque_limit, leg.torque_limit).tolist())
