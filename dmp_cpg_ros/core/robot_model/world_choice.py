# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Choice of the world: by parameters of the robot, or by the entry ``world`` of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.parameters import Parameters, parameter, shown
from dmp_cpg_ros.core.robot_model.world import Blocks, LowFriction, Slope, Steps, World

WORLDS: dict[str, type[World]] = {
    kind.KIND: kind for kind in (World, Slope, Blocks, Steps, LowFriction)
}
"""Worlds by the word that chooses them."""

PREFIX = 'world_'
"""What stands before a world's parameter among the parameters of a node."""


@dataclass(frozen=True)
class WorldParameters(Parameters):
    """Which world the robot walks in; each kind uses those of its own."""

    world: str = parameter('flat', 'kind of ground', choices=tuple(WORLDS))
    world_degrees: float = parameter(
        10.0, 'slope: its angle; negative: downhill', unit='deg', minimum=-40.0, maximum=40.0
    )
    world_height: float = parameter(
        0.05, 'blocks: height of the highest; steps: height of each', unit='m', minimum=0.0,
        maximum=1.0,
    )
    world_size: float = parameter(
        0.2, 'blocks: side of each', unit='m', minimum=0.05, maximum=2.0
    )
    world_seed: int = parameter(0, 'blocks: seed of their heights', minimum=0)
    world_depth: float = parameter(
        0.35, 'steps: depth of each', unit='m', minimum=0.05, maximum=4.0
    )
    world_count: int = parameter(
        1, 'steps: how many up, and down', minimum=1, maximum=50
    )
    world_platform: float = parameter(
        2.0, 'steps: length of the platform on top', unit='m', minimum=0.1, maximum=20.0
    )
    world_friction: float = parameter(
        0.0, "sliding friction of all contacts; 0: the model's own, 0.3 on low_friction",
        minimum=0.0, maximum=2.0,
    )

    def build(self) -> World:
        """Make the world."""
        kind = WORLDS[self.world]
        given = {field.name: getattr(self, PREFIX + field.name) for field in fields(kind)}
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
        raise DataError(
            f'{where}: world must be a mapping with kind, one of {", ".join(WORLDS)}, '
            f'not {shown(values)}'
        )
    own = {name: value for name, value in values.items() if name != 'kind'}
    try:
        WORLDS[kind].from_mapping(own, 'world')
    except ParameterError as error:
        raise DataError(f'{where}: {kind}: {error}') from error
    return {'world': kind, **{PREFIX + name: value for name, value in own.items()}}
