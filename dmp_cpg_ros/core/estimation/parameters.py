# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the state estimate: its source, and the sensor noise that the filter assumes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import Parameters, parameter

ESTIMATE, GROUND_TRUTH = 'estimate', 'ground_truth'
"""Words of ``state_source``."""


@dataclass(frozen=True)
class StateSourceParameters(Parameters):
    """Where the posture controller takes the body's state from."""

    state_source: str = parameter(
        ESTIMATE, "source of the body's state: the estimator, or (for comparison) the simulator",
        choices=(ESTIMATE, GROUND_TRUTH))


@dataclass(frozen=True)
class EstimationParameters(Parameters):
    """Noise that the estimator expects, and when a foot counts as standing.

    The noise of the IMU is larger than in its data sheet, because the body vibrates between two
    readings, which the mean over a tick does not show.
    """

    gyro_noise: float = parameter(
        2e-3, 'noise density of the gyroscope', 1e-6, 1.0, unit='rad/s/sqrt(Hz)')
    accelerometer_noise: float = parameter(
        0.05, 'noise density of the accelerometer', 1e-5, 10.0, unit='m/s^2/sqrt(Hz)')
    gyro_bias_walk: float = parameter(
        1e-5, "random walk of the gyroscope's bias", 0.0, 1.0, unit='rad/s^2/sqrt(Hz)')
    accelerometer_bias_walk: float = parameter(
        1e-4, "random walk of the accelerometer's bias", 0.0, 10.0, unit='m/s^3/sqrt(Hz)')
    foot_noise: float = parameter(
        0.1, 'standard deviation of the velocity of a standing foot', 1e-4, 10.0, unit='m/s')
    foot_freedom: float = parameter(
        4.0, "degrees of freedom of Student's t distribution of a foot's velocity; fewer: "
        'slipping feet count less', 1.0, 1e6)
    contact_share: float = parameter(
        0.25, 'normal force from which a foot has full weight in the estimate, as a fraction of '
        'the body weight', 1e-3, 1.0)
    contact_settling: float = parameter(
        0.06, 'time after touchdown over which the weight of a foot in the estimate rises', 1e-3,
        1.0, unit='s')
    terrain_time: float = parameter(
        0.3, "time constant of the filter on the ground's plane", 0.01, 10.0, unit='s')
    estimate_rate: float = parameter(
        50.0, 'rate of odom and of its transform; 0: never', 0.0, 2000.0, unit='Hz')

    @cached_property
    def spread(self) -> Array:
        """Diagonal of the process noise per second (12,)."""
        return np.repeat(np.square((self.gyro_noise, self.accelerometer_noise,
                                    self.gyro_bias_walk, self.accelerometer_bias_walk)), 3)
