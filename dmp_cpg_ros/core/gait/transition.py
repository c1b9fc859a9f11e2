# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Change of gait while walking: the phase offsets move and the network stays certified.

**The spectrum does not see the offsets.** With offsets φ_i the coupling is −Σ_j k (x_i −
R(φ_i − φ_j) x_j). Let R = blockdiag(R(φ_1), …, R(φ_N)) and x = R y. Then Rᵀ L_φ R has the blocks
R(φ_i)ᵀ k R(φ_i) = k I and −R(φ_i)ᵀ k R(φ_i − φ_j) R(φ_j) = −k I: it is L_K, the same for all
offsets. R is orthogonal, so L_φ has the spectrum of L_K whatever the φ_i, and so have its
symmetric part and L_φ + diag α, because diag α is a multiple of I in each block. The oscillator
f(x; ω) = ω S x + ρ(r² − |x|²) x commutes with rotations, so growth bounds, inhibited regions
|x_i − R(φ_i) x_d| ≤ r₀ and equilibria are rotated too, radii and rates kept. Every margin of
synchronisation and contraction is therefore the same in every gait and every blend.

**Moving offsets are unequal frequencies.** With φ_i(t), ẏ_i = f(y_i; ω_i − φ̇_i) + (coupling
without offsets). Left alone, φ̇_i disturbs as a mismatch of frequencies does, within certificate
(g)'s margin. Here it is fed forward, ω_i = ω + φ̇_i, and nothing is left of it: y obeys exactly the
equation of a gait that does not change, so the phase error keeps its bound and decays at its rate
during a transition as outside of it.

**The course.** The share s runs from 0 to 1 with ṡ = ω/(2πn), filtered at ``SETTLING_RATE``; the
weight w = s²(3 − 2s) blends offsets, rest phase, cadence and duty factor. n is the number of
cycles for which no leg's frequency differs from ω by more than the fraction ``gait_change_rate``.
While a stop is requested ṡ goes to 0 and the blend stays as it is; at rest the new gait takes
force at once (:mod:`~dmp_cpg_ros.core.gait.running`).

**How fast.** A change that is asked for begins when the reference has come down to
:func:`changing_speed`, to which commands are shortened until it is done. One that ``auto_gait``
chooses is made at the speed at which it was chosen, and speeds up to the higher of both at most.

**The arcs.** Leg i is at the position o_i = rest − lag_i of its cycle when oscillator fl has phase
0. From one gait to another it moves by the arc a_i ≡ o_i' − o_i (mod 1). Only differences matter:
a common arc is a faster or slower cycle for all. The rule, in this order:

1. the smallest spread max a − min a, so that the legs' frequencies differ least,
2. the fewest legs in swing at once: the least mean square of their number over all phases and all
   blends between the gaits,
3. the least total movement Σ |a_i − middle|,
4. a leg moves forward in its cycle rather than backward, the front legs first.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product
from math import exp, inf

import numpy as np

from dmp_cpg_ros.core.canonical.phase import wrapped
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.com_height import Bounce
from dmp_cpg_ros.core.gait.gait import CycleOfLegs, Gait
from dmp_cpg_ros.core.gait.speed_limit import blended_limit
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import Parameters, parameter

STEEPEST = 1.5
"""Largest slope of the weight w(s)."""

SHORTEST = 1.0
"""Cycles that a transition takes at least, between gaits with the same offsets."""

SETTLING_RATE = 12.0
"""Rate of the filter through which a transition starts, pauses and goes on [1/s]."""

CHANGING = 0.5
"""Share of the highest speed of the slower of two gaits at which one becomes the other: a blend of
both is neither, and has less to give than each of them at its limit.
"""

ROUNDING = 1e-9
"""Differences of the costs of arcs below this are ties."""

STANDING = 0.02
"""A transition that pauses stands still below this fraction of its usual rate."""


@dataclass(frozen=True)
class GaitChangeParameters(Parameters):
    """How gaits change."""

    gait_change_rate: float = parameter(
        0.25, "largest change of a leg's frequency during a change of gait, as a fraction of the "
        "gait's frequency", 0.01, 0.6)


@dataclass(frozen=True)
class GaitTransition:
    """The way from one gait to another.

    Attributes
    ----------
    before, after : Gait
        Both gaits.
    arcs : ndarray (4,)
        a_i: what each leg's cycle gains on a walk at the common frequency, in cycles.
    rest_arc : float
        By how much the rest phase moves, in cycles.
    offset_arcs : ndarray (4,)
        By how much the phase offsets move, in cycles; with the rest phase and a common arc that
        speeds all oscillators they add up to ``arcs``.
    """

    before: Gait
    after: Gait
    arcs: Array = field(init=False, repr=False, compare=False)
    rest_arc: float = field(init=False, repr=False, compare=False)
    offset_arcs: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Choose the arcs."""
        before, after = self.before, self.after
        middle = [float(np.median(gait.duty_factor)) for gait in (before, after)]
        places = [(gait.rest - gait.lag).tobytes() for gait in (before, after)]
        arcs = _arcs(*places, *middle)
        rest_arc = (after.rest - before.rest + 0.5) % 1.0 - 0.5
        moves = arcs - arcs[0] + round(float(before.lag[0] - after.lag[0]), 12)
        vars(self).update(arcs=arcs, rest_arc=rest_arc, offset_arcs=moves)

    @property
    def common_arc(self) -> float:
        """By how much all oscillators run ahead of ω, in cycles."""
        return float(self.arcs[0] - self.offset_arcs[0]) - self.rest_arc

    def cycles(self, rate: float) -> float:
        """Length n in cycles when no leg's frequency may change by more than a fraction."""
        return max(SHORTEST, STEEPEST * float(np.abs(self.arcs).max()) / rate)

    def fastest(self, rate: float) -> float:
        """Largest change of a leg's frequency on the way, as a fraction of ω; at most ``rate``."""
        return STEEPEST * float(np.abs(self.arcs).max()) / self.cycles(rate)

    def at(self, share: float, rate: float) -> BlendedGait:
        """Blend at a share s in [0, 1] that grows at a rate ṡ [1/s]."""
        return BlendedGait(self, share, rate)


@dataclass(frozen=True)
class BlendedGait(CycleOfLegs):
    """A gait between two gaits; everywhere that phases are read it stands for a :class:`Gait`.

    Attributes
    ----------
    transition : GaitTransition
        From where to where.
    share : float
        s in [0, 1].
    rate : float
        ṡ ≥ 0 [1/s].
    cadence_scale : float
        Factor on the cadences of both gaits.

    Raises
    ------
    ParameterError
        If the share or the rate is impossible.
    """

    transition: GaitTransition
    share: float
    rate: float
    cadence_scale: float = 1.0
    weight: float = field(init=False, repr=False, compare=False)
    turning: float = field(init=False, repr=False, compare=False)
    rest: float = field(init=False, repr=False, compare=False)
    apart: float = field(init=False, repr=False, compare=False)
    two_sided: float = field(init=False, repr=False, compare=False)
    firm: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Validate and blend; ``turning`` is 2π dw/dt, the rate of an arc of one cycle [rad/s]."""
        s = self.share
        if not (0.0 <= s <= 1.0 and 0.0 <= self.rate < float('inf')):
            raise ParameterError(f'need share in [0, 1], rate not negative: {s!r}, {self.rate!r}')
        way, weight = self.transition, s * s * (3.0 - 2.0 * s)
        turning = 2.0 * np.pi * 6.0 * s * (1.0 - s) * self.rate
        phases = way.before.phases + (2.0 * np.pi * weight) * way.offset_arcs
        vars(self).update(
            weight=weight, turning=turning, rest=way.before.rest + weight * way.rest_arc,
            **{name: getattr(way.before, name) + weight * (
                getattr(way.after, name) - getattr(way.before, name))
               for name in ('apart', 'two_sided', 'firm')},
            phases=phases, moving_phases=phases, rest_rate=turning * way.rest_arc)

    @property
    def name(self) -> str:
        """Both names, as ``amble>trot``."""
        return '>'.join(end.name for end in self.ends)

    @property
    def ends(self) -> tuple[Gait, Gait]:
        """Both gaits."""
        return self.transition.before, self.transition.after

    def scaled(self, cadence_scale: float) -> BlendedGait:
        """Return this blend with this factor on its cadences."""
        return replace(self, cadence_scale=cadence_scale)

    def following(self, omega: float, change_rate: float, pauses: bool, dt: float
                  ) -> tuple[GaitInForce, float]:
        """Blend a time step later, or the new gait at the end of the way.

        Parameters
        ----------
        omega : float
            The gait's frequency [rad/s].
        change_rate : float
            Largest change of a leg's frequency, as a fraction.
        pauses : bool
            Whether the share is to stay as it is.
        dt : float
            Time step [s].

        Returns
        -------
        gait : BlendedGait or Gait
        gained : float
            By how much the oscillators run ahead of ω meanwhile [rad].
        """
        transition = self.transition
        cycles = transition.cycles(change_rate)
        wanted = 0.0 if pauses else omega / (2.0 * np.pi * cycles)
        rate = wanted + (self.rate - wanted) * exp(-SETTLING_RATE * dt)
        if pauses and rate * 2.0 * np.pi * cycles < STANDING * omega:
            rate = 0.0
        share = self.share + rate * dt
        following: GaitInForce = (
            transition.after.scaled(self.cadence_scale) if share >= 1.0
            else replace(self, share=share, rate=rate))
        weight = following.weight if isinstance(following, BlendedGait) else 1.0
        return following, 2.0 * np.pi * transition.common_arc * (weight - self.weight)

    def oscillator_omegas(self, omega: float) -> Array:
        """Frequencies of the oscillators when the gait's is ω, with moving offsets [rad/s]."""
        omega = omega + self.turning * self.transition.common_arc
        return omega + self.turning * self.transition.offset_arcs

    def highest(self, scale: BodyScale) -> float:
        """Dimensionless foot speed that is never exceeded on a robot, between those of both."""
        before, after = self.ends
        return blended_limit(before.highest(scale), after.highest(scale), self.weight)

    def omega(self, foot_speed: float, scale: BodyScale) -> float:
        """Angular frequency ω at a foot speed, as :meth:`Gait.omega` [rad/s]."""
        foot_speed = min(foot_speed, scale.speed(self.highest(scale)))
        return self.cadence_scale * self._blended(
            *(end.omega(foot_speed, scale) for end in self.ends))

    def duty(self, foot_speed: float, scale: BodyScale) -> float:
        """Duty factor β at a foot speed, as :meth:`Gait.duty`."""
        foot_speed = min(foot_speed, scale.speed(self.highest(scale)))
        return self._blended(*(end.duty(foot_speed, scale) for end in self.ends))

    def own_omegas(self, omega: float) -> list[float]:
        """Frequencies with which the legs go through their cycles, as
        :meth:`Gait.own_omegas` [rad/s].
        """
        return [omega + self.turning * arc for arc in self.transition.arcs.tolist()]

    def bounce(self, cycle_position: float, duty: float, omega: float) -> Bounce:
        """How the body is planned to rise and fall, as :meth:`Gait.bounce`."""
        before, after = self.ends
        return before.bounce(cycle_position, duty, omega).mixed(
            after.bounce(cycle_position, duty, omega), self.weight)

    def _blended(self, before: float, after: float) -> float:
        return before + self.weight * (after - before)


GaitInForce = Gait | BlendedGait
"""What phases are read in."""


def changing_speed(gait: GaitInForce, wanted: Gait, scale: BodyScale) -> float:
    """Largest foot speed on a robot while a gait changes into the one that is wanted, in the form
    of ``highest_speed``; infinite when it is in force, or no gait has a limit.
    """
    if gait.name == wanted.name:
        return inf
    return CHANGING * min(each.highest(scale) for each in (*gait.ends, wanted))


def arcs_between(places: Array, new_places: Array, duty: float, new_duty: float) -> Array:
    """Arcs of the four legs by the rule above.

    Parameters
    ----------
    places, new_places : ndarray (4,)
        o_i of both gaits, in cycles.
    duty, new_duty : float
        Duty factors of both, for the second criterion.

    Returns
    -------
    ndarray (4,)
        a_i in cycles; the largest and the smallest are equally far from 0, so that the mean
        frequency of the two is that of the gait.
    """
    direct = wrapped(2.0 * np.pi * (new_places - places)) / (2.0 * np.pi)
    possible = direct + np.array(list(product((0.0,), *[(0.0, 1.0, -1.0)] * (len(direct) - 1))))
    possible -= 0.5 * (possible.max(axis=1) + possible.min(axis=1))[:, None]
    spread = np.ptp(possible, axis=1)
    best, least = direct, (np.inf,)
    for arcs in possible[spread <= spread.min() + ROUNDING]:  # crowding decides among them alone
        cost = (crowding(places, arcs, duty, new_duty), np.abs(arcs).sum(), *(-arcs).tolist())
        if _less(cost, least):
            best, least = arcs, cost
    return best


@lru_cache(maxsize=64)
def _arcs(places: bytes, new_places: bytes, duty: float, new_duty: float) -> Array:
    """Arcs of :func:`arcs_between`, kept: gaits change between the same few again and again."""
    arcs = arcs_between(np.frombuffer(places), np.frombuffer(new_places), duty, new_duty)
    arcs.setflags(write=False)
    return arcs


def crowding(places: Array, arcs: Array, duty: float, new_duty: float, grid: int = 48) -> float:
    """Mean square of the number of legs in swing, over all phases and all blends.

    Parameters
    ----------
    places, arcs : ndarray (4,)
        o_i at the beginning and a_i, in cycles.
    duty, new_duty : float
        Duty factors at the beginning and at the end.
    grid : int
        Number of blends and of phases that the mean is taken over.

    Returns
    -------
    float
    """
    weight = (np.arange(grid) + 0.5) / grid
    phases = np.arange(grid) / grid
    at = phases[:, None, None] + places + weight[:, None] * arcs
    from_mid_swing = np.abs((at + 0.5) % 1.0 - 0.5)
    swing = 0.5 * (1.0 - duty - weight * (new_duty - duty))
    return float(np.mean(np.sum(from_mid_swing < swing[:, None], axis=-1) ** 2.0))


def _less(cost: tuple[float, ...], least: tuple[float, ...]) -> bool:
    """Compare costs in order; a later one decides only where the earlier ones are equal."""
    for one, other in zip(cost, least, strict=False):
        if abs(one - other) > ROUNDING:
            return one < other
    return False
