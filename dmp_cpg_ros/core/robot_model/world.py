# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds to walk in, as data: what stands on the floor and how high the ground is anywhere.

The robot starts at the origin, facing along x, on a patch that is flat up to x = ``PATCH``. A
world is chosen by parameters of the robot, or by the entry ``world`` of a scenario.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import cos, pi, radians, sin, tan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import Parameters, parameter, shown

PATCH = 0.7
"""The ground is flat from behind the robot to here, about 1 m around its feet [m]."""

LENGTH = 8.0
"""Length of a slope and of a field of blocks along x [m]."""

HALF_WIDTH = 3.0
"""What stands on the floor reaches so far to either side of the x axis [m]."""

LEVEL = 4.0
"""Length of the level ground at the top of a slope [m]."""

THICKNESS = 1.0
"""Thickness of slabs, most of it inside the floor [m]."""

_ACROSS = (-HALF_WIDTH, HALF_WIDTH)


@dataclass(frozen=True)
class Box:
    """A box of the terrain.

    Attributes
    ----------
    centre : tuple of float
        In the world [m].
    half_size : tuple of float
        [m]
    pitch : float
        Rotation about +y [rad]; a positive one lowers the end towards +x.
    """

    centre: tuple[float, float, float]
    half_size: tuple[float, float, float]
    pitch: float = 0.0


class Surface(NamedTuple):
    """Ground that rises and falls: heights on a grid, and triangles between.

    Attributes
    ----------
    x, y : tuple of float
        Where the grid begins and ends [m].
    height : ndarray (along y, along x)
        Of the grid's corners [m].
    """

    x: tuple[float, float]
    y: tuple[float, float]
    height: Array

    def at(self, x: Array, y: Array, beside: float) -> Array:
        """Height at places [m]; ``beside`` where the surface does not reach."""
        rows, columns = self.height.shape
        u = (x - self.x[0]) / (self.x[1] - self.x[0]) * (columns - 1)
        v = (y - self.y[0]) / (self.y[1] - self.y[0]) * (rows - 1)
        i = np.clip(np.floor(u).astype(int), 0, columns - 2)
        j = np.clip(np.floor(v).astype(int), 0, rows - 2)
        right, up, h = u - i, v - j, self.height
        # the diagonal of a cell goes from its corner (0, 0) to (1, 1)
        height = np.where(
            right > up,
            h[j, i] + right * (h[j, i + 1] - h[j, i]) + up * (h[j + 1, i + 1] - h[j, i + 1]),
            h[j, i] + up * (h[j + 1, i] - h[j, i]) + right * (h[j + 1, i + 1] - h[j + 1, i]))
        inside = (u >= 0.0) & (u <= columns - 1) & (v >= 0.0) & (v <= rows - 1)
        return np.where(inside, height, beside)


@dataclass(frozen=True)
class World(Parameters):
    """A flat floor; the base of all worlds."""

    friction: float = parameter(
        0.0, "sliding friction of all contacts; 0: the model's own, 0.3 on low_friction", 0.0, 2.0)

    @property
    def floor(self) -> float:
        """Height of the floor on which everything stands [m]."""
        return 0.0

    @cached_property
    def is_flat(self) -> bool:
        """Whether nothing stands on the floor; asked for at every tick."""
        return not self.boxes() and self.surface() is None

    def boxes(self) -> tuple[Box, ...]:
        """What stands on the floor."""
        return ()

    def surface(self) -> Surface | None:
        """Ground over the floor that is not made of boxes."""
        return None

    def height_at(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Height of the ground.

        Parameters
        ----------
        x, y : array_like (...)
            Places in the world [m].

        Returns
        -------
        ndarray (...)
            [m]
        """
        return self._height(*np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float)))

    def _height(self, x: Array, y: Array) -> Array:
        return np.zeros(x.shape)


@dataclass(frozen=True)
class LowFriction(World):
    """A flat, slippery floor."""

    friction: float = parameter(0.3, 'sliding friction of all contacts', 0.02, 2.0)


@dataclass(frozen=True)
class Slope(World):
    """A slope, and level ground at both of its ends."""

    degrees: float = parameter(
        10.0, 'slope: its angle; negative: downhill; hills: in the mean', -40.0, 40.0, unit='deg')

    @property
    def floor(self) -> float:
        """Height of the floor: the foot of the slope."""
        return min(0.0, self._rise)

    @property
    def _rise(self) -> float:
        return LENGTH * tan(radians(self.degrees))

    def boxes(self) -> tuple[Box, ...]:
        """The ramp and the level ground at its top."""
        if self.degrees == 0.0:
            return ()
        angle, half = radians(self.degrees), 0.5 * THICKNESS
        ramp = Box((PATCH + 0.5 * LENGTH + half * sin(angle), 0.0,
                    0.5 * self._rise - half * cos(angle)),
                   (0.5 * LENGTH / cos(angle), HALF_WIDTH, half), -angle)
        start = PATCH - LEVEL if self.degrees < 0.0 else PATCH + LENGTH
        top = max(0.0, self._rise)
        return ramp, _slab((start, start + LEVEL), _ACROSS, (top - abs(self._rise), top))

    def _height(self, x: Array, y: Array) -> Array:
        along = np.clip(x - PATCH, 0.0, LENGTH) / LENGTH * self._rise
        upper = x <= PATCH if self.degrees < 0.0 else x >= PATCH + LENGTH
        end = x < PATCH - LEVEL if self.degrees < 0.0 else x > PATCH + LENGTH + LEVEL
        return np.where((np.abs(y) > HALF_WIDTH) | (upper & end), self.floor, along)


@dataclass(frozen=True)
class Blocks(World):
    """A field of square blocks of random heights."""

    height: float = parameter(
        0.05, 'blocks: height of the highest; steps: height of each', 0.0, 1.0, unit='m')
    size: float = parameter(0.2, 'blocks: side of each', 0.05, 2.0, unit='m')
    seed: int = parameter(0, 'blocks: seed of their heights', 0)

    def heights(self) -> Array:
        """Heights of the blocks, uniform in [0, ``height``], ndarray (along x, along y) [m]."""
        return _block_heights(self.size, self.seed) * self.height

    def boxes(self) -> tuple[Box, ...]:
        """All blocks."""
        if self.height == 0.0:
            return ()
        heights, size = self.heights(), self.size
        left = -0.5 * heights.shape[1] * size
        return tuple(_slab((PATCH + i * size, PATCH + (i + 1) * size),
                           (left + j * size, left + (j + 1) * size), (-0.1, float(height)))
                     for (i, j), height in np.ndenumerate(heights))

    def _height(self, x: Array, y: Array) -> Array:
        heights = self.heights()
        i = np.floor((x - PATCH) / self.size).astype(int)
        j = np.floor(y / self.size + 0.5 * heights.shape[1]).astype(int)
        inside = (i >= 0) & (i < heights.shape[0]) & (j >= 0) & (j < heights.shape[1])
        return np.where(inside, heights[np.where(inside, i, 0), np.where(inside, j, 0)], 0.0)


def _as_of(world: type[World], name: str) -> Any:
    """The same parameter as another world's."""
    field = world.__dataclass_fields__[name]
    return dataclasses.field(default=field.default, metadata=field.metadata)


@dataclass(frozen=True)
class Steps(World):
    """Steps up, a platform, and as many steps down."""

    height: float = _as_of(Blocks, 'height')
    depth: float = parameter(
        0.35, 'steps: depth of each; gaps: length of the ground between', 0.05, 4.0, unit='m')
    count: int = parameter(1, 'steps: how many up, and down; gaps: how many', 1, 50)
    platform: float = parameter(2.0, 'steps: length of the platform on top', 0.1, 20.0, unit='m')

    def _ends(self) -> list[tuple[float, float]]:
        """Where each layer begins and ends along x [m], the lowest first."""
        whole = 2.0 * (self.count - 1) * self.depth + self.platform
        return [(PATCH + i * self.depth, PATCH + whole - i * self.depth)
                for i in range(self.count)]

    def boxes(self) -> tuple[Box, ...]:
        """One slab per step, the highest in the middle."""
        if self.height == 0.0:
            return ()
        return tuple(_slab(ends, _ACROSS, (i * self.height - 0.1, (i + 1) * self.height))
                     for i, ends in enumerate(self._ends()))

    def _height(self, x: Array, y: Array) -> Array:
        layers = np.sum([(x >= start) & (x < end) for start, end in self._ends()], axis=0)
        return np.where(np.abs(y) <= HALF_WIDTH, layers * self.height, 0.0)


@dataclass(frozen=True)
class RoughSlope(Slope):
    """A slope on which square blocks of random heights stand upright to it."""

    height: float = _as_of(Blocks, 'height')
    size: float = _as_of(Blocks, 'size')
    seed: int = _as_of(Blocks, 'seed')

    def _blocks(self) -> Array:
        return _block_heights(self.size, self.seed) * self.height

    @property
    def _step(self) -> float:
        """Length of a block along x [m]."""
        return self.size * cos(radians(self.degrees))

    @property
    def _begin(self) -> float:
        """Where the blocks begin along x: none leans over the flat ground [m]."""
        return PATCH + self.height * max(0.0, sin(radians(self.degrees)))

    @property
    def _rows(self) -> int:
        """How many blocks there are along x."""
        return min(round(LENGTH / self.size), int((LENGTH - self.height) / self._step))

    def _middle(self, i: ArrayLike, height: ArrayLike) -> tuple[Array, Array]:
        """Middle of the top of a block along x and z [m]."""
        angle, up = radians(self.degrees), np.asarray(height)
        along = self._begin - PATCH + (np.asarray(i) + 0.5) * self._step
        return PATCH + along - up * sin(angle), along * tan(angle) + up * cos(angle)

    def boxes(self) -> tuple[Box, ...]:
        """The slope and all blocks."""
        if self.height == 0.0:
            return super().boxes()
        angle, half = radians(self.degrees), 0.05
        heights = self._blocks()
        left, boxes = -0.5 * heights.shape[1] * self.size, []
        for (i, j), height in np.ndenumerate(heights[:self._rows]):
            x, z = self._middle(i, height - half)
            boxes.append(Box((float(x), left + (j + 0.5) * self.size, float(z)),
                             (0.5 * self.size, 0.5 * self.size, half), -angle))
        return (*super().boxes(), *boxes)

    def _height(self, x: Array, y: Array) -> Array:
        heights, angle, ground = self._blocks(), radians(self.degrees), super()._height(x, y)
        steep, half = tan(angle), 0.5 * self.size
        near = np.floor((x - self._begin) / self._step).astype(int)
        j = np.floor(y / self.size + 0.5 * heights.shape[1]).astype(int)
        for i in (near - 1, near, near + 1):  # blocks lean over their neighbours
            there = (i >= 0) & (i < self._rows) & (j >= 0) & (j < heights.shape[1])
            middle_x, middle_z = self._middle(
                i, heights[np.where(there, i, 0), np.where(there, j, 0)])
            ahead = x - middle_x
            past = np.abs(ahead) - half * cos(angle)
            # of the sides, that which faces up the slope is seen from above
            side = middle_z + half * abs(sin(angle)) - past / max(abs(steep), 1e-12)
            top = np.where(past <= 0.0, middle_z + ahead * steep,
                           np.where(ahead * steep > 0.0, side, ground))
            ground = np.where(there, np.maximum(ground, top), ground)
        return ground


@dataclass(frozen=True)
class Gaps(World):
    """Gaps across the way, and ground between them."""

    width: float = parameter(0.1, 'gaps: width of each', 0.0, 2.0, unit='m')
    depth: float = _as_of(Steps, 'depth')
    count: int = _as_of(Steps, 'count')

    @property
    def floor(self) -> float:
        """Height of the floor: the bottom of the gaps."""
        return 0.0 if self.width == 0.0 else -THICKNESS

    def _ends(self) -> list[tuple[float, float]]:
        """Where each piece of ground begins and ends along x [m]."""
        after = [PATCH + k * (self.width + self.depth) for k in range(self.count)]
        begins = [PATCH - LEVEL, *(end + self.width for end in after)]
        return list(zip(begins, [*after, PATCH + LENGTH], strict=True))

    def boxes(self) -> tuple[Box, ...]:
        """The pieces of ground."""
        if self.width == 0.0:
            return ()
        return tuple(_slab(ends, _ACROSS, (-THICKNESS, 0.0)) for ends in self._ends())

    def _height(self, x: Array, y: Array) -> Array:
        if self.width == 0.0:
            return super()._height(x, y)
        on = np.any([(x >= start) & (x <= end) for start, end in self._ends()], axis=0)
        return np.where(on & (np.abs(y) <= HALF_WIDTH), 0.0, self.floor)


@dataclass(frozen=True)
class Hills(World):
    """Hills and hollows: waves from all directions, as steep as they say in the mean."""

    degrees: float = _as_of(Slope, 'degrees')
    wave: float = parameter(
        1.5, 'hills: length of their waves, within a third', 0.3, 10.0, unit='m')
    seed: int = _as_of(Blocks, 'seed')

    @property
    def floor(self) -> float:
        """Height of the floor, below all hollows."""
        return -THICKNESS if self.degrees else 0.0

    def surface(self) -> Surface | None:
        """The hills; their slope has the root mean square tan(``degrees``) in x and y together."""
        return _hills(self.degrees, self.wave, self.seed) if self.degrees else None

    def _height(self, x: Array, y: Array) -> Array:
        surface = self.surface()
        return super()._height(x, y) if surface is None else surface.at(x, y, self.floor)


GRID = 0.04
"""Distance of the corners of a surface [m]."""

WAVES = 12
"""Waves that make hills."""


@lru_cache(maxsize=4)
def _hills(degrees: float, wave: float, seed: int) -> Surface:
    """Surface of :class:`Hills`, flat up to ``PATCH`` and as steep as it is to be 1 m later."""
    begin, end = PATCH - LEVEL, PATCH + LENGTH
    x = np.linspace(begin, end, round((end - begin) / GRID) + 1)
    y = np.linspace(-HALF_WIDTH, HALF_WIDTH, round(2.0 * HALF_WIDTH / GRID) + 1)
    draw, height = np.random.default_rng(seed), np.zeros((len(y), len(x)))
    for _ in range(WAVES):
        angle, turn = draw.uniform(0.0, 2.0 * pi, 2)
        rate = 2.0 * pi / (wave * draw.uniform(2.0 / 3.0, 4.0 / 3.0))
        size = tan(radians(degrees)) * (2.0 / WAVES) ** 0.5 / rate
        height += size * np.cos(
            rate * (np.cos(angle) * x + np.sin(angle) * y[:, None]) + turn)
    into = np.clip(x - PATCH - 1e-9, 0.0, 1.0)
    height = np.maximum(height, 0.05 - THICKNESS) * into ** 2 * (3.0 - 2.0 * into)
    height.flags.writeable = False
    return Surface((begin, end), (-HALF_WIDTH, HALF_WIDTH), height)


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


@lru_cache(maxsize=16)
def _block_heights(size: float, seed: int) -> Array:
    """Heights of a field of blocks as shares of the highest."""
    shape = (round(LENGTH / size), 2 * round(HALF_WIDTH / size))
    heights: Array = np.random.default_rng(seed).uniform(0.0, 1.0, shape)
    heights.flags.writeable = False
    return heights


def _slab(*ends: tuple[float, float]) -> Box:
    """An upright box between its ends along x, y and z."""
    (x_0, x_1), (y_0, y_1), (z_0, z_1) = ends
    return Box((0.5 * (x_0 + x_1), 0.5 * (y_0 + y_1), 0.5 * (z_0 + z_1)),
               (0.5 * (x_1 - x_0), 0.5 * (y_1 - y_0), 0.5 * (z_1 - z_0)))


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
    world_degrees: float = _as_of(Slope, 'degrees')
    world_height: float = _as_of(Blocks, 'height')
    world_size: float = _as_of(Blocks, 'size')
    world_seed: int = _as_of(Blocks, 'seed')
    world_depth: float = _as_of(Steps, 'depth')
    world_count: int = _as_of(Steps, 'count')
    world_platform: float = _as_of(Steps, 'platform')
    world_width: float = _as_of(Gaps, 'width')
    world_wave: float = _as_of(Hills, 'wave')
    world_friction: float = _as_of(World, 'friction')

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
