# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the robot fared: falls, distance, drift, energy, slip."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import (
    MOVING,
    fall_noticed,
    gait_period,
    should_stand,
    steady_segments,
)
from dmp_cpg_ros.analysis.foot_motion import foot_slip
from dmp_cpg_ros.analysis.ground import height_over_ground
from dmp_cpg_ros.analysis.motion import held, integral, roll_pitch_yaw, smoothed, tilt
from dmp_cpg_ros.analysis.recording import Recording

FALLEN_HEIGHT_SHARE = 0.5
"""Share of the standing height below which the robot has fallen."""

FALLEN_TILT = np.deg2rad(60.0)
"""Tilt of the base beyond which the robot has fallen [rad]."""

SWAY_WINDOW = 1.0
"""The path is averaged over whole gait cycles of at least this time: sway is no distance [s]."""

SHORTEST_DISTANCE = 0.5
"""Distance below which figures per metre are not given [m]."""


def robot_metrics(recording: Recording, context: RunContext) -> dict[str, Any]:
    """Group ``robot`` of ``metrics.json``; None where topic or description are missing.

    Returns
    -------
    dict
        ``fell``; ``distance_m``, the length of the horizontal path without sway;
        ``yaw_drift_deg_per_10m``, the size of the yaw gained on straight, steady stretches;
        ``cost_of_transport``, positive mechanical joint work over m g distance, and
        ``cost_of_transport_from``, the topic that it was taken from;
        ``peak_torque_share``, the largest torque of a joint over its limit; ``foot_slip_m``,
        the sum over feet and run of sliding under load, and ``foot_slip_m_per_foot_and_m``;
        ``down_at_start``, whether the recording begins with a fall that was before it.
    """
    distance = distance_walked(recording)
    slip = foot_slip(recording, context.robot, context.contact_force) if context.robot else None
    total = None if slip is None else float(slip.sum())
    far = distance if distance is not None and distance >= SHORTEST_DISTANCE else None
    cost, source = cost_of_transport(recording, context, far)
    return {
        'fell': fell(recording, context),
        'down_at_start': down_at_start(recording),
        'distance_m': distance,
        'yaw_drift_deg_per_10m': yaw_drift(recording),
        'cost_of_transport': cost,
        'cost_of_transport_from': source,
        'peak_torque_share': peak_torque_share(recording, context),
        'foot_slip_m': total,
        'foot_slip_m_per_foot_and_m': total / 4.0 / far if far and total is not None else None,
    }


def fell(recording: Recording, context: RunContext) -> bool | None:
    """Whether the base ever was too low or too tilted while the robot should stand, or the suite
    noticed a fall.
    """
    odometry = recording.odometry
    if not odometry.time.size:
        return None
    height = height_over_ground(odometry, context)
    standing = height[0] if context.robot is None else context.robot.stance_height
    too_low = height < FALLEN_HEIGHT_SHARE * standing
    down = too_low | (tilt(odometry.quaternion) > FALLEN_TILT)
    return fall_noticed(recording) or bool(np.any(down & should_stand(recording, odometry.time)))


def down_at_start(recording: Recording) -> bool | None:
    """Whether the robot lay fallen when the recording began; None where nothing tells."""
    return recording.modes[0].message == 'damped' if recording.modes else None


def distance_walked(recording: Recording) -> float | None:
    """Length of the horizontal path of the base, sway averaged out [m]."""
    odometry = recording.odometry
    if not odometry.time.size:
        return None
    period = gait_period(recording) or SWAY_WINDOW
    window = period * np.ceil(SWAY_WINDOW / period)
    path = smoothed(odometry.time, odometry.position_in_world[:, :2], window)
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def yaw_drift(recording: Recording) -> float | None:
    """Size of the yaw gained per 10 m on straight, steady stretches [deg]."""
    odometry = recording.odometry
    if not odometry.time.size:
        return None
    reference, yaw = recording.reference, roll_pitch_yaw(odometry.quaternion)[:, 2]
    gained = walked = 0.0
    for interval in steady_segments(recording):
        v_x, v_y, gamma = held(reference.time, reference.value, np.array(interval[:1]))[0]
        if abs(gamma) > MOVING or np.hypot(v_x, v_y) < MOVING:
            continue
        x, y, psi = (np.diff(np.interp(interval, odometry.time, column)).item()
                     for column in (*odometry.position_in_world[:, :2].T, yaw))
        walked += float(np.hypot(x, y))
        gained += abs(psi)
    return float(np.rad2deg(gained)) * 10.0 / walked if walked >= SHORTEST_DISTANCE else None


def cost_of_transport(
    recording: Recording, context: RunContext, distance: float | None
) -> tuple[float | None, str | None]:
    """Positive mechanical work of all joints over m g d; no losses, no recuperation.

    Returns
    -------
    cost : float or None
    source : str or None
        ``joint_work``, which was integrated at every physics step, or else ``joint_states``: an
        estimate, from torque times velocity at the stamps alone. It misses what a drive does
        between two stamps, such as correcting an error at once when a target comes.
    """
    joints, work = recording.joints, recording.work
    if context.robot is None or not distance:
        return None, None
    weight = context.robot.mass * 9.81
    if work.time.size > 1:
        return float((work.work[-1] - work.work[0]).sum() / (weight * distance)), 'joint_work'
    if not joints.time.size:
        return None, None
    power = np.maximum(joints.effort * joints.velocity, 0.0).sum(axis=1)
    return float(integral(joints.time, power)[-1] / (weight * distance)), 'joint_states'


def peak_torque_share(recording: Recording, context: RunContext) -> float | None:
    """Largest torque of a joint over its limit: of every physics step where the robot told it,
    otherwise at the stamps of its states.
    """
    effort = recording.work.peak_effort if recording.work.time.size else recording.joints.effort
    if context.robot is None or not np.isfinite(effort).any():
        return None
    limit = np.concatenate([leg.torque_limit for leg in context.robot.legs])
    return float(np.nanmax(np.abs(effort) / limit))
