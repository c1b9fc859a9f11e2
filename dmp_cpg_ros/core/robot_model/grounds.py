# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Grounds to walk on, as data: what stands on the floor and how high the ground is anywhere.

The robot starts at the origin, facing along x, on a patch that is flat up to x = ``PATCH``.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import cos, radians, sin, tan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import Parameters, parameter

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

ACROSS = (-HALF_WIDTH, HALF_WIDTH)


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
        return ramp, slab((start, start + LEVEL), ACROSS, (top - abs(self._rise), top))

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
        return block_heights(self.size, self.seed) * self.height

    def boxes(self) -> tuple[Box, ...]:
        """All blocks."""
        if self.height == 0.0:
            return ()
        heights, size = self.heights(), self.size
        left = -0.5 * heights.shape[1] * size
        return tuple(slab((PATCH + i * size, PATCH + (i + 1) * size),
                           (left + j * size, left + (j + 1) * size), (-0.1, float(height)))
                     for (i, j), height in np.ndenumerate(heights))

    def _height(self, x: Array, y: Array) -> Array:
        heights = self.heights()
        i = np.floor((x - PATCH) / self.size).astype(int)
        j = np.floor(y / self.size + 0.5 * heights.shape[1]).astype(int)
        inside = (i >= 0) & (i < heights.shape[0]) & (j >= 0) & (j < heights.shape[1])
        return np.where(inside, heights[np.where(inside, i, 0), np.where(inside, j, 0)], 0.0)


def as_of(world: type[World], name: str) -> Any:
    """The same parameter as another world's."""
    field = world.__dataclass_fields__[name]
    return dataclasses.field(default=field.default, metadata=field.metadata)


@dataclass(frozen=True)
class Steps(World):
    """Steps up, a platform, and as many steps down."""

    height: float = as_of(Blocks, 'height')
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
        return tuple(slab(ends, ACROSS, (i * self.height - 0.1, (i + 1) * self.height))
                     for i, ends in enumerate(self._ends()))

    def _height(self, x: Array, y: Array) -> Array:
        layers = np.sum([(x >= start) & (x < end) for start, end in self._ends()], axis=0)
        return np.where(np.abs(y) <= HALF_WIDTH, layers * self.height, 0.0)


@lru_cache(maxsize=16)
def block_heights(size: float, seed: int) -> Array:
    """Heights of a field of blocks as shares of the highest."""
    shape = (round(LENGTH / size), 2 * round(HALF_WIDTH / size))
    heights: Array = np.random.default_rng(seed).uniform(0.0, 1.0, shape)
    heights.flags.writeable = False
    return heights


def slab(*ends: tuple[float, float]) -> Box:
    """An upright box between its ends along x, y and z."""
    (x_0, x_1), (y_0, y_1), (z_0, z_1) = ends
    return Box((0.5 * (x_0 + x_1), 0.5 * (y_0 + y_1), 0.5 * (z_0 + z_1)),
               (0.5 * (x_1 - x_0), 0.5 * (y_1 - y_0), 0.5 * (z_1 - z_0)))
