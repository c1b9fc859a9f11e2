# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How well the body followed the reference."""

from __future__ import annotations

from itertools import zip_longest
from typing import Any

import numpy as np

from dmp_cpg_ros.analysis import motion
from dmp_cpg_ros.analysis.episodes import MOVING, cycle_count, gait_period, steady_segments
from dmp_cpg_ros.analysis.recording import Array, Recording

NAMES = ('v_rmse', 'v_y_rmse', 'gamma_rmse')


def tracking_metrics(recording: Recording) -> dict[str, Any]:
    """Group ``tracking`` of ``metrics.json``.

    Returns
    -------
    dict
        ``v_rmse``, ``v_y_rmse`` [m/s] and ``gamma_rmse`` [rad/s]: root mean squares over the whole
        run of measured minus reference at every instant; with ``_cycle`` after averaging over a
        gait cycle, which leaves the sway of every step out; ``steady``: one entry per stretch of
        constant reference with means over whole gait cycles, and ``v_error_max``, the largest
        relative error of forward speed among them.
    """
    odometry, reference, steady = recording.odometry, recording.reference, steady_errors(recording)
    found: list[float] = []
    if odometry.time.size and reference.time.size:
        error = body_motion(recording) - motion.held(
            reference.time, reference.value, odometry.time)
        found = motion.root_mean_square(error)
        period = gait_period(recording)
        if period is not None:
            found += motion.root_mean_square(motion.smoothed(odometry.time, error, period))
    names = [*NAMES, *(f'{name}_cycle' for name in NAMES)]
    errors = [abs(entry['v_error']) for entry in steady if entry['v_error'] is not None]
    return {**dict(zip_longest(names, found)), 'steady': steady,
            'v_error_max': max(errors, default=None)}


def body_motion(recording: Recording) -> Array:
    """Measured v_x, v_y, γ in the heading frame, ndarray (n, 3)."""
    odometry = recording.odometry
    return np.column_stack(
        [motion.velocity_in_heading(odometry)[:, :2], motion.yaw_rate(odometry)])


def steady_errors(recording: Recording) -> list[dict[str, Any]]:
    """Means over whole gait cycles for each stretch of constant reference.

    Returns
    -------
    list of dict
        ``start_s``, ``end_s``, ``cycles``, ``v``, ``v_reference``, ``v_error`` (relative; None
        when the reference does not go forward), ``v_y``, ``gamma``, ``gamma_reference``,
        ``gamma_error`` (relative, None when straight).
    """
    odometry, reference, entries = recording.odometry, recording.reference, []
    if not odometry.time.size:
        return []
    measured = body_motion(recording)
    for start, end in steady_segments(recording):
        v, v_y, gamma = motion.mean_between(odometry.time, measured, start, end).tolist()
        v_r, v_y_r, gamma_r = motion.mean_between(
            reference.time, reference.value, start, end).tolist()
        entries.append({
            'start_s': start, 'end_s': end, 'cycles': round(cycle_count(recording, start, end)),
            'v': v, 'v_reference': v_r, 'v_error': _relative(v, v_r),
            'v_y': v_y, 'v_y_reference': v_y_r,
            'gamma': gamma, 'gamma_reference': gamma_r, 'gamma_error': _relative(gamma, gamma_r)})
    return entries


def _relative(value: float, reference: float) -> float | None:
    return (value - reference) / abs(reference) if abs(reference) > MOVING else None
