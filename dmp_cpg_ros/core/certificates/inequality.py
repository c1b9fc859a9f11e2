# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One inequality, left < right, with its unit, its grade and a sentence; and the certificate that
several of them make.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from dmp_cpg_ros.core.contraction.finding import CONTINUOUS, GRADES, PROVED, SAMPLED, weakest
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.contact_feedback import ContactLimits
from dmp_cpg_ros.core.maths.records import replace_unchecked

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
    def share(self) -> float:
        """Margin over the sum of both sides' sizes, −1 to 1; below 0 where it does not hold, ±∞
        where a side is infinite or no number.
        """
        whole = abs(self.left) + abs(self.right)
        if not whole < math.inf:
            return math.inf if self.holds else -math.inf
        return self.margin / whole if self.holds else min(
            self.margin / max(whole, ROUNDING), -ROUNDING)

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
            return replace_unchecked(row, required=proved is (row.name in STEP_ROWS))
        return replace_unchecked(row, grade=PROVED if proved else CONTINUOUS) if (
            row.name in _CARRIED_OVER) else row

    return [now(row) for row in rows]


def lost(rows: Iterable[Inequality]) -> tuple[Inequality, ...]:
    """Required inequalities that do not hold."""
    return tuple(row for row in rows if row.required and not row.holds)


class Look(NamedTuple):
    """What was seen of some inequalities.

    Attributes
    ----------
    lost : tuple of str
        Names of the required ones that do not hold.
    shares : mapping of str to float
        :attr:`Inequality.share` of each.
    """

    lost: tuple[str, ...]
    shares: Mapping[str, float]

    @classmethod
    def at(cls, rows: Iterable[Inequality]) -> Look:
        """Look at some."""
        required = [row for row in rows if row.required]
        return cls(tuple(row.name for row in required if not row.holds),
                   {row.name: row.share for row in required})

    def share(self, names: Iterable[str]) -> float:
        """The least of those that do not hold, and of some others by their names."""
        return min((self.shares[name] for name in (*self.lost, *names) if name in self.shares),
                   default=math.inf)


@dataclass(frozen=True)
class Certificate:
    """Inequalities of one set of parameters.

    Attributes
    ----------
    inequalities : tuple of Inequality
        In the order (a) to (j) of :mod:`~dmp_cpg_ros.core.certificates.certify`.
    contraction_grade : str
        ``global``: the inhibited network contracts from every state; ``regional``: on the set that
        capture leads into; ``none``.
    omega_max : float
        Highest cadence that was considered [rad/s].
    time_to_rest, time_to_walking : float
        Bounds on the time from a request to rest and from a release to walking [s]; infinite
        without a certificate.
    rest_phase : tuple of float
        Phase by which each leg rests ahead of its place [rad]; empty without an equilibrium.
    rest_radius : tuple of float
        |x_i| of each leg at rest.
    contact : ContactLimits or None
        What contact feedback may do; None where it is off.
    distance_to_rest : float
        Bound on the way of the reference after a request at the largest speed [m].
    legs : tuple of str
        Legs that are inhibited, or of which one is chosen.
    """

    inequalities: tuple[Inequality, ...]
    contraction_grade: str
    omega_max: float
    time_to_rest: float = math.inf
    time_to_walking: float = math.inf
    rest_phase: tuple[float, ...] = ()
    rest_radius: tuple[float, ...] = ()
    contact: ContactLimits | None = None
    distance_to_rest: float = math.inf
    legs: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Inequality:
        """Return the inequality of a name; raises ParameterError with the names that exist."""
        named = {entry.name: entry for entry in self.inequalities}
        if name not in named:
            raise ParameterError(f"there is no inequality '{name}'; valid are {', '.join(named)}")
        return named[name]

    @property
    def failing(self) -> tuple[Inequality, ...]:
        """Required inequalities that do not hold."""
        return lost(self.inequalities)

    @property
    def holds(self) -> bool:
        """Whether every required inequality holds."""
        return not self.failing

    @property
    def sampled(self) -> tuple[str, ...]:
        """Names of the required inequalities that are sampled and not proved."""
        return self._graded(SAMPLED)

    @property
    def continuous(self) -> tuple[str, ...]:
        """Names of those that are proved of the differential equation alone."""
        return self._graded(CONTINUOUS)

    def _graded(self, grade: str) -> tuple[str, ...]:
        return tuple(entry.name for entry in self.inequalities
                     if entry.required and entry.grade == grade)

    @property
    def grade(self) -> str:
        """The weakest of the required inequalities."""
        return weakest(tuple(entry.grade for entry in self.inequalities if entry.required))

    def as_mapping(self) -> dict[str, object]:
        """Return everything as values that strict JSON can write, for ``metrics.json``."""
        return {
            'holds': self.holds, 'grade': self.grade, 'contraction_grade': self.contraction_grade,
            'omega_max': self.omega_max, 'time_to_rest_s': finite(self.time_to_rest),
            'time_to_walking_s': finite(self.time_to_walking),
            'distance_to_rest_m': finite(self.distance_to_rest), 'legs': list(self.legs),
            'rest_phase_rad': list(self.rest_phase), 'rest_radius': list(self.rest_radius),
            'sampled': list(self.sampled), 'continuous': list(self.continuous),
            'failing': [entry.name for entry in self.failing],
            'inequalities': {entry.name: entry.as_mapping() for entry in self.inequalities}}

    def explained(self) -> str:
        """One line: that all holds, or the inequalities that fail."""
        if self.holds:
            return 'every required inequality holds'
        return ' | '.join(entry.explained() for entry in self.failing)
