# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the state estimate: its source, and the sensor noise that the filter assumes."""

from __future__ import annotations

from dataclasses import dataclass

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
        2e-3, 'noise density of the gyroscope', unit='rad/s/sqrt(Hz)', minimum=1e-6, maximum=1.0)
    accelerometer_noise: float = parameter(
        0.05, 'noise density of the accelerometer', unit='m/s^2/sqrt(Hz)', minimum=1e-5,
        maximum=10.0)
    gyro_bias_walk: float = parameter(
        1e-5, "random walk of the gyroscope's bias", unit='rad/s^2/sqrt(Hz)', minimum=0.0,
        maximum=1.0)
    accelerometer_bias_walk: float = parameter(
        1e-4, "random walk of the accelerometer's bias", unit='m/s^3/sqrt(Hz)', minimum=0.0,
        maximum=10.0)
    foot_noise: float = parameter(
        0.1, 'standard deviation of the velocity of a standing foot', unit='m/s', minimum=1e-4,
        maximum=10.0)
    foot_freedom: float = parameter(
        4.0, "degrees of freedom of Student's t distribution of a foot's velocity; fewer: "
        'slipping feet count less', minimum=1.0, maximum=1e6)
    contact_share: float = parameter(
        0.25, 'normal force from which a foot has full weight in the estimate, as a fraction of '
        'the body weight', minimum=1e-3, maximum=1.0)
    contact_settling: float = parameter(
        0.06, 'time after touchdown over which the weight of a foot in the estimate rises',
        unit='s', minimum=1e-3, maximum=1.0)
    terrain_time: float = parameter(
        0.3, "time constant of the filter on the ground's plane", unit='s', minimum=0.01,
        maximum=10.0)
    estimate_rate: float = parameter(
        50.0, 'rate at which estimated_odom is published; 0: never', unit='Hz', minimum=0.0,
        maximum=2000.0)
