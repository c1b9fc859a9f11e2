# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lanes in which the legs of one side pass each other.

Where steps are longer than the distance D from a fore foot to the hind foot behind it, the hind
foot comes down where the fore foot stood. If that has not left yet, one leg kicks the other, as
horses do that forge. Both feet follow the same path p(c), odd in the position c of the cycle,
which the hind foot goes through δ of a cycle ahead of the fore foot. They are nearest when the
hind foot is at δ/2 (or δ/2 − 1/2) and the fore foot at −δ/2, where straight ahead

    gap = D − 2 x(δ/2) .

A lower leg of the width w needs W = w + ``BESIDE`` l to pass another one, l being the standing
height of the hips. The feet that come from behind, the hind ones on the way ahead, are placed
outwards until they are beside the others by what the gap is short of it, S = W − gap, but not
more than W. Sideways and in curves the paths of a side have come apart already, outwards or
inwards, by b = 2 y(δ/2) and what the turn adds: S − b is what is left to do, and nothing where
they are so far apart, outwards by S or inwards by ``INWARDS`` S.

The velocity is the one that the body can have by now, for where a body brakes it is that and not
its reference by which one foot comes near the other.

So it is where legs of a side step half a cycle apart (δ = 1/2), as in a trot, and less the more
another gait differs, none from a quarter on: with feet aside the body of an amble, which sways,
touches its own legs as often, and was slower.
"""

from __future__ import annotations

from math import tau

from dmp_cpg_ros.core.gait.lags import SIDES
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.maths import clamped
from dmp_cpg_ros.core.maths.vec3 import Pair, Triple
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.leg import body_scale, nominal_foothold

BESIDE = 0.05
"""What legs that pass each other are beside their planned places, in standing heights of the hips.
"""

INWARDS, CHANGING = 1.5, 0.3
"""Shares of what the gap is short of: how far inwards a foot passes the other one, and over how
much less it goes over to the outside.
"""

OWN_LANES = (0.0, 0.0, 0.0, 0.0)
"""Displacements of feet that do not meet."""


class Lanes:
    """Lanes of one robot's feet.

    Parameters
    ----------
    description : RobotDescription
        The robot; legs without a width pass through each other.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Keep distances, and what is needed to pass."""
        legs, beside = description.legs, BESIDE * body_scale(description).leg_length
        self._places = [nominal_foothold(description, leg.name).tolist() for leg in legs]
        self._sides = [
            (fore, hind, 1.0 if self._places[fore][1] > 0.0 else -1.0,
             max(legs[fore].width, legs[hind].width) + beside)
            for fore, hind in SIDES if legs[fore].width > 0.0 and legs[hind].width > 0.0]

    def aside(self, gait: GaitInForce, velocity: Triple, omega: float, duty: float
              ) -> tuple[float, ...]:
        """Displacements across the body of the feet's places.

        Parameters
        ----------
        gait : Gait or BlendedGait
            In force.
        velocity : tuple of float
            That the body can have by now: v_x, v_y [m/s], γ [rad/s].
        omega, duty : float
            Rate of the cycle [rad/s], and share of stance.

        Returns
        -------
        tuple of four floats
            To the left [m].
        """
        if not self._sides:
            return OWN_LANES
        aside = list(OWN_LANES)
        for fore, hind, outward, needed in self._sides:
            delta = float(gait.phases[hind] - gait.phases[fore]) / tau % 1.0
            share = clamped(2.0 - 8.0 * abs(delta - 0.5), 0.0, 1.0)
            if share == 0.0:
                continue
            fore_path, hind_path = (FootPath(self._places[leg], *velocity, omega, duty, 0.0)
                                    for leg in (fore, hind))
            gap, beside = min(_apart(fore_path, hind_path, delta, at) for at in (
                0.5 * delta, 0.5 * delta - 0.5))
            leg, along = (hind, outward) if velocity[0] > 0.0 else (fore, -outward)
            aside[leg] = outward * share * _farther(
                along * beside, clamped(needed - gap, 0.0, needed))
        return tuple(aside)


def _apart(fore: FootPath, hind: FootPath, delta: float, at: float) -> Pair:
    """How far the fore foot is ahead of the hind one, which is at a position of the cycle, and the
    hind one to the left of it [m].
    """
    (fore_x, fore_y, _), _ = fore.at((at - delta + 0.5) % 1.0 - 0.5)
    (hind_x, hind_y, _), _ = hind.at(at)
    return fore_x - hind_x, hind_y - fore_y


def _farther(beside: float, short: float) -> float:
    """What brings a foot that is outwards of another one by ``beside`` to ``short``, where it does
    not pass it inwards [m].
    """
    if not -INWARDS * short < beside < short:
        return 0.0
    return clamped((beside / short + INWARDS) / CHANGING, 0.0, 1.0) * (short - beside)
