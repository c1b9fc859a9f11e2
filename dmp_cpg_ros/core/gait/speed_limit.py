# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Limits of commands: the highest speed of the gait, and the curves that friction can hold.

Commands are limited before they are filtered, by the gait that is wanted
(:class:`~dmp_cpg_ros.core.reference.filter.CommandGate`), so that the reference comes to the
highest speed as smoothly as to any other. While gaits change, the reference is not there yet, or
the old gait cannot do what the new one can: whatever reads the reference by a gait, the
oscillators' frequency, the legs' paths and the posture controller, takes it within the limit of
the gait in force, which moves from one to the other with the blend. The robot slows down on the
way into a slower gait and speeds up on the way into a faster one.

A body at speed u that turns with γ is accelerated by u |γ| towards the centre of its curve. The
feet push it there as far as friction bears that, and the less the more the legs are at their limit
with the speed alone. Commands therefore keep to

    s² + c² ≤ 1 ,    c = u |γ| / (κ g) ,

with s the speed's share of the highest one and κ the parameter ``max_curve`` times the share of
stance in which feet of both sides stand, for one side alone does not hold the roll of a curve, or
``ONE_SIDED`` where they never do, for a gait that could not turn at all could not be led home; a
reference on its way to a command is never far outside. Legs that all swing together turn the
body meanwhile, the more the less its inertia, and across the way it stands on a narrower track:
speed sideways and from turning then counts (I_yy/I_xx) (x/y) times in s, with x and y the feet's
distances, else twice.

Velocity and turn rate are shortened alike: a curve stays the same curve.

The highest speed is that of the gait, or less on a robot that cannot swing its legs as fast. The
swing is a cubic from one end of the stance, u β/f long, to the other within (1 − β)/f, and meets
the ground's speed −u at both (:mod:`~dmp_cpg_ros.core.transformation.foot_path`); so at its ends
the foot is accelerated by

    6 (u β/f + u (1 − β)/f) (f/(1 − β))² = 6 u f/(1 − β)² ≤ τ l/I ,

with τ the torque of the hip joint, I the leg's inertia about it and l the height of the hips: what
the hip alone gives to a foot under it.

A cadence that is slower than the gait's by a factor c < 1 has longer strides, u β/(c f), which
legs reach no farther for. They stay within those of the gait at its highest speed. At a quicker
one the same hips swing the legs c times as often: commands keep to the inequality with c f. While
the cadence moves from one factor to another they keep to the limits at both.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, inf, sqrt

from dmp_cpg_ros.core.maths.roots import last_that_holds
from dmp_cpg_ros.core.maths.vec3 import Triple

BEYOND = 5.0
"""Dimensionless speed beyond any of legged animals and robots, to look for a limit up to twice it.
"""

ONE_SIDED = 0.05
"""Least share of stance on both sides by which curves count; the package's gaits have more.
"""


def within_limit(velocity: Triple, speed: float, most: float, tightest: float = inf) -> Triple:
    """Shorten a velocity to the highest speed and the largest curve.

    Parameters
    ----------
    velocity : tuple of float
        v_x, v_y [m/s], γ [rad/s].
    speed : float
        The foot speed that goes with it, as from
        :meth:`~dmp_cpg_ros.core.gait.body_scale.BodyScale.foot_speed`, in proportion to it.
    most : float
        Highest foot speed, in the same unit.
    tightest : float, optional
        Largest acceleration towards the centre of a curve [m/s^2].

    Returns
    -------
    tuple of float
        The same where it is within the limit.
    """
    fast = (speed / most) ** 2
    tight = (hypot(velocity[0], velocity[1]) * velocity[2] / tightest) ** 2
    if fast + tight <= 1.0:
        return velocity
    # shortened by k, the one grows with k², the other with k⁴
    share = sqrt(2.0 / (fast + sqrt(fast * fast + 4.0 * tight)))
    return velocity[0] * share, velocity[1] * share, velocity[2] * share


def blended_limit(before: float, after: float, weight: float) -> float:
    """Limit on the way from one to another: the slowness 1/u moves evenly, so that it is a number
    also where one of them has no limit, and near the slower one for most of the way.

    Parameters
    ----------
    before, after : float
        Limits, positive; infinite for none.
    weight : float
        In [0, 1].
    """
    slowness = (1.0 - weight) / before + weight / after
    return 1.0 / slowness if slowness > 0.0 else inf


def swing_acceleration(speed: float, cadence: float, duty: float) -> float:
    """Acceleration of a foot at both ends of its swing, 6 u f/(1 − β)².

    Parameters
    ----------
    speed : float
        u [m/s], or u/√(g l).
    cadence : float
        f [1/s], or f √(l/g).
    duty : float
        β in (0, 1).

    Returns
    -------
    float
        [m/s^2], or as a share of g.
    """
    return 6.0 * speed * cadence / (1.0 - duty) ** 2


def fastest_swing(needed: Callable[[float], float], available: float, highest: float,
                  grid: int = 64) -> float:
    """Lowest speed from which on swinging the legs takes more than there is.

    Parameters
    ----------
    needed : callable (float) → float
        Acceleration that a speed takes, 0 at rest.
    available : float
        That there is, in the same unit.
    highest : float
        Speed that is not exceeded anyway; infinite for none.
    grid : int
        Number of steps in which it is looked for.

    Returns
    -------
    float
        ``highest`` where none below takes more.
    """
    if available == inf:
        return highest
    last, end = 0.0, highest if highest < inf else 2.0 * BEYOND
    for i in range(1, grid + 1):
        speed = end * i / grid
        if needed(speed) > available:
            return last_that_holds(lambda u: needed(u) <= available, last, speed, 50)
        last = speed
    return highest


def fastest_stride(stride: Callable[[float], float], slower: float, highest: float) -> float:
    """Speed at which a slower cadence has the strides of the highest speed.

    Parameters
    ----------
    stride : callable (float) → float
        Way of a standing foot at a speed at the gait's own cadence, u β/f, which grows with it.
    slower : float
        Factor on the cadence, in (0, 1].
    highest : float
        Highest speed at the gait's own cadence; infinite for none.

    Returns
    -------
    float
        In (0, ``highest``].
    """
    if highest == inf:
        return highest
    longest = slower * stride(highest)
    return last_that_holds(lambda u: stride(u) <= longest, 0.0, highest, 50)
