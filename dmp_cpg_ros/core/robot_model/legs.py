# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feet and Jacobians of all legs, computed once per tick for all who ask."""

from __future__ import annotations

from collections.abc import Sequence

from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics


class RobotLegs:
    """Kinematics of one robot's legs; the answer for the last joint angles is kept.

    Estimator, sense of the body and posture controller ask for the same measured angles in turn,
    so they share one of these.

    Parameters
    ----------
    description : RobotDescription
        The robot.

    Attributes
    ----------
    kinematics : list of LegKinematics
        Of each leg.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Build the legs."""
        self.kinematics = [LegKinematics(leg) for leg in description.legs]
        self._at: list[float] = []
        self._found: tuple[tuple[Triple, Matrix], ...] = ()

    def at(self, q: Sequence[float]) -> tuple[tuple[Triple, Matrix], ...]:
        """Foot in the base and Jacobian of each leg, as tuples.

        Parameters
        ----------
        q : sequence of 12 floats
            Joint angles [rad].

        Returns
        -------
        tuple of (foot_in_base, jacobian_in_base)
            As of :meth:`~dmp_cpg_ros.core.robot_model.kinematics.LegKinematics.foot_and_jacobian`.
        """
        if q != self._at:
            self._at = list(q)
            self._found = tuple(
                leg.foot_and_jacobian(q[3 * i : 3 * i + 3])
                for i, leg in enumerate(self.kinematics)
            )
        return self._found
