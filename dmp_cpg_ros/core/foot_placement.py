# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where swinging feet come down, and how standing feet go along with a push.

A foot comes down at

    d = v T_s / 2 + k sqrt(l / g) (v − v_plan)

from its neutral place, with v the velocity of the body over that foot and T_s the duration of
stance: the neutral point of Raibert (1986), in the middle of the way that the body makes while
the foot stands, and beyond it the capture point of the linear inverted pendulum (Pratt et al.
2006; there k = 1 brings the body to rest over the foot). d ends at the leg's reach, and on the
foot's own side of the body. The foot path brings the foot to v_plan T_s / 2, with v_plan the
velocity of its stance; the rest is the shift.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.gait import GRAVITY
from dmp_cpg_ros.core.leg_kinematics import LegKinematics
from dmp_cpg_ros.core.posture_parameters import PostureParameters

Array = NDArray[np.float64]

LARGEST_RAISE = 0.35
"""Largest correction of a swinging foot's height by levelling, in leg lengths."""


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

    def __init__(
        self, kinematics: list[LegKinematics], footholds_in_base: Array, leg_length: float
    ) -> None:
        """Keep places and lengths."""
        self.footholds_in_base, self._leg_length = footholds_in_base, leg_length
        self._side = np.sign(footholds_in_base[:, 1])
        self._straight = np.array([leg.thigh_length + leg.shank_length for leg in kinematics])
        self._lateral = np.array([leg.lateral_offset for leg in kinematics])
        self._depth = np.array([
            float(leg.geometry.hip_in_base[2]) - height
            for leg, height in zip(kinematics, footholds_in_base[:, 2], strict=True)
        ])
        self._across = np.stack([-footholds_in_base[:, 1], footholds_in_base[:, 0]], axis=1)

    def over_feet(self, velocity: Array) -> Array:
        """Velocity of the body over its feet, v + γ ẑ × p.

        Parameters
        ----------
        velocity : ndarray (3,)
            v_x, v_y [m/s], γ [rad/s].

        Returns
        -------
        ndarray (4, 2)
            [m/s]
        """
        return velocity[:2] + velocity[2] * self._across

    def within_reach(self, down: Array, reach: float) -> Array:
        """Shorten displacements from the neutral places to what the legs reach.

        The leg's plane is beside its abduction axis by y_0, so a foot at (x, y_0 + y, z) from the
        hip needs a leg of length sqrt(x² + y² + 2 y_0 y + z²).

        Parameters
        ----------
        down : ndarray (4, 2)
            Displacements [m].
        reach : float
            Share of the straight leg that is used.

        Returns
        -------
        ndarray (4, 2)
        """
        room = np.maximum((reach * self._straight) ** 2 - self._depth**2, 1e-6)
        squared = np.maximum((down * down).sum(axis=1), 1e-12)
        outward = self._lateral * down[:, 1]
        share = (np.sqrt(outward * outward + squared * room) - outward) / squared
        return down * np.minimum(1.0, share)[:, None]

    def shift(
        self, p: PostureParameters, measured: Array, planned: Array, half_stance: float
    ) -> Array:
        """Shift of the footholds.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        measured, planned : ndarray (3,)
            Velocity of the body, and v_plan: v_x, v_y [m/s], γ [rad/s].
        half_stance : float
            T_s / 2 [s].

        Returns
        -------
        ndarray (4, 2)
            [m]
        """
        over = self.over_feet(measured)
        capture = p.placement_gain * (self._leg_length / GRAVITY) ** 0.5
        down = half_stance * over + capture * (over - self.over_feet(planned))
        down = self.within_reach(down, p.reach)
        across = self.footholds_in_base[:, 1]
        down[:, 1] = self._side * np.maximum(self._side * (across + down[:, 1]), 0.0) - across
        return down - half_stance * self.over_feet(planned)

    def raised(self, p: PostureParameters, shift: Array, R_ground_base: Array) -> Array:
        """Change of the feet's height in the base that keeps them level over the ground.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        shift : ndarray (4, 2)
            Shift of the footholds [m].
        R_ground_base : ndarray (3, 3)
            Attitude.

        Returns
        -------
        ndarray (4,)
            [m]
        """
        foot = self.footholds_in_base.copy()
        foot[:, :2] += shift
        upward = R_ground_base[2]
        lost = foot[:, 2] - foot @ upward
        limit = LARGEST_RAISE * self._leg_length
        return np.clip(p.levelling * lost / max(float(upward[2]), 0.3), -limit, limit)

    def drift(
        self, p: PostureParameters, measured: Array, planned: Array, activity: Array
    ) -> Array:
        """Velocity that standing feet add to their paths so as to go along with the ground.

        Without it the joint drive would hold the body to its planned velocity, with a force that
        knows nothing of balance and slips or topples it. They do not go along with a turn: what
        holds the heading does not topple.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        measured, planned : ndarray (3,)
            As for :meth:`shift`.
        activity : ndarray (4,)
            Swing activity; at rest the feet hold the body.

        Returns
        -------
        ndarray (4, 2)
            [m/s]
        """
        return -p.yielding * activity[:, None] * (measured - planned)[:2]
