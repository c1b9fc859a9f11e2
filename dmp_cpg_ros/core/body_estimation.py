# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The state of the body from what a robot has: gyroscope, accelerometer, joints, contacts.

A Kalman filter (:mod:`~dmp_cpg_ros.core.velocity_filter`) fuses the IMU with the velocities that
the standing legs measure (:mod:`~dmp_cpg_ros.core.leg_odometry`); position is integrated, the
ground is a plane through the newest footholds (:mod:`~dmp_cpg_ros.core.terrain_plane`). An
attitude that the IMU's driver may give is not used: here yaw is the gyroscope's, whose bias the
standing legs correct.

What cannot be used (not finite, impossible, absent) never reaches the filter and is named in
``BodyEstimate.problems``: a leg without joints measures nothing, a foot without contact sensor is
judged by its joint torques, and without IMU the standing feet tell how the body turns.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.body_estimate import BodyEstimate
from dmp_cpg_ros.core.estimation_parameters import EstimationParameters
from dmp_cpg_ros.core.gait import GRAVITY
from dmp_cpg_ros.core.leg_odometry import (
    FootMotion,
    LegOdometry,
    force_from_torque,
    turn_rate_of_feet,
)
from dmp_cpg_ros.core.robot_description import RobotDescription
from dmp_cpg_ros.core.robot_state import LEGS
from dmp_cpg_ros.core.rotations import levelled, rotation_matrix
from dmp_cpg_ros.core.sensor_readings import SensorReadings
from dmp_cpg_ros.core.terrain_plane import (
    TerrainState,
    initial_terrain,
    normal_in_world,
    terrain_step,
)
from dmp_cpg_ros.core.velocity_filter import FilterNoise, FilterState, predict, settle, update

Array = NDArray[np.float64]

BLIND = 0.02
"""Time for which the last turn rate is held without IMU and feet [s]; then the body counts as not
turning. Also the gap between ticks beyond which readings do not stand for their mean.
"""

BLIND_NOISE = (0.3, 3.0)
"""Noise densities of such guesses instead of the IMU's [rad/s/√Hz], [m/s²/√Hz]."""

INITIAL_DEVIATION = (0.05, 0.1, 0.005, 0.1)
"""Of attitude [rad], velocity [m/s], biases of gyroscope [rad/s] and accelerometer [m/s^2]."""

UNTRUSTED_SHARE = 0.2
"""Share of the force of full trust below which a foot is not trusted at all."""

STILL_JOINT, STILL_TURN = 0.15, 0.03
"""Velocities of joints and body below which a robot on all four feet stands still [rad/s]."""

STILL_TIME = 0.3
"""Time after which a robot that seems to stand still does so [s]; it sways out before."""

STILL_DEVIATION = 0.01
"""By which such a body turns all the same [rad/s]."""

HEIGHT_RATE = 50.0
"""Rate at which the height follows the kinematics of the stance legs [1/s]."""


@dataclass(frozen=True)
class EstimatorState:
    """State of the estimator between ticks.

    Attributes
    ----------
    filter : FilterState
        Attitude, velocity, biases.
    terrain : TerrainState
        Footholds and plane.
    estimate : BodyEstimate
        The last one.
    rate : ndarray (3,)
        Last usable reading of the gyroscope [rad/s].
    blind : float
        Time since the IMU could be used [s].
    still : float
        Time for which the robot has stood still [s].
    """

    filter: FilterState
    terrain: TerrainState
    estimate: BodyEstimate
    rate: Array
    blind: float
    still: float


class BodyEstimator:
    """Estimator of one robot; state in, state out.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    parameters : EstimationParameters
        Noise and thresholds.
    """

    def __init__(self, description: RobotDescription, parameters: EstimationParameters) -> None:
        """Scale the thresholds by the robot's weight."""
        self.parameters = parameters
        self.odometry = LegOdometry(description)
        self._weight = description.mass * GRAVITY

    def step(
        self, memory: EstimatorState | None, readings: SensorReadings
    ) -> tuple[EstimatorState, BodyEstimate]:
        """Take in the readings of one tick.

        Parameters
        ----------
        memory : EstimatorState or None
            State after the last tick; None at the first, which takes the robot to be at rest.
        readings : SensorReadings
            A stamp that is not later than the last one means that the robot began anew.

        Returns
        -------
        memory : EstimatorState
        estimate : BodyEstimate
        """
        if memory is None or readings.time_ns <= memory.estimate.time_ns:
            return self._begin(readings)
        dt = (readings.time_ns - memory.estimate.time_ns) * 1e-9
        legs, contacts, seeing = (
            readings.usable_legs,
            readings.usable_contacts,
            readings.imu_is_usable,
        )
        blind = 0.0 if seeing and dt <= BLIND else memory.blind + dt
        noise = self._noise(blind)
        if seeing:
            rate, force = readings.rate_in_base, readings.specific_force_in_base
        else:
            rate, force = self._guessed(memory, readings, legs, blind)
        predicted = predict(memory.filter, 0.5 * (memory.rate + rate), force, dt, noise)
        motion, normal = self._motion(memory.terrain, predicted, readings, legs)
        trust = self._trust(readings, contacts, motion, normal)
        trust = np.minimum(trust, memory.estimate.trust + dt / self.parameters.contact_settling)
        trust[~legs] = 0.0
        state, stands = predicted, trust > 0.0
        if stands.any():
            state, _ = update(
                predicted,
                rate,
                motion.contact_in_base[stands],
                motion.velocity_in_base[stands],
                trust[stands],
                noise,
            )
        rests = seeing and bool(stands.all()) and _is_still(readings, state)
        still = memory.still + dt if rests else 0.0
        if still > STILL_TIME:
            state = settle(state, rate, STILL_DEVIATION)
        problems = _problems(legs, contacts, seeing)
        if not np.isfinite(state.covariance.sum() + state.velocity_in_base.sum()):
            problems = (*problems, 'filter')
            state = memory.filter
        terrain, estimate = self._finished(
            memory, state, readings.time_ns, rate, motion, trust, problems
        )
        return EstimatorState(state, terrain, estimate, rate, blind, still), estimate

    def _begin(self, readings: SensorReadings) -> tuple[EstimatorState, BodyEstimate]:
        """Start at rest: the accelerometer tells the vertical, the feet the ground."""
        seeing = readings.imu_is_usable
        upward = readings.specific_force_in_base if seeing else np.array((0.0, 0.0, 1.0))
        zero = np.zeros(3)
        covariance = np.diag(np.repeat(np.square(INITIAL_DEVIATION), 3))
        state = FilterState(levelled(upward), zero, zero, zero, covariance)
        legs, contacts = readings.usable_legs, readings.usable_contacts
        R = rotation_matrix(state.quaternion)
        flat = TerrainState(np.zeros((4, 3)), np.zeros(2))
        motion, normal = self._motion(flat, state, readings, legs)
        trust = np.where(legs, self._trust(readings, contacts, motion, normal), 0.0)
        contact = motion.contact_in_base @ R.T
        height = -float(contact[legs, 2].mean()) if legs.any() else 0.0
        place = np.array((0.0, 0.0, height))
        contact = np.where(legs[:, None], contact + place, 0.0)
        estimate = BodyEstimate(
            readings.time_ns,
            place,
            state.quaternion,
            zero,
            readings.rate_in_base if seeing else zero,
            height,
            normal_in_world(flat.slope),
            trust,
            covariance.diagonal()[3:6],
            _problems(legs, contacts, seeing),
        )
        terrain = initial_terrain(contact) if legs.all() else flat
        rate = estimate.rate_in_base
        return EstimatorState(state, terrain, estimate, rate, 0.0, 0.0), estimate

    def _guessed(
        self,
        memory: EstimatorState,
        readings: SensorReadings,
        legs: NDArray[np.bool_],
        blind: float,
    ) -> tuple[Array, Array]:
        """Guess what a silent IMU would read: the feet tell the turn rate, nothing accelerates."""
        state, trust = memory.filter, np.where(legs, memory.estimate.trust, 0.0)
        upward = rotation_matrix(state.quaternion)[2]
        rate = memory.rate if blind <= BLIND else state.gyro_bias
        if trust.any():
            motion, _ = self._motion(memory.terrain, state, readings, legs)
            rate = state.gyro_bias + turn_rate_of_feet(
                motion.contact_in_base, motion.velocity_in_base, trust
            )
        return rate, GRAVITY * upward + state.accelerometer_bias

    def _motion(
        self,
        terrain: TerrainState,
        state: FilterState,
        readings: SensorReadings,
        legs: NDArray[np.bool_],
    ) -> tuple[FootMotion, Array]:
        """Motion of the feet, and the normal of the ground in the base."""
        normal = normal_in_world(terrain.slope) @ rotation_matrix(state.quaternion)
        q, q_dot = readings.joint_position, readings.joint_velocity
        if not legs.all():  # a placeholder for legs that are left out later
            q, q_dot = (np.where(np.repeat(legs, 3), values, 0.0) for values in (q, q_dot))
        return self.odometry.motion(q, q_dot, normal), normal

    def _trust(
        self,
        readings: SensorReadings,
        contacts: NDArray[np.bool_],
        motion: FootMotion,
        normal: Array,
    ) -> Array:
        """Trust in each foot from its force alone, (4,) in [0, 1]."""
        force = readings.foot_force
        if not contacts.all():
            force = force.copy()
            for i in np.flatnonzero(~contacts):
                torque = readings.joint_effort[3 * i : 3 * i + 3]
                felt = force_from_torque(motion.jacobian_in_base[i], torque, normal)
                force[i] = felt if np.isfinite(felt) else 0.0
        full = self.parameters.contact_share * self._weight
        return np.clip((force / full - UNTRUSTED_SHARE) / (1.0 - UNTRUSTED_SHARE), 0.0, 1.0)

    def _noise(self, blind: float) -> FilterNoise:
        p = self.parameters
        gyro, accelerometer = BLIND_NOISE if blind else (p.gyro_noise, p.accelerometer_noise)
        return FilterNoise(
            gyro,
            accelerometer,
            p.gyro_bias_walk,
            p.accelerometer_bias_walk,
            p.foot_noise,
            p.foot_freedom,
        )

    def _finished(
        self,
        memory: EstimatorState,
        state: FilterState,
        time_ns: int,
        rate: Array,
        motion: FootMotion,
        trust: Array,
        problems: tuple[str, ...],
    ) -> tuple[TerrainState, BodyEstimate]:
        """Integrate the position, follow the ground, and put the estimate together."""
        last = memory.estimate
        dt = (time_ns - last.time_ns) * 1e-9
        R, R_before = rotation_matrix(state.quaternion), rotation_matrix(last.quaternion)
        velocity = 0.5 * (R @ state.velocity_in_base + R_before @ last.velocity_in_base)
        position = last.position_in_world + velocity * dt
        contact = motion.contact_in_base @ R.T
        terrain = terrain_step(
            memory.terrain, contact + position, trust, dt, self.parameters.terrain_time
        )
        normal = normal_in_world(terrain.slope)
        height, weight = last.height + float(normal @ velocity) * dt, float(trust.sum())
        if weight > 0.0:
            measured = -float(trust @ (contact @ normal)) / weight
            share = 1.0 - exp(-HEIGHT_RATE * min(weight, 1.0) * dt)
            height += share * (measured - height)
        estimate = BodyEstimate(
            time_ns,
            position,
            state.quaternion,
            state.velocity_in_base,
            rate - state.gyro_bias,
            height,
            normal,
            trust,
            state.covariance.diagonal()[3:6],
            problems,
        )
        return terrain, estimate


def _is_still(readings: SensorReadings, state: FilterState) -> bool:
    """Whether neither joints nor body move."""
    turn = readings.rate_in_base - state.gyro_bias
    return bool(
        np.abs(readings.joint_velocity).max() < STILL_JOINT and turn @ turn < STILL_TURN**2
    )


def _problems(
    legs: NDArray[np.bool_], contacts: NDArray[np.bool_], seeing: bool
) -> tuple[str, ...]:
    """Names of the sensors that could not be used."""
    if seeing and legs.all() and contacts.all():
        return ()
    return (
        *(() if seeing else ('imu',)),
        *(f'joints of {leg}' for leg, usable in zip(LEGS, legs, strict=True) if not usable),
        *(f'contact of {leg}' for leg, usable in zip(LEGS, contacts, strict=True) if not usable),
    )
