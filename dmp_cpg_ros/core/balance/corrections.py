# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Slow loops for what the model does not know: of velocity, heading, and the centre of mass.

Their errors are means over cycles. A velocity that stays behind while the reference stands still
tells of payload or friction, which last; while it moves it tells of the way there, for which less
is corrected. With the correction legs go no faster than the gait may: in a pronk, whose feet push
all at once, faster ones pitch the body more and bring it no farther. A tilt that stays tells of a
centre of mass beside where the model has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, exp, hypot, inf, isnan, pi
from typing import NamedTuple

from dmp_cpg_ros.core.balance.motion_plan import MotionPlan
from dmp_cpg_ros.core.balance.parameters import PostureParameters
from dmp_cpg_ros.core.maths import clamped
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Matrix, Pair, Triple

SLOWEST = 0.3
"""Froude speed below which the limit of the correction shrinks no more."""

SETTLED = 0.01
"""Froude speed by which the body may be behind a reference that stands still, by plan."""

WIDENING_S, NARROWING_S = 2.0, 0.5
"""Times in which the limit of the correction widens where the reference stands still, and becomes
narrow again where it moves [s].
"""

FORGETTING = 250.0
"""Rate at which heading and widened limit are forgotten for each e-fold of the legs' activity
[1/s].
"""

MEAN = 0.5
"""Rate at which the mean tilt follows, in √(g/l)."""

BELIEVED = 0.025
"""Mean tilt that a body has by itself, of which nothing is concluded [rad]."""


class VelocityCorrection(NamedTuple):
    """Integral velocity and heading correction, slow: added to the velocity of the standing feet.

    Attributes
    ----------
    correction : tuple of float
        Correction of the stance velocity, v_x and v_y [m/s].
    heading_error : float
        Commanded minus measured heading [rad].
    yaw : float
        Heading at the last tick [rad]; NaN before the first.
    wide : float
        How far the limit of the correction has widened, in [0, 1].
    """

    correction: Pair = (0.0, 0.0)
    heading_error: float = 0.0
    yaw: float = float('nan')
    wide: float = 0.0

    def integrated(self, p: PostureParameters, leg_length: float, moving: float,
                   quaternion: Sequence[float], velocity: Triple, plan: MotionPlan, gamma: float,
                   dt: float, room: float = inf) -> VelocityCorrection:
        """Integrate the errors of velocity and heading while the legs move; forget them at rest.

        Parameters
        ----------
        p : PostureParameters
            Gains.
        leg_length : float
            Standing height of the hips [m].
        moving : float
            Mean activity of the legs.
        quaternion : sequence of four floats
            Orientation of the base, x, y, z, w.
        velocity : tuple of float
            Of the base in the levelled frame [m/s].
        plan : MotionPlan
            Of this tick; it says what velocity the body can have by now.
        gamma : float
            Reference of the turn rate [rad/s].
        dt : float
            [s]
        room : float
            By how much the legs may go faster than they are asked [m/s].
        """
        x, y, z, w = quaternion
        yaw = atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
        froude, wanted = (GRAVITY * leg_length) ** 0.5, plan.expected
        wide = self.wide + dt * (1.0 / WIDENING_S if plan.behind < SETTLED * froude
                                 else -1.0 / NARROWING_S)
        left = moving ** (FORGETTING * dt)
        wide = clamped(wide, 0.0, 1.0) * left
        share = p.speed_correction_limit + wide * max(
            p.speed_mismatch_limit - p.speed_correction_limit, 0.0)
        limit = share * max(hypot(*wanted), SLOWEST * froude)
        gain = p.speed_integral * (GRAVITY / leg_length) ** 0.5 * moving * dt
        kept = exp(-(1.0 - moving) * p.activity_rate * dt)
        (along, across), (should_along, should_across) = self.correction, wanted
        along = clamped(along + gain * (should_along - velocity[0]), -limit, limit) * kept
        across = clamped(across + gain * (should_across - velocity[1]), -limit, limit) * kept
        along, across = _no_faster(along, should_along, room), _no_faster(
            across, should_across, room)
        turn = 0.0 if isnan(self.yaw) else (yaw - self.yaw + pi) % (2.0 * pi) - pi
        error = (self.heading_error + gamma * dt - turn) * left
        return VelocityCorrection(
            (along, across), clamped(error, -p.heading_limit, p.heading_limit), yaw, wide)

    def lasting(self, p: PostureParameters, leg_length: float, plan: MotionPlan) -> Pair:
        """Part of the correction beyond the limit where the reference moves [m/s]: it makes up for
        what the model does not know, and says nothing of a disturbance.
        """
        limit = p.speed_correction_limit * max(
            hypot(*plan.expected), SLOWEST * (GRAVITY * leg_length) ** 0.5)
        x, y = self.correction
        return x - clamped(x, -limit, limit), y - clamped(y, -limit, limit)

    def acting(self, p: PostureParameters, leg_length: float, moving: float) -> Triple:
        """Correction of v_x, v_y [m/s], γ [rad/s] that the legs apply."""
        turn = p.heading_gain * (GRAVITY / leg_length) ** 0.5 * self.heading_error
        return moving * self.correction[0], moving * self.correction[1], moving * turn


class MassOffset(NamedTuple):
    """Displacement of the centre of mass from where the model has it.

    Where the feet carry a body whose mass is beside, it tilts to that side until springs hold it:
    the displacement is the integral of the mean tilt beyond ``BELIEVED``, while the legs move.
    With it the forces of the feet balance about the true centre, and swinging feet come down
    around it.

    Attributes
    ----------
    tilt : tuple of float
        Roll and pitch of the body against the ground, in the mean [rad].
    place : tuple of float
        Ahead and to the left [m].
    """

    tilt: Pair = (0.0, 0.0)
    place: Pair = (0.0, 0.0)

    def found(self, p: PostureParameters, leg_length: float, moving: float,
              R_ground_base: Matrix, dt: float) -> MassOffset:
        """Go on for a tick; arguments as for :meth:`VelocityCorrection.integrated`."""
        froude_rate, (z_x, z_y, _) = (GRAVITY / leg_length) ** 0.5, R_ground_base[2]
        forgotten = exp(-MEAN * froude_rate * dt)
        (roll, pitch), (x, y) = self.tilt, self.place
        roll, pitch = z_y + forgotten * (roll - z_y), -z_x + forgotten * (pitch + z_x)
        limit = p.offset_limit * leg_length
        speed = p.offset_rate * froude_rate * leg_length * moving * dt
        return MassOffset((roll, pitch), (
            clamped(x + speed * _beyond(pitch), -limit, limit),
            clamped(y - speed * _beyond(roll), -limit, limit)))


def _no_faster(correction: float, velocity: float, room: float) -> float:
    """Correction that adds a room to the size of a velocity at most [m/s]."""
    if velocity == 0.0:
        return correction
    return min(correction, room) if velocity > 0.0 else max(correction, -room)


def _beyond(tilt: float) -> float:
    """What of a mean tilt is not the body's own [rad]."""
    return tilt - clamped(tilt, -BELIEVED, BELIEVED)
