# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a pushed robot steps: the factor on the common cadence of all oscillators.

While a foot stands at p, the capture point ξ of the linear inverted pendulum leaves it as
ξ − p = (ξ₀ − p) e^{ω₀ t}. With steps of at most s and a time T between them it is caught in the
end only if, when a step begins,

    |ξ − p| ≤ d∞ = s / (e^{ω₀ T} − 1)

(Koolen, de Boer, Rebula, Goswami & Pratt 2012): beyond the reach it is the time that decides, and
a foot that comes earlier need not go as far (Khadiv, Herzog, Moosavian & Righetti 2016). So all
legs go through their cycles κ times as fast while the room of the capture point
(:func:`~dmp_cpg_ros.core.inhibition.caution.room`) is small,

    κ = 1 + (QUICKEST − 1) (1 − sat(room / DISTURBED)) :

from what standing legs can just bear to a capture point on the edge of the support, but no farther
than hips can swing the legs at the speed that the body has from walking (:func:`quickest`). κ
rises within ``RISING`` and falls at ``SLOWING``: later steps are early too.

ω is common to all oscillators. In the frame that turns with it nothing changes, so that phase
relations stay, and what is certified of free legs holds for any ω(t). In a stop, and in a start
that no push has caused, κ only falls, at its rate whatever the body does: both are predicted.
Inhibition is armed once κ is 1, so that what is certified of captured legs is about cadences that
it was computed for.
"""

from __future__ import annotations

from math import exp, hypot, inf, pi

from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.speed_limit import swing_acceleration
from dmp_cpg_ros.core.inhibition.caution import DISTURBED
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.vec3 import Pair

QUICKEST = 2.5
"""Largest factor on the cadence: legs that swing faster come down no more where they are to."""

RISING = 0.02
"""Time in which the factor rises from 1 to its largest [s]. Standing feet are where their phase
and the cadence put them: a jump of the cadence would be a jump of the feet.
"""

SLOWING = 2.0
"""Rate at which the factor falls again [1/s]: a step or two."""

FORGETTING = 0.3
"""Rate at which a speed of the reference is forgotten [1/s]: far slower than a body loses it."""


def quickened(quickness: float, left: float | None, dt: float, most: float = QUICKEST) -> float:
    """Factor κ on the cadence after a tick of dt [s], in [1, ``QUICKEST``], from the one before
    and the room, where it is known and may act; it does not rise above the most that hips allow.
    """
    slower = max(1.0, quickness - SLOWING * dt)
    if left is None:
        return slower
    wanted = 1.0 + (QUICKEST - 1.0) * (1.0 - min(max(left / DISTURBED, 0.0), 1.0))
    wanted = min(wanted, most)
    return max(slower, min(wanted, quickness + (QUICKEST - 1.0) * dt / RISING))


def fastest_lately(before: float, r: Array, dt: float) -> float:
    """Fastest that a reference (3,) has been, slowly forgotten, a tick of dt [s] later [m/s]."""
    return max(hypot(*r.tolist()[:2]), before * exp(-FORGETTING * dt))


def quickest(network: GaitNetwork, quickness: float, r: Array, body: Pair, lately: float) -> float:
    """Factor κ up to which hips can swing the legs, 6 u κ f/(1 − β)² ≤ τ l/I, as commands keep to
    (:mod:`~dmp_cpg_ros.core.gait.speed_limit`). The speed u is that of the reference, or of the
    body along it, which stays behind in a stop; what a push has added does not count. Feet that
    come down faster than hips can bring them to the speed of the ground throw the body up.

    Parameters
    ----------
    network : GaitNetwork
        That acts, with a factor on its cadence already.
    quickness : float
        That factor.
    r : ndarray (3,)
        Reference v_x, v_y [m/s], γ [rad/s].
    body : pair of float
        Velocity of the body [m/s].
    lately : float
        From :func:`fastest_lately` [m/s].

    Returns
    -------
    float
        Positive; infinite without a speed, or where it is not known what hips can.
    """
    (v_x, v_y, _), omega, _, duty = network.gait.pace(r, network.scale)
    speed = hypot(v_x, v_y)
    if speed == 0.0:
        return inf
    along = max(speed, min(lately, (v_x * body[0] + v_y * body[1]) / speed))
    return network.scale.swing / swing_acceleration(along, omega / (2.0 * pi * quickness), duty)


def time_to_slow(quickness: float) -> float:
    """Time in which the factor falls to 1 by itself [s]."""
    return (quickness - 1.0) / SLOWING
