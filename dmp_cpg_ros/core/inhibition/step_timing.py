# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a pushed robot steps: the factor on the common cadence of all oscillators.

While a foot stands at p, the capture point ξ of the linear inverted pendulum leaves it as
ξ − p = (ξ₀ − p) e^{ω₀ t}. With steps of at most s and a time T between them it is caught in the
end only if, when a step begins,

    |ξ − p| ≤ d∞ = s / (e^{ω₀ T} − 1)

(Koolen, de Boer, Rebula, Goswami & Pratt 2012): beyond the reach it is the time that decides, and
a foot that comes earlier need not go as far (Khadiv, Herzog, Moosavian & Righetti 2016). So all
legs go through their cycles κ times as fast while the least margin m of the capture point in the
support polygon is small,

    κ = 1 + (QUICKEST − 1) (1 − sat(m / (DISTURBED q l))) ,

with q as for :mod:`~dmp_cpg_ros.core.inhibition.caution`: from what standing legs can just bear to
a capture point on the edge of the support. Steady walking has more room, but at limits of what is
declared. κ rises within ``RISING`` and falls at ``SLOWING``: later steps are early too.

ω is common to all oscillators. In the frame that turns with it nothing changes, so that phase
relations stay, and what is certified of free legs holds for any ω(t). In a stop, and in a start
that no push has caused, κ only falls, at its rate whatever the body does: both are predicted.
Inhibition is armed once κ is 1, so that what is certified of captured legs is about cadences that
it was computed for.
"""

from __future__ import annotations

from collections.abc import Sequence

from dmp_cpg_ros.core.inhibition.caution import DISTURBED, least

QUICKEST = 2.5
"""Largest factor on the cadence: legs that swing faster come down no more where they are to."""

RISING = 0.02
"""Time in which the factor rises from 1 to its largest [s]. Standing feet are where their phase
and the cadence put them: a jump of the cadence would be a jump of the feet.
"""

SLOWING = 2.0
"""Rate at which the factor falls again [1/s]: a step or two."""


def quickened(quickness: float, margins: Sequence[float] | None, leg_length: float, dt: float,
              two_sided: float = 1.0) -> float:
    """Factor κ on the cadence after a tick, in [1, ``QUICKEST``].

    Parameters
    ----------
    quickness : float
        One tick before.
    margins : sequence of four floats, or None
        To the edges of the support polygon [m], where they are known and may act.
    leg_length : float
        l [m].
    dt : float
        [s]
    two_sided : float
        Share of stance with feet of both sides on the ground, of the gait.
    """
    slower = max(1.0, quickness - SLOWING * dt)
    if margins is None:
        return slower
    left = min(max(least(margins, leg_length, two_sided) / DISTURBED, 0.0), 1.0)
    wanted = 1.0 + (QUICKEST - 1.0) * (1.0 - left)
    return max(slower, min(wanted, quickness + (QUICKEST - 1.0) * dt / RISING))


def time_to_slow(quickness: float) -> float:
    """Time in which the factor falls to 1 by itself [s]."""
    return (quickness - 1.0) / SLOWING
