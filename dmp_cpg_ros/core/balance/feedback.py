# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the balance controller sends to the legs."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from dmp_cpg_ros.core.balance.body_command import STANDING, BodyCommand
from dmp_cpg_ros.core.balance.capture_point import WIDE
from dmp_cpg_ros.core.balance.terrain import LEVEL_FEET
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.leg import LegFeedback

FELT = (True,) * len(LEGS)


@made_often
@dataclass(frozen=True)
class PostureFeedback:
    """What the posture controller sends to the legs.

    Attributes
    ----------
    torque : ndarray (12,)
        τ_fb in the order of the joint names [N m].
    shift_in_base : ndarray (4, 3)
        Foot placement shifts for swinging feet [m].
    drift_in_base : ndarray (4, 2)
        What standing feet add to the velocity of their paths [m/s].
    correction : ndarray (3,)
        What the legs add to the reference velocity of the stance feet: v_x, v_y [m/s], γ [rad/s].
    command : BodyCommand
        What the body does.
    measured : ndarray (12,)
        Measured joint angles that the feedback was made of [rad].
    foot_force : ndarray (4,)
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

    torque: Array
    shift_in_base: Array
    drift_in_base: Array
    correction: Array
    command: BodyCommand = STANDING
    measured: Array = field(default_factory=lambda: np.zeros(12))
    foot_force: Array = field(default_factory=lambda: np.zeros(4))
    margins: tuple[float, ...] = WIDE
    progress: Progress | None = None
    felt: tuple[bool, ...] = FELT
    level: tuple[float, ...] = LEVEL_FEET

    def of_leg(self, i: int) -> LegFeedback:
        """What the path of leg ``i`` takes of it."""
        measured, shift, drift, correction, force = self._numbers
        return LegFeedback(
            measured[3 * i:3 * i + 3], shift[i], drift[i], correction, force[i], self.level[i],
            self.progress.rough if self.progress else 0.0)

    @cached_property
    def _numbers(self) -> tuple[list[float], list[list[float]], list[list[float]], list[float],
                                list[float]]:
        """What is told of the legs, as numbers: four legs ask in turn."""
        return (self.measured.tolist(), self.shift_in_base.tolist(), self.drift_in_base.tolist(),
                self.correction.tolist(), self.foot_force.tolist())
