# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Disturbances of a whole walk, drawn: some of a slippery floor, hills and bumps, a payload, and
pushes, each well within what is borne alone. No controller knows of any of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import pi, sqrt

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import parameter
from dmp_cpg_ros.core.robot_model.grounds import Blocks, Slope, Surface, World, as_of
from dmp_cpg_ros.core.robot_model.rough_grounds import Hills, waves
from dmp_cpg_ros.studies.push_trials import PUSH_DURATIONS
from dmp_cpg_ros.studies.walking_trials import Values

FRICTION, PAYLOAD = (0.4, 0.6), (0.0, 0.3)
"""Of the floor; mass in the trunk as a share of the robot's."""

DEGREES, WAVE, BUMPS, LONGEST_WAVE = (0.0, 5.0), (1.5, 6.0), (0.0, 0.03), 10.0
"""Mean slope of hills [deg], length of their waves and height of bumps on them, for the package's
own robot, and the longest waves [m].
"""

PUSHES, SPEED_CHANGE = (3.0, 8.0), (0.0, 0.6)
"""Times between pushes [s], and by how much they would change the speed of a free body [m/s]."""

REACH, CORNERS, START = 60.0, 0.2, 0.7
"""Of rough ground: how far it reaches to all sides, the distance of its corners, and the flat
around the start [m].
"""


@dataclass(frozen=True)
class Wilderness(World):
    """Hills and bumps to all sides, as far as a walk of a minute comes."""

    degrees: float = as_of(Slope, 'degrees')
    wave: float = as_of(Hills, 'wave')
    bumps: float = parameter(0.02, 'height of the highest bump', 0.0, 1.0, unit='m')
    seed: int = as_of(Blocks, 'seed')

    def surface(self) -> Surface:
        """Waves, and a height of its own for every corner; flat around the start."""
        return _wilderness(self.degrees, self.wave, self.bumps, self.seed)

    @property
    def floor(self) -> float:
        """Height of the floor, below all hollows."""
        return float(self.surface().height.min()) - 0.05

    def _height(self, x: Array, y: Array) -> Array:
        return self.surface().at(x, y, self.floor)


@lru_cache(maxsize=2)
def _wilderness(degrees: float, wave: float, bumps: float, seed: int) -> Surface:
    draw = np.random.default_rng(seed)
    x = np.linspace(-REACH, REACH, round(2.0 * REACH / CORNERS) + 1)
    height = waves(degrees, wave, draw, x, x)
    height += bumps * draw.random(height.shape)
    into = np.clip(np.hypot(x, x[:, None]) - START, 0.0, 1.0)
    height *= into ** 2 * (3.0 - 2.0 * into)
    height.flags.writeable = False
    return Surface((-REACH, REACH), (-REACH, REACH), height)


@dataclass(frozen=True)
class Disturbance:
    """What disturbs one walk.

    Attributes
    ----------
    world : World, optional
        Flat without.
    values : tuple of (str, value)
        Parameters of the robot that its controllers do not know.
    pushes : bool
        Whether it is pushed.
    told : dict of str to float
        World and values in numbers.
    """

    world: World | None = None
    values: Values = ()
    pushes: bool = False
    told: dict[str, float] = field(default_factory=dict)

    @classmethod
    def drawn(cls, seed: int, size: float = 1.0) -> Disturbance:
        """Draw one, for a robot of so many times the lengths of the package's own: each kind with
        a probability of a half.
        """
        rng = _rngs(seed)[0]
        slips, carries, rough, pushed = (rng.random(4) < 0.5).tolist()
        friction, payload, degrees, bumps = (
            float(rng.uniform(*of)) for of in (FRICTION, PAYLOAD, DEGREES, BUMPS))
        ground = {'friction': friction} if slips else {}
        values = {'payload': payload} if carries else {}
        hills = {'degrees': degrees, 'bumps': size * bumps,
                 'wave': min(size * float(rng.uniform(*WAVE)), LONGEST_WAVE)}
        told = {**ground, **values, **(hills if rough else {})}
        return cls(Wilderness(**ground, **hills, seed=seed) if rough else World(**ground),
                   tuple(values.items()), pushed, told)


UNDISTURBED = Disturbance()


def pushes(seed: int, seconds: float, size: float = 1.0
           ) -> list[tuple[float, str, tuple[float, float, float]]]:
    """Pushes of one walk of a robot of so many times the package's own lengths, as events of time,
    ``push``, and speed change [m/s], direction in the base frame [rad] and duration [s]; those of
    a longer one begin with them.
    """
    rng, at, events = _rngs(seed)[1], 0.0, []
    while (at := at + float(rng.uniform(*PUSHES))) < seconds:
        events.append((at, 'push', (sqrt(size) * float(rng.uniform(*SPEED_CHANGE)),
                                    float(rng.uniform(0.0, 2.0 * pi)),
                                    round(float(rng.uniform(*PUSH_DURATIONS)), 2))))
    return events


def _rngs(seed: int) -> list[np.random.Generator]:
    """Other numbers than those of the commands of the same seed."""
    return np.random.default_rng((seed, 1)).spawn(2)
