# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Memory of how rough the ground is, which all legs share unless ``climbing`` is off.

A leg that feels alone learns of every step by tripping over it, and it stands on a step as if that
were level: it goes back to the height of the others and throws the body to its side. What one foot
has felt here serves all (Focchi et al. 2018 keep a step's height for the hind legs; Bledt et al.
2018 and Kim et al. 2019 let a body climb stairs blind along a plane through its footholds).

**Level.** With p_i the newest foothold of each leg and n the normal of the plane that the body
follows, foot i stands

    e_i = n · p_i − mean_j n · p_j

over that plane, and is left there: its path has its stance at e_i − ``RAISED`` ρ instead of 0.
A foot that is to stand and touches nothing goes on down, by ``SEARCHED`` l. The plane leans as the
footholds do only by the share ``FOLLOWED``: between two steps it is too steep, most of all at the
foot of a way down, where a body that follows it dives.

**Rough.** ρ is the height of what the feet are to be lifted over. It is 0 until one foothold is
higher than the median of all by more than ``STEP`` l, l the length of the leg, or a swinging foot
meets something: a body that waited for its first foothold on a step would walk over forefeet that
the riser holds. That counts under a body that does not roll, for after a push it feels steps where
there are none; that is at less than ``SLOW`` of its gait's highest speed, near which the footholds
of a walk differ as much on even ground; and that is borne by both sides and both ends (``firm``):
a pronk that brakes pitches as much. A lower foothold tells nothing, nor does what a foot meets
while one is lower by ``HOLLOW`` l: a foot may as well be in a gap, and to look for the ground
there, or to count on it, overturns the robot. From there on ρ grows to

- max e − min e, where this is more than ``UNEVEN`` l: feet stand on steps, up or down;
- h + ``MARGIN`` l for a foot that touches something in the middle of its swing, at h over the mean
  of the footholds, and has been free in it: something is there, and is higher. One that has
  touched since its stance is still held there, or has a sensor that is late;

up to ``HIGHEST`` l, and fades by e^(−s/(``FADES`` l)) on a way s. On flat ground no foothold is
that high, ρ is 0 and so are all e_i.

**Barred.** A foot that meets something higher than ``CLIMBED`` l over the mean of the footholds
has met what the robot does not climb: one foot may come up there, and the body falls off. A sensor
that tells anything feigns that; one that has changed its mind more than ``FLICKERS`` times in a
swing is not believed until it was of one for ``STEADY`` of it: at an edge a foot is shaken, too.
The stop is requested (:mod:`~dmp_cpg_ros.core.inhibition.blocked`), and for the next ``FADES`` l
feet come down where the ground was, and ρ goes to what footholds differ by, at ``RELAXES``.

**Gaps.** A foot that is to stand, touches nothing, and is lower than the median of all footholds
by more than ``HOLLOW`` l is in a gap. For the next ``FADES`` l the body does not follow less of
its command because of it: it would fall over the leg that does not bear, and slow feet step into
every gap. Where ρ is 0 the others bear for one that is deeper than ``DEEP`` l. Only a calm body
finds a first gap, and only in a gait whose legs step in turn: two of a trot bear too short.

**At rest.** A leg that is held where the ground is lower than the plane through the others hangs,
and stays so. A foot of a resting leg that touches nothing while ``STANDING`` others do goes down,
by ``LOWEST`` l at most, until it touches, and stands there until it swings again.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, exp
from typing import NamedTuple

from dmp_cpg_ros.core.gait.contact_feedback import LOADED, UNLOADED
from dmp_cpg_ros.core.maths import vec3
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, dot
from dmp_cpg_ros.core.robot_model.state import RobotState

UNEVEN = 0.1
"""Difference between the heights of footholds that even ground does not feign, in lengths of the
leg: six gaits on the flat have at most half of it.
"""

STEP = 0.25
"""By how much a foothold is higher than the median that tells the first step, in lengths of the
leg; the edge of a gap, into which a foot slips or the body leans, tells less.
"""

ROLLING = 0.17
"""Sine of the body's roll to its ground, 10 degrees, up to which it may tell the first step."""

SLOW = 0.5
"""Share of a gait's highest speed below which it may, of the reference and of the body."""

HOLLOW, DEEP = 0.05, 0.1
"""How deep a foot without ground hangs in a gap, and from where it is not counted on (those that
find ground on hills hang by less), in lengths of the leg.
"""

SCUFFING = (0.25, 0.8)
"""Shares of the swing between which a foot that touches something has met an obstacle."""

CLEAR_OF_GROUND = 0.06
"""Height from which that is not the ground that it has just left, in lengths of the leg."""

MARGIN = 0.13
"""By how much an obstacle is taken to be higher than where it was touched, in lengths of the leg,
as in the stumbling reflex.
"""

HIGHEST = 0.6
"""Largest height that is remembered, in lengths of the leg."""

CLIMBED = 0.5
"""Height over the mean of the footholds at which a foot meets what is not climbed, in lengths of
the leg; on stairs of 0.36 l, which are, feet met nothing above 0.45 l.
"""

FLICKERS = 6
"""How often a contact sensor may change its mind in a swing of which it is to tell that."""

STEADY = 0.2
"""Share of a swing for which one that did so more often must have been of one mind."""

RELAXES = 10.0
"""Rate at which the height that is remembered is given up before an obstacle [1/s]: at once
the body drops and is thrown up, at 2/s one of two walks fell before a step of 0.7 l.
"""

FADES = 4.0
"""Way on which the memory fades to 1/e, in lengths of the leg: a few strides."""

FORGOTTEN = 0.05
"""Height below which nothing is left of it, in lengths of the leg."""

JUMP = 1.0
"""Way within a tick from which the body's estimated place began anew, in lengths of the leg."""

RAISED = 0.3
"""By how much of ρ the legs stand longer, so that trunk and knees stay clear of edges."""

FOLLOWED = 0.5
"""Share of the slope of the footholds that the body follows where it is rough."""

SEARCHED = 0.25
"""How much deeper a foot looks for ground that is not where its stance begins, in lengths of the
leg; no further than it can reach.
"""

QUIET = 0.05
"""Share of √(g l) of a body's speed below which its feet may go down: a pushed one lifts them."""

SINKING, LOWEST = 0.3, 0.1
"""Speed at which a foot that hangs at rest goes down, and how far, in lengths of the leg [1/s]."""

STANDING = 2
"""Feet on which a robot stands whose others hang; one that is held up has none."""

LEVEL_FEET: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
"""Heights of feet that stand in the plane [m]."""

NO_FOOT = (False,) * 4


class Terrain(NamedTuple):
    """The memory.

    Attributes
    ----------
    rough : float
        ρ [m]; 0 on even ground.
    gaps : float
        For how much more way gaps are counted on [m].
    footholds : tuple of (float, float, float)
        p_i, where each foot stood last [m]; empty before the first tick.
    place : tuple of float
        Of the body at the last tick, in the same frame [m].
    lowered : tuple of four floats
        How far feet went down that hung at rest, not above 0 [m].
    walked : bool
        Whether a foot has left the ground; before, all stand where the robot was put.
    barred : float
        For how much more way an obstacle that is not climbed is counted on [m].
    high : int
        Place of the leg that has met one in this swing; −1: none has.
    lifted, touched : tuple of four bool
        Which feet have been free in the swing they are in, and touched something at the last tick.
    changes, changed : tuple of four int, tuple of four floats
        How often that has changed in the swing a foot is in, and share of it at which it did last.
    empty : tuple of four bool
        Which feet hang so deep in a gap that others bear for them.
    """

    rough: float = 0.0
    gaps: float = 0.0
    footholds: tuple[Triple, ...] = ()
    place: Triple = (0.0, 0.0, 0.0)
    lowered: tuple[float, ...] = LEVEL_FEET
    walked: bool = False
    barred: float = 0.0
    high: int = -1
    lifted: tuple[bool, ...] = NO_FOOT
    touched: tuple[bool, ...] = NO_FOOT
    changes: tuple[int, ...] = (0,) * 4
    changed: tuple[float, ...] = (0.0,) * 4
    empty: tuple[bool, ...] = NO_FOOT

    @property
    def followed(self) -> float:
        """Share of the slope of the footholds that the body follows."""
        return FOLLOWED if self.rough else 1.0

    def felt(self, place: Triple, feet: Sequence[Triple], normal: Triple,
             swung: Sequence[float], touches: Sequence[bool], leg_length: float,
             calm: bool = True, in_turn: bool = True, rests: Sequence[bool] = (False,) * 4,
             quiet_s: float = 0.0, dt: float = 0.0) -> tuple[Terrain, tuple[float, ...]]:
        """Advance by one tick.

        Parameters
        ----------
        place : tuple of float
            Of the body [m].
        feet : sequence of four tuples of float
            Measured places in the same frame [m].
        normal : tuple of float
            n, of the plane that the body follows.
        swung : sequence of four floats
            Share of the swing that has passed; outside of [0, 1] in stance, below 0 in the second
            half of it.
        touches : sequence of four bool
            Whether a foot touches something, as far as its sensor tells.
        leg_length : float
            l [m].
        calm : bool
            Whether the body may tell the first step.
        in_turn : bool
            Whether the legs step one after the other.
        rests : sequence of four bool
            Which legs rest on feet that tell what they touch.
        quiet_s : float
            Time of this tick in which feet may go down that then touch nothing [s].
        dt : float
            Time since the last tick [s].

        Returns
        -------
        terrain : Terrain
        level : tuple of four floats
            Where the feet are to stand over the plane [m]; 0 while nothing is rough and no foot
            was lowered.
        """
        way = dist(place, self.place)
        anew = not self.footholds or way > JUMP * leg_length
        swings, levels = [0.0 <= share <= 1.0 for share in swung], [dot(normal, at) for at in feet]
        footholds, heights = [*feet], [*levels]
        for i, last in enumerate(() if anew else self.footholds):
            height = dot(normal, last)
            # a foot with a silent sensor stands in the end, but no higher: a tilting body lifts it
            if not ((touches[i] and not swings[i]) or (swung[i] < 0.0 and levels[i] <= height)):
                footholds[i], heights[i] = last, height
        low, lower, higher, high = sorted(heights)
        mean, middle = sum(heights) / len(heights), 0.5 * (lower + higher)
        rough = 0.0 if anew else self.rough * exp(-way / (FADES * leg_length))
        if (calm and high - middle > STEP * leg_length) or (
                rough and high - low > UNEVEN * leg_length):
            rough = max(rough, high - low)
        even = not (anew or self.gaps) and middle - low < HOLLOW * leg_length
        tells = rough > 0.0 or (calm and even)
        barred = 0.0 if anew else max(0.0, self.barred - way)
        met = -1 if self.high < 0 or not swings[self.high] else self.high
        lifted, changes, changed = self._in_swings(swung, swings, touches)
        for i, share in enumerate(swung):
            if tells and touches[i] and lifted[i] and SCUFFING[0] < share < SCUFFING[1]:
                height = levels[i] - mean
                if height > CLIMBED * leg_length:
                    if changes[i] <= FLICKERS or share - changed[i] > STEADY:
                        barred, met = FADES * leg_length, i
                elif height > CLEAR_OF_GROUND * leg_length and not barred:
                    rough = max(rough, height + MARGIN * leg_length)
        if barred:
            rough = max(self.rough * exp(-RELAXES * dt), (high - low) * (
                high - low > UNEVEN * leg_length))
        depths = [0.0 if touches[i] or swings[i] else middle - level
                  for i, level in enumerate(levels)]
        hangs = not anew and in_turn and (calm or self.gaps) and max(depths) > HOLLOW * leg_length
        gaps = FADES * leg_length if hangs else 0.0 if anew else max(0.0, self.gaps - way)
        rough = min(rough, HIGHEST * leg_length) if rough > FORGOTTEN * leg_length else 0.0
        walked = self.walked or any(swinging and not (touch or rest) for swinging, touch, rest
                                    in zip(swings, touches, rests, strict=True))
        sink = SINKING * leg_length * quiet_s * (walked and sum(touches) >= STANDING)
        lowered = LEVEL_FEET if not any(rests) and self.lowered is LEVEL_FEET else tuple(
            0.0 if swing and not rest else
            max(last - sink * (rest and not touch), -LOWEST * leg_length)
            for last, rest, swing, touch in zip(self.lowered, rests, swings, touches, strict=True))
        terrain = Terrain(
            rough, gaps, tuple(footholds), place, lowered if any(lowered) else LEVEL_FEET, walked,
            barred, met, lifted, tuple(touches), changes, changed,
            tuple(depth > DEEP * leg_length for depth in depths)
            if hangs and rough == 0.0 else NO_FOOT)
        return terrain, terrain.lowered if rough == 0.0 else tuple(
            height - mean - RAISED * rough + down - (
                SEARCHED * leg_length if share > 1.0 and not (touch or rest) else 0.0)
            for height, down, rest, share, touch in zip(
                heights, lowered, rests, swung, touches, strict=True))

    def _in_swings(self, swung: Sequence[float], swings: Sequence[bool], touches: Sequence[bool]
                   ) -> tuple[tuple[bool, ...], tuple[int, ...], tuple[float, ...]]:
        """``lifted``, ``changes`` and ``changed``."""
        lifted, changes, changed = [], [], []
        for i, touch in enumerate(touches):
            turned = touch != self.touched[i]
            lifted.append(swings[i] and (self.lifted[i] or not touch))
            changes.append(self.changes[i] + turned if swings[i] else 0)
            changed.append(swung[i] if turned else self.changed[i])
        return tuple(lifted), tuple(changes), tuple(changed)


def contacts(state: RobotState, forces: Sequence[float], rests: Sequence[bool],
             legs: Sequence[tuple[Triple, Matrix]], quarter: float
             ) -> tuple[list[bool], list[bool]]:
    """Which feet touch something as their sensors tell, and which legs rest without a doubt of it:
    one whose joints press on the ground while its sensor tells nothing has a sensor that is dead.

    Parameters
    ----------
    state : RobotState
        Measured.
    forces : sequence of four floats
        Of the feet, those that can be believed [N].
    rests : sequence of four bool
        Which legs rest; their feet touch with less than one that comes down.
    legs : sequence of (foot_in_base, jacobian_in_base)
        Of the four legs.
    quarter : float
        A quarter of the robot's weight [N].
    """
    touches = [forces[i] > (UNLOADED if rest else LOADED) * quarter
               for i, rest in enumerate(rests)]
    if not any(rests):
        return touches, [*rests]
    told, efforts = state.foot_force.tolist(), state.joint_effort.tolist()
    return touches, [
        rest and force == said and (touch or pressure(jacobian, efforts[3 * i:3 * i + 3])
                                    < LOADED * quarter)
        for i, (rest, force, said, touch, (_, jacobian)) in enumerate(
            zip(rests, forces, told, touches, legs, strict=True))]


def pressure(jacobian: Matrix, efforts: Sequence[float]) -> float:
    """Force [N] downwards in the base by which joint torques [N m] press a foot: −f_z of the
    statics f = J⁻ᵀ τ, that of the leg's own weight included.
    """
    x, y, z = zip(*jacobian, strict=True)
    hip, thigh, knee = efforts
    return -vec3.damped_solution((x, y, z), (hip, thigh, knee))[2]


NOTHING_FELT = Terrain()
"""Before the first foothold."""
