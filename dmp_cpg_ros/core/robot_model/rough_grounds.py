# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rougher grounds: blocks on a slope, gaps, hills."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, radians, sin, tan

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import parameter
from dmp_cpg_ros.core.robot_model.grounds import (
    ACROSS,
    HALF_WIDTH,
    LENGTH,
    LEVEL,
    PATCH,
    THICKNESS,
    Blocks,
    Box,
    Slope,
    Steps,
    Surface,
    World,
    as_of,
    block_heights,
    slab,
)


@dataclass(frozen=True)
class RoughSlope(Slope):
    """A slope on which square blocks of random heights stand upright to it."""

    height: float = as_of(Blocks, 'height')
    size: float = as_of(Blocks, 'size')
    seed: int = as_of(Blocks, 'seed')

    def _blocks(self) -> Array:
        return block_heights(self.size, self.seed) * self.height

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
    depth: float = as_of(Steps, 'depth')
    count: int = as_of(Steps, 'count')

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
        return tuple(slab(ends, ACROSS, (-THICKNESS, 0.0)) for ends in self._ends())

    def _height(self, x: Array, y: Array) -> Array:
        if self.width == 0.0:
            return super()._height(x, y)
        on = np.any([(x >= start) & (x <= end) for start, end in self._ends()], axis=0)
        return np.where(on & (np.abs(y) <= HALF_WIDTH), 0.0, self.floor)


@dataclass(frozen=True)
class Hills(World):
    """Hills and hollows: waves from all directions, as steep as they say in the mean."""

    degrees: float = as_of(Slope, 'degrees')
    wave: float = parameter(
        1.5, 'hills: length of their waves, within a third', 0.3, 10.0, unit='m')
    seed: int = as_of(Blocks, 'seed')

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
    height = waves(degrees, wave, np.random.default_rng(seed), x, y)
    into = np.clip(x - PATCH - 1e-9, 0.0, 1.0)
    height = np.maximum(height, 0.05 - THICKNESS) * into ** 2 * (3.0 - 2.0 * into)
    height.flags.writeable = False
    return Surface((begin, end), (-HALF_WIDTH, HALF_WIDTH), height)


def waves(degrees: float, wave: float, draw: np.random.Generator, x: Array, y: Array) -> Array:
    """Heights of waves from all directions at the corners of a grid, ndarray (along y, along x)
    [m]; steepness and length as of :class:`Hills`.
    """
    height = np.zeros((len(y), len(x)))
    for _ in range(WAVES):
        angle, turn = draw.uniform(0.0, 2.0 * pi, 2)
        rate = 2.0 * pi / (wave * draw.uniform(2.0 / 3.0, 4.0 / 3.0))
        size = tan(radians(degrees)) * (2.0 / WAVES) ** 0.5 / rate
        height += size * np.cos(
            rate * (np.cos(angle) * x + np.sin(angle) * y[:, None]) + turn)
    return height
