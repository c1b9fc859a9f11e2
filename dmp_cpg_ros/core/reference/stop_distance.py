# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far and for how long the reference goes on after a stop is requested.

The filter v̇ = −α_r v (paper, Section 5) leaves v₀/α_r to go. Its limit on the acceleration does
not act where it brakes to rest, so that this holds for every speed. With ``braking`` a_b the
largest speed s of a foot falls by a_b dt a tick at least, and v in proportion: with D = dt/(1 −
exp(−α_r dt)) and c = min(s₀, a_b D), where the one takes over from the other, the samples' way is
v₀/s₀ ((s₀ − c) D + (c + a_b dt/2)²/2a_b) at most. The robot holds each sample for a tick, and the
request acts a tick or two later.
"""

from __future__ import annotations

from math import exp, inf, log

from dmp_cpg_ros.core.reference.filter import ReferenceParameters

LATE_TICKS = 2
"""Ticks until the reference takes a request; until then it may still speed up."""


def slowing_time(parameters: ReferenceParameters, speed: float, wanted: float, tick_s: float
                 ) -> float:
    """Bound on the time in which a stop brings the largest speed of a foot down [s].

    ṡ = −max(α_r s, a_b): the filter down to a_b/α_r, the constant deceleration from there, and a
    tick because the step in which they change does the one or the other.

    Parameters
    ----------
    parameters : ReferenceParameters
        Rate and braking.
    speed, wanted : float
        At the request and to be reached [m/s]; any that is not below the speed of every foot and
        falls with it in proportion.
    tick_s : float
        Control tick [s].

    Returns
    -------
    float
        Infinite for a speed of zero without braking.
    """
    if not speed > wanted:
        return 0.0
    a_b, alpha_r = parameters.braking, parameters.alpha_r
    if not a_b > 0.0:
        return log(speed / wanted) / alpha_r if wanted > 0.0 else inf
    change = min(speed, max(wanted, a_b / alpha_r))
    return log(speed / change) / alpha_r + (change - wanted) / a_b + tick_s


def stop_distance(parameters: ReferenceParameters, speed: float, commanded: float,
                  tick_s: float, turning: float = 0.0, lead_s: float = 0.0) -> float:
    """Bound on the way of the reference from the request of a stop, for ever after [m].

    v dt (n + 1/(1 − exp(−α_r dt))), the sum of the samples v exp(−α_r k dt) that are held for a
    tick each, and n more; with the largest v that is reached within n ticks. A lead of the
    request adds to those.

    Parameters
    ----------
    parameters : ReferenceParameters
        Rate, largest acceleration, braking.
    speed : float
        |v| of the reference at the request [m/s].
    commanded : float
        |v_ext| of the command that acts until the request does [m/s].
    tick_s : float
        Control tick dt > 0 [s].
    turning : float
        Largest |γ| of both times the distance of a foot, s − |v| [m/s].
    lead_s : float
        Time from the request until it acts, beyond the ticks that it takes in any case [s].

    Returns
    -------
    float
        Length of the path in the plane; how the body follows it is not part of it.
    """
    late, a_b = LATE_TICKS * tick_s + lead_s, parameters.braking
    faster = (1.0 - exp(-parameters.alpha_r * late)) * (commanded - speed)
    most = speed + max(0.0, min(faster, parameters.max_acceleration * late))
    D = tick_s / (1.0 - exp(-parameters.alpha_r * tick_s))
    if not (a_b > 0.0 and most > 0.0):
        return most * (late + D)
    of_feet = most + turning
    change = min(of_feet, a_b * D)
    way = (of_feet - change) * D + (change + 0.5 * a_b * tick_s)**2 / (2.0 * a_b)
    return most * (late + way / of_feet)
