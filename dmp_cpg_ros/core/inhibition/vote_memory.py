# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Votes that fade: who asked for how much, and when.

A weight falls to zero in equal steps after it was last asked for, so that votes are constant
between a few instants: every change of the gains costs the oscillators a new time step, and
``inhibition_state`` a message.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isnan

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]

FADE_STEPS = 8
"""Number of equal steps in which a vote fades."""

@dataclass(frozen=True)
class Ask:
    """What one source last asked for.

    Attributes
    ----------
    weights : tuple of float
        α_i of each leg, at least zero.
    asked_ns : tuple of int
        Stamps at which each was asked for [ns].
    """

    weights: tuple[float, ...]
    asked_ns: tuple[int, ...]

    def faded(self, time_ns: int, fade_ns: int) -> tuple[float, ...]:
        """Weights that are left at a time, of votes that fade within ``fade_ns`` [ns]."""
        return tuple(
            weight * max(0, FADE_STEPS - FADE_STEPS * (time_ns - asked) // fade_ns) / FADE_STEPS
            for weight, asked in zip(self.weights, self.asked_ns, strict=True)
        )


@dataclass(frozen=True)
class VoteMemory:
    """Votes of all sources; immutable.

    Attributes
    ----------
    asks : mapping of str to Ask
        By the source's name.
    """

    asks: Mapping[str, Ask] = field(default_factory=dict)

    def heard(self, source: str, weights: Sequence[float], time_ns: int) -> VoteMemory:
        """Memory after a source has spoken.

        Parameters
        ----------
        source : str
            Who speaks.
        weights : sequence of float
            α_i of the four legs; NaN where the source says nothing: its former vote fades on.
        time_ns : int
            Stamp [ns].
        """
        if all(map(isnan, weights)):
            return self
        former = self.asks.get(source)
        former = former or Ask((0.0,) * len(LEGS), (time_ns,) * len(LEGS))
        said = [not isnan(weight) for weight in weights]
        ask = Ask(
            tuple(float(w) if s else f for w, s, f in zip(
                weights, said, former.weights, strict=True)),
            tuple(time_ns if s else f for s, f in zip(said, former.asked_ns, strict=True)),
        )
        return VoteMemory({**self.asks, source: ask})

    def alive(self, time_ns: int, fade_ns: int) -> VoteMemory:
        """Memory without the sources of which nothing is left."""
        dead = [name for name, ask in self.asks.items() if not any(ask.faded(time_ns, fade_ns))]
        if not dead:
            return self
        return VoteMemory({name: ask for name, ask in self.asks.items() if name not in dead})

    def weights(self, time_ns: int, fade_ns: int) -> Array:
        """Sum of what is left of all votes, per leg, ndarray (4,)."""
        total = np.zeros(len(LEGS))
        for ask in self.asks.values():
            total += ask.faded(time_ns, fade_ns)
        return total

    def causes(self, time_ns: int, fade_ns: int) -> tuple[str, ...]:
        """Names of the sources behind each leg's vote, joined by ``+``; empty without a vote."""
        left = {name: ask.faded(time_ns, fade_ns) for name, ask in sorted(self.asks.items())}
        return tuple(
            '+'.join(name for name, weights in left.items() if weights[i] > 0.0)
            for i in range(len(LEGS))
        )
