# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the paths of the feet come from: the one place at which another source plugs in.

A leg asks a :class:`FootMotion` for its foot at every tick and adds the feedback of the body
(shifts, stumbling reflex) before inverse kinematics makes joint goals of it. The default is
:class:`~dmp_cpg_ros.core.transformation.foot_path.FootPath`; learned primitives are in
:mod:`~dmp_cpg_ros.core.transformation.learned_motion`.
"""

from __future__ import annotations

from math import pi
from typing import Any, Protocol

from dmp_cpg_ros.core.maths.vec3 import Triple, moved
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.transformation.foot_path import FootPath


class FootMotion(Protocol):
    """Motion of one foot in the base."""

    def step(self, state: Any, path: FootPath, cycle_position: float, rate: float,
             dt: float) -> tuple[Any, Triple, Triple]:
        """Advance to the time at which the inputs hold.

        Parameters
        ----------
        state : object
            What the source returned one tick before; None at the first.
        path : FootPath
            What the gait and the reference ask: velocity, frequency, duty factor, foothold, and
            the height of the swing that acts now, which is 0 for a leg at rest.
        cycle_position : float
            0 at mid-swing, ±1/2 at mid-stance, in [−1/2, 1/2].
        rate : float
            Rate of the phase [rad/s].
        dt : float
            Time since the last tick [s]; 0 at the first.

        Returns
        -------
        state : object
        position_in_base, velocity_in_base : tuple of float
            [m], [m/s]
        """


class Motion(Protocol):
    """Motions of all feet of any robot."""

    @property
    def clearance(self) -> float:
        """Height of the swing as a fraction of the standing height."""

    def of_leg(self, leg: str, description: RobotDescription) -> FootMotion:
        """Motion of one foot, scaled to a robot."""


class HermiteMotion:
    """The foot path itself."""

    def step(self, state: None, path: FootPath, cycle_position: float, rate: float,
             dt: float) -> tuple[None, Triple, Triple]:
        """Foot on its path, as :meth:`FootMotion.step`."""
        foot, slope = path.at(cycle_position)
        return None, foot, moved((0.0, 0.0, 0.0), slope, rate / (2.0 * pi))
