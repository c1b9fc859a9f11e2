# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Automatic choice of the gait by speed.

Animals change gait at similar dimensionless speeds û = u/√(g l) (Alexander & Jayes 1983: from
walk to trot about û = 0.7, Froude number 0.5), and later when they speed up than when they slow
down; the band between keeps the choice from flickering.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.gait import BodyScale, Gait
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.parameters import Parameters, parameter


@dataclass(frozen=True)
class GaitChoiceParameters(Parameters):
    """Automatic choice of the gait."""

    auto_gait: bool = parameter(False, 'whether the gait is chosen by the reference speed')
    auto_gaits: tuple[str, ...] = parameter(
        ('walk', 'trot'), 'gaits that auto_gait chooses among, from slow to fast')
    auto_speeds: tuple[float, ...] = parameter(
        (0.3,), 'dimensionless foot speeds u / sqrt(g l) at which auto_gait changes to the next '
        'gait', 0.0, 10.0)
    auto_hysteresis: float = parameter(
        0.05, 'width of the band around each of auto_speeds in which auto_gait keeps the gait',
        0.0, 2.0)

    def __post_init__(self) -> None:
        """Validate; one speed between every two gaits, and bands that do not overlap."""
        super().__post_init__()
        if len(self.auto_speeds) != len(self.auto_gaits) - 1:
            raise ParameterError(
                f'auto_speeds = {list(self.auto_speeds)} must hold one speed between every two of '
                f'auto_gaits = {list(self.auto_gaits)}')
        if len(set(self.auto_gaits)) != len(self.auto_gaits):
            raise ParameterError(f'auto_gaits = {list(self.auto_gaits)} must not repeat a gait')
        if np.any(np.diff(self.auto_speeds) <= self.auto_hysteresis):
            raise ParameterError(
                f'auto_speeds = {list(self.auto_speeds)} must increase by more than '
                f'auto_hysteresis = {self.auto_hysteresis:g}')


def highest_speed(parameters: GaitChoiceParameters, name: str,
                  named: Callable[[str], Gait]) -> float:
    """Dimensionless foot speed up to which commands are followed.

    Parameters
    ----------
    parameters : GaitChoiceParameters
        Whether the gait is chosen, and among which.
    name : str
        Gait that is wanted where it is not chosen.
    named : callable (str) → Gait
        Gait of a name.

    Returns
    -------
    float
        That of the gait, or of the fastest that may be chosen.
    """
    names = parameters.auto_gaits if parameters.auto_gait else (name,)
    return max(named(each).highest_speed for each in names)


def chosen_gait(parameters: GaitChoiceParameters, present: str, r: Array, scale: BodyScale) -> str:
    """Gait for a reference.

    Parameters
    ----------
    parameters : GaitChoiceParameters
        Gaits, speeds, band.
    present : str
        Gait that is wanted now; it is kept when ``auto_gait`` is off.
    r : ndarray (3,)
        Reference v_x, v_y [m/s], γ [rad/s].
    scale : BodyScale
        The robot's lengths.

    Returns
    -------
    str
    """
    p = parameters
    if not p.auto_gait:
        return present
    speed = scale.foot_speed(float(r[0]), float(r[1]), float(r[2]))
    speed /= (GRAVITY * scale.leg_length) ** 0.5
    if present not in p.auto_gaits:
        return p.auto_gaits[sum(speed > border for border in p.auto_speeds)]
    place, half = p.auto_gaits.index(present), 0.5 * p.auto_hysteresis
    while place < len(p.auto_speeds) and speed > p.auto_speeds[place] + half:
        place += 1
    while place > 0 and speed < p.auto_speeds[place - 1] - half:
        place -= 1
    return p.auto_gaits[place]
