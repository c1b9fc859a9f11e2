# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole-body movements: goal postures, durations, and how much weight the legs then carry.

Standing up and lying down follow :func:`~dmp_cpg_ros.core.modes.postures.raised_posture`. A robot
on its
side or back rolls over. *Lower* is the side on which it lies, or over which it rolls:

- from the back, ``turn``: the thighs of the upper side swing up to the ground behind the back and
  press that side up, the lower legs fold out of the way; ``tip``: the upper legs stretch on to the
  far side, the lower ones away from the body, which falls over its lower side,
- from the side, ``push``: the legs of the lower side swing to the ground behind the back and turn
  the belly to the ground,
- ``over``: the upper legs fold away, and the body falls onto its belly.

Durations scale with √(l/g), l the standing height of the hips (dynamic similarity), so that one
table serves robots of any size.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.modes.postures import (
    leg_angles,
    lying_posture,
    raised_posture,
    standing_posture,
)
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.transformation.leg import body_scale

Array = NDArray[np.float64]
LegPosture = tuple[float, float, float]

SIDES = ('left', 'right')

TUCKED: LegPosture = (0.0, 1.3, 2.6)
HANGING: LegPosture = (0.0, 0.0, 0.9)
"""Counterweight on the belly's side."""
BEHIND: LegPosture = (-0.76, 2.77, 1.65)
BEHIND_FAR: LegPosture = (0.95, 3.4, 0.5)
"""Over the back: bent against the ground, and stretched on to the far side."""
FORWARDS: LegPosture = (-0.9, -0.5, 2.65)
AWAY: LegPosture = (-0.73, 0.0, 0.4)
"""Folded out of the way of the rolling body, and stretched away from it."""
BEHIND_OUTWARDS: LegPosture = (-0.9, 2.7, 0.9)
"""Over the back, and there swung down to the ground; outwards for a leg that points upwards."""

ROLLING: dict[str, tuple[LegPosture, LegPosture, float]] = {
    'turn': (BEHIND, FORWARDS, 3.0),
    'tip': (BEHIND_FAR, AWAY, 3.0),
    'push': (HANGING, BEHIND_OUTWARDS, 3.0),
    'over': (TUCKED, BEHIND_OUTWARDS, 2.4),
}
"""Postures (outward, hip, bend) [rad] of upper and lower legs, and duration in √(l/g)."""

RISE, FOLD, TUCK = 9.0, 6.0, 3.6
"""Durations in √(l/g)."""

MOVEMENT_NAMES = (
    'rise', 'lower', 'fold', 'tuck', *(f'{name}_{side}' for name in ROLLING for side in SIDES))
"""Names of all movements."""

PAUSE = 1.5
"""Rest after every movement in √(l/g)."""

PATH_SAMPLES = 101


@dataclass(frozen=True, eq=False)
class Movement:
    """One movement of all joints.

    Attributes
    ----------
    name : str
        Name in the table.
    goal : ndarray (12,)
        Posture at its end [rad].
    duration : float
        [s]
    path : ndarray (m, 12) or None
        Postures on the way, evenly spaced in time, when it is not straight in the joint angles.
    support : tuple of float
        Share of the robot's weight that the legs carry at the beginning and at the end.
    """

    name: str
    goal: Array
    duration: float
    path: Array | None = None
    support: tuple[float, float] = (0.0, 0.0)


class Movements:
    """All movements of one robot, by name.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Derive the postures."""
        self.time_unit = sqrt(body_scale(description).leg_length / GRAVITY)
        self.pause = PAUSE * self.time_unit
        shares = minimum_jerk(np.linspace(0.0, 1.0, PATH_SAMPLES))
        rise = np.array([raised_posture(description, share) for share in shares])
        tucked = _posture(description, 'left', TUCKED, TUCKED)
        lying, standing = lying_posture(description), standing_posture(description)
        unit = self.time_unit
        movements = [
            Movement('rise', standing, RISE * unit, rise, (0.0, 1.0)),
            Movement('lower', lying, RISE * unit, rise[::-1].copy(), (1.0, 0.0)),
            Movement('fold', lying, FOLD * unit),
            Movement('tuck', tucked, TUCK * unit),
        ]
        for name, (upper, lower, duration) in ROLLING.items():
            for side in SIDES:
                goal = _posture(description, side, upper, lower)
                movements.append(Movement(f'{name}_{side}', goal, duration * unit))
        self._by_name = {movement.name: movement for movement in movements}

    def named(self, name: str) -> Movement:
        """Movement of a name; raises DataError that lists the valid names."""
        try:
            return self._by_name[name]
        except KeyError:
            raise DataError(
                f"there is no movement '{name}'; valid are {', '.join(self._by_name)}"
            ) from None

    def duration(self, names: tuple[str, ...]) -> float:
        """Time that movements take one after the other, pauses included [s]."""
        return sum(self.named(name).duration + self.pause for name in names)


def minimum_jerk(share: Array) -> Array:
    """Smooth step 10 s³ − 15 s⁴ + 6 s⁵ of least jerk (Flash & Hogan 1985), s clipped to [0, 1]."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s * s))


def _posture(
    description: RobotDescription, lower_side: str, upper: LegPosture, lower: LegPosture
) -> Array:
    """Posture (12,) with one leg posture on the lower side and another on the upper."""
    angles = []
    for leg in description.legs:
        on_lower = (leg.name[1] == 'l') == (lower_side == 'left')
        angles.append(leg_angles(leg, *(lower if on_lower else upper)))
    return np.concatenate(angles)
