# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Estimate of the body's state, and its form for the controllers."""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import RobotState


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
    height : float
        Of ``base_link`` over the ground under the stance feet, along its normal [m].
    normal_in_world : ndarray (3,)
        Of the ground's plane, upwards.
    trust : ndarray (4,)
        How well each foot stands, in [0, 1].
    velocity_variance : ndarray (3,)
        Of ``velocity_in_base``, as the filter believes [m^2/s^2].
    problems : tuple of str
        Sensors that could not be used at this tick.
    """

    time_ns: int
    position_in_world: Array
    quaternion: Array
    velocity_in_base: Array
    rate_in_base: Array
    height: float
    normal_in_world: Array
    trust: Array
    velocity_variance: Array
    problems: tuple[str, ...] = ()


def estimated_state(readings: SensorReadings, estimate: BodyEstimate) -> RobotState:
    """Robot's state with an estimate in place of the ground truth, for the controllers."""
    return RobotState(
        readings.time_ns, readings.joint_position, readings.joint_velocity, readings.joint_effort,
        estimate.position_in_world, estimate.quaternion, estimate.velocity_in_base,
        estimate.rate_in_base, readings.specific_force_in_base, readings.foot_force,
        readings.rate_in_base, estimate.normal_in_world)
