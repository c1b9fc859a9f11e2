# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Votes for a stop: the inbox of other nodes' votes, how votes fade, and the tally of a tick.

A weight falls to zero in equal steps after it was last asked for, so that votes are constant
between a few instants: every change of the gains costs the oscillators a new time step, and
``inhibition_state`` a message.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.state import LEGS

Stamps = NDArray[np.int64]

OWN_SOURCES = ('footing', 'collision', 'tilt', 'silence')
"""Names of the sources inside the suite."""

ANONYMOUS = 'user'
"""Name of a voter that does not give one."""

MOST_VOTERS = 12
"""Number of voters from outside whose votes are alive."""

FADE_STEPS = 8
"""Number of equal steps in which a vote fades."""

Vote = tuple[str, tuple[float, ...]]
"""Voter and the weights α_i of the four legs, NaN for legs of which it says nothing."""


class VoteInbox:
    """Checked votes of other nodes, until the tick that counts them."""

    def __init__(self) -> None:
        """Start without votes."""
        self._voters: set[str] = set()
        self._waiting: dict[str, tuple[float, ...]] = {}

    def accept(self, weights: Mapping[str, float], voter: str = '') -> None:
        """Take a vote; it counts from the next :meth:`take` on.

        Parameters
        ----------
        weights : mapping of str to float
            Weight α_i ≥ 0 by leg; zero withdraws the voter's vote of that leg.
        voter : str
            Who votes; votes of different voters add up, a voter's new vote replaces its old one.

        Raises
        ------
        DataError
            If a name or a number cannot be used; nothing is taken then.
        """
        voter = voter or ANONYMOUS
        if not weights or not set(weights) <= set(LEGS):
            raise DataError(
                f'votes for {list(weights)} must name one or more of the legs {", ".join(LEGS)}')
        for leg, weight in weights.items():
            if not (isfinite(weight) and weight >= 0.0):
                raise DataError(f'vote of {leg} = {weight} must be finite and at least 0')
        if voter in OWN_SOURCES or not voter.isprintable() or len(voter) > 40 or '+' in voter:
            raise DataError(
                f'{voter!r} cannot be the name of a voter: it must be printable, of at most 40 '
                f'characters, without +, and none of {", ".join(OWN_SOURCES)}')
        if voter not in self._voters and len(self._voters) >= MOST_VOTERS:
            raise DataError(f"'{voter}' is one voter too many; the {MOST_VOTERS} that can vote "
                            f'are {", ".join(sorted(self._voters))}')
        self._voters.add(voter)
        former = self._waiting.get(voter, (float('nan'),) * len(LEGS))
        self._waiting[voter] = tuple(map(weights.get, LEGS, former))

    def take(self, alive: Collection[str] = ()) -> tuple[Vote, ...]:
        """Votes since the last call, one of each voter, in the order of their arrival; who is
        neither among these voters nor among those whose votes are alive is forgotten.
        """
        if not self._voters:
            return ()
        waiting, self._waiting = self._waiting, {}
        self._voters = {*waiting, *self._voters.intersection(alive)}
        return tuple(waiting.items())


@dataclass(frozen=True)
class VoteMemory:
    """Fading votes of all sources.

    Attributes
    ----------
    asks : mapping of str to (ndarray (4,), ndarray (4,) of int)
        By the source's name: weight α_i of each leg, and the stamp at which it was asked for [ns].
    """

    asks: Mapping[str, tuple[Array, Stamps]] = field(default_factory=dict)

    def heard(self, source: str, weights: Sequence[float] | Array, time_ns: int) -> VoteMemory:
        """Memory after a source has voted; where a weight is NaN its former vote fades on."""
        given = np.asarray(weights, dtype=float)
        said = ~np.isnan(given)
        if not said.any():
            return self
        former, asked_ns = self.asks.get(source, (np.zeros(len(LEGS)), time_ns))
        ask = np.where(said, given, former), np.where(said, time_ns, asked_ns)
        return VoteMemory({**self.asks, source: ask})

    def left(self, time_ns: int, fade_ns: int) -> dict[str, Array]:
        """Weights that are left of each source's votes, which fade within ``fade_ns`` [ns]."""
        return {
            source: weights * np.maximum(
                0, FADE_STEPS - FADE_STEPS * (time_ns - asked_ns) // fade_ns) / FADE_STEPS
            for source, (weights, asked_ns) in self.asks.items()}

    def alive(self, time_ns: int, fade_ns: int) -> VoteMemory:
        """Memory without the sources of which nothing is left."""
        left = self.left(time_ns, fade_ns)
        return VoteMemory({name: ask for name, ask in self.asks.items() if left[name].any()})

    def weights(self, time_ns: int, fade_ns: int) -> Array:
        """Sum of what is left of all votes, per leg, ndarray (4,)."""
        return np.sum([np.zeros(len(LEGS)), *self.left(time_ns, fade_ns).values()], axis=0)

    def causes(self, time_ns: int, fade_ns: int) -> tuple[str, ...]:
        """Names of the sources behind each leg's vote, joined by ``+``; empty without a vote."""
        left = sorted(self.left(time_ns, fade_ns).items())
        return tuple('+'.join(name for name, weights in left if weights[i] > 0.0)
                     for i in range(len(LEGS)))


@dataclass(frozen=True)
class Tally:
    """Result of counting the votes of a tick.

    Attributes
    ----------
    weights : ndarray (4,)
        Clamped weights α_i of the legs.
    gains : ndarray (4,)
        Gains k_inh α_i that they make act [1/s]; the largest alone where the winner takes all.
    stops : bool
        Whether these gains overcome the threshold.
    causes : tuple of str
        What each leg's vote comes from; empty without a vote.
    """

    weights: Array = field(default_factory=lambda: np.zeros(len(LEGS)))
    gains: Array = field(default_factory=lambda: np.zeros(len(LEGS)))
    stops: bool = False
    causes: tuple[str, ...] = ('',) * len(LEGS)

    @property
    def alive(self) -> bool:
        """Whether any leg votes."""
        return bool(self.weights.any())

    @property
    def cause(self) -> str:
        """Who votes and why, such as ``fl footing, rr footing+user``; ``none`` without votes."""
        told = [f'{leg} {cause}' for leg, cause in zip(LEGS, self.causes, strict=True) if cause]
        return ', '.join(told) or 'none'


NO_VOTES = Tally()
"""Nobody votes."""
