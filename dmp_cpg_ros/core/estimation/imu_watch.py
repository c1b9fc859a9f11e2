# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An IMU that tells something else than the feet do for longer than a foot slides.

A motion is told twice: the accelerometer feels f̃, and the feet correct the velocity v that the
filter believes. With the vertical u in the base, the share of f̃ that no motion explains,

    a = f̃ − g u − ω × v − v̇ ,

is what the corrections of all feet take back in the filter: its innovations, in units of an
acceleration. A sound IMU leaves nothing of it in the mean, whatever the body does; an offset of
the accelerometer is seen at once, one of the gyroscope as the vertical turns away, a = g × its
angle.

An IMU in doubt is not believed until a has been small for a while, and the gyroscope has turned as
the feet do. Without IMU the vertical drifts slowly, so what counts as small grows with time.
"""

from __future__ import annotations

from math import cos, exp, hypot, sqrt
from typing import NamedTuple

from dmp_cpg_ros.core.estimation.velocity_filter import TILT, VELOCITY, FilterState
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.maths.rotations import turned
from dmp_cpg_ros.core.maths.vec3 import Pair, Triple, cross, dot, minus, moved, triple, upward
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings

MEMORY_S = 0.3
"""Time constant with which what was is forgotten [s]: feet slide for a shorter time."""

DOUBTED, DEVIATIONS = 0.7, 2.0
"""Mean of a, along the ground, beyond which an IMU is not believed [m/s²], more by g times so many
deviations of the vertical, which may be as far off.
"""

AGREES, DRIFT, AT_MOST = 0.4, 0.2, 1.0
"""Mean of a below which it agrees [m/s²], more by the drift of a vertical without IMU [m/s³], and
its largest value [m/s²].
"""

TURNS = 0.2
"""Mean difference of the turn rates of gyroscope and feet below which they agree [rad/s]."""

AGREED_S = 0.3
"""Time for which an IMU in doubt must have agreed to be believed [s]."""

BACK_S = 0.4
"""Least age of the state that was not spoilt yet, when an IMU begins to be in doubt [s]."""

GUESSED = 0.2
"""Deviation of a velocity that is a guess, of a body that has felt nothing for a while [m/s]: what
the feet take back of it tells nothing of the IMU. One that is felt is known to 0.03 m/s.
"""

UPRIGHT = cos(0.6)
"""Tilt from which feet tell nothing: who tumbles needs the IMU, whatever it is like."""


Unspoilt = tuple[FilterState, Pair]
"""State of the filter, and slope of the ground."""


class ImuWatch(NamedTuple):
    """Memory of the comparison.

    Attributes
    ----------
    unexplained : tuple of float
        Mean of a [m/s²].
    turning : tuple of float
        Mean by which the gyroscope turns faster than the feet do, as far as these tell, while it
        is in doubt [rad/s].
    doubted_s, agreed_s : float
        Time for which it has been in doubt, and has agreed since [s]; 0 while it is believed.
    kept, next_kept : Unspoilt or None
        Of a time ``BACK_S`` ago or longer while it was believed, and of one after that.
    age_s : float
        Age of the latter [s].
    """

    unexplained: Triple = (0.0, 0.0, 0.0)
    turning: Triple = (0.0, 0.0, 0.0)
    doubted_s: float = 0.0
    agreed_s: float = 0.0
    kept: Unspoilt | None = None
    next_kept: Unspoilt | None = None
    age_s: float = 0.0

    def followed(self, before: FilterState, after: FilterState, slope: Pair,
                 readings: SensorReadings, rate: Triple, dt: float) -> ImuWatch:
        """Compare the readings of a tick.

        Parameters
        ----------
        before, after : FilterState
            Of the ticks before and now, after the correction by the feet.
        slope : tuple of float
            Of the ground.
        readings : SensorReadings
            As they came.
        rate : tuple of float
            Reading of the gyroscope that the filter took, or was guessed [rad/s].
        dt : float
            Time between the ticks [s].
        """
        if not (readings.imu_is_usable and all(readings.usable_legs)):
            return ImuWatch(turning=self.turning, doubted_s=self.doubted_s)
        up, velocity = upward(after.quaternion), after.velocity_in_base
        guessed = max(before.covariance.diagonal()[VELOCITY].tolist()) > GUESSED * GUESSED
        if up[2] < UPRIGHT or guessed and not self.doubted_s:
            return NEW
        turning = minus(rate, after.gyro_bias)
        change = minus(velocity, before.velocity_in_base)
        felt = moved(triple(readings.specific_force_in_base.tolist()), up, -GRAVITY)
        felt = minus(moved(felt, change, -1.0 / dt), cross(turning, velocity))
        share = 1.0 - exp(-dt / MEMORY_S)
        a = moved(self.unexplained, minus(felt, self.unexplained), share)
        size = hypot(a[0], a[1])
        if not self.doubted_s:
            roll, pitch, _ = after.covariance.diagonal()[TILT].tolist()
            most = DOUBTED + DEVIATIONS * GRAVITY * sqrt(roll if roll > pitch else pitch)
            age, kept = self.age_s + dt, (self.kept, self.next_kept)
            if age >= BACK_S:
                age, kept = 0.0, (self.next_kept, (after, slope))
            return ImuWatch(a, (0.0, 0.0, 0.0), dt if size > most else 0.0, 0.0, *kept, age)
        apart = minus(triple(readings.rate_in_base.tolist()), rate)
        turning = moved(self.turning, minus(apart, self.turning), share)
        agrees = (size < min(AGREES + DRIFT * self.doubted_s, AT_MOST)
                  and dot(turning, turning) < TURNS * TURNS)
        agreed = max(self.agreed_s + (dt if agrees else -dt), 0.0)
        return NEW if agreed > AGREED_S else ImuWatch(a, turning, self.doubted_s + dt, agreed)

    def unspoilt(self, state: FilterState, slope: Pair) -> Unspoilt:
        """State with vertical and biases, and slope, of a time before the IMU was wrong; yaw
        stays.
        """
        if self.kept is None:
            return state, slope
        kept, slope = self.kept
        up, now = upward(kept.quaternion), upward(state.quaternion)
        return replace_unchecked(
            state, quaternion=turned(state.quaternion, cross(up, now)),
            gyro_bias=kept.gyro_bias, accelerometer_bias=kept.accelerometer_bias), slope


NEW = ImuWatch()
"""Of an IMU that is believed."""
