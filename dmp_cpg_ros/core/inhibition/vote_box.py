# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where votes from outside the suite arrive: checked, and counted at the next tick."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import LEGS

FOOTING, COLLISION, TILT, SILENCE = 'footing', 'collision', 'tilt', 'silence'

OWN_SOURCES = (FOOTING, COLLISION, TILT, SILENCE)
"""Names of the sources inside the suite."""

ANONYMOUS = 'user'
"""Name of a voter that does not give one."""

MOST_VOTERS = 12
"""Number of voters from outside."""

Vote = tuple[str, tuple[float, ...]]
"""Voter and the weights α_i of the four legs, NaN for legs of which it says nothing."""


class VoteBox:
    """Takes votes when they come and hands them out when they are counted."""

    def __init__(self) -> None:
        """Start without votes."""
        self._voters: set[str] = set()
        self._waiting: list[Vote] = []

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
                f'votes for {list(weights)} must name one or more of the legs {", ".join(LEGS)}'
            )
        for leg, weight in weights.items():
            if not (isfinite(weight) and weight >= 0.0):
                raise DataError(f'vote of {leg} = {weight} must be finite and at least 0')
        self._check_voter(voter)
        self._voters.add(voter)
        self._waiting.append((voter, tuple(weights.get(leg, float('nan')) for leg in LEGS)))

    def take(self) -> tuple[Vote, ...]:
        """Votes since the last call, in the order of their arrival."""
        waiting, self._waiting = tuple(self._waiting), []
        return waiting

    def _check_voter(self, voter: str) -> None:
        if voter in OWN_SOURCES or not voter.isprintable() or len(voter) > 40 or '+' in voter:
            raise DataError(
                f'{voter!r} cannot be the name of a voter: it must be printable, of at most 40 '
                f'characters, without +, and none of {", ".join(OWN_SOURCES)}'
            )
        if voter not in self._voters and len(self._voters) >= MOST_VOTERS:
            raise DataError(
                f"'{voter}' is one voter too many; the {MOST_VOTERS} that can vote are "
                f'{", ".join(sorted(self._voters))}'
            )
