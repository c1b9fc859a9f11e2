# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where a swinging foot is going, for people to look at; nothing walks by it."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from dmp_cpg_ros.core.canonical.phase import scalar_phase, scalar_phase_rate
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.vec3 import Triple, triple
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.leg import LegFeedback, LegPrimitive
from dmp_cpg_ros.core.transformation.stumble import Stumble


def rest_of_swing(leg: LegPrimitive, gait: GaitInForce, x: Array, x_dot: Array, r: Array,
                  feedback: LegFeedback, count: int = 16) -> Array | None:
    """Way of a swinging foot to its next foothold.

    Parameters
    ----------
    leg : LegPrimitive
        The leg.
    gait, x, x_dot, r, feedback
        As for :meth:`~dmp_cpg_ros.core.transformation.leg.LegPrimitive.step`.
    count : int
        Number of points.

    Returns
    -------
    ndarray (count, 3) or None
        From the measured foot to where it will stand, in the base as it is now, if the reference
        stays [m]; None of a foot that stands or comes to rest.
    """
    reference, _, own_omegas, duty = gait.pace(r, leg.scale)
    omega, (x_1, x_2) = own_omegas[leg.place], x.tolist()
    rate = scalar_phase_rate(x_1, x_2, *x_dot.tolist()) + gait.rest_rate
    begin, end = gait.scalar_cycle_position(scalar_phase(x_1, x_2)), 0.5 * (1.0 - duty)
    if abs(begin) >= end or rate < 0.5 * omega:
        return None
    path = leg.path(reference, omega, duty, 1.0, Stumble(), feedback)
    positions = np.linspace(begin, end, count)
    planned = [leg.motion.step(None, path, position, omega, 0.0)[1]
               for position in positions.tolist()]
    left = np.linspace(1.0, 0.0, count)[:, None]
    away = np.subtract(leg.kinematics.foot(feedback.joint_position), planned[0])
    points = planned + left * away + (1.0 - left) * feedback.shift_in_base
    seconds = (positions - begin) * 2.0 * pi / omega
    return np.array([seen_from_now(path, t, triple(point)) for t, point in zip(
        seconds.tolist(), points.tolist(), strict=True)])


def seen_from_now(path: FootPath, seconds: float, point: Triple) -> Triple:
    """A point of the base as it will be, in the base as it is now, for a held reference [m]."""
    angle = path.gamma * seconds
    s, c = sin(angle), cos(angle)
    along, across = ((s / path.gamma, (1.0 - c) / path.gamma) if abs(angle) > 1e-6
                     else (seconds, 0.5 * angle * seconds))
    x, y, z = point
    return (c * x - s * y + along * path.v_x - across * path.v_y,
            s * x + c * y + across * path.v_x + along * path.v_y, z)
