# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How well the body followed the reference."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.episodes import MOVING, cycle_count, gait_period, steady_segments
from dmp_cpg_ros.analysis.motion import (
    held,
    mean_between,
    root_mean_square,
    smoothed,
    velocity_in_heading,
    yaw_rate,
)
from dmp_cpg_ros.analysis.recording import Recording

Array = NDArray[np.float64]


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
    names = ('v_rmse', 'v_y_rmse', 'gamma_rmse')
    metrics: dict[str, Any] = dict.fromkeys([*names, *(f'{name}_cycle' for name in names)])
    odometry, reference = recording.odometry, recording.reference
    if odometry.time.size and reference.time.size:
        error = body_motion(recording) - held(reference.time, reference.value, odometry.time)
        metrics.update(zip(names, root_mean_square(error), strict=True))
        period = gait_period(recording)
        if period is not None:
            averaged = root_mean_square(smoothed(odometry.time, error, period))
            metrics.update(zip([f'{name}_cycle' for name in names], averaged, strict=True))
    metrics['steady'] = steady = steady_errors(recording)
    errors = [abs(entry['v_error']) for entry in steady if entry['v_error'] is not None]
    metrics['v_error_max'] = max(errors, default=None)
    return metrics


def body_motion(recording: Recording) -> Array:
    """Measured v_x, v_y, γ in the heading frame, ndarray (n, 3)."""
    return np.column_stack(
        [velocity_in_heading(recording.odometry)[:, :2], yaw_rate(recording.odometry)]
    )


def steady_errors(recording: Recording) -> list[dict[str, Any]]:
    """Means over whole gait cycles for each stretch of constant reference.

    Returns
    -------
    list of dict
        ``start_s``, ``end_s``, ``cycles``, ``v``, ``v_reference``, ``v_error`` (relative; None
        when the reference does not go forward), ``v_y``, ``gamma``, ``gamma_reference``,
        ``gamma_error`` (relative, None when straight).
    """
    if not recording.odometry.time.size:
        return []
    motion, entries = body_motion(recording), []
    for start, end in steady_segments(recording):
        v_x, v_y, gamma = mean_between(recording.odometry.time, motion, start, end)
        reference = mean_between(recording.reference.time, recording.reference.value, start, end)
        entries.append({
            'start_s': start, 'end_s': end, 'cycles': round(cycle_count(recording, start, end)),
            'v': float(v_x), 'v_reference': float(reference[0]),
            'v_error': _relative(v_x, reference[0]),
            'v_y': float(v_y), 'v_y_reference': float(reference[1]),
            'gamma': float(gamma), 'gamma_reference': float(reference[2]),
            'gamma_error': _relative(gamma, reference[2])})
    return entries


def _relative(value: float, reference: float) -> float | None:
    return float((value - reference) / abs(reference)) if abs(reference) > MOVING else None
