# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gaits as data: which leg follows which, for how long it stands, and how often it steps.

Speeds and cadences are dimensionless (Alexander & Jayes 1983, dynamic similarity), so that one
gait serves robots of any size: speed û = u / sqrt(g l), cadence f̂ = f sqrt(l / g), with l the
standing height of the hip.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, nan, tau
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.core.canonical.phase import wrapped
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait import speed_limit
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.com_height import Bounce, planned_bounce
from dmp_cpg_ros.core.gait.lags import ENDS, SIDES, rest_phase, stance_groups, stand_together
from dmp_cpg_ros.core.maths import Array, interpolated
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.parameters import Key, check_names, needed
from dmp_cpg_ros.core.robot_model.state import LEGS

BACKWARD_WEIGHT, ONE_SIDED_WEIGHT = 1.3, 2.0
"""Weights of speed backwards, by the highest speed: of a gait whose legs all swing together, and
of one that stands on one side only.
"""

WIDE_STANCE = 0.75
"""Share of stance on both sides, or ends, from which on a gait counts as standing on both."""

KEYS = {
    'lag': Key('number by leg', 'fraction of a cycle by which the leg follows fl, in [0, 1)'),
    'speed': Key('list', 'foot speeds u / sqrt(g l), increasing; l is the height of the hips'),
    'cadence': Key('list', 'stride frequencies f sqrt(l / g) at these speeds'),
    'duty_factor': Key('list', 'share of a cycle that a foot stands, in (0, 1), at these speeds'),
    'highest_speed': Key('number', 'foot speed that is never exceeded', default='no limit')}
"""Entries of a gait."""


class Pace(NamedTuple):
    """What a gait makes of a reference.

    Attributes
    ----------
    velocity : tuple of float
        The reference within the gait's limit, v_x, v_y [m/s], γ [rad/s].
    omega : float
        Angular frequency ω of the gait [rad/s].
    own_omegas : list of four floats
        Frequencies with which the legs go through their cycles [rad/s].
    duty : float
        Duty factor β.
    """

    velocity: Triple
    omega: float
    own_omegas: list[float]
    duty: float


class CycleOfLegs(ABC):
    """What a gait and a blend of two have in common.

    Attributes
    ----------
    rest : float
        Cycle position of fl at phase 0, where inhibition holds it: all legs are then as far from
        their mid-swing as can be.
    phases : ndarray (4,)
        Locked oscillator phases relative to fl [rad].
    moving_phases : ndarray (4,) or None
        The same while gaits change, which moves them.
    apart : float
        0 where all legs swing together, which turns the body, else 1; between while gaits change.
    two_sided : float
        Share of stance with feet of both sides on the ground, where it is shortest.
    firm : float
        1 where feet of both sides and of both ends stand nearly all the time, as in a trot, a walk
        and an amble, else 0; between while gaits change.
    rest_rate : float
        Rate of the rest phase, to be added to the rate of a leg's phase [rad/s]; 0, other than
        while gaits change.
    """

    rest: float
    phases: Array
    moving_phases: Array | None = None
    apart: float = 1.0
    two_sided: float = 1.0
    firm: float = 1.0
    rest_rate: float = 0.0
    _paced: tuple[tuple[float, ...], Pace] | None = None

    @abstractmethod
    def omega(self, foot_speed: float, scale: BodyScale) -> float:
        """Angular frequency ω of the oscillators at a foot speed as from
        :meth:`BodyScale.foot_speed` [rad/s].
        """

    @abstractmethod
    def duty(self, foot_speed: float, scale: BodyScale) -> float:
        """Duty factor β at a foot speed [m/s]."""

    @abstractmethod
    def highest(self, scale: BodyScale) -> float:
        """Dimensionless foot speed that is never exceeded on a robot."""

    def own_omegas(self, omega: float) -> list[float]:
        """Frequencies of the legs' cycles when the gait's is ω: the same, other than while gaits
        change [rad/s].
        """
        return [omega] * len(LEGS)

    def oscillator_omegas(self, omega: float) -> float | Array:
        """Frequencies of the oscillators when the gait's is ω: the same, other than while gaits
        change [rad/s].
        """
        return omega

    @cached_property
    def wide(self) -> float:
        """1 where feet of both sides stand for long enough, 0 where one side stands alone."""
        return min(1.0, self.two_sided / WIDE_STANCE)

    def limiting_speed(self, velocity: Triple, scale: BodyScale) -> float:
        """Foot speed of a velocity (v_x, v_y [m/s], γ [rad/s]) that counts by the highest speed
        [m/s].
        """
        backwards = (1.0 + (1.0 - self.apart) * (BACKWARD_WEIGHT - 1.0)
                     + (1.0 - self.wide) * (ONE_SIDED_WEIGHT - 1.0))
        return scale.foot_speed(*velocity, self.apart, backwards)

    def room(self, velocity: Triple, scale: BodyScale) -> float:
        """Foot speed that a velocity leaves up to the highest one [m/s]."""
        return max(0.0, scale.speed(self.highest(scale)) - self.limiting_speed(velocity, scale))

    def limited(self, velocity: Triple, scale: BodyScale, max_curve: float = inf) -> Triple:
        """Velocity (v_x, v_y [m/s], γ [rad/s]) within the highest speed and what ``max_curve``
        leaves of curves: :mod:`~dmp_cpg_ros.core.gait.speed_limit`.
        """
        return speed_limit.within_limit(
            velocity, self.limiting_speed(velocity, scale), scale.speed(self.highest(scale)),
            max_curve * max(self.two_sided, speed_limit.ONE_SIDED) * GRAVITY)

    def pace(self, r: Array, scale: BodyScale) -> Pace:
        """What the gait makes of a reference (v_x, v_y, γ), ndarray (3,); the last answer is
        kept, for the body and its legs ask in turn.
        """
        v_x, v_y, gamma = r.tolist()
        asked = (v_x, v_y, gamma, scale.leg_length, scale.hip_radius, scale.rolling, scale.swing)
        if self._paced is None or self._paced[0] != asked:
            velocity = self.limited((v_x, v_y, gamma), scale)
            speed = scale.foot_speed(*velocity)
            omega, duty = self.omega(speed, scale), self.duty(speed, scale)
            pace = Pace(velocity, omega, self.own_omegas(omega), duty)
            vars(self)['_paced'] = (asked, pace)
            return pace
        return self._paced[1]

    def cycle_position(self, phi: Array | float) -> Array:
        """Where legs are in their cycle at phases φ (...) [rad]: 0 at mid-swing, in [−1/2, 1/2).

        At phase 0 of fl, where inhibition holds it, all legs are farthest from mid-swing.
        """
        return wrapped(np.asarray(phi) + 2.0 * np.pi * self.rest) / (2.0 * np.pi)

    def scalar_cycle_position(self, phi: float) -> float:
        """As :meth:`cycle_position` of one leg, without arrays."""
        return (phi / tau + self.rest + 0.5) % 1.0 - 0.5


@dataclass(frozen=True, eq=False)
class Gait(CycleOfLegs):
    """One gait; equal to itself only.

    Attributes
    ----------
    name : str
        Name in the YAML.
    lag : ndarray (4,)
        Fraction of a cycle by which each leg (fl, fr, rl, rr) follows fl, in [0, 1).
    speed : ndarray (n,)
        Increasing dimensionless foot speeds at which the next two are given; held constant
        outside.
    cadence : ndarray (n,)
        Dimensionless stride frequencies.
    duty_factor : ndarray (n,)
        Fraction β of the cycle that a foot is planned to stand, in (0, 1).
    steps : int
        How often in a cycle feet come down.
    highest_speed : float
        Dimensionless foot speed that the gait never exceeds, not below the last of ``speed``, so
        that the cadence is that of the tables with and without it; infinite for none. What holds
        on a robot is :meth:`highest`.
    """

    name: str
    lag: Array
    speed: Array
    cadence: Array
    duty_factor: Array
    highest_speed: float = inf
    rest: float = field(init=False)
    phases: Array = field(init=False, repr=False, compare=False)
    groups: int = field(init=False)
    steps: int = field(init=False)
    two_sided: float = field(init=False)
    firm: float = field(init=False, default=1.0)
    apart: float = field(init=False, default=1.0)
    cadence_scale: float = field(init=False, default=1.0)
    _tables: tuple[list[float], ...] = field(init=False, repr=False, compare=False)
    _nominal: list[float] = field(init=False, repr=False, compare=False)
    _highest: tuple[float, float] = field(init=False, repr=False, compare=False)
    _strides: tuple[float, float] = field(init=False, default=(nan, nan), repr=False)

    def __post_init__(self) -> None:
        """Validate and find the rest phase."""
        tables = (self.speed, self.cadence, self.duty_factor)
        lag, fastest = self.lag, float(self.speed.max(initial=0.0))
        for holds, rule in (
            (self.name and not any(sign.isspace() or sign == '>' for sign in self.name),
             "a name must be one word without '>'"),
            (lag.shape == (len(LEGS),) and np.all((lag >= 0.0) & (lag < 1.0)),
             f'lag needs four fractions in [0, 1), not {lag}'),
            (len(self.speed) == len(self.cadence) == len(self.duty_factor) > 0,
             'speed, cadence and duty_factor must have equal lengths'),
            (np.all(np.diff(self.speed) > 0.0) and np.all(np.isfinite(self.speed)),
             'speed must increase'),
            (np.all((self.duty_factor > 0.0) & (self.duty_factor < 1.0)),
             'duty_factor must lie in (0, 1)'),
            (np.all((self.cadence > 0.0) & np.isfinite(self.cadence)),
             'cadence must be positive'),
            (self.highest_speed >= max(fastest, 1e-3),
             f'highest_speed must be positive and not below the last of speed, {fastest:g}, not '
             f'{self.highest_speed:g}')):
            if not holds:
                raise ParameterError(f"gait '{self.name}': {rule}")
        two_sided, two_ended = (stand_together(lag, float(self.duty_factor.min()), parts)
                                for parts in (SIDES, ENDS))
        vars(self).update(
            rest=rest_phase(lag), phases=-2.0 * np.pi * lag, groups=stance_groups(lag),
            apart=float(stance_groups(lag) != 1), steps=len(np.unique(np.round(lag % 1.0, 9))),
            two_sided=two_sided, firm=float(
                stance_groups(lag) != 1 and min(two_sided, two_ended) >= WIDE_STANCE),
            _tables=tuple(table.tolist() for table in tables),
            _nominal=self.cadence.tolist(), _highest=(inf, self.highest_speed))

    @classmethod
    def from_mapping(cls, name: str, values: Mapping[str, Any]) -> Gait:
        """Build from one entry of the gaits YAML.

        Raises
        ------
        ParameterError
            If a key is missing or not known, or a value is impossible.
        """
        check_names(values, KEYS, needed(KEYS), f"gait '{name}'")
        lag = values['lag']
        if not isinstance(lag, Mapping) or set(lag) != set(LEGS):
            raise ParameterError(f"gait '{name}': lag must name the legs {', '.join(LEGS)}")
        try:
            speed, cadence, duty = (np.asarray(values[key], dtype=float)
                                    for key in ('speed', 'cadence', 'duty_factor'))
            return cls(name, np.array([float(lag[leg]) for leg in LEGS]), speed, cadence, duty,
                       float(values.get('highest_speed', inf)))
        except (TypeError, ValueError) as error:
            raise ParameterError(f"gait '{name}': {error}") from error

    @property
    def ends(self) -> tuple[Gait, ...]:
        """The gait itself; of a blend the two that it lies between."""
        return (self,)

    def scaled(self, cadence_scale: float) -> Gait:
        """Return this gait with all cadences multiplied; itself for a factor of 1.

        Parameters
        ----------
        cadence_scale : float
            Positive factor.
        """
        if cadence_scale == 1.0:
            return self
        scaled, cadence = copy(self), self.cadence * cadence_scale
        vars(scaled).update(
            cadence=cadence, cadence_scale=self.cadence_scale * cadence_scale, _paced=None,
            _strides=(nan, nan), _tables=(self._tables[0], cadence.tolist(), self._tables[2]))
        return scaled

    def limiting(self, cadence_scale: float) -> Gait:
        """Return the gait whose limits commands keep at a positive factor on the cadence: strides
        of a slower one do not get longer, and hips can swing the legs as fast as a quicker one.
        """
        if cadence_scale <= 1.0:
            return self.scaled(cadence_scale)
        quicker = copy(self)
        vars(quicker).update(_nominal=[f * cadence_scale for f in self._nominal], _paced=None,
                             _highest=(inf, self.highest_speed))
        return quicker

    def following(self, omega: float, change_rate: float, pauses: bool, dt: float
                  ) -> tuple[Gait, float]:
        """Gait a time step later, and what oscillators gain on ω [rad]: the same, and nothing."""
        return self, 0.0

    def omega(self, foot_speed: float, scale: BodyScale) -> float:
        """Angular frequency ω of the oscillators at a foot speed [rad/s]."""
        root = (GRAVITY / scale.leg_length) ** 0.5
        speed = foot_speed / (root * scale.leg_length)
        return tau * root * interpolated(speed, self._tables[0], self._tables[1])

    def duty(self, foot_speed: float, scale: BodyScale) -> float:
        """Duty factor β at a foot speed."""
        return interpolated(
            foot_speed / (GRAVITY * scale.leg_length) ** 0.5, self._tables[0], self._tables[2])

    def highest(self, scale: BodyScale) -> float:
        """Dimensionless foot speed that is never exceeded on a robot: the gait's, or the one for
        which hips can swing the legs without a factor on the cadence, and with a slower one the
        one with the same strides as that; the last answers are kept.
        """
        speeds, _, duties = self._tables
        if self._highest[0] != scale.swing:
            vars(self)['_highest'] = scale.swing, speed_limit.fastest_swing(
                lambda u: speed_limit.swing_acceleration(
                    u, interpolated(u, speeds, self._nominal), interpolated(u, speeds, duties)),
                scale.swing / GRAVITY, self.highest_speed)
        highest = self._highest[1]
        if self.cadence_scale >= 1.0:
            return highest
        if self._strides[0] != highest:
            vars(self)['_strides'] = highest, speed_limit.fastest_stride(
                lambda u: u * interpolated(u, speeds, duties) / interpolated(
                    u, speeds, self._nominal), self.cadence_scale, highest)
        return self._strides[1]

    def bounce(self, cycle_position: float, duty: float, omega: float) -> Bounce:
        """How the body rises and falls, see :mod:`~dmp_cpg_ros.core.gait.com_height`."""
        return planned_bounce(cycle_position, self.groups, duty, omega)
