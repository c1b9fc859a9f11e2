# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that change while the suite runs: may they, and what is the nearest that may.

A change that would lose the certificate is refused with the inequality that fails, both its sides,
and what works: near values on the straight way from the running numbers, the other words.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any

from dmp_cpg_ros.core.canonical.inhibition import AUTO
from dmp_cpg_ros.core.certificates.certify import BEFORE_VOTES, QUICK_ROWS
from dmp_cpg_ros.core.certificates.changes import refused_change
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.certificates.inequality import Certificate, Inequality, Look
from dmp_cpg_ros.core.certificates.suggest import nearest_values
from dmp_cpg_ros.core.certificates.votes import VOTE_ROWS
from dmp_cpg_ros.core.contraction.voting import alike
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.parameters import typed
from dmp_cpg_ros.core.robot_model.state import LEGS

_MOST_LOOKS, _MOST_WHOLE = 8, 5
"""How often values on the way to what is refused are looked at at most, in one inequality and in
all.
"""

MOST_EFFORT = 60
"""Most :meth:`Running.effort` of a verdict that looks for what would work, for its time to stay
bounded: 0.4 to 1 ms each on a slow core."""


@dataclass(frozen=True)
class Verdict:
    """Whether a change may be made.

    Attributes
    ----------
    certificate : Certificate
        With the change, for every cadence on the way to that of the parameters.
    settled : Certificate or None
        For that one; None where the change is refused, or where it is still to be computed because
        another one acts.
    accepted : bool
        Whether no inequality is lost by it.
    reason : str
        Why not: the inequalities with both sides, and what is nearest; empty when accepted.
    """

    certificate: Certificate
    settled: Certificate | None
    accepted: bool
    reason: str = ''


@dataclass(frozen=True)
class Change:
    """A change that is asked for, with everything that the verdict depends on.

    Attributes
    ----------
    present, held : Running, Certificate
        What runs, and its certificate when the cadence is settled.
    proposed : Running
        What is asked for.
    gaits : tuple of Gait
        Walked until those of ``proposed`` are, both ends of a change included; may repeat.
    """

    present: Running
    held: Certificate
    proposed: Running
    gaits: tuple[Gait, ...] = ()

    def verdict(self) -> Verdict:
        """Judge: accepted when no required inequality is lost, nor gets worse where it fails."""
        of, before = self.proposed, self.present
        certificate = of.certificate(every_gait=not self.held.holds)
        lost = [entry for entry in certificate.failing if self._worse(entry)]
        same = (of.gait, of.others) == (before.gait, before.others)
        refused = '' if same and lost else refused_change(
            of.parameters, self.gaits, (of.gait, *of.others), of.scale, of.tick_s,
            of.moving_cadence)
        if refused:
            refused += '; ask again when the gait has changed' * same
            return Verdict(certificate, None, False, refused)
        if not lost:
            # in every gait: where what runs holds, nothing fails, and all were looked at
            return Verdict(certificate, None if of.moving else certificate, True)
        reason = ' | '.join(entry.explained() for entry in lost)
        nearest = self._nearest(lost)
        return Verdict(certificate, None, False, f'{reason}; {nearest}')

    def _worse(self, entry: Inequality) -> bool:
        """Whether an inequality that fails held before, or failed by less."""
        rows = self.held.inequalities
        if entry.name in VOTE_ROWS and not any(row.name in VOTE_ROWS for row in rows):
            rows = tuple(self.present.settled.votes())
        before = next(row for row in rows if row.name == entry.name)
        return before.holds or entry.margin < before.margin

    def covers(self, other: Change) -> bool:
        """Whether the verdict on this change is one on another, in which a cadence acts that lies
        between the one that acts here and the one that is asked for: all between are certified.
        """
        return self._settled == other._settled and self.proposed.covers(other.proposed)

    @property
    def _settled(self) -> Change:
        return replace(self, present=self.present.settled, proposed=self.proposed.settled)

    def _judging(self, name: str) -> int:
        """Effort until an inequality of a name was found to be lost: of the certificate, in which
        votes are looked at last, of changes from what is walked to other gaits, and of the votes
        of what runs where others of its rows fail.
        """
        of, before = self.proposed, self.present
        others = (of.gait, of.others) != (before.gait, before.others)
        return of.effort('' if name in VOTE_ROWS else BEFORE_VOTES) * (1 + others) + (
            name in VOTE_ROWS and not self.held.holds) * before.effort(name)

    def _nearest(self, lost: Sequence[Inequality]) -> str:
        """Nearest values that work, as text, where inequalities are lost; the one that is looked
        at with least effort is looked at first.
        """
        name = min((entry.name for entry in lost), key=self.proposed.effort)
        looks = _Looks(MOST_EFFORT - self._judging(name))
        differences = self.present.differences(self.proposed)
        band = differences.pop('auto_hysteresis', None)  # goes with auto_speeds, certifies nothing
        numbers = {name: pair for name, pair in differences.items() if isinstance(pair[0], float)}
        words = {name: pair[1] for name, pair in differences.items() if name not in numbers}
        with_words = self.present.changed(
            words if band is None else {**words, 'auto_hysteresis': band[1]})
        runs = looks.look(with_words, name if numbers else '') if words else Look.at(
            self.held.inequalities)
        if words and runs.lost:
            return self._choices(words, looks)
        if not (self.held.holds or words) or not numbers:
            return 'nothing nearer is known: the running parameters are not certified themselves'
        values = nearest_values(
            numbers, lambda at, among: looks.look(with_words.changed(at), among),
            name, (Look.at(lost), runs), partial(looks.allowed, with_words))
        none = values == {name: before for name, (before, _) in numbers.items()}
        if none and words and looks.look(with_words).lost:
            return self._choices(words, looks)
        if none and looks.spent:
            return _TOO_LONG
        told = ', '.join(f'{name} = {typed(value)}' for name, value in values.items())
        return f'nearest value{"s that work" if len(values) > 1 else " that works"}: {told}'

    def _choices(self, words: Mapping[str, Any], looks: _Looks) -> str:
        """Other words that work in place of those that were asked for."""
        found, holds = [], dict[Any, bool]()
        for name, asked in words.items():
            working = []
            for choice in _alternatives(self.proposed, name):
                changed = self.proposed.changed({name: choice})
                kind = name, _alike(changed, choice) if name == 'inhibited_legs' else choice
                if kind not in holds:
                    holds[kind] = choice != asked and not looks.look(changed).lost
                if choice != asked and holds[kind]:
                    working.append(typed(choice))
            if working:
                found.append(f'{name} = {" or ".join(working)}')
            elif not looks.spent:
                found.append(f'no other {name} with the rest as it is')
        return f'what works: {"; ".join(found)}' if found else _TOO_LONG


_TOO_LONG = 'nothing nearer was looked for: with these gaits and votes that takes too long'


@dataclass
class _Looks:
    """What is looked at for something that works, until the effort that is left is spent; beyond
    that nothing is found to work.
    """

    left: int
    spent: bool = False

    def allowed(self, running: Running, name: str) -> tuple[str, int]:
        """What to look at on the way to what loses an inequality, it where that is much less than
        all, which has to be looked at in the end; and how often at most.
        """
        whole, alone = running.effort(), max(1, running.effort(name))
        among, most = (name, min((self.left - whole) // alone, _MOST_LOOKS)) if (
            2 * alone <= whole) else ('', min(self.left // whole, _MOST_WHOLE))
        self.spent = self.spent or most < 1
        return among, max(0, most)

    def look(self, running: Running, among: str = '') -> Look:
        """:meth:`Running.look`, or that it is not known."""
        if self.left < running.effort(among):
            self.spent = True
            return _UNKNOWN
        seen = _look(running, among)
        lost = seen.lost[0] if seen.lost else ''
        self.left -= running.effort(lost if lost in QUICK_ROWS else among)
        return seen


_UNKNOWN = Look(('unknown',), {'unknown': -math.inf})


def _look(running: Running, among: str = '') -> Look:
    try:
        return running.look(among)
    except DmpCpgError:
        return _UNKNOWN


def _alike(running: Running, legs: tuple[str, ...]) -> tuple[Any, ...]:
    """Which legs are alike some that are inhibited."""
    return legs if AUTO in legs else alike(
        running.networks[0].system, [LEGS.index(leg) for leg in legs])


def _alternatives(running: Running, name: str) -> list[Any]:
    """All values of a parameter that is a choice; for several at once, one up to all of them."""
    entry = next(held.__dataclass_fields__[name] for held in running.parameters.sets.values()
                 if name in held.__dataclass_fields__)
    choices = entry.metadata['choices']
    if not isinstance(entry.default, tuple):
        return list(choices)
    several = [choice for choice in choices if choice != AUTO]
    return [*((choice,) for choice in choices), *(
        some for size in range(2, len(several) + 1) for some in combinations(several, size))]
