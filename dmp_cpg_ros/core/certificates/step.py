# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Time step against stiffness: what the exponential step can take; and delays against what capture
bears.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.contraction.capture import radius_tolerance
from dmp_cpg_ros.core.contraction.delays import (
    Capture,
    carried_margin,
    held_margin,
    late_margin,
)
from dmp_cpg_ros.core.contraction.finding import PROVED, SAMPLED
from dmp_cpg_ros.core.maths.exponential import ExponentialStep
from dmp_cpg_ros.core.maths.roots import last_that_holds

STEP_ERROR = 0.025
"""c: with s = tick · ℓ, a mode that decays by more than c s⁴ per tick decays in the step too."""

LARGEST_MILD_STEP = 1.4
"""Largest s = tick · ℓ for which that is so with some room."""

EXPECTED_TICKS = 3
"""Ticks that a sample should be allowed to be old: held for one, a tick late, one message lost."""


def mild_rate(rho: float, radius: float, omega: float) -> float:
    """ℓ = sup ‖∂N/∂x‖ over |x| ≤ r of the part that the step does not integrate exactly.

    With z = x₁ + i x₂, N = (ρr² − iω − ρ|z|²) z has ‖∂N/∂x‖ = |ρr² − iω − 2ρ|z|²| + ρ|z|², a
    convex function of |z|², largest at |z| = r.

    Parameters
    ----------
    rho, radius, omega : float
        Parameters of the oscillators [1/s], [-], [rad/s].

    Returns
    -------
    float
        [1/s]
    """
    return math.hypot(omega, rho * radius**2) + rho * radius**2


def longest_step(rho: float, radius: float, omega: float, rate: float) -> float:
    """Longest step in which every mode that decays at ``rate`` or faster decays too [s].

    The linear part is exact whatever its gains, so that only the mild part limits the step. On the
    test equation ẏ = (z + w) y / h, with z ≤ 0 the exact and |w| ≤ s the mild part, decay by more
    than c s⁴ per step is decay of the step, for every z: sampled densely, and tested.

    Parameters
    ----------
    rho, radius, omega : float
        Parameters of the oscillators, the largest ω.
    rate : float
        Slowest decay rate that must not be lost [1/s].

    Returns
    -------
    float
        0 when there is no decay to keep.
    """
    if not rate > 0.0:
        return 0.0
    ell = mild_rate(rho, radius, omega)
    return min(LARGEST_MILD_STEP / ell, (rate / (STEP_ERROR * ell**4)) ** (1.0 / 3.0))


def cycle_radius_error(rho: float, radius: float, omega: float, tick_s: float) -> float:
    """Share by which the integrated limit cycle's radius differs from r.

    A locked network feels no coupling, so that each oscillator is stepped as if it were alone: by
    the method of the suite without a linear part, which is Kutta's third-order one. Its circle is
    found by bisection.

    Parameters
    ----------
    rho, radius, omega : float
        Parameters of the oscillators.
    tick_s : float
        Step [s].

    Returns
    -------
    float
        |R/r − 1|; infinite when the step has no cycle near r.
    """
    step = ExponentialStep(np.zeros((2, 2)), np.zeros(2), tick_s)
    field = partial(AndronovHopf(rho, radius).field, omega=omega)

    def change(R: float) -> float:
        return float(np.hypot(*step(np.array((R, 0.0)), field))) - R

    low, high = 0.5 * radius, 1.5 * radius
    if not change(low) > 0.0 > change(high):
        return math.inf
    cycle = last_that_holds(lambda R: change(R) > 0.0, low, high, 50)
    return abs(cycle / radius - 1.0)


def step_inequalities(s: Setting, rate: float) -> list[Inequality]:
    """Inequalities (d): the tick against the mild part, and against the region C.

    Parameters
    ----------
    s : Setting
        Oscillators, region and tick.
    rate : float
        Slowest certified rate of the network [1/s].

    Returns
    -------
    list of Inequality
    """
    rho, radius = s.network.parameters.rho, s.network.parameters.radius
    omega, tick_s, r0 = s.span.omega[1], s.tick_s, s.parameters.inhibition.region_radius
    limit = longest_step(rho, radius, omega, rate)
    return [
        Inequality('time_step', tick_s, limit, 's', 'tick', 'longest stable step', SAMPLED,
                   'what decays in the equations decays in their numerical integration'),
        Inequality('cycle_radius', cycle_radius_error(rho, radius, omega, tick_s),
                   radius_tolerance(radius, r0) / radius, '',
                   '|R/r - 1| as integrated', 'what capture allows', PROVED,
                   'the integration keeps the radius of the limit cycle'),
        Inequality('region_per_tick', omega * tick_s, s.arc, 'rad', 'omega_max tick', 'arc of C',
                   PROVED, 'an oscillator cannot step over the region C between two ticks')]


def delay_inequalities(capture: Capture, tick_s: float) -> list[Inequality]:
    """Inequalities (j): delays, held samples and lost messages against what capture bears.

    Parameters
    ----------
    capture : Capture
        Of the suite, at the fastest cadence at which inhibition is armed.
    tick_s : float
        Control tick [s].

    Returns
    -------
    list of Inequality
        None is required: in the suite one node has all oscillators and switches inhibition.
    """
    age = EXPECTED_TICKS * tick_s
    slower = 1.0 + age * float(capture.coupling.sum(axis=1).max())

    def row(name: str, margin: float, what: str, how: str) -> Inequality:
        late = 'any number of' if math.isinf(margin) else max(0, math.floor(margin / tick_s) - 1)
        return Inequality(name, age, margin, 's', 'held, late, one lost', what, PROVED,
                          f'{how}, {late} ticks late or messages lost', required=False)

    return [
        row('late_inhibition', late_margin(capture), 'time to cross C',
            'inhibition captures as it does at once when it acts'),
        row('held_coupling', held_margin(capture), 'age of states',
            "with an oscillator per node that holds the others' states "
            f'(at {slower:.3g} times the period) capture would bear'),
        row('carried_coupling', carried_margin(capture), 'age of states',
            'with states that are carried on by their rate times their age it would bear')]
