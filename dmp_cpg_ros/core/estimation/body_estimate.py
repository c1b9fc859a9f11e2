# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the robot believes of its body, how well it knows that, and what controllers take of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.estimation.velocity_filter import GYRO_BIAS, TILT, VELOCITY
from dmp_cpg_ros.core.maths import Array, vec3
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import RobotState

DRIFT_SHARE = 0.03
"""Deviation of the position per length of the way that led there, one of dead reckoning. It is a
constant, no filter's: more than twice the errors that runs of the package's own robot ended with,
by ``estimation.position_error_share`` and ``z_error_share`` of ``metrics.json`` (0.011 and 0.012
at most; doc/architecture.md has the commands). Other robots and grounds may err by more.
"""


@made_often
@dataclass(frozen=True)
class BodyEstimate:
    """The body's state as far as the sensors tell it.

    Attributes
    ----------
    time_ns : int
        Stamp [ns].
    position_in_world : ndarray (3,)
        By leg odometry, from where the robot was switched on; z over the ground there [m].
    quaternion : ndarray (4,)
        Orientation of ``base_link``, x, y, z, w; yaw is 0 where the robot was switched on.
    velocity_in_base, rate_in_base : ndarray (3,)
        [m/s], [rad/s]
    velocity_in_world : tuple of float
        The same velocity [m/s].
    height : float
        Of ``base_link`` over the ground under the stance feet, along its normal [m].
    normal_in_world : ndarray (3,)
        Of the ground's plane, upwards.
    trust : ndarray (4,)
        How well each foot stands, in [0, 1].
    covariance : ndarray (12, 12)
        Of the filter's error state.
    rate_noise : float
        Variance of a tick's mean reading of the gyroscope [rad²/s²].
    way : float
        Length of the way to ``position_in_world`` [m].
    problems : tuple of str
        Sensors that could not be used at this tick.
    readings : SensorReadings, optional
        Where there are any: the readings without those of the sensors that failed, whose joints
        keep their last angles.
    """

    time_ns: int
    position_in_world: Array
    quaternion: Array
    velocity_in_base: Array
    rate_in_base: Array
    velocity_in_world: Triple
    height: float
    normal_in_world: Array
    trust: Array
    covariance: Array
    rate_noise: float
    way: float
    problems: tuple[str, ...] = ()
    readings: SensorReadings | None = None

    @property
    def position_variance(self) -> Array:
        """Of ``position_in_world`` (3,) [m²]: no filter knows how far it has drifted."""
        return np.full(3, (DRIFT_SHARE * self.way) ** 2)

    @property
    def attitude_variance(self) -> Array:
        """Of rotations about the axes of the world (3,), as the filter believes [rad²]; that of
        yaw grows.
        """
        R = np.array(vec3.rotation(self.quaternion.tolist()))
        return np.einsum('ij,jk,ik->i', R, self.covariance[TILT, TILT], R)

    @property
    def velocity_variance(self) -> Array:
        """Of ``velocity_in_base`` (3,), as the filter believes [m²/s²]."""
        return self.covariance.diagonal()[VELOCITY]

    @property
    def rate_variance(self) -> Array:
        """Of ``rate_in_base`` (3,): the gyroscope's noise and what is not known of its bias
        [rad²/s²].
        """
        return self.rate_noise + self.covariance.diagonal()[GYRO_BIAS]


def estimated_state(readings: SensorReadings, estimate: BodyEstimate) -> RobotState:
    """Robot's state with an estimate in place of the ground truth, for the controllers."""
    readings = estimate.readings or readings
    felt = None if all(readings.usable_legs) else readings.usable_legs
    return RobotState(
        readings.time_ns, readings.joint_position, readings.joint_velocity, readings.joint_effort,
        estimate.position_in_world, estimate.quaternion, estimate.velocity_in_base,
        estimate.rate_in_base, readings.specific_force_in_base, readings.foot_force,
        readings.rate_in_base, estimate.normal_in_world, felt_legs=felt)
