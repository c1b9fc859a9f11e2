# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a walking body that is held up waits, and when it stops.

A walk may come to an obstacle that it does not cross. Nothing is seen: what the robot feels
is that it does not come ahead although its legs walk (:class:`Progress`).

- **Held.** The feet that lead the way come down short of their places, because something holds
  them up, and the body that goes on would fall over them. Where it comes on with less than
  ``SLUGGISH`` of the speed that is asked for, and the feet are behind beyond ``HELD`` lengths of
  the leg, less of the command is followed, down to the least at ``PINNED``: the body waits for its
  feet.
- **Blocked.** While it is asked to go at speed u, the body's way along the reference grows by
  ``STEP`` l again and again. Where it has not come farther than it once was while it was to go
  ``PATIENCE`` l, with u up to ``BRISK`` √(g l) counted, it is blocked: a stop is requested as the
  service does, with its prediction and its bound; at once where a foot meets what is too high
  (:mod:`~dmp_cpg_ros.core.balance.terrain`).
  Where the legs' targets come too late to be followed, feet tell nothing (:class:`InTime`).

It stays stopped while the same is asked: a command within 60° of the way that was blocked does not
start the gait. The service does, a command that leads elsewhere (back, aside or a turn on the
spot), and any after a zero command, when the stop is as any automatic one.
"""

from __future__ import annotations

from math import exp, hypot
from typing import NamedTuple

from dmp_cpg_ros.core.clock import fresh
from dmp_cpg_ros.core.inhibition.caution import LEAST
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Pair

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

LATE_NS, SETTLES_NS = 80_000_000, 500_000_000
"""Age of what is heard of the gait, or time without, beyond which the legs' targets come too late
to be followed, and time for which it must have been less until feet tell of obstacles again [ns].
"""

SAME_WAY = 0.5
"""Cosine between two directions that count as the same."""

NO_WAY, FEET_HELD, TOO_HIGH = (
    'the body made no way', 'its leading feet were held up',
    'a foot met what is too high to be climbed')
"""Why a walk was stopped, in words for people."""


class Progress(NamedTuple):
    """How the body comes ahead.

    Attributes
    ----------
    velocity : tuple of float
        Of the body over the ground, ahead and to the left, less its planned sway [m/s].
    behind : float
        How far the feet that lead the way stand behind where the gait has them [m]; negative
        where they are ahead of it, 0 where none of them stands.
    rough : float
        Height of what its feet are to be lifted over [m]; 0 on even ground.
    gaps : float
        For what way gaps are counted on [m]; 0 where the ground has none.
    high : float
        1 while a foot has met what the robot does not climb, else 0.
    """

    velocity: Pair = (0.0, 0.0)
    behind: float = 0.0
    rough: float = 0.0
    gaps: float = 0.0
    high: float = 0.0


class InTime(NamedTuple):
    """Whether the legs do what the gait has them do, as far as news of it come in time. A robot
    whose targets are late goes on with its last rhythm, and its feet are elsewhere: that is no
    obstacle.

    Attributes
    ----------
    late_ns : int
        Stamp of the last tick that came late [ns].
    """

    late_ns: int = -SETTLES_NS

    def at(self, stamp_ns: int, before_ns: int, now_ns: int) -> InTime:
        """After a tick, the stamp of the one before, and the newest time that is known [ns]."""
        return InTime(stamp_ns) if max(
            now_ns - stamp_ns, stamp_ns - before_ns) > LATE_NS else self

    def of_obstacles(self, stamp_ns: int, progress: Progress | None) -> Progress | None:
        """Progress at a stamp [ns], without what feet tell of obstacles while they are late, or
        were a moment ago.
        """
        if progress is None or not fresh(self.late_ns, stamp_ns, SETTLES_NS):
            return progress
        return progress._replace(behind=0.0, high=0.0)


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
    why : str
        Why it was stopped; empty while it is not.
    """

    acts: bool = False
    ahead: Pair = (0.0, 0.0)
    made: float = 0.0
    asked: float = 0.0
    behind: float = 0.0
    most: float = 1.0
    pinned: float = 0.0
    comes: float = 0.0
    why: str = ''

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
    why = (TOO_HIGH if progress.high > 0.0 else FEET_HELD if pinned > FIRM * leg_length
           else NO_WAY if asked > PATIENCE * leg_length else '')
    return BlockState(
        bool(why), ahead, made, asked, behind, most, pinned, comes_on, why)
