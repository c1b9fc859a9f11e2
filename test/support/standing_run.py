# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The walking loop on a robot that only stands: nothing of the body enters the oscillators, the
reference or the words of a stop.
"""

from __future__ import annotations

from copy import copy, deepcopy
from dataclasses import replace
from functools import lru_cache
from itertools import groupby

from core_examples import GAITS, TICK_NS, quadruped, standing_state, suite_parameters
from limbless import LimblessLoop, NoBalance

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.loop import Tick

ROBOT = quadruped()
STANDING = standing_state(ROBOT)
TICK = TICK_NS * 1e-9


class Run:
    """A walking loop on a robot that stands still, tick by tick."""

    def __init__(self, gait: str = 'amble', **changes: object) -> None:
        self.loop = LimblessLoop(ROBOT, GAITS[gait], suite_parameters(**changes))
        self.loop.body.posture = NoBalance(ROBOT, PostureParameters())
        self.time_ns = 0
        self.ticks: list[Tick] = []

    def go(self, seconds: float) -> Run:
        for _ in range(round(seconds / TICK)):
            self.ticks.append(self.loop.tick(replace(STANDING, time_ns=self.time_ns)))
            self.time_ns += TICK_NS
        return self

    def copy(self) -> Run:
        """A run that goes on as this one does; both have the same past."""
        other = copy(self)
        other.loop, other.ticks = deepcopy(self.loop), list(self.ticks)
        return other

    def until(self, *words: str, longest: float = 12.0) -> float:
        """Time until the state is one of the words [s]."""
        for k in range(1, round(longest / TICK) + 1):
            self.go(TICK)
            if self.loop.stop.state in words:
                return k * TICK
        raise AssertionError(f'{self.loop.stop.state} for {longest} s')

    def words(self) -> list[str]:
        return [word for word, _ in groupby(tick.supervisor.state for tick in self.ticks)]


def walking(gait: str = 'amble', speed: float = 0.5, seconds: float = 3.0,
            **changes: object) -> Run:
    """A run that walks: what was walked in the same way before, from there on."""
    return walked(gait, speed, seconds, tuple(sorted(changes.items()))).copy()


@lru_cache(maxsize=32)
def walked(gait: str, speed: float, seconds: float, changes: tuple[tuple[str, object], ...]
           ) -> Run:
    run = Run(gait, **dict(changes)).go(2 * TICK)
    run.loop.command(speed)
    return run.go(seconds)
