# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds to walk in by their names. A world is chosen by parameters of the robot, or by the entry
``world`` of a scenario.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import Parameters, parameter, shown
from dmp_cpg_ros.core.robot_model.grounds import Blocks, LowFriction, Slope, Steps, World, as_of
from dmp_cpg_ros.core.robot_model.rough_grounds import Gaps, Hills, RoughSlope

WORLDS: dict[str, type[World]] = {'flat': World, 'slope': Slope, 'blocks': Blocks, 'steps': Steps,
                                  'low_friction': LowFriction, 'rough_slope': RoughSlope,
                                  'gaps': Gaps, 'hills': Hills}
"""Worlds by the word that chooses them."""

PREFIX = 'world_'
"""What stands before a world's parameter among the parameters of a node."""


@dataclass(frozen=True)
class WorldParameters(Parameters):
    """Which world the robot walks in; each kind uses those of its own."""

    world: str = parameter('flat', 'kind of ground', choices=tuple(WORLDS))
    world_degrees: float = as_of(Slope, 'degrees')
    world_height: float = as_of(Blocks, 'height')
    world_size: float = as_of(Blocks, 'size')
    world_seed: int = as_of(Blocks, 'seed')
    world_depth: float = as_of(Steps, 'depth')
    world_count: int = as_of(Steps, 'count')
    world_platform: float = as_of(Steps, 'platform')
    world_width: float = as_of(Gaps, 'width')
    world_wave: float = as_of(Hills, 'wave')
    world_friction: float = as_of(World, 'friction')

    def build(self) -> World:
        """Make the world."""
        kind = WORLDS[self.world]
        given = {field.name: getattr(self, PREFIX + field.name)
                 for field in dataclasses.fields(kind)}
        if given['friction'] == 0.0:
            del given['friction']
        return kind(**given)


def world_overrides(values: Any, where: str) -> dict[str, Any]:
    """Parameters of the robot for the entry ``world`` of a scenario.

    Parameters
    ----------
    values : mapping or None
        ``kind`` and that world's own parameters, such as ``{kind: blocks, height: 0.05}``.
    where : str
        For the text of errors.

    Returns
    -------
    dict
        Such as ``{'world': 'blocks', 'world_height': 0.05}``; empty for None.

    Raises
    ------
    DataError
        If the kind or one of its parameters is not known, or a value is bad.
    """
    if values is None:
        return {}
    kind = values.get('kind') if isinstance(values, Mapping) else None
    if not isinstance(kind, str) or kind not in WORLDS:
        raise DataError(f'{where}: world must be a mapping with kind, one of {", ".join(WORLDS)}, '
                        f'not {shown(values)}')
    own = {name: value for name, value in values.items() if name != 'kind'}
    try:
        WORLDS[kind].from_mapping(own, 'world')
    except ParameterError as error:
        raise DataError(f'{where}: {kind}: {error}') from error
    return {'world': kind, **{PREFIX + name: value for name, value in own.items()}}


def height_over_ground(world: World, base_position_in_world: ArrayLike, hips_in_world: ArrayLike
                       ) -> Array:
    """Height of the base over the ground below its hips.

    Parameters
    ----------
    world : World
        The world.
    base_position_in_world : array_like (..., 3)
        [m]
    hips_in_world : array_like (..., 4, 3)
        [m]

    Returns
    -------
    ndarray (...)
        [m]
    """
    base, hips = np.asarray(base_position_in_world), np.asarray(hips_in_world)
    height: Array = base[..., 2] - world.height_at(hips[..., 0], hips[..., 1]).mean(axis=-1)
    return height
