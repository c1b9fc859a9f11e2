# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the robot fared: falls, distance, drift, energy, slip."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmp_cpg_ros.analysis import episodes, motion
from dmp_cpg_ros.analysis.context import RunContext
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
    slips = motion.foot_slip(
        recording, context.robot, context.contact_force) if context.robot else None
    slip = None if slips is None else float(slips.sum())
    far = distance if distance is not None and distance >= SHORTEST_DISTANCE else None
    cost, source = cost_of_transport(recording, context, far)
    return {
        'fell': fell(recording, context),
        'down_at_start': recording.modes[0].message == 'damped' if recording.modes else None,
        'distance_m': distance,
        'yaw_drift_deg_per_10m': yaw_drift(recording),
        'cost_of_transport': cost,
        'cost_of_transport_from': source,
        'peak_torque_share': peak_torque_share(recording, context),
        'foot_slip_m': slip,
        'foot_slip_m_per_foot_and_m': slip / 4.0 / far if far and slip is not None else None,
    }


def fell(recording: Recording, context: RunContext) -> bool | None:
    """Whether the base ever was too low or too tilted while the robot should stand, or the suite
    noticed a fall.
    """
    odometry = recording.odometry
    if not odometry.time.size:
        return None
    height = motion.height_over_ground(odometry, context)
    standing = height[0] if context.robot is None else context.robot.stance_height
    down = (height < FALLEN_HEIGHT_SHARE * standing) | (
        motion.tilt(odometry.quaternion) > FALLEN_TILT)
    # a robot that was found fallen has not fallen since
    noticed = any(event.message == 'damped' for event in recording.modes[1:])
    return noticed or bool(np.any(down & episodes.should_stand(recording, odometry.time)))


def distance_walked(recording: Recording) -> float | None:
    """Length of the horizontal path of the base, sway averaged out [m]."""
    odometry = recording.odometry
    if not odometry.time.size:
        return None
    period = episodes.gait_period(recording) or SWAY_WINDOW
    path = motion.smoothed(odometry.time, odometry.position_in_world[:, :2],
                           period * np.ceil(SWAY_WINDOW / period))
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def yaw_drift(recording: Recording) -> float | None:
    """Size of the yaw gained per 10 m on straight, steady stretches [deg]."""
    odometry = recording.odometry
    if not odometry.time.size:
        return None
    reference, yaw = recording.reference, motion.roll_pitch_yaw(odometry.quaternion)[:, 2]
    gained = walked = 0.0
    for interval in episodes.steady_segments(recording):
        v_x, v_y, gamma = motion.held(reference.time, reference.value, np.array(interval[:1]))[0]
        if abs(gamma) <= episodes.MOVING <= np.hypot(v_x, v_y):
            x, y, psi = (np.diff(np.interp(interval, odometry.time, column)).item()
                         for column in (*odometry.position_in_world[:, :2].T, yaw))
            walked += float(np.hypot(x, y))
            gained += abs(psi)
    return float(np.rad2deg(gained)) * 10.0 / walked if walked >= SHORTEST_DISTANCE else None


def cost_of_transport(recording: Recording, context: RunContext, distance: float | None,
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
    joints, told = recording.joints, recording.work
    if context.robot is None or not distance or not (told.time.size > 1 or joints.time.size):
        return None, None
    if told.time.size > 1:
        work, source = (told.work[-1] - told.work[0]).sum(), 'joint_work'
    else:
        power = np.maximum(joints.effort * joints.velocity, 0.0).sum(axis=1)
        work, source = motion.integral(joints.time, power)[-1], 'joint_states'
    return float(work / (context.robot.mass * 9.81 * distance)), source


def peak_torque_share(recording: Recording, context: RunContext) -> float | None:
    """Largest torque of a joint over its limit: of every physics step where the robot told it,
    otherwise at the stamps of its states.
    """
    effort = recording.work.peak_effort if recording.work.time.size else recording.joints.effort
    if context.robot is None or not np.isfinite(effort).any():
        return None
    limit = np.concatenate([leg.torque_limit for leg in context.robot.legs])
    return float(np.nanmax(np.abs(effort) / limit))
