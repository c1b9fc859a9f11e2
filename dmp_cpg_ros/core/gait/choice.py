# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Choice of the gait by speed.

The gait may be chosen by speed. Animals change gait at similar dimensionless speeds û = u/√(g l)
(Alexander & Jayes 1983: from walk to trot about û = 0.7, Froude number 0.5), and later when they
speed up than when they slow down; the band between keeps the choice from flickering.

A gait is kept up to its border, or up to its highest speed where that is lower, and commands up to
the highest speed of the last of the gaits: a reference that goes on beyond what the gait in force
can do leaves the body behind, and a Go1 that ambled after one of 1.85 m/s at its 1.68 fell. Nor
does a reference speed up while the gait changes, beyond what is borne when a change is asked for
(:func:`~dmp_cpg_ros.core.gait.transition.changing_speed`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.transition import GaitInForce
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
            raise ParameterError('auto_speeds must increase by more than auto_hysteresis')

    def check_asked(self, gait: str) -> None:
        """Raise ParameterError for a gait that is asked for while gaits are chosen."""
        if self.auto_gait:
            raise ParameterError(
                f"gait = '{gait}' cannot be set while auto_gait chooses among "
                f'{", ".join(self.auto_gaits)}; set auto_gait to false first')


def limiting_gaits(parameters: GaitChoiceParameters, name: str, named: Callable[[str], Gait],
                   cadence_scale: float = 1.0) -> tuple[Gait, ...]:
    """Gaits whose limits commands are to keep.

    Parameters
    ----------
    parameters : GaitChoiceParameters
        Whether the gait is chosen, and among which.
    name : str
        Gait that is wanted where it is not chosen.
    named : callable (str) → Gait
        Gait of a name.
    cadence_scale : float
        Factor on the cadence that is wanted.

    Returns
    -------
    tuple of Gait
        The gait, or all that may be chosen.
    """
    names = parameters.auto_gaits if parameters.auto_gait else (name,)
    return tuple(named(each).limiting(cadence_scale) for each in names)


def chosen_gait(parameters: GaitChoiceParameters, present: str, r: Array, scale: BodyScale,
                gaits: Sequence[Gait] = ()) -> str:
    """Gait for a reference. Where a gait ends below its border, its end is the border.

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
    gaits : sequence of Gait
        Those of ``auto_gaits``, whose highest speeds count where they are given.

    Returns
    -------
    str
    """
    p = parameters
    if not p.auto_gait:
        return present
    velocity = float(r[0]), float(r[1]), float(r[2])
    root, half = (GRAVITY * scale.leg_length) ** 0.5, 0.5 * p.auto_hysteresis
    speed = scale.foot_speed(*velocity) / root
    beyond = [speed - border for border in p.auto_speeds]
    for i, gait in enumerate(gaits[:len(beyond)]):
        end = gait.highest(scale) - half
        beyond[i] = max(beyond[i], gait.limiting_speed(velocity, scale) / root - end)
    if present not in p.auto_gaits:
        return p.auto_gaits[sum(each > 0.0 for each in beyond)]
    place = p.auto_gaits.index(present)
    while place < len(beyond) and beyond[place] > half:
        place += 1
    while place > 0 and beyond[place - 1] < -half:
        place -= 1
    return p.auto_gaits[place]


class Changing(NamedTuple):
    """Change of the gait, while which commands are shortened.

    Attributes
    ----------
    wanted : Gait
        Into which gaits change.
    chosen : bool
        Whether it was chosen by speed, and is made at any.
    """

    wanted: Gait
    chosen: bool = False


def changing_to(parameters: GaitChoiceParameters, gait: GaitInForce, asked: Gait
                ) -> Changing | None:
    """Change that shortens commands: into the gait that was asked for, begun or not; one that was
    chosen only once it has begun. None for none.
    """
    if not parameters.auto_gait:
        return None if gait.name == asked.name else Changing(asked)
    return Changing(gait.ends[-1], True) if len(gait.ends) > 1 else None
