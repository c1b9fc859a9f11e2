# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The stumbling reflex: a swinging foot that is held up by an obstacle is lifted over it.

Cats lift a paw higher when its back touches something while it swings (Forssberg 1979); with
oscillators as here it took robots over steps blind (Focchi et al. 2013; Ajallooeian et al. 2013).
The touch is felt by the joints: the foot has fallen behind its target along its way, further than
targets that act late would leave it, and stands still over the ground. That needs no contact
sensor. Where a sensor feels a touch as well, lateness is no explanation, and the ground is felt
from the middle of the swing: otherwise a hind foot that comes down on a step is pushed into it for
the rest of its swing, which throws the body up and forward. Angles and forces reach the legs with
the posture's feedback.

A foot that tripped yields at once, so that it neither pushes the body back nor is wedged by
friction, rises, and goes on when it is up. What comes too late in a swing to be cleared is cleared
by the next ones: for ``WARY`` swings the foot steps as high from the start.

A foot that comes down on something high stands still as well, above its target. It yields, too,
and its path comes back to the height of the others over the stance, so that it does not throw the
body up.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.transformation.foot_way import Way

FEELING = (0.3, 0.85)
"""Shares of the swing between which the foot feels what holds it up."""

STANDSTILL = 0.35
"""Speed over the ground, as a share of the swing's mean, below which a foot is held up."""

TOUCHING = 0.75
"""Share of the swing from which a foot may feel the ground under it."""

TOUCHED = 0.5
"""The same for a foot that a contact sensor says touches something."""

SETTLED = 0.6
"""Speed downwards, as a share of the mean, below which a foot that should come down has landed."""

LATENCY = 0.02
"""Time by which targets may act late without being taken for an obstacle [s]."""

HIGH = 0.65
"""Share of the swing up to which a foot that tripped stays raised."""

GENTLENESS = 8.0
"""Share of the additional height that is given back per second [1/s]; also in stance, for a foot
that comes down fast on something high throws the body up.
"""

RISEN = 0.7
"""Share of the additional height from which a foot that tripped goes on."""

QUICKNESS = 60.0
"""Rate at which the height goes to what is wanted [1/s]."""

FOLLOWING = 120.0
"""Rate at which the foot's speed is followed [1/s]."""

YIELDING = 40.0
"""Rate at which the target of a foot that yields goes to where the foot is [1/s]."""

WARY = 2
"""Swings after a stumble in which the foot steps higher from the start."""


@dataclass(frozen=True)
class Stumble:
    """What the reflex does to one foot.

    Attributes
    ----------
    tripped : bool
        Whether something held the foot up in this swing.
    landed : bool
        Whether it came down early in this swing.
    yields : bool
        Whether the foot yields now instead of following its path.
    wary : int
        Number of swings, with the present one, in which the foot steps higher from the start.
    up : bool
        Whether the foot that tripped has been raised.
    height : float
        Additional height that acts now [m].
    rate : float
        Its mean rate over the last tick [m/s].
    way : Way or None
        Of the swinging foot at the last tick; None in stance.
    speed, sinking : float
        Its speed over the ground, and downwards in the base, followed [m/s].
    """

    tripped: bool = False
    landed: bool = False
    yields: bool = False
    wary: int = 0
    up: bool = False
    height: float = 0.0
    rate: float = 0.0
    way: Way | None = None
    speed: float = 0.0
    sinking: float = 0.0


def stumble_step(
    before: Stumble, way: Way | None, lift: float, threshold: float, dt: float
) -> Stumble:
    """Advance the reflex of one foot.

    Parameters
    ----------
    before : Stumble
        One tick before.
    way : Way or None
        Of a swinging foot; None in stance.
    lift : float
        Additional height of a foot that has tripped [m].
    threshold : float
        Distance from its target at which a foot that stands still has tripped or landed [m].
    dt : float
        Time since the last tick [s].

    Returns
    -------
    Stumble
    """
    if dt <= 0.0:
        return before
    if way is None:
        return _in_stance(before, lift, dt)
    last = before.way
    if last is None:  # the foot has time to set off
        return Stumble(wary=before.wary, height=before.height, way=way, speed=way.swing_speed)
    share = 1.0 - exp(-FOLLOWING * dt)
    moved = (way.place - last.place) / dt + way.body_speed
    speed = before.speed + share * (moved - before.speed)
    sinking = before.sinking + share * ((last.level - way.level) / dt - before.sinking)
    above, late = way.level - way.target_level, 0.0 if way.touches else LATENCY / dt
    tripped = before.tripped or (
        not before.landed
        and FEELING[0] < way.swung < FEELING[1]
        and speed < STANDSTILL * way.swing_speed
        and way.target_place - way.place > max(
            threshold + late * max(0.0, way.target_place - last.target_place), 2.0 * above)
    )
    landed = before.landed or (
        way.swung > (TOUCHED if way.touches else TOUCHING)
        and sinking < SETTLED * way.sinking_speed
        and above > threshold + late * max(0.0, last.target_level - way.target_level)
    )
    height, up = before.height, before.up or before.height >= RISEN * lift
    if tripped and not landed and (not up or way.swung < HIGH):
        height = lift + (height - lift) * exp(-QUICKNESS * dt)
    elif not landed:
        height = max(0.0, height - GENTLENESS * lift * dt)
    yields = landed or (tripped and not up)
    return Stumble(tripped, landed, yields, before.wary, up, height,
                   (height - before.height) / dt, way, speed, sinking)


def _in_stance(before: Stumble, lift: float, dt: float) -> Stumble:
    """What is left of a swing: wariness, and a height that is given back gently."""
    if before.way is None and before.rate == 0.0:
        return before
    height = max(0.0, before.height - GENTLENESS * lift * dt)
    wary = before.wary
    if before.way is not None:
        wary = WARY if before.tripped else max(0, wary - 1)
    return Stumble(wary=wary, height=height, rate=(height - before.height) / dt)


def yielding(stumble: Stumble, shift_rate: Triple, velocity: Triple, away: Triple) -> Triple:
    """Rate of the shift of a swinging foot's path [m/s].

    Parameters
    ----------
    stumble : Stumble
        What the reflex does.
    shift_rate : tuple of float
        Rate without it [m/s].
    velocity : tuple of float
        Of the foot's path, against which the shift of a foot that yields works [m/s].
    away : tuple of float
        Where the foot is relative to its target [m].
    """
    if not stumble.yields:
        return shift_rate
    x, y, z = (YIELDING * a - v for a, v in zip(away, velocity, strict=True))
    return x, y, z if stumble.landed else shift_rate[2]
