# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lanes in which the legs of one side pass each other.

Where steps are longer than the distance D from a fore foot to the hind foot behind it, the hind
foot comes down where the fore foot stood. If that has not left yet, one leg kicks the other, as
horses do that forge. Both feet follow the same path x(c), odd in the position c of the cycle,
which the hind foot goes through δ of a cycle ahead of the fore foot. They are nearest when the
hind foot is at δ/2 (or δ/2 − 1/2) and the fore foot at −δ/2, where

    gap = D − 2 x(δ/2) .

A lower leg of the width w needs W = w + ``BESIDE`` l to pass another one, l being the standing
height of the hips. What the gap is short of it, W − gap, but not more than W, the feet that come
from behind, the hind ones on the way ahead, are placed outwards.

So it is where legs of a side step half a cycle apart (δ = 1/2), as in a trot, and less the more
another gait differs, none from a quarter on: with feet aside the body of an amble, which sways,
touches its own legs as often, and was slower.
"""

from __future__ import annotations

from math import tau

from dmp_cpg_ros.core.gait.lags import SIDES
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.maths import clamped
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.leg import body_scale, nominal_foothold

BESIDE = 0.05
"""What legs that pass each other are beside their planned places, in standing heights of the hips.
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
        places = [nominal_foothold(description, leg.name) for leg in legs]
        self._outward = [1.0 if place[1] > 0.0 else -1.0 for place in places]
        self._sides = [
            (fore, hind, float(places[fore][0] - places[hind][0]),
             max(legs[fore].width, legs[hind].width) + beside)
            for fore, hind in SIDES if legs[fore].width > 0.0 and legs[hind].width > 0.0]

    def aside(self, gait: GaitInForce, v_x: float, omega: float, duty: float
              ) -> tuple[float, ...]:
        """Displacements across the body of the feet's places.

        Parameters
        ----------
        gait : Gait or BlendedGait
            In force.
        v_x : float
            Reference [m/s].
        omega, duty : float
            Rate of the cycle [rad/s], and share of stance.

        Returns
        -------
        tuple of four floats
            To the left [m].
        """
        if not self._sides or v_x == 0.0:
            return OWN_LANES
        path = FootPath((0.0, 0.0, 0.0), v_x, 0.0, 0.0, omega, duty, 0.0)
        aside = list(OWN_LANES)
        for fore, hind, distance, needed in self._sides:
            ahead = float(gait.phases[hind] - gait.phases[fore]) / tau % 1.0
            share = clamped(2.0 - 8.0 * abs(ahead - 0.5), 0.0, 1.0)
            gap = distance - 2.0 * max(path.at(0.5 * ahead)[0][0],
                                       path.at(0.5 * ahead - 0.5)[0][0])
            leg = hind if v_x > 0.0 else fore
            aside[leg] = self._outward[leg] * share * clamped(needed - gap, 0.0, needed)
        return tuple(aside)
