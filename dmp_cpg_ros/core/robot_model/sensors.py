# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Noise and biases of the simulated sensors.

The defaults are those of the inertial sensor of Mini Cheetah (VectorNav VN-100, data
sheet: 0.0035 °/s/√Hz and 0.14 mg/√Hz) with biases as they remain after calibration at the
factory, and of 14-bit encoders behind a gear of 1:6 whose velocity is filtered.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from dmp_cpg_ros.core.parameters import Parameters, parameter

_noise = partial(parameter, minimum=0.0)


@dataclass(frozen=True)
class SensorParameters(Parameters):
    """Noise and biases of the simulated sensors; drawn from the robot's seed."""

    sensor_noise: float = _noise(
        1.0, 'factor on all noise and biases of the simulated sensors; 0: perfect sensors',
        maximum=100.0)
    gyro_noise_density: float = _noise(
        6.1e-5, 'white noise of the gyroscope', unit='rad/s/sqrt(Hz)', maximum=1.0)
    gyro_bias: float = _noise(
        1e-3, "standard deviation of the gyroscope's constant bias", unit='rad/s', maximum=1.0)
    accelerometer_noise_density: float = _noise(
        1.4e-3, 'white noise of the accelerometer', unit='m/s^2/sqrt(Hz)', maximum=10.0)
    accelerometer_bias: float = _noise(
        0.02, "standard deviation of the accelerometer's constant bias", unit='m/s^2',
        maximum=10.0)
    encoder_noise: float = _noise(
        1e-4, 'standard deviation of a measured joint angle', unit='rad', maximum=0.1)
    joint_velocity_noise: float = _noise(
        0.02, 'standard deviation of a measured joint velocity', unit='rad/s', maximum=10.0)
