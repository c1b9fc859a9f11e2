# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the body's state: whose it is, and what its estimator believes of the sensors."""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.parameters import Parameters, parameter

ESTIMATE, GROUND_TRUTH = 'estimate', 'ground_truth'
"""Words of ``state_source``."""


@dataclass(frozen=True)
class StateSourceParameters(Parameters):
    """Where the posture controller takes the body's state from."""

    state_source: str = parameter(
        ESTIMATE,
        "body state from the robot's sensors, or (for comparison) from the simulator",
        choices=(ESTIMATE, GROUND_TRUTH),
    )


@dataclass(frozen=True)
class EstimationParameters(Parameters):
    """Noise that the estimator expects, and when a foot counts as standing.

    The noise of the IMU is larger than its data sheet says: between two readings the body shakes
    more than a mean over the tick tells.
    """

    gyro_noise: float = parameter(
        2e-3, 'noise density of the gyroscope', unit='rad/s/sqrt(Hz)', minimum=1e-6, maximum=1.0
    )
    accelerometer_noise: float = parameter(
        0.05,
        'noise density of the accelerometer',
        unit='m/s^2/sqrt(Hz)',
        minimum=1e-5,
        maximum=10.0,
    )
    gyro_bias_walk: float = parameter(
        1e-5,
        "random walk of the gyroscope's bias",
        unit='rad/s^2/sqrt(Hz)',
        minimum=0.0,
        maximum=1.0,
    )
    accelerometer_bias_walk: float = parameter(
        1e-4,
        "random walk of the accelerometer's bias",
        unit='m/s^3/sqrt(Hz)',
        minimum=0.0,
        maximum=10.0,
    )
    foot_noise: float = parameter(
        0.1,
        'deviation of the velocity of a foot that stands',
        unit='m/s',
        minimum=1e-4,
        maximum=10.0,
    )
    foot_freedom: float = parameter(
        4.0,
        "degrees of freedom of Student's t for a foot's velocity: few forgive slips, many "
        'trust every foot alike',
        minimum=1.0,
        maximum=1e6,
    )
    contact_share: float = parameter(
        0.25,
        'normal force from which a foot is trusted in full, as a share of the weight',
        minimum=1e-3,
        maximum=1.0,
    )
    contact_settling: float = parameter(
        0.06,
        'time after touchdown in which the trust in a foot grows',
        unit='s',
        minimum=1e-3,
        maximum=1.0,
    )
    terrain_time: float = parameter(
        0.3,
        "time constant with which the ground's plane is followed",
        unit='s',
        minimum=0.01,
        maximum=10.0,
    )
    estimate_rate: float = parameter(
        50.0,
        'rate at which estimated_odom is published; 0: never',
        unit='Hz',
        minimum=0.0,
        maximum=2000.0,
    )
