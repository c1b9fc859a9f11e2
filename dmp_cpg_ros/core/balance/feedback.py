# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the balance controller sends to the legs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dmp_cpg_ros.core.balance.body_command import STANDING, BodyCommand
from dmp_cpg_ros.core.balance.capture_point import WIDE
from dmp_cpg_ros.core.balance.terrain import LEVEL_FEET
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.maths.vec3 import Pair, Triple
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.core.transformation.leg import LegFeedback

FELT = (True,) * len(LEGS)


@made_often
@dataclass(frozen=True)
class PostureFeedback:
    """What the posture controller sends to the legs, in numbers, for code that runs at every tick.

    Attributes
    ----------
    torque : sequence of 12 floats
        τ_fb in the order of the joint names [N m].
    shift_in_base : sequence of 4 tuples of 3 floats
        Foot placement shifts for swinging feet [m].
    drift_in_base : sequence of 4 pairs of floats
        What standing feet add to the velocity of their paths [m/s].
    correction : tuple of 3 floats
        What the legs add to the reference velocity of the stance feet: v_x, v_y [m/s], γ [rad/s].
    command : BodyCommand
        What the body does.
    measured : sequence of 12 floats
        Measured joint angles that the feedback was made of [rad].
    foot_force : sequence of 4 floats
        Measured normal forces of the feet [N]; 0 where there is none to be believed.
    felt : tuple of 4 bool
        Whose joints were measured; those of other legs are planned.
    margins : tuple of float
        Of the capture point to the edges of the support polygon [m]; ``WIDE`` while nobody asks.
    progress : Progress or None
        Whether the body comes ahead, where it balances, and how rough its ground is.
    level : tuple of 4 float
        How far over the plane that the body follows the feet are to stand [m].
    """

    torque: Sequence[float]
    shift_in_base: Sequence[Triple]
    drift_in_base: Sequence[Pair]
    correction: Triple
    command: BodyCommand = STANDING
    measured: Sequence[float] = (0.0,) * len(JOINT_NAMES)
    foot_force: Sequence[float] = (0.0,) * len(LEGS)
    margins: tuple[float, ...] = WIDE
    progress: Progress | None = None
    felt: tuple[bool, ...] = FELT
    level: tuple[float, ...] = LEVEL_FEET

    def of_leg(self, i: int) -> LegFeedback:
        """What the path of leg ``i`` takes of it."""
        return LegFeedback(
            self.measured[3 * i:3 * i + 3], self.shift_in_base[i], self.drift_in_base[i],
            self.correction, self.foot_force[i], self.level[i],
            self.progress.rough if self.progress else 0.0)
