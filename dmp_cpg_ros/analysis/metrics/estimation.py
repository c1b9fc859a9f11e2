# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far the robot's estimate of its own motion was from the simulator's truth."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.analysis import motion
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.metrics.robot import SHORTEST_DISTANCE
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.suite_table import POSTURE


class EstimateErrors(NamedTuple):
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
    both = motion.matched(recording.odometry, recording.estimate)
    if len(both[0].time) < 2:
        return None
    true, found = both
    way, believed = (of.position_in_world - of.position_in_world[0] for of in both)
    angles = motion.roll_pitch_yaw(found.quaternion) - motion.roll_pitch_yaw(true.quaternion)
    return EstimateErrors(
        true.time, found.velocity_in_base - true.velocity_in_base, angles[:, :2],
        angles[:, 2] - angles[0, 2], believed - way,
        float(np.hypot(*np.diff(way[:, :2], axis=0).T).sum()))


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
    names = ('v_x_rmse', 'v_y_rmse', 'v_z_rmse', 'roll_rmse_deg', 'pitch_rmse_deg',
             'yaw_error_deg', 'yaw_error_deg_per_10m', 'position_error_share', 'z_error_share',
             'height_rmse_m')
    errors = estimate_errors(recording)
    if errors is None:
        return dict.fromkeys(names)
    yaw, (x, y, z) = float(np.rad2deg(errors.yaw[-1])), errors.position_in_world[-1].tolist()
    per_metre = [value / errors.walked if errors.walked >= SHORTEST_DISTANCE else None
                 for value in (abs(yaw) * 10.0, float(np.hypot(x, y)), abs(z))]
    return dict(zip(names, [
        *motion.root_mean_square(errors.velocity_in_base),
        *motion.root_mean_square(np.rad2deg(errors.tilt)), yaw, *per_metre,
        _height_error(recording, context)], strict=True))


def _height_error(recording: Recording, context: RunContext) -> float | None:
    """Root mean square over the height that the node tells now and then [m]."""
    odometry = recording.odometry
    told = [(event.time, height) for event in recording.statuses.get(POSTURE, ())
            if (height := event.number('estimated_height_m')) is not None]
    if not told:
        return None
    time, height = np.array(told, dtype=float).T
    # The height is along the ground's normal; on a slope that is shorter than the vertical one.
    upward = 1.0 if context.world.is_flat else motion.rotations(odometry.quaternion)[:, 2, 2]
    true = np.interp(time, odometry.time, motion.height_over_ground(odometry, context) * upward)
    return float(np.sqrt(((height - true) ** 2).mean()))
