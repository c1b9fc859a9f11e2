# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motion library: the robot's named configurations, and the whole-body movements between them.

Configurations between lying and standing come from the legs' geometry alone. The feet stay on the
ground: at base height h a foot's centre is at z = r − h in ``base_link``. The stance has the feet
below the hips. Near the ground a leg cannot fold far enough for that, so the feet go outwards
(abduction), and behind the hips where abduction does not suffice, by as little as the fully folded
leg needs.

A robot on its side or back rolls over. *Lower* is the side on which it lies, or over which it
rolls:

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

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import asin, atan2, cos, hypot, sin, sqrt

import numpy as np

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.learning.discrete import learn_discrete
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, minimum_jerk
from dmp_cpg_ros.core.primitives.discrete import DiscretePrimitive
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.transformation.leg import body_scale, nominal_foothold

LegPosture = tuple[float, float, float]

LIMIT_MARGIN = 0.08
"""Distance that goals keep from the joint limits [rad]."""

LARGEST_BEND = 2.65
"""Angle between thigh and shank beyond which a leg would fold into itself [rad]."""

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

BASES = 15
"""Number of basis functions; the unit movement is met within 2e-4 of its length."""


@cache
def unit_movement() -> DiscretePrimitive:
    """Movement 0 → 1 in a unit of time with least jerk."""
    return learned(minimum_jerk(np.linspace(0.0, 1.0, PATH_SAMPLES))[:, None])


def phase_at(share: float) -> float:
    """Phase x of the canonical system when a share of a movement's duration has passed."""
    return float(np.exp(-unit_movement().phase_decay * share))


def learned(path: Array) -> DiscretePrimitive:
    """Primitive of a path (m, n) that takes a unit of time."""
    return learn_discrete(Demonstration(np.linspace(0.0, 1.0, len(path)), path), BASES)


def time_unit(description: RobotDescription) -> float:
    """√(l/g), in which durations are told [s]."""
    return sqrt(body_scale(description).leg_length / GRAVITY)


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

    def posture(self, share: float, begin: Array) -> Array:
        """Joint angles (12,) of a movement that began at others [rad], after a share of its
        duration.
        """
        gone = min(max(share, 0.0), 1.0)
        if self.path is not None:
            return self.path[round(gone * (len(self.path) - 1))]
        return begin + float(minimum_jerk(np.array(gone))) * (self.goal - begin)


class Movements:
    """All movements of one robot, by name.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Derive the postures."""
        self.time_unit = unit = time_unit(description)
        self.pause = PAUSE * unit
        shares = minimum_jerk(np.linspace(0.0, 1.0, PATH_SAMPLES))
        rise = raised_postures(description, shares)
        tucked = _posture(description, 'left', TUCKED, TUCKED)
        lying, standing = lying_posture(description), standing_posture(description)
        movements = [
            Movement('rise', standing, RISE * unit, rise, (0.0, 1.0)),
            Movement('lower', lying, RISE * unit, rise[::-1].copy(), (1.0, 0.0)),
            Movement('fold', lying, FOLD * unit), Movement('tuck', tucked, TUCK * unit)]
        movements += [
            Movement(f'{name}_{side}', _posture(description, side, upper, lower), duration * unit)
            for name, (upper, lower, duration) in ROLLING.items() for side in SIDES]
        self._by_name = {movement.name: movement for movement in movements}

    def named(self, name: str) -> Movement:
        """Movement of a name; raises DataError that lists the valid names."""
        if name not in self._by_name:
            raise DataError(
                f"there is no movement '{name}'; valid are {', '.join(self._by_name)}")
        return self._by_name[name]

    def duration(self, names: tuple[str, ...]) -> float:
        """Time that movements take one after the other, pauses included [s]."""
        return sum(self.named(name).duration + self.pause for name in names)


def _posture(description: RobotDescription, lower_side: str, upper: LegPosture, lower: LegPosture
             ) -> Array:
    """Posture (12,) with one leg posture on the lower side and another on the upper."""
    return np.concatenate([
        leg_angles(leg, *(lower if leg.name[1] == lower_side[0] else upper))
        for leg in description.legs])


def standing_posture(description: RobotDescription) -> Array:
    """Joint angles (12,) of the gait's stance: every foot at its nominal foothold [rad]."""
    return np.concatenate([
        within_limits(leg, LegKinematics(leg).inverse(nominal_foothold(description, leg.name)))
        for leg in description.legs])


def lying_posture(description: RobotDescription) -> Array:
    """Joint angles (12,) of a robot on its belly, legs folded, soles at the ground [rad]."""
    return raised_posture(description, 0.0)


def raised_posture(description: RobotDescription, share: float) -> Array:
    """Joint angles (12,) at a share of the way from lying to standing [rad]."""
    return np.array(raised_postures(description, (share,))[0])


def raised_postures(description: RobotDescription, shares: Sequence[float] | Array) -> Array:
    """Joint angles on the way from lying to standing.

    The height rises linearly with the share, and the feet slide from beside the hips to their
    footholds mostly while the body is low and little loads them.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    shares : sequence of m floats
        0: on the belly; 1: standing.

    Returns
    -------
    ndarray (m, 12)
        [rad]
    """
    low, high = description.belly_depth, description.stance_height
    angles = []
    for leg in description.legs:
        kinematics, foot = LegKinematics(leg), nominal_foothold(description, leg.name)
        x, y, _ = foot.tolist()
        aside_x, aside_y, _ = (_lying_foot(leg, low) - foot).tolist()
        feet = [(x + (1.0 - share) ** 2 * aside_x, y + (1.0 - share) ** 2 * aside_y,
                 leg.foot_radius - (low + (high - low) * share)) for share in shares]
        angles.append(within_limits(leg, np.array([kinematics.angles(at) for at in feet])))
    return np.hstack(angles)


def within_limits(leg: LegGeometry, angles: Array) -> Array:
    """Clip a leg's angles (..., 3) to its joint limits less ``LIMIT_MARGIN`` [rad]."""
    return np.clip(angles, leg.position_lower + LIMIT_MARGIN, leg.position_upper - LIMIT_MARGIN)


def folded_length(leg: LegGeometry) -> float:
    """Distance from hip joint to foot with the knee bent as far as its limits allow [m]."""
    kinematics = LegKinematics(leg)
    a, b = kinematics.thigh_length, kinematics.shank_length
    lengths = [sqrt(a * a + b * b + 2.0 * a * b * cos(LARGEST_BEND))]
    for knee in (leg.position_lower[2] + LIMIT_MARGIN, leg.position_upper[2] - LIMIT_MARGIN):
        turn = leg.axis_sign[2] * knee
        c, s = cos(turn), sin(turn)
        x = leg.thigh[0] + c * leg.shank[0] + s * leg.shank[2]
        z = leg.thigh[2] + c * leg.shank[2] - s * leg.shank[0]
        lengths.append(hypot(float(x), float(z)))
    return max(lengths[0], min(lengths[1:]))


def _lying_foot(leg: LegGeometry, height: float) -> Array:
    """Foot of a folded leg at the ground beside (or behind) its hip, in ``base_link``."""
    kinematics = LegKinematics(leg)
    side = 1.0 if kinematics.lateral_offset >= 0.0 else -1.0
    lateral, length = abs(kinematics.lateral_offset), folded_length(leg)
    down = length - float(leg.hip_offset[2])  # of the foot below the abduction axis, in the plane
    z = leg.foot_radius - height - float(leg.hip_in_base[2])
    radius = hypot(lateral, down)
    outward = atan2(down, lateral) + asin(min(max(z / radius, -1.0), 1.0))
    limit = min(abs(leg.position_lower[0]), abs(leg.position_upper[0])) - LIMIT_MARGIN
    behind = 0.0
    if outward > limit:
        outward = limit
        down = (lateral * sin(outward) - z) / cos(outward)
        reach = down + float(leg.hip_offset[2])
        behind = sqrt(max(length * length - reach * reach, 0.0))
    y = lateral * cos(outward) + down * sin(outward)
    x = float(leg.hip_in_base[0] + leg.hip_offset[0]) - behind
    return np.array((x, float(leg.hip_in_base[1]) + side * y, leg.foot_radius - height))


def leg_angles(leg: LegGeometry, outward: float, hip: float, bend: float) -> Array:
    """Joint angles of a leg by what they mean, within its limits.

    Parameters
    ----------
    leg : LegGeometry
        The leg.
    outward : float
        Abduction away from the middle of the body for a leg that hangs down [rad].
    hip : float
        How far the thigh is swung from straight down towards where the knee points [rad].
    bend : float
        Angle between the directions of thigh and shank; 0: straight [rad].

    Returns
    -------
    ndarray (3,)
        Abduction, hip, knee [rad].
    """
    side = 1.0 if LegKinematics(leg).lateral_offset >= 0.0 else -1.0
    thigh_zero = atan2(-float(leg.thigh[0]), -float(leg.thigh[2]))
    shank_zero = atan2(-float(leg.shank[0]), -float(leg.shank[2]))
    thigh = -leg.knee_sign * hip - thigh_zero  # about +y: the knee points against its bend
    shank = leg.knee_sign * bend - shank_zero + thigh_zero
    return within_limits(leg, leg.axis_sign * np.array((side * outward, thigh, shank)))
