# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a swinging foot is on its way, and where it should be."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, pi

from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.transformation.foot_path import LOWERING, FootPath

SLOWEST = 0.02
"""Speed of the body over a foot below which the foot feels nothing [m/s]."""


@dataclass(frozen=True)
class Way:
    """Where a swinging foot is on its way, in the direction in which the body is to go over it.

    Attributes
    ----------
    swung : float
        Share of the swing that has passed, in [0, 1).
    place, level : float
        Measured place along the way, and height, in the base [m].
    target_place, target_level : float
        The same of its target [m].
    body_speed : float
        Speed of the body over this foot [m/s].
    swing_speed, sinking_speed : float
        Mean speed of the swing over the ground, and mean speed with which it comes down [m/s].
    touches : bool
        Whether a contact sensor in the foot feels something.
    """

    swung: float
    place: float
    level: float
    target_place: float
    target_level: float
    body_speed: float
    swing_speed: float
    sinking_speed: float
    touches: bool = False


def way_of(
    path: FootPath, swung: float, foot: Triple, target: Triple, touches: bool = False
) -> Way | None:
    """Way of a swinging foot; None where the body hardly moves over it.

    Parameters
    ----------
    path : FootPath
        Of the foot.
    swung : float
        Share of the swing that has passed.
    foot, target : tuple of float
        Measured and wanted place in the base [m].
    touches : bool
        Whether a contact sensor in the foot feels something.
    """
    x, y, _ = path.foothold_in_base
    along, across = path.v_x - path.gamma * y, path.v_y + path.gamma * x
    body_speed = hypot(along, across)
    if body_speed < SLOWEST:
        return None
    along, across, swing = along / body_speed, across / body_speed, 1.0 - path.duty
    return Way(
        swung,
        along * foot[0] + across * foot[1],
        foot[2],
        along * target[0] + across * target[1],
        target[2],
        body_speed,
        body_speed / swing,
        path.clearance * path.omega / (2.0 * pi * swing * LOWERING),
        touches,
    )
