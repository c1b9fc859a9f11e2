# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much of the command a walking body that is disturbed follows.

The measure is the least margin m of the capture point in the support polygon
(:mod:`~dmp_cpg_ros.core.balance.capture_point`), of a leg of length l. While the robot walks as it
is to, it is above ``EASY`` q l in all gaits but at some of the limits of what is declared. Less
says that the body does not follow its reference: it was pushed, a foot has slipped, a gait is
changing, or what is asked is more than the gait can do. The steps that bring it back need the room
that speed takes, so the reference is given only the share

    s = (room − DISTURBED) / (EASY − DISTURBED)  in [LEAST, 1] ,    room = m/(q l)

of the command. It falls at once and grows by ``REGAIN`` again. q is 1 where feet of both sides
carry most of the time, and falls to ``NARROW`` for gaits that stand on one side, whose body sways
by itself. While a gait changes into one that was asked for, no more than :func:`changing_share` is
followed. In a stop and while a start is under way s is 1: their predictions depend on nothing of
the body.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from dmp_cpg_ros.core.gait.choice import Changing
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.transition import changing_speed
from dmp_cpg_ros.core.inhibition.push_recovery import PUSHED

DISTURBED, EASY = PUSHED, 2.0 * PUSHED
"""Margins at which the share is least and 1, in lengths of the leg: what standing legs can just
bear, and twice that.
"""

LEAST = 0.1
"""Least share: with none a robot that is held, or wrong about its speed, would not move again."""

CLIMBING = 0.8
"""Least share on ground that is known to be rough: on steps the feet stand where the ground lets
them, the margins are small by that, and a body that does not go on falls back from them.
"""

STRIDING = 1.0
"""Least share where gaps are counted on: a body that brakes falls over the leg that hangs in one,
and slow feet step into every gap.
"""

OUTWARD = ((1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0))
"""Directions out of the support over its edges: front, right, rear, left."""

TRAILING = 0.5
"""Cosine between an edge's direction and the way's opposite from which the edge lies behind: to
slow down does not help who falls back. Over the other edges bodies fall from hills, which feel
like gaps where they are round and like steps where they are hollow.
"""

NARROW = 0.5
"""q of a gait that stands on one side only."""

REGAIN = 1.0
"""Rate at which the share grows again [1/s]: a cycle or two to test what has been given back."""


def room(margins: Sequence[float] | None, leg_length: float, wide: float) -> float | None:
    """Least margin of the capture point, in q l.

    Parameters
    ----------
    margins : sequence of four floats, or None
        To the edges of the support polygon [m], where they are known.
    leg_length : float
        l [m].
    wide : float
        Of the gait: 1 where feet of both sides stand, 0 where one side stands alone.
    """
    if margins is None:
        return None
    q = NARROW + (1.0 - NARROW) * wide
    return min(margins) / (q * leg_length)


def falls(margins: Sequence[float] | None, r: Sequence[float]) -> bool:
    """Whether the capture point has left the support over an edge that the way does not leave
    behind; a body that goes on helps itself there no more.

    Parameters
    ----------
    margins : sequence of four floats, or None
        To the edges of the support polygon, where they are known [m].
    r : sequence of 3 float
        Reference v_x, v_y [m/s], γ [rad/s].
    """
    if margins is None or min(margins) >= 0.0:
        return False
    trailing = -TRAILING * hypot(r[0], r[1])
    return any(margin < 0.0 and x * r[0] + y * r[1] >= trailing
               for margin, (x, y) in zip(margins, OUTWARD, strict=True))


def least_share(rough: float, gaps: float, falling: bool) -> float:
    """Least share of the command that is followed on the ground that is felt, whose feet are to be
    lifted over ``rough`` and that counts on gaps for a way ``gaps`` [m], by a body that
    :func:`falls` or does not.
    """
    if falling:
        return LEAST
    return CLIMBING if rough else STRIDING if gaps else LEAST


def followed_share(share: float, left: float | None, dt: float, most: float = 1.0,
                   least: float = LEAST) -> float:
    """Share of the command after a tick of dt [s], in [least, 1], from the one before,
    :func:`room`, and the most and the least that may be followed.
    """
    regained = min(most, share + REGAIN * dt)
    if left is None:
        return regained
    return min(regained, max(least, (left - DISTURBED) / (EASY - DISTURBED)))


def changing_share(network: GaitNetwork, changing: Changing, command: tuple[float, float, float],
                   speed: float = 0.0) -> float:
    """Share of a command at which the gait in force becomes the one that is wanted; 1 when it is.
    One that was chosen is made at the speed of the reference, which gains none meanwhile.

    Parameters
    ----------
    network : GaitNetwork
        With the gait in force.
    changing : Changing
        Into which gait, and who chose it.
    command : tuple of float
        v_x, v_y [m/s], γ [rad/s].
    speed : float
        Foot speed of the reference [m/s].
    """
    (wanted, chosen), scale = changing, network.scale
    if network.gait.name == wanted.name:
        return 1.0
    most = scale.speed(changing_speed(network.gait, wanted, scale))
    asked = wanted.limiting_speed(command, scale)
    if asked <= most:
        return 1.0
    return min(1.0, max(most / asked, speed / scale.foot_speed(*command) if chosen else 0.0))
