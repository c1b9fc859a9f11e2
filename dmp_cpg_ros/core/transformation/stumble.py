# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The stumbling reflex: a swinging foot that is held up by an obstacle is lifted over it.

Cats lift a paw higher when its back touches something while it swings (Forssberg 1979); with
oscillators as here it took robots over steps blind (Focchi et al. 2013; Ajallooeian et al. 2013).
The touch is felt by the joints: the foot has fallen behind its target along its path, further than
targets that act late would leave it, and stands still over the ground. That needs no contact
sensor. Where a sensor feels a touch as well, lateness is no explanation, and the ground is felt
from the middle of the swing: otherwise a hind foot that comes down on a step is pushed into it for
the rest of its swing, which throws the body up and forward. Angles and forces reach the legs with
the posture's feedback.

A foot that tripped yields at once, so that it neither pushes the body back nor is wedged by
friction, rises, and goes on when it is up. What comes too late in a swing to be cleared is cleared
by the next ones: for ``POST_STUMBLE_SWINGS`` swings the foot steps as high from the start. A foot
that trips in one of them has met something higher, and steps higher again, up to ``HIGHEST``
lifts.

Over rough ground a foot may be held up again when it goes on: it meets the edge. It yields again,
along its way only, and comes down. What holds it is in front of it while it is farther behind its
target than above it, for friction lifts less than it holds back; beyond that it stands there, and
has landed. One that was driven on against an edge threw the body up with twice its weight.

A foot that comes down on something high stands still as well, above its target. It yields, too,
and its path comes back to the height of the others over the stance, so that it does not throw the
body up.
"""

from __future__ import annotations

from math import exp, hypot, pi
from typing import NamedTuple

from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.transformation.foot_path import LOWERING, FootPath

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

COMPLIANCE = 40.0
"""Rate at which the target of a compliant foot goes to where the foot is [1/s]."""

SLOWEST = 0.02
"""Speed of the body over a foot below which the foot feels nothing [m/s]."""

POST_STUMBLE_SWINGS = 2
"""Swings after a stumble in which the foot steps higher from the start."""

HIGHEST = 2
"""Additional heights by which a foot steps higher that trips again and again."""

CLEARING = 0.15
"""By how much a swing is higher than what is known to be in the way, in lengths of the leg."""

HIGHEST_SWING = 0.45
"""Height of the highest swing over rough ground, what a foot that has tripped adds included, in
lengths of the leg. With the longer legs of rough ground a foot comes 0.63 l over the others: one
that comes up 0.7 l makes the body fall off more often than it climbs.
"""

LEAST_LIFT = 0.1
"""Share of what a foot that has tripped adds that is left where swings are that high."""


class SwingProgress(NamedTuple):
    """How far a swinging foot has come, along the direction in which the body moves over it.

    Attributes
    ----------
    swung : float
        Share of the swing that has passed, in [0, 1).
    place, level : float
        Measured position along that direction, and height, in the base [m].
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


def swing_progress(path: FootPath, swung: float, foot: Triple, target: Triple,
                   touches: bool = False) -> SwingProgress | None:
    """Swing progress of a foot; None where the body hardly moves over it.

    Parameters
    ----------
    path : FootPath
        Of the foot.
    swung : float
        Share of the swing that has passed.
    foot, target : tuple of float
        Measured and wanted position in the base [m].
    touches : bool
        Whether a contact sensor in the foot feels something.
    """
    x, y, _ = path.foothold_in_base
    along, across = path.v_x - path.gamma * y, path.v_y + path.gamma * x
    body_speed = hypot(along, across)
    if body_speed < SLOWEST:
        return None
    along, across, swing = along / body_speed, across / body_speed, 1.0 - path.duty
    return SwingProgress(
        swung, along * foot[0] + across * foot[1], foot[2], along * target[0] + across * target[1],
        target[2], body_speed, body_speed / swing,
        path.clearance * path.omega / (2.0 * pi * swing * LOWERING), touches)


class Stumble(NamedTuple):
    """State of the stumbling reflex of one foot.

    Attributes
    ----------
    tripped : bool
        Whether something held the foot up in this swing.
    landed : bool
        Whether it came down early in this swing.
    compliant : bool
        Whether the foot yields now instead of following its path.
    post_stumble : int
        Number of swings, with the present one, in which the foot steps higher from the start.
    up : bool
        Whether the foot that tripped has been raised.
    height : float
        Additional height that acts now [m].
    rate : float
        Its mean rate over the last tick [m/s].
    progress : SwingProgress or None
        Of the swinging foot at the last tick; None in stance.
    speed, sinking : float
        Its speed over the ground, and downwards in the base, followed [m/s].
    lifts : int
        Additional heights by which these swings are higher.
    """

    tripped: bool = False
    landed: bool = False
    compliant: bool = False
    post_stumble: int = 0
    up: bool = False
    height: float = 0.0
    rate: float = 0.0
    progress: SwingProgress | None = None
    speed: float = 0.0
    sinking: float = 0.0
    lifts: int = 0


def stumble_step(before: Stumble, progress: SwingProgress | None, lift: float, threshold: float,
                 dt: float, rough: bool = False) -> Stumble:
    """Advance the reflex of one foot.

    Parameters
    ----------
    before : Stumble
        One tick before.
    progress : SwingProgress or None
        Of a swinging foot; None in stance.
    lift : float
        Additional height of a foot that has tripped [m].
    threshold : float
        Distance from its target at which a foot that stands still has tripped or landed [m].
    dt : float
        Time since the last tick [s].
    rough : bool
        Whether the ground is known to be uneven: a foot that touches something in the second half
        of its swing, has not tripped in it and is not held up, has then landed.

    Returns
    -------
    Stumble
    """
    if dt <= 0.0:
        return before
    if progress is None:
        return _in_stance(before, lift, dt)
    last = before.progress
    if last is None:  # the foot has time to set off
        return Stumble(post_stumble=before.post_stumble, height=before.height,
                       progress=progress, speed=progress.swing_speed, lifts=before.lifts)
    share = 1.0 - exp(-FOLLOWING * dt)
    moved = (progress.place - last.place) / dt + progress.body_speed
    speed = before.speed + share * (moved - before.speed)
    sinking = before.sinking + share * ((last.level - progress.level) / dt - before.sinking)
    above, late = progress.level - progress.target_level, 0.0 if progress.touches else LATENCY / dt
    tripped = before.tripped or (
        not before.landed
        and FEELING[0] < progress.swung < FEELING[1]
        and speed < STANDSTILL * progress.swing_speed
        and progress.target_place - progress.place > max(
            threshold + late * max(0.0, progress.target_place - last.target_place), 2.0 * above))
    came_down = (
        progress.swung > (TOUCHED if progress.touches else TOUCHING)
        and sinking < SETTLED * progress.sinking_speed
        and above > threshold + late * max(0.0, last.target_level - progress.target_level)) or (
        rough and progress.touches and not tripped and progress.swung > TOUCHED)
    held_up = rough and progress.target_place - progress.place > max(threshold, above)
    landed = before.landed or (came_down and not held_up)
    height, up = before.height, before.up or before.height >= RISEN * lift
    if tripped and not landed and (not up or progress.swung < HIGH):
        height = lift + (height - lift) * exp(-QUICKNESS * dt)
    elif not landed:
        height = max(0.0, height - GENTLENESS * lift * dt)
    compliant = landed or (tripped and not (up and not (held_up and progress.touches)))
    return Stumble(tripped, landed, compliant, before.post_stumble, up, height,
                   (height - before.height) / dt, progress, speed, sinking, before.lifts)


def _in_stance(before: Stumble, lift: float, dt: float) -> Stumble:
    """What is left of a swing: the swings to step higher in, and a height given back gently."""
    if before.progress is None and before.rate == 0.0:
        return before
    height = max(0.0, before.height - GENTLENESS * lift * dt)
    post_stumble, lifts = before.post_stumble, before.lifts
    if before.progress is not None:
        post_stumble = POST_STUMBLE_SWINGS if before.tripped else max(0, post_stumble - 1)
        lifts = min(lifts + before.tripped, HIGHEST) if post_stumble else 0
    return Stumble(post_stumble=post_stumble, height=height, rate=(height - before.height) / dt,
                   lifts=lifts)


def compliant_offset_rate(stumble: Stumble, offset_rate: Triple, velocity: Triple,
                          away: Triple) -> Triple:
    """Rate of the foothold offset of a swinging foot's path [m/s].

    Parameters
    ----------
    stumble : Stumble
        What the reflex does.
    offset_rate : tuple of float
        Rate without it [m/s].
    velocity : tuple of float
        Of the foot's path, against which the shift of a compliant foot works [m/s].
    away : tuple of float
        Where the foot is relative to its target [m].
    """
    if not stumble.compliant:
        return offset_rate
    x, y, z = (COMPLIANCE * a - v for a, v in zip(away, velocity, strict=True))
    return x, y, z if stumble.landed else offset_rate[2]


def swing_clearance(clearance: float, lift: float, stumble: Stumble, rough: float,
                    leg_length: float) -> float:
    """Height of a swing [m].

    Parameters
    ----------
    clearance, lift : float
        Height on even ground, and what a foot that has tripped adds to it [m].
    stumble : Stumble
        What the reflex does.
    rough : float
        Height of what is known to be in the way of all feet [m]; 0 on even ground.
    leg_length : float
        l [m].
    """
    higher = clearance + lift * stumble.lifts
    if not rough:
        return higher
    return max(clearance, min(
        max(higher, rough + CLEARING * leg_length), HIGHEST_SWING * leg_length))


def lift_left(lift: float, path: FootPath, rough: float, leg_length: float) -> float:
    """What a foot that has tripped adds to the height of its path [m]; arguments as of
    :func:`swing_clearance`.
    """
    if not rough:
        return lift
    return max(LEAST_LIFT * lift, min(lift, HIGHEST_SWING * leg_length - path.clearance))
