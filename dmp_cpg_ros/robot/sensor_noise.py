# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Adds noise and biases to the simulated sensor readings."""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.robot_model.sensors import SensorParameters
from dmp_cpg_ros.core.robot_model.state import RobotState

STREAM = 1
"""Tells the sensors' random numbers from others of the same seed."""


class SensorNoise:
    """Noise of one robot's sensors; the same seed gives the same noise.

    Parameters
    ----------
    parameters : SensorParameters
        How good the sensors are.
    seed : int
        Seed of noise and biases.
    tick_ns : int
        Time between two readings [ns]: a density n gives deviations n / √tick.
    """

    def __init__(self, parameters: SensorParameters, seed: int, tick_ns: int) -> None:
        """Scale the deviations: gyroscope, accelerometer, joint angles, joint velocities."""
        p, root = parameters, (tick_ns * 1e-9) ** -0.5
        self._seed = seed
        self._deviation = p.sensor_noise * np.repeat(
            (p.gyro_noise_density * root, p.accelerometer_noise_density * root, p.encoder_noise,
             p.joint_velocity_noise), (3, 3, 12, 12))
        self._bias_deviation = p.sensor_noise * np.repeat((p.gyro_bias, p.accelerometer_bias), 3)
        self.reset()

    def reset(self) -> None:
        """Draw the biases, and begin the noise anew."""
        self._random = np.random.default_rng((self._seed, STREAM))
        self._bias = self._bias_deviation * self._random.standard_normal(6)

    def measured(self, state: RobotState) -> RobotState:
        """State as the sensors tell it; what is no sensor's stays the truth.

        Without any noise the numbers are the truth's, bit for bit.
        """
        noise = self._deviation * self._random.standard_normal(30)
        noise[:6] += self._bias
        return replace_unchecked(
            state, joint_position=state.joint_position + noise[6:18],
            joint_velocity=state.joint_velocity + noise[18:],
            acceleration_in_base=state.acceleration_in_base + noise[3:6],
            gyro_in_base=state.measured_rate_in_base + noise[:3])
