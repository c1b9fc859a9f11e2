# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the simulated robot differs from the model that its controllers have."""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES


@dataclass(frozen=True)
class MismatchParameters(Parameters):
    """What the simulated robot is and its controllers do not know; by default nothing."""

    payload: float = parameter(
        0.0, "mass added to the simulated robot's trunk, spread as its own, as a share of the "
        "robot's", 0.0, 3.0)
    mass_offset: tuple[float, ...] = parameter(
        (0.0, 0.0), "displacement of the centre of mass of the simulated robot's trunk, ahead and "
        'to the left', -0.1, 0.1, unit='m')
    joint_friction: float = parameter(
        1.0, "factor on dry friction and damping of the simulated robot's joints", 0.0, 100.0)
    joint_strength: tuple[float, ...] = parameter(
        (1.0,) * len(JOINT_NAMES), "factors on the torques of the simulated robot's drives: "
        'abduction, hip, knee of fl, fr, rl, rr', 0.0, 2.0)

    def __post_init__(self) -> None:
        """Validate; raises ParameterError for lists of a wrong length."""
        super().__post_init__()
        for name, size in (('mass_offset', 2), ('joint_strength', len(JOINT_NAMES))):
            if len(getattr(self, name)) != size:
                raise ParameterError(
                    f'{name} must hold {size} numbers, not {list(getattr(self, name))}')
