# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One inequality of a certificate: left < right, with its unit, its grade and a sentence."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from dmp_cpg_ros.core.contraction.finding import CONTINUOUS, GRADES, PROVED
from dmp_cpg_ros.core.errors import ParameterError

ROUNDING = 1e-9
"""Share of the larger side by which an inequality must hold, far above all rounding errors."""


@dataclass(frozen=True)
class Inequality:
    """left < right.

    Attributes
    ----------
    name : str
        Short name, a word with underscores.
    left, right : float
        Both sides; not a number counts as not holding.
    unit : str
        SI unit of both sides, empty for pure numbers.
    left_is, right_is : str
        What the sides are, as short expressions.
    grade : str
        ``proved``, ``continuous`` (of the differential equation) or ``sampled``.
    sentence : str
        What it means for the robot.
    required : bool
        Whether the certificate fails without it.

    Raises
    ------
    ParameterError
        If there is no such grade.
    """

    name: str
    left: float
    right: float
    unit: str
    left_is: str
    right_is: str
    grade: str
    sentence: str
    required: bool = True

    def __post_init__(self) -> None:
        """Validate."""
        if self.grade not in GRADES:
            raise ParameterError(f"inequality '{self.name}': the grade must be one of "
                                 f"{', '.join(GRADES)}, not '{self.grade}'")

    @property
    def margin(self) -> float:
        """Right minus left, in the unit; negative where the inequality fails."""
        if math.isinf(self.left) and math.isinf(self.right):
            return -math.inf
        return self.right - self.left

    @property
    def holds(self) -> bool:
        """Whether left < right beyond rounding."""
        if math.isnan(self.left) or math.isnan(self.right) or math.isinf(self.left):
            return self.left == -math.inf
        return self.margin > ROUNDING * max(abs(self.left), min(abs(self.right), 1e300))

    @property
    def proved(self) -> bool:
        """Whether it is proved of what runs."""
        return self.grade == PROVED

    def as_mapping(self) -> dict[str, object]:
        """Return everything as values that strict JSON can write; None for what is not finite."""
        return {**vars(self), 'holds': self.holds, 'left': finite(self.left),
                'right': finite(self.right), 'margin': finite(self.margin)}

    def explained(self) -> str:
        """Name, both sides and the sentence in one line."""
        relation, told = ('<', '') if self.holds else ('is not <', 'not guaranteed: ')
        unit = f' {self.unit}' if self.unit else ''
        return (f'{self.name}: {self.left_is} = {self.left:.4g}{unit} {relation} {self.right_is} '
                f'= {self.right:.4g}{unit}; {told}{self.sentence}')


def finite(value: float) -> float | None:
    """Return a value that strict JSON can write; None for what is not finite."""
    return float(value) if math.isfinite(value) else None


STEP_ROWS = ('step_capture', 'step_contraction', 'step_synchronisation')
"""Rows that say of the step that runs what others say of the differential equation."""

_CARRIED_OVER = ('synchronisation', 'contraction', 'capture', 'time_to_rest')


def discharged(rows: Iterable[Inequality], *, alike: bool) -> list[Inequality]:
    """Rows with what those of the step make of them.

    Where the step is proved to capture, contract and synchronise, the sampled ``time_step`` is not
    required, and what is proved of the equation is so of what runs.

    Parameters
    ----------
    rows : iterable of Inequality
        All of a certificate.
    alike : bool
        Whether all legs turn at one frequency and only the service stops them: votes and unequal
        frequencies are in no row of the step.
    """
    rows = list(rows)
    proved = alike and all(row.holds for row in rows if row.name in STEP_ROWS)

    def now(row: Inequality) -> Inequality:
        if row.name in STEP_ROWS or row.name == 'time_step':
            return replace(row, required=proved is (row.name in STEP_ROWS))
        return replace(row, grade=PROVED if proved else CONTINUOUS) if (
            row.name in _CARRIED_OVER) else row

    return [now(row) for row in rows]
