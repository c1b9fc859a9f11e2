# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far the robot's estimate of its own motion was from the simulator's truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.ground import height_over_ground
from dmp_cpg_ros.analysis.motion import (
    common_rows,
    roll_pitch_yaw,
    root_mean_square,
    rotations,
)
from dmp_cpg_ros.analysis.recording import Recording, taken
from dmp_cpg_ros.suite_table import POSTURE

Array = NDArray[np.float64]

SHORTEST_DISTANCE = 0.5
"""Distance below which figures per metre are not given [m]."""


@dataclass(frozen=True)
class EstimateErrors:
    """Estimate minus truth where both were recorded with the same stamp.

    Attributes
    ----------
    time : ndarray (n,)
        [s]
    velocity_in_base : ndarray (n, 3)
        [m/s]
    tilt : ndarray (n, 2)
        Of roll and pitch [rad].
    yaw : ndarray (n,)
        Relative to the first [rad].
    position_in_world : ndarray (n, 3)
        Relative to the first [m].
    walked : float
        Length of the true horizontal path, sampled as the estimate is [m].
    """

    time: Array
    velocity_in_base: Array
    tilt: Array
    yaw: Array
    position_in_world: Array
    walked: float


def estimate_errors(recording: Recording) -> EstimateErrors | None:
    """Errors of ``estimated_odom`` against ``odom``; None where one of them is missing."""
    truth, estimate = recording.odometry, recording.estimate
    rows = common_rows(truth.time, estimate.time)
    if len(rows[0]) < 2:
        return None
    true, found = taken(truth, rows[0]), taken(estimate, rows[1])
    angles = roll_pitch_yaw(found.quaternion) - roll_pitch_yaw(true.quaternion)
    way, way_found = (each.position_in_world - each.position_in_world[0] for each in (true, found))
    velocity = found.velocity_in_base - true.velocity_in_base
    walked = float(np.hypot(*np.diff(way[:, :2], axis=0).T).sum())
    yaw = angles[:, 2] - angles[0, 2]
    return EstimateErrors(true.time, velocity, angles[:, :2], yaw, way_found - way, walked)


def estimation_metrics(recording: Recording, context: RunContext) -> dict[str, Any]:
    """Group ``estimation`` of ``metrics.json``; None where there is no estimate.

    Returns
    -------
    dict
        ``v_x_rmse``, ``v_y_rmse``, ``v_z_rmse`` [m/s] in the base; ``roll_rmse_deg``,
        ``pitch_rmse_deg``; ``yaw_error_deg`` at the end, and its size per 10 m;
        ``position_error_share``, the horizontal error at the end over the distance, and
        ``z_error_share``; ``height_rmse_m`` over the ground.
    """
    metrics: dict[str, Any] = dict.fromkeys((
        'v_x_rmse', 'v_y_rmse', 'v_z_rmse', 'roll_rmse_deg', 'pitch_rmse_deg', 'yaw_error_deg',
        'yaw_error_deg_per_10m', 'position_error_share', 'z_error_share', 'height_rmse_m'))
    errors = estimate_errors(recording)
    if errors is None:
        return metrics
    rms = [*root_mean_square(errors.velocity_in_base), *root_mean_square(np.rad2deg(errors.tilt))]
    yaw = float(np.rad2deg(errors.yaw[-1]))
    metrics.update(zip(metrics, [*rms, yaw], strict=False))
    metrics['height_rmse_m'] = _height_error(recording, context)
    if errors.walked >= SHORTEST_DISTANCE:
        x, y, z = errors.position_in_world[-1].tolist()
        metrics['yaw_error_deg_per_10m'] = abs(yaw) * 10.0 / errors.walked
        metrics['position_error_share'] = float(np.hypot(x, y)) / errors.walked
        metrics['z_error_share'] = abs(z) / errors.walked
    return metrics


def _height_error(recording: Recording, context: RunContext) -> float | None:
    """Root mean square over the height that the node tells now and then [m]."""
    odometry = recording.odometry
    told = [(event.time, height) for event in recording.statuses.get(POSTURE, ())
            if (height := event.number('estimated_height_m')) is not None]
    if not told:
        return None
    time, height = np.array(told, dtype=float).T
    # The height is along the ground's normal; on a slope that is shorter than the vertical one.
    upward = rotations(odometry.quaternion)[:, 2, 2] if not context.world.is_flat else 1.0
    true = np.interp(time, odometry.time, height_over_ground(odometry, context) * upward)
    return float(np.sqrt(((height - true) ** 2).mean()))
