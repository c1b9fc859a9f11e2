# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Body state estimator from gyroscope, accelerometer, joints and contacts.

A Kalman filter (:mod:`~dmp_cpg_ros.core.estimation.velocity_filter`) fuses the IMU with the
velocities that the standing legs measure (:mod:`~dmp_cpg_ros.core.estimation.leg_odometry`);
position is integrated, the ground is a plane through the newest footholds. An attitude that the
IMU's driver may give is not used: here yaw is the gyroscope's, whose bias the standing legs
correct.

What cannot be used (not finite, impossible, absent, or
:mod:`~dmp_cpg_ros.core.estimation.frozen`) never reaches the filter and is named in
``BodyEstimate.problems``: a leg without joints measures nothing, a foot without contact sensor is
judged by its joint torques, and without IMU the standing feet tell how the body turns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, hypot, inf, isfinite

import numpy as np

from dmp_cpg_ros.core.clock import time_step
from dmp_cpg_ros.core.estimation import frozen, leg_odometry, mid_stride, velocity_filter
from dmp_cpg_ros.core.estimation.body_estimate import BodyEstimate
from dmp_cpg_ros.core.estimation.imu_watch import NEW, ImuWatch
from dmp_cpg_ros.core.estimation.leg_odometry import FootMotion, TerrainState, normal_in_world
from dmp_cpg_ros.core.estimation.parameters import EstimationParameters
from dmp_cpg_ros.core.estimation.velocity_filter import FilterState
from dmp_cpg_ros.core.maths import Array, clamped, vec3
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.records import made_often, replace_unchecked
from dmp_cpg_ros.core.maths.rotations import levelled
from dmp_cpg_ros.core.maths.vec3 import Triple, triple
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import LEGS

BLIND = 0.02
"""Time for which the last turn rate is held without IMU and feet [s]; then the body counts as not
turning. Also the gap between ticks beyond which readings do not stand for their mean.
"""

BLIND_NOISE = {'gyro_noise': 0.3, 'accelerometer_noise': 3.0}
"""Noise densities of such guesses instead of the IMU's [rad/s/√Hz], [m/s²/√Hz]."""

LEVELLING = 3.0
"""Rate at which a vertical without IMU follows the plane of the feet [1/s]."""

INITIAL_DEVIATION = (0.05, 0.1, 0.005, 0.1)
"""Of attitude [rad], velocity [m/s], biases of gyroscope [rad/s] and accelerometer [m/s^2]."""

UNTRUSTED_SHARE = 0.2
"""Share of the force of full trust below which a foot is not trusted at all."""

STILL_TURN = 0.03
"""Turn rate below which a robot on all four feet whose joints rest stands still [rad/s]."""

STILL_TIME = 0.3
"""Time after which a robot that seems to stand still does so [s]; it sways out before."""

STILL_DEVIATION = 0.01
"""By which such a body turns all the same [rad/s]."""

HEIGHT_RATE = 50.0
"""Rate at which the height follows the kinematics of the stance legs [1/s]."""


@made_often
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
    rate : tuple of float
        Last usable reading of the gyroscope [rad/s].
    blind : float
        Time since the IMU could be used [s].
    still : float
        Time for which the robot has stood still [s].
    watch : SensorWatch
        For sensors that freeze.
    imu : ImuWatch
        For an IMU that contradicts the feet.
    """

    filter: FilterState
    terrain: TerrainState
    estimate: BodyEstimate
    rate: Triple
    blind: float
    still: float
    watch: frozen.SensorWatch
    imu: ImuWatch = NEW


class BodyEstimator:
    """Estimator of one robot; state in, state out.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    parameters : EstimationParameters
        Noise and thresholds.
    legs : RobotLegs, optional
        The robot's legs, where others ask them too.
    """

    def __init__(self, description: RobotDescription, parameters: EstimationParameters,
                 legs: RobotLegs | None = None) -> None:
        """Scale the thresholds by the robot's weight."""
        self.parameters = parameters  # may be set while the estimator runs
        self.odometry = leg_odometry.LegOdometry(description, legs)
        self._weight = description.mass * GRAVITY

    def step(self, memory: EstimatorState | None, readings: SensorReadings
             ) -> tuple[EstimatorState, BodyEstimate]:
        """Take in the readings of one tick.

        Parameters
        ----------
        memory : EstimatorState or None
            State after the last tick; None at the first, which takes a robot whose joints
            rest to be at rest.
        readings : SensorReadings
            A stamp that is not later than the last one means that the robot began anew.

        Returns
        -------
        memory : EstimatorState
        estimate : BodyEstimate
        """
        if memory is None or readings.time_ns <= memory.estimate.time_ns:
            return self._begin(readings)
        watch, told = frozen.without_frozen(memory.watch, readings, self._weight)
        readings = frozen.without_imu(told) if memory.imu.doubted_s else told
        dt = time_step(memory.estimate.time_ns, readings.time_ns)
        seeing = readings.imu_is_usable
        blind = 0.0 if seeing and dt <= BLIND else memory.blind + dt
        noise = replace(self.parameters, **BLIND_NOISE) if blind else self.parameters
        measured = ((readings.rate_in_base, readings.specific_force_in_base) if seeing
                    else self._guessed(memory, readings, told, blind))
        rate, force = triple(measured[0].tolist()), triple(measured[1].tolist())
        (x, y, z), (last_x, last_y, last_z) = rate, memory.rate
        mean = 0.5 * (last_x + x), 0.5 * (last_y + y), 0.5 * (last_z + z)
        state = velocity_filter.predict(memory.filter, mean, force, dt, noise, not seeing)
        motion, normal = self._motion(memory.terrain, state, readings)
        if not (seeing or any(readings.usable_legs)):  # a body that feels nothing stays low
            kept = state.velocity_in_base
            state = replace_unchecked(state, velocity_in_base=vec3.moved(
                kept, normal, -vec3.dot(kept, normal)))
        more = dt / self.parameters.contact_settling
        before = memory.estimate.trust.tolist()
        trust = [min(now, before[i] + more)
                 for i, now in enumerate(self._trust(readings, motion, normal))]
        state, _ = velocity_filter.update(
            state, rate, motion.contact_in_base, motion.velocity_in_base, trust, noise)
        rests = seeing and min(trust) > 0.0 and _is_still(readings, state)
        if blind > BLIND and any(trust):  # footholds that no foot tells anew do not turn with it
            state = replace_unchecked(state, quaternion=leg_odometry.levelled_by_feet(
                state.quaternion, memory.terrain, LEVELLING * dt))
        still = memory.still + dt if rests else 0.0
        if still > STILL_TIME:
            state = velocity_filter.settle(state, rate, STILL_DEVIATION)
        problems = _problems(readings)
        covariance, velocity = state.covariance.ravel(), state.velocity_in_base
        if not isfinite(covariance.dot(covariance) + vec3.dot(velocity, velocity)):
            problems, state = (*problems, 'filter'), memory.filter
        terrain, estimate = self._finished(
            memory, state, readings.time_ns, rate, noise.gyro_noise**2 / dt, motion, trust,
            blind > BLIND, problems)
        if problems:
            estimate = replace_unchecked(estimate, readings=frozen.with_joints(watch, readings))
        imu = memory.imu.followed(
            memory.filter, state, terrain.slope, told, rate, dt)
        if imu.doubted_s and not memory.imu.doubted_s:
            state, slope = memory.imu.unspoilt(state, terrain.slope)
            terrain = replace_unchecked(terrain, slope=slope)
            if any(trust):
                state = replace_unchecked(state, velocity_in_base=mid_stride.velocity_of_feet(
                    motion, vec3.minus(rate, state.gyro_bias), trust))
        return EstimatorState(state, terrain, estimate, rate, blind, still, watch, imu), estimate

    def resumed(self, memory: EstimatorState, readings: SensorReadings
                ) -> tuple[EstimatorState, BodyEstimate]:
        """Go on after a while without readings, in which a body has kept its attitude; its
        velocity is that of its feet, where any stands. Arguments and results as of :meth:`step`.
        """
        return self._begin(readings, memory)

    def _begin(self, readings: SensorReadings, before: EstimatorState | None = None
               ) -> tuple[EstimatorState, BodyEstimate]:
        """Start at rest: the accelerometer tells the vertical, the feet the ground. Where joints
        move, standing feet alone do, and how fast the body is.
        """
        seeing, moving = readings.imu_is_usable, mid_stride.moves(readings)
        up = readings.specific_force_in_base if seeing else np.array((0.0, 0.0, 1.0))
        zero = 0.0, 0.0, 0.0
        if moving:
            up = mid_stride.steadied(up, walks=mid_stride.on_feet(readings, self._weight))
        covariance = np.diag(np.repeat(np.square(INITIAL_DEVIATION), 3))
        state = FilterState(levelled(up), zero, zero, zero, covariance)
        if before is not None:
            state = replace_unchecked(before.filter, covariance=covariance)
        R = vec3.rotation(state.quaternion)
        flat = TerrainState(((0.0, 0.0, 0.0),) * len(LEGS), (0.0, 0.0))
        motion, normal = self._motion(flat, state, readings)
        trust, legs = self._trust(readings, motion, normal), readings.usable_legs
        rate = triple(readings.rate_in_base.tolist()) if seeing else zero
        stands = [t > 0.0 for t in trust] if moving and any(trust) else legs
        if (moving or before is not None) and any(trust):  # it may have come to a stand meanwhile
            state = replace_unchecked(
                state, velocity_in_base=mid_stride.velocity_of_feet(motion, rate, trust))
        contact = [vec3.times(R, place) for place in motion.contact_in_base]
        depths = [z for (_, _, z), stand in zip(contact, stands, strict=True) if stand]
        height = -sum(depths) / len(depths) if depths else 0.0
        position, way = np.array((0.0, 0.0, height)), 0.0
        velocity = vec3.times(R, state.velocity_in_base)
        if before is not None:
            last = before.estimate
            gone = 1e-9 * (readings.time_ns - last.time_ns) * np.array(velocity)
            position, way = last.position_in_world + gone, last.way + float(np.linalg.norm(gone))
        estimate = BodyEstimate(
            readings.time_ns, position, np.array(state.quaternion),
            np.array(state.velocity_in_base), np.array(rate), velocity, height,
            np.array(normal_in_world(flat.slope)), np.array(trust), covariance,
            self.parameters.gyro_noise**2 / BLIND, way, _problems(readings))
        feet = tuple((x, y, z + height if stand else 0.0)
                     for (x, y, z), stand in zip(contact, stands, strict=True))
        terrain = TerrainState(feet, leg_odometry.fitted_slope(feet)) if all(legs) else flat
        watch = frozen.first_watch(readings)
        if estimate.problems:
            estimate = replace_unchecked(estimate, readings=frozen.with_joints(watch, readings))
        return EstimatorState(state, terrain, estimate, rate, 0.0, 0.0, watch), estimate

    def _guessed(self, memory: EstimatorState, readings: SensorReadings, told: SensorReadings,
                 blind: float) -> tuple[Array, Array]:
        """Guess what an IMU that is not believed would read: the feet tell the turn rate, and what
        they do not measure a gyroscope by its changes, where it tells any; nothing accelerates.
        """
        state = memory.filter
        trust = np.where(readings.usable_legs, memory.estimate.trust, 0.0)
        up, bias = np.array(vec3.upward(state.quaternion)), np.array(state.gyro_bias)
        rate = np.array(memory.rate) if blind <= BLIND else bias
        if told.imu_is_usable:
            rate = told.rate_in_base - np.array(memory.imu.turning)
        if trust.any():
            motion, _ = self._motion(memory.terrain, state, readings)
            rate = bias + leg_odometry.turn_rate_of_feet(
                np.array(motion.contact_in_base), np.array(motion.velocity_in_base), trust,
                rate - bias)
        return rate, GRAVITY * up + state.accelerometer_bias

    def _motion(self, terrain: TerrainState, state: FilterState, readings: SensorReadings
                ) -> tuple[FootMotion, Triple]:
        """Motion of the feet, and the normal of the ground in the base."""
        R = vec3.rotation(state.quaternion)
        normal = vec3.transposed_times(R, normal_in_world(terrain.slope))
        q, q_dot, legs = readings.joint_position, readings.joint_velocity, readings.usable_legs
        if not all(legs):  # a placeholder for legs that are left out later
            q, q_dot = (np.where(np.repeat(legs, 3), values, 0.0) for values in (q, q_dot))
        return self.odometry.motion(
            q.tolist(), q_dot.tolist(), normal, readings.foot_force.tolist()), normal

    def _trust(self, readings: SensorReadings, motion: FootMotion, normal: Triple
               ) -> list[float]:
        """Trust in each foot from its force alone, in [0, 1]; 0 for legs without joints."""
        force = readings.foot_force.tolist()
        for i, usable in enumerate(readings.usable_contacts):
            if not usable:
                felt = leg_odometry.force_from_torque(np.array(motion.jacobian_in_base[i]),
                                         readings.joint_effort[3 * i : 3 * i + 3],
                                         np.array(normal))
                force[i] = felt if isfinite(felt) else 0.0
        full = self.parameters.contact_share * self._weight
        return [
            clamped((felt / full - UNTRUSTED_SHARE) / (1.0 - UNTRUSTED_SHARE), 0.0, 1.0)
            if usable else 0.0
            for felt, usable in zip(force, readings.usable_legs, strict=True)]

    def _finished(
        self, memory: EstimatorState, state: FilterState, time_ns: int, rate: Triple,
        rate_noise: float, motion: FootMotion, trust: list[float], blind: bool,
        problems: tuple[str, ...],
    ) -> tuple[TerrainState, BodyEstimate]:
        """Integrate the position, follow the ground, and put the estimate together."""
        last = memory.estimate
        dt = time_step(last.time_ns, time_ns)
        R = vec3.rotation(state.quaternion)
        v = vec3.times(R, state.velocity_in_base)
        u = last.velocity_in_world
        velocity = 0.5 * (v[0] + u[0]), 0.5 * (v[1] + u[1]), 0.5 * (v[2] + u[2])
        position = vec3.moved(triple(last.position_in_world.tolist()), velocity, dt)
        contact = [vec3.times(R, place) for place in motion.contact_in_base]
        terrain = leg_odometry.terrain_step(
            memory.terrain, [vec3.plus(position, place) for place in contact], trust, dt,
            inf if blind else self.parameters.terrain_time)
        normal = normal_in_world(terrain.slope)
        height, weight = last.height + vec3.dot(normal, velocity) * dt, sum(trust)
        if weight > 0.0:
            depths = [share * vec3.dot(contact[i], normal) for i, share in enumerate(trust)]
            measured = -sum(depths) / weight
            share = 1.0 - exp(-HEIGHT_RATE * min(weight, 1.0) * dt)
            height += share * (measured - height)
        return terrain, BodyEstimate(
            time_ns, np.array(position), np.array(state.quaternion),
            np.array(state.velocity_in_base), np.array(vec3.minus(rate, state.gyro_bias)), v,
            height, np.array(normal), np.array(trust),
            state.covariance, rate_noise, last.way + hypot(*velocity) * dt, problems)


def _is_still(readings: SensorReadings, state: FilterState) -> bool:
    """Whether neither joints nor body move."""
    x, y, z = (readings.rate_in_base - state.gyro_bias).tolist()
    return (x * x + y * y + z * z < STILL_TURN**2
            and float(np.abs(readings.joint_velocity).max()) < mid_stride.MOVING_JOINT)


def _problems(readings: SensorReadings) -> tuple[str, ...]:
    """Names of the sensors that could not be used."""
    legs, contacts = readings.usable_legs, readings.usable_contacts
    if readings.imu_is_usable and all(legs) and all(contacts):
        return ()
    return (
        *(() if readings.imu_is_usable else ('imu',)),
        *(f'joints of {leg}' for leg, usable in zip(LEGS, legs, strict=True) if not usable),
        *(f'contact of {leg}' for leg, usable in zip(LEGS, contacts, strict=True) if not usable))
