# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a run besides its recording: the robot, the gait, the inhibition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES

CONTACT_WEIGHT_SHARE = 0.02
"""A foot is on the ground while it carries more than this share of the weight."""

USUAL_CONTACT_FORCE = 2.0
"""The same for a robot whose mass is not known [N]."""


@dataclass(frozen=True)
class RunContext:
    """Knowledge that metrics and figures use when they have it.

    Attributes
    ----------
    robot : RobotDescription or None
        Geometry, mass and limits; metrics that need them are null without.
    gait : Gait or None
        The gait that the walk began with; without, phase offsets are taken from the recording.
    inhibition : InhibitionParameters
        Region C and inhibited legs.
    radius : float
        Radius r of the limit cycle.
    world : World
        What the robot walked on.
    gaits : mapping of str to Gait
        Gaits that it may have changed to.
    """

    robot: RobotDescription | None = None
    gait: Gait | None = None
    inhibition: InhibitionParameters = field(default_factory=InhibitionParameters)
    radius: float = 1.0
    world: World = field(default_factory=World)
    gaits: Mapping[str, Gait] = field(default_factory=dict)

    @property
    def contact_force(self) -> float:
        """Normal force above which a foot counts as being on the ground [N]."""
        if self.robot is None:
            return USUAL_CONTACT_FORCE
        return CONTACT_WEIGHT_SHARE * self.robot.mass * GRAVITY

    @property
    def joint_names(self) -> tuple[str, ...]:
        """What the robot calls its joints, in the order of ``JOINT_NAMES``."""
        return JOINT_NAMES if self.robot is None else self.robot.joint_names


def find_parameter(parameters: Mapping[str, Any] | None, name: str, default: Any = None) -> Any:
    """Value of a parameter wherever it stands in nested mappings."""
    for key, value in (parameters or {}).items():
        if isinstance(value, Mapping):
            value = find_parameter(value, name)
        elif key != name:
            continue
        if value is not None:
            return value
    return default
