# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Unit and meaning of every number in ``metrics.json``."""

from __future__ import annotations

DEFINITIONS: dict[str, tuple[str, str]] = {
    'robot.fell': (
        '',
        'base below half the standing height over the ground, or tilted by more than 60°, at any '
        'time at which it should stand; or the suite noticed a fall',
    ),
    'robot.distance_m': ('m', 'length of the horizontal path of the base, its sway averaged out'),
    'robot.yaw_drift_deg_per_10m': (
        '°/10 m',
        'size of the yaw gained per distance on straight stretches, over whole gait cycles',
    ),
    'robot.cost_of_transport': (
        '',
        'positive mechanical work of all joints, ∫Σ max(τ q̇, 0) dt, over m g distance',
    ),
    'robot.cost_of_transport_from': (
        '',
        'topic of that work: joint_work, summed over every physics step, or joint_states, an '
        'estimate from torque and velocity at the stamps alone',
    ),
    'robot.peak_torque_share': (
        '',
        'largest torque of a joint over its limit, of every physics step where joint_work tells',
    ),
    'robot.down_at_start': ('', 'whether the robot lay fallen when the recording began'),
    'recording.undecodable_messages': (
        '',
        'messages on topics that the analysis reads that could not be decoded and were left out',
    ),
    'robot.foot_slip_m': (
        'm',
        'distance that contact points slid under load, summed over the four feet and the run',
    ),
    'robot.foot_slip_m_per_foot_and_m': ('m/m', 'the same per foot and metre walked'),
    'tracking.v_rmse': (
        'm/s',
        'root mean square of measured minus reference forward speed, every sample',
    ),
    'tracking.v_y_rmse': ('m/s', 'the same sideways: the sway of every step is in it'),
    'tracking.gamma_rmse': ('rad/s', 'the same for the turn rate'),
    'tracking.v_rmse_cycle': ('m/s', 'forward speed error after averaging over a gait cycle'),
    'tracking.v_y_rmse_cycle': ('m/s', 'lateral speed error after averaging over a gait cycle'),
    'tracking.gamma_rmse_cycle': ('rad/s', 'turn rate error after averaging over a gait cycle'),
    'tracking.v_error_max': (
        '',
        'largest relative error of mean forward speed among stretches of constant reference',
    ),
    'estimation.v_x_rmse': (
        'm/s',
        "root mean square of estimated minus true forward velocity of the base, at the estimate's "
        'stamps',
    ),
    'estimation.v_y_rmse': ('m/s', 'the same to the left'),
    'estimation.v_z_rmse': ('m/s', 'the same upwards'),
    'estimation.roll_rmse_deg': ('°', 'the same of the roll angle'),
    'estimation.pitch_rmse_deg': ('°', 'the same of the pitch angle'),
    'estimation.yaw_error_deg': ('°', 'error of the estimated yaw gained over the run'),
    'estimation.yaw_error_deg_per_10m': ('°/10 m', 'its size per distance walked'),
    'estimation.position_error_share': (
        'm/m',
        'horizontal error of the estimated way over the run, per distance walked',
    ),
    'estimation.z_error_share': ('m/m', 'its vertical error, per distance walked'),
    'estimation.height_rmse_m': (
        'm',
        'root mean square of estimated minus true height over the ground, once per second',
    ),
    'gait.name': ('', 'gait that the walk began with'),
    'gait.names': ('', 'gaits that were walked, in order'),
    'gait.changes': ('s', 'intervals in which gaits changed'),
    'gait.phase_error_rad_max': (
        'rad',
        'largest deviation of a leg from its place in the gait, walking freely and settled',
    ),
    'gait.duty_factor': ('', 'share of the cycle that a foot carries load, mean of the legs'),
    'gait.duty_factor_of_leg.fl': ('', 'of the front left foot'),
    'gait.duty_factor_of_leg.fr': ('', 'of the front right foot'),
    'gait.duty_factor_of_leg.rl': ('', 'of the rear left foot'),
    'gait.duty_factor_of_leg.rr': ('', 'of the rear right foot'),
    'gait.duty_factor_planned': ('', 'what the gait plans at the same speeds'),
    'gait.period_s': ('s', 'median duration of a gait cycle'),
    'stop.predicted_s': ('s', 'time to rest as predicted at the request; of the slowest stop'),
    'stop.bound_s': ('s', 'guaranteed bound on it'),
    'stop.measured_s': ('s', 'time to rest as measured'),
    'stop.count': ('', 'stops that were asked for'),
    'stop.completed': ('', 'stops that came to rest'),
    'start.predicted_s': (
        's',
        'time to phase lock as predicted at the request; of the slowest start',
    ),
    'start.bound_s': ('s', 'guaranteed bound on it'),
    'start.measured_s': ('s', 'time to phase lock as measured'),
    'start.count': ('', 'starts that were asked for'),
    'start.completed': ('', 'starts that came to walking'),
    'timing.rate_hz': ('Hz', 'ticks per second of wall time'),
    'timing.real_time_factor': ('', "robot's time over wall time"),
    'timing.latency_ms_p50': ('ms', 'from a state to the last of its four targets, median'),
    'timing.latency_ms_p99': ('ms', 'the same, 99th percentile'),
    'timing.deadline_misses': ('', 'ticks whose targets came after the next state'),
}
"""Dotted name → (unit, meaning)."""
