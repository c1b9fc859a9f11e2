# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far the reference goes on after a stop is requested.

The filter v̇ = −α_r v (paper, Section 5) leaves v₀/α_r to go. Its limit on the acceleration does
not act where it brakes to rest, so that this holds for every speed. The robot holds each sample
for a tick, and the request acts a tick or two later.
"""

from __future__ import annotations

from math import exp

from dmp_cpg_ros.core.reference.filter import ReferenceParameters

LATE_TICKS = 2
"""Ticks until the reference takes a request; until then it may still speed up."""


def stop_distance(parameters: ReferenceParameters, speed: float, commanded: float,
                  tick_s: float) -> float:
    """Bound on the way of the reference from the request of a stop, for ever after [m].

    v dt (n + 1/(1 − exp(−α_r dt))), the sum of the samples v exp(−α_r k dt) that are held for a
    tick each, and n more; with the largest v that is reached within n ticks.

    Parameters
    ----------
    parameters : ReferenceParameters
        Rate and largest acceleration.
    speed : float
        |v| of the reference at the request [m/s].
    commanded : float
        |v_ext| of the command that acts until the request does [m/s].
    tick_s : float
        Control tick dt > 0 [s].

    Returns
    -------
    float
        Length of the path in the plane; how the body follows it is not part of it.
    """
    late = LATE_TICKS * tick_s
    faster = (1.0 - exp(-parameters.alpha_r * late)) * (commanded - speed)
    most = speed + max(0.0, min(faster, parameters.max_acceleration * late))
    return most * (late + tick_s / (1.0 - exp(-parameters.alpha_r * tick_s)))
