# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Footholds: placement of swinging feet, and compliance of standing feet with a push.

A foot comes down at

    d = v T_s / 2 + k sqrt(l / g) (v − v_plan)

from its neutral place, with v the velocity of the body over that foot and T_s the duration of
stance: the neutral point of Raibert (1986), in the middle of the way that the body makes while
the foot stands, and beyond it the capture point of the linear inverted pendulum (Pratt et al.
2006; there k = 1 brings the body to rest over the foot). d ends at the leg's reach, and on the
foot's own side of the body. The foot path brings the foot to v_plan T_s / 2, with v_plan the
velocity of its stance; the rest is the shift.

Where the feet of one side stand alone at y from the middle, their force points through the centre
of mass at the height h with a friction of y/h, else it rolls the body. A foot comes down within

    |y| ≤ μ h/√2

of the middle then, with μ what is counted on: as much of the cone is left to push the body ahead.

All this is in the frame of the ground (:mod:`~dmp_cpg_ros.core.robot_model.ground_frame`): at the
base, with its heading, z along the normal of the ground. A controller that works in this frame
holds the body parallel to a slope, keeps its height along the normal, and its friction cones stand
on the ground. On level ground, or without an estimate of it, the frame is level; of a slight slope
it takes a part only.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign, hypot, sqrt

from dmp_cpg_ros.core.balance.parameters import PostureParameters
from dmp_cpg_ros.core.maths import Array, clamped, vec3
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Matrix, Pair, Triple
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics

LARGEST_RAISE = 0.35
"""Largest correction of a swinging foot's height by levelling, in leg lengths."""

INSIDE = 0.3
"""How far from the middle the capture point is left to feet that stand around it, as a share of
their distance.
"""

BACKWARDS, QUICK = 0.75, 0.6
"""See :meth:`FootPlacement.yielding`."""


class FootPlacement:
    """Placement for one robot's feet.

    Parameters
    ----------
    kinematics : sequence of LegKinematics
        Legs.
    footholds_in_base : ndarray (4, 3)
        Neutral places of the feet [m].
    leg_length : float
        Standing height of the hips [m].
    """

    def __init__(self, kinematics: list[LegKinematics], footholds_in_base: Array,
                 leg_length: float) -> None:
        """Keep places and lengths."""
        self._footholds = [vec3.triple(foot) for foot in footholds_in_base.tolist()]
        self._across = tuple(y for _, y, _ in self._footholds)
        self._leg_length = leg_length
        self._straight = [leg.thigh_length + leg.shank_length for leg in kinematics]
        self._lateral = [leg.lateral_offset for leg in kinematics]
        self._depth = [
            float(leg.geometry.hip_in_base[2]) - height
            for leg, (_, _, height) in zip(kinematics, self._footholds, strict=True)]

    def over_feet(self, velocity: Triple) -> list[Pair]:
        """Velocity of the body over its feet, v + γ ẑ × p.

        Parameters
        ----------
        velocity : tuple of float
            v_x, v_y [m/s], γ [rad/s].

        Returns
        -------
        list of four pairs of float
            [m/s]
        """
        v_x, v_y, gamma = velocity
        return [(v_x - gamma * y, v_y + gamma * x) for x, y, _ in self._footholds]

    def across(self, friction: float, height: float, wide: float) -> tuple[float, ...]:
        """Where feet come down across the body: nearer to the middle where one side is alone.

        Parameters
        ----------
        friction : float
            μ.
        height : float
            Of the centre of mass over the ground [m].
        wide : float
            Of the gait: 1 where feet of both sides stand, 0 where one side stands alone.

        Returns
        -------
        tuple of four floats
            To the left of the middle [m].
        """
        if wide == 1.0:
            return self._across
        most = friction * height / sqrt(2.0)
        return tuple(copysign(abs(y) - (1.0 - wide) * max(0.0, abs(y) - most), y)
                     for y in self._across)

    def room(self, reach: float) -> float:
        """Way that the body can make over standing feet with a share of the straight legs [m]."""
        return min(sqrt(max((reach * straight) ** 2 - depth * depth, 0.0))
                   for straight, depth in zip(self._straight, self._depth, strict=True))

    def caught(self, measured: Triple, planned: Triple, apart: float) -> Triple:
        """Velocity for which feet are placed: the measured one, but where all legs swing together
        only what the four feet do not catch that stand afterwards. Of an error e of the velocity
        that is the part with |e| √(h/g) beyond ``INSIDE`` of the feet's distance from the middle.

        Parameters
        ----------
        measured, planned : tuple of float
            v_x, v_y [m/s], γ [rad/s].
        apart : float
            Of the gait: 0 where all legs swing together.
        """
        if apart == 1.0:
            return measured
        place_x, place_y, _ = self._footholds[0]
        inside = INSIDE * (1.0 - apart) * (GRAVITY / self._leg_length) ** 0.5
        e_x, e_y, e_gamma = vec3.minus(measured, planned)
        e_x -= min(max(e_x, -inside * place_x), inside * place_x)
        e_y -= min(max(e_y, -inside * place_y), inside * place_y)
        return vec3.plus(planned, (e_x, e_y, apart * e_gamma))

    def within_reach(self, down: Sequence[Pair], reach: float) -> list[Pair]:
        """Shorten displacements from the neutral places to what the legs reach.

        The leg's plane is beside its abduction axis by y_0, so a foot at (x, y_0 + y, z) from the
        hip needs a leg of length sqrt(x² + y² + 2 y_0 y + z²).

        Parameters
        ----------
        down : sequence of four pairs of float
            Displacements [m].
        reach : float
            Share of the straight leg that is used.

        Returns
        -------
        list of four pairs of float
        """
        reached = []
        for i, (x, y) in enumerate(down):
            straight, depth, lateral = self._straight[i], self._depth[i], self._lateral[i]
            room, squared = (reach * straight) ** 2 - depth * depth, x * x + y * y
            room, squared = 1e-6 if room < 1e-6 else room, 1e-12 if squared < 1e-12 else squared
            outward = lateral * y
            share = (sqrt(outward * outward + squared * room) - outward) / squared
            share = 1.0 if share > 1.0 else share
            reached.append((x * share, y * share))
        return reached

    def shift(self, p: PostureParameters, measured: Triple, planned: Triple,
              half_stance: float, across: Sequence[float] | None = None) -> list[Pair]:
        """Shift of the footholds.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        measured, planned : tuple of float
            Velocity of the body, and v_plan: v_x, v_y [m/s], γ [rad/s].
        half_stance : float
            T_s / 2 [s].
        across : sequence of four floats, optional
            As from :meth:`across`; the neutral places without.

        Returns
        -------
        list of four pairs of float
            [m]
        """
        capture = p.placement_gain * (self._leg_length / GRAVITY) ** 0.5
        way, wanted = half_stance + capture, self.over_feet(planned)
        wished = [(way * x - capture * wanted[i][0], way * y - capture * wanted[i][1])
                  for i, (x, y) in enumerate(self.over_feet(measured))]
        if across is not None and across != self._across:
            wished = [(x, y + (at - place)) for (x, y), at, place in zip(
                wished, across, self._across, strict=True)]
        shift = []
        for i, (x, y) in enumerate(self.within_reach(wished, p.reach)):
            planned_x, planned_y = wanted[i]
            shift.append((x - half_stance * planned_x,
                          _on_own_side(y, self._across[i]) - half_stance * planned_y))
        return shift

    def raised(self, p: PostureParameters, shift: Sequence[Pair],
               R_ground_base: Matrix) -> list[float]:
        """Change of the feet's height in the base that keeps them level over the ground.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        shift : sequence of four pairs of float
            Shift of the footholds [m].
        R_ground_base : tuple of rows
            Attitude.

        Returns
        -------
        list of four floats
            [m]
        """
        upward, limit = R_ground_base[2], LARGEST_RAISE * self._leg_length
        gain, raised = p.levelling / max(upward[2], 0.3), []
        for i, (x, y, z) in enumerate(self._footholds):
            more_x, more_y = shift[i]
            lost = z - vec3.dot((x + more_x, y + more_y, z), upward)
            raised.append(clamped(gain * lost, -limit, limit))
        return raised

    def yielding(self, p: PostureParameters, v_x: float, firm: float,
                 acceleration: Pair = (0.0, 0.0)) -> float:
        """Share of an error of the velocity with which standing feet go along.

        Feet that hold a body which goes backwards roll it to one side, where it stays: they go
        along further, by ``BACKWARDS`` of what is left from a dimensionless speed of ``QUICK`` on.
        Not where all legs swing together: they pitch it the more the less they hold it; nor where
        one side or one end stands alone, which they tilt the more. And the less, the more a
        planned acceleration is of μ g/√2: feet that go along do not hold a curve, and slide.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        v_x : float
            Reference [m/s].
        firm : float
            Of the gait: 0 where all legs swing together or one side or one end is alone, else 1.
        acceleration : pair of float
            Planned, with that of a curve [m/s^2].
        """
        if v_x >= 0.0:
            return p.yielding
        quick = min(1.0, -v_x / (QUICK * (GRAVITY * self._leg_length) ** 0.5))
        held = min(1.0, sqrt(2.0) * hypot(*acceleration) / (p.friction * GRAVITY))
        return p.yielding + (1.0 - held) * firm * BACKWARDS * quick * (1.0 - p.yielding)

    def drift(self, yielding: float, measured: Triple, planned: Triple,
              activity: Sequence[float], sway_velocity: float = 0.0) -> list[Pair]:
        """Velocity that standing feet add to their paths so as to go along with the ground.

        Without it the joint drive would hold the body to its planned velocity, with a force that
        knows nothing of balance and slips or topples it. They do not go along with a turn: what
        holds the heading does not topple.

        Parameters
        ----------
        yielding : float
            As from :meth:`yielding`.
        measured, planned : tuple of float
            As for :meth:`shift`.
        activity : sequence of four floats
            Swing activity; at rest the feet hold the body.
        sway_velocity : float
            Planned velocity across, which ``measured`` is without, and with which the feet go
            along fully [m/s].

        Returns
        -------
        list of four pairs of float
            [m/s]
        """
        x = -yielding * (measured[0] - planned[0])
        y = -yielding * (measured[1] - planned[1]) - sway_velocity
        return [(swings * x, swings * y) for swings in activity]


def _on_own_side(y: float, place: float) -> float:
    """Displacement across the body of a foot from its place, but not beyond the middle."""
    inside = place + y < 0.0 if place > 0.0 else place + y > 0.0
    return -place if inside else y
