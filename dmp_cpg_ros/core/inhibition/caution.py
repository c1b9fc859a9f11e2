# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much of the command a walking body that is disturbed or held up follows, and when it stops.

The measure is the least margin m of the capture point in the support polygon
(:mod:`~dmp_cpg_ros.core.balance.capture_point`), of a leg of length l. While the robot walks as it
is to, it is above ``EASY`` q l in all gaits but at some of the limits of what is declared. Less
says that the body does not follow its reference: it was pushed, a foot has slipped, a gait is
changing, or what is asked is more than the gait can do. The steps that bring it back need the room
that speed takes, so the reference is given only the share

    s = (room − DISTURBED) / (EASY − DISTURBED)  in [LEAST, 1] ,    room = m/(q l)

of the command. It falls at once and grows by ``REGAIN`` again. q is 1 where feet of both sides
carry most of the time, and falls to ``NARROW`` for gaits that stand on one side, whose body sways
by itself. In a stop and while a start is under way s is 1: their predictions depend on nothing of
the body.

A walk may also come to an obstacle that it does not cross. Nothing is seen: what the robot feels
is that it does not come ahead although its legs walk (:class:`Progress`).

- **Held.** The feet that lead the way come down short of their places, because something holds
  them up, and the body that goes on would fall over them. Where it comes on with less than
  ``SLUGGISH`` of the speed that is asked for, and the feet are behind beyond ``HELD`` lengths of
  the leg, less of the command is followed, down to the least at ``PINNED``: the body waits for its
  feet.
- **Blocked.** While it is asked to go at speed u, the body's way along the reference grows by
  ``STEP`` l again and again. Where it has not come farther than it once was while it was to go
  ``PATIENCE`` l, with u up to ``BRISK`` √(g l) counted, it is blocked: a stop is requested as the
  service does, with its prediction and its bound.

It stays stopped while the same is asked: a command within 60° of the way that was blocked does not
start the gait. The service does, a command that leads elsewhere (back, aside or a turn on the
spot), and any after a zero command, when the stop is as any automatic one.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot
from typing import NamedTuple

from dmp_cpg_ros.core.inhibition.push_recovery import PUSHED
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY

DISTURBED, EASY = PUSHED, 2.0 * PUSHED
"""Margins at which the share is least and 1, in lengths of the leg: what standing legs can just
bear, and twice that.
"""

LEAST = 0.1
"""Least share: with none a robot that is held, or wrong about its speed, would not move again."""

NARROW, WIDE_STANCE = 0.5, 0.75
"""q of a gait that stands on one side only, and the share of stance on both from which it is 1."""

REGAIN = 1.0
"""Rate at which the share grows again [1/s]: a cycle or two to test what has been given back."""


def room(margins: Sequence[float] | None, leg_length: float, two_sided: float) -> float | None:
    """Least margin of the capture point, in q l.

    Parameters
    ----------
    margins : sequence of four floats, or None
        To the edges of the support polygon [m], where they are known.
    leg_length : float
        l [m].
    two_sided : float
        Share of stance with feet of both sides on the ground, of the gait.
    """
    if margins is None:
        return None
    q = NARROW + (1.0 - NARROW) * min(1.0, two_sided / WIDE_STANCE)
    return min(margins) / (q * leg_length)


def followed_share(share: float, left: float | None, dt: float, most: float = 1.0) -> float:
    """Share of the command after a tick of dt [s], in [LEAST, 1], from the one before,
    :func:`room`, and the most that may be followed.
    """
    regained = min(most, share + REGAIN * dt)
    if left is None:
        return regained
    return min(regained, max(LEAST, (left - DISTURBED) / (EASY - DISTURBED)))


HELD, PINNED = 0.3, 0.5
"""How far the leading feet are behind where the body begins to wait for them, and where it waits,
in lengths of the leg; both are ``FASTER`` for every √(g l) of speed more, by which a body that is
only setting off is behind.
"""

FASTER = 0.1

MEAN = 15.0
"""Rate at which the means of what the feet are behind, and of the speed, follow [1/s]."""

SLUGGISH = 0.6
"""Share of the speed that is asked for beyond which the feet are not held: a body that runs ahead
downhill leaves its feet behind, too.
"""

STEP = 0.4
"""Way that counts as having come ahead, in lengths of the leg."""

PATIENCE = 3.5
"""Way that was asked for, without having come ahead, at which it is blocked, in lengths of the
leg.
"""

FIRM = 0.6
"""Way that was asked for while the leading feet were held, less that while they were not, at which
it is blocked, in lengths of the leg.
"""

SLOW, BRISK = 0.04, 0.15
"""Speeds in √(g l): below the first nothing is asked, beyond the second no more is counted."""

SAME_WAY = 0.5
"""Cosine between two directions that count as the same."""

Pair = tuple[float, float]


class Progress(NamedTuple):
    """How the body comes ahead.

    Attributes
    ----------
    velocity : tuple of float
        Of the body over the ground, ahead and to the left, less its planned sway [m/s].
    behind : float
        How far the feet that lead the way stand behind where the gait has them [m]; negative
        where they are ahead of it, 0 where none of them stands.
    """

    velocity: Pair = (0.0, 0.0)
    behind: float = 0.0


class BlockState(NamedTuple):
    """What an obstacle has done to the walk.

    Attributes
    ----------
    acts : bool
        Whether a stop is in force because of it.
    ahead : tuple of float
        Direction in which it was, in the base frame; (0, 0) where every command ends the stop.
    made : float
        Way made since the farthest place, at most 0 but for a part of a step [m].
    asked : float
        Way asked for since then [m].
    behind : float
        How far the leading feet are behind, in the mean [m].
    most : float
        Most of the command that a body with these feet may follow, in [LEAST, 1].
    pinned : float
        Way asked for while the leading feet were held, less that while they were not [m].
    comes : float
        Speed along the reference, in the mean [m/s].
    """

    acts: bool = False
    ahead: Pair = (0.0, 0.0)
    made: float = 0.0
    asked: float = 0.0
    behind: float = 0.0
    most: float = 1.0
    pinned: float = 0.0
    comes: float = 0.0

    def leads_there(self, command: tuple[float, float, float]) -> bool:
        """Whether a command (v_x, v_y, γ) leads to the obstacle."""
        v_x, v_y, _ = command
        along = v_x * self.ahead[0] + v_y * self.ahead[1]
        return along > SAME_WAY * hypot(v_x, v_y)


NO_BLOCK = BlockState()


def block_step(state: BlockState, r: Array, wanted: float, progress: Progress | None,
               leg_length: float, dt: float) -> BlockState:
    """Advance by one tick of a walk.

    Parameters
    ----------
    state : BlockState
        After the last tick.
    r : ndarray (3,)
        Reference v_x, v_y [m/s], γ [rad/s].
    wanted : float
        Speed that is asked for, of which the reference may follow a share [m/s].
    progress : Progress or None
        Of the body, where it is known.
    leg_length : float
        l [m].
    dt : float
        Time since the last tick [s].
    """
    v_x, v_y, _ = r.tolist()
    speed, froude = hypot(v_x, v_y), (GRAVITY * leg_length) ** 0.5
    if progress is None or wanted < SLOW * froude or speed == 0.0:
        return NO_BLOCK
    kept, ahead = exp(-MEAN * dt), (v_x / speed, v_y / speed)
    comes = progress.velocity[0] * ahead[0] + progress.velocity[1] * ahead[1]
    behind = progress.behind + (state.behind - progress.behind) * kept
    comes_on = comes + (state.comes - comes) * kept
    made, due = state.made + dt * comes, dt * min(wanted, BRISK * froude)
    asked = state.asked + due
    if made > STEP * leg_length:
        made = asked = 0.0
    far = behind / leg_length - FASTER * speed / froude
    if comes_on > SLUGGISH * wanted:
        far = 0.0
    most = min(1.0, max(LEAST, (PINNED - far) / (PINNED - HELD)))
    pinned = max(0.0, state.pinned + (due if far > HELD else -due))
    blocked = asked > PATIENCE * leg_length or pinned > FIRM * leg_length
    return BlockState(blocked, ahead, made, asked, behind, most, pinned, comes_on)
