# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plan of the centre of mass: contact schedule weights, and lateral motion over the cycle.

In a gait that at times stands on one side only the body sways from side to side.

While all feet that stand are on one side, at y_s from the middle, the ground's force passes level
through the centre of mass only if it leans inward by y_s / h: the body must swing like the linear
inverted pendulum (Kajita, Kanehiro, Kaneko, Yokoi, Hirukawa 2001),

    ÿ = (g / h) (y − p) ,

with p = y_s there and 0 wherever feet on both sides can share the load. Of the periodic solution
the fundamental is taken: with p_1 that of p, at the gait's frequency ω,

    y_1 = p_1 (g / h) / (ω² + g / h) .

A side stands alone while both legs of the other one swing. For swings of 1 − β and legs that are Δ
cycles apart that is a share w = 1 − β − Δ of the cycle around the middle of the two swings, and
w' = 1 − β − (1 − Δ) half a cycle later, where these are positive, so that with c the place of that
middle

    p_1 = (2 / π) y_s (sin π w − sin π w') cos 2π c .

A trot, a walk, a bound and a pronk do not sway; an amble does a little, a pace much. A body that
was planned not to sway would take its sway for a push: it would place its feet as if to catch it,
and the wider they are the more force across they need, until friction does not yield that force
any more. Placement therefore answers what differs from the plan, standing feet go along with it,
and the forces accelerate the body as it says. They do not follow its velocity: a force that damps
the sway as well bears stronger pushes. Nor is there a plan for a body that goes sideways, which is
caught anyway by the feet that go ahead of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin
from typing import NamedTuple

from dmp_cpg_ros.core.maths.constants import GRAVITY


class LateralPlan(NamedTuple):
    """Planned lateral motion of the centre of mass, about the middle.

    Attributes
    ----------
    place : float
        y [m].
    velocity : float
        ẏ [m/s].
    acceleration : float
        ÿ [m/s^2].
    """

    place: float
    velocity: float
    acceleration: float


SIDEWAYS = 0.3
"""Speed sideways from which no sway is planned, in √(g l)."""

STRAIGHT = LateralPlan(0.0, 0.0, 0.0)
"""Plan of a gait without single-side stance."""


def lateral_plan(cycle_position: Sequence[float], duty: float, omega: float,
                 across: Sequence[float], height: float) -> LateralPlan:
    """Lateral plan, from where its legs are in their cycles.

    Parameters
    ----------
    cycle_position : sequence of four floats
        0 at mid-swing, in [−1/2, 1/2].
    duty : float
        Duty factor β.
    omega : float
        Angular frequency of the gait [rad/s].
    across : sequence of four floats
        Footholds' places to the left of the middle [m].
    height : float
        Of the centre of mass [m].

    Returns
    -------
    LateralPlan
    """
    along = quadrature = 0.0
    (fl, fr, rl, rr), (y_fl, y_fr, y_rl, y_rr) = cycle_position, across
    for front, hind, standing in ((fr, rr, y_fl + y_rl), (fl, rl, y_fr + y_rr)):
        amplitude, middle = _both_swing(front, hind, 1.0 - duty)
        if amplitude != 0.0:
            amplitude *= 0.5 * standing
            along += amplitude * cos(2.0 * pi * middle)
            quadrature += amplitude * sin(2.0 * pi * middle)
    if along == quadrature == 0.0:
        return STRAIGHT
    pendulum = GRAVITY / height
    share = pendulum / (omega * omega + pendulum)
    y = share * along
    return LateralPlan(y, -omega * share * quadrature, -omega * omega * y)


def _both_swing(front: float, hind: float, swing: float) -> tuple[float, float]:
    """Amplitude of the fundamental of 'both legs of a side swing', and the place in the cycle of
    the middle of their swings.
    """
    apart = (front - hind + 0.5) % 1.0 - 0.5
    together = max(0.0, swing - abs(apart))
    opposite = max(0.0, swing - 1.0 + abs(apart))
    return 2.0 / pi * (sin(pi * together) - sin(pi * opposite)), hind + 0.5 * apart


def contact_weights(cycle_position: Sequence[float], duty: float, activity: Sequence[float],
                    transfer: float) -> list[float]:
    """Contact schedule weights: how much load each foot may take, a trapezoid over its stance.

    Parameters
    ----------
    cycle_position : sequence of n floats
        0 at mid-swing, in [−1/2, 1/2).
    duty : float
        Duty factor β.
    activity : sequence of n floats
        Swing activity; a leg that does not swing carries.
    transfer : float
        Fraction of the cycle over which a foot takes and gives load.

    Returns
    -------
    list of n floats
        In [0, 1].
    """
    lift_off = 0.5 * (1.0 - duty)
    return [
        max(min(max((abs(position) - lift_off) / transfer, 0.0), 1.0), 1.0 - swings)
        for position, swings in zip(cycle_position, activity, strict=True)]
