# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the robot fared, how it followed the reference, and what it believed of its motion."""

from __future__ import annotations

from itertools import zip_longest
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.analysis import episodes, motion
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.modes.falls import FALLEN_HEIGHT_SHARE, FALLEN_TILT
from dmp_cpg_ros.suite_table import POSTURE

SWAY_WINDOW = 1.0
"""The path is averaged over whole gait cycles of at least this time: sway is no distance [s]."""

SHORTEST_DISTANCE = 0.5
"""Distance below which figures per metre are not given [m]."""

TRACKED = ('v_rmse', 'v_y_rmse', 'gamma_rmse')

ESTIMATED = (
    'v_x_rmse', 'v_y_rmse', 'v_z_rmse', 'roll_rmse_deg', 'pitch_rmse_deg', 'yaw_error_deg',
    'yaw_error_deg_per_10m', 'position_error_share', 'z_error_share', 'height_rmse_m')


def robot_metrics(recording: Recording, context: RunContext) -> dict[str, Any]:
    """Group ``robot`` of ``metrics.json``; None where topic or description are missing.

    Returns
    -------
    dict
        ``fell``; ``distance_m``, the length of the horizontal path without sway;
        ``yaw_drift_deg_per_10m``, the size of the yaw gained on straight, steady stretches;
        ``cost_of_transport``, positive mechanical joint work over m g distance, and
        ``cost_of_transport_from``, the topic that it was taken from;
        ``cost_without_joint_losses``, less what damping and friction in the joints took;
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
        'distance_m': distance, 'yaw_drift_deg_per_10m': yaw_drift(recording),
        'cost_of_transport': cost, 'cost_of_transport_from': source,
        'cost_without_joint_losses': cost_without_losses(recording, context, far),
        'peak_torque_share': peak_torque_share(recording, context), 'foot_slip_m': slip,
        'foot_slip_m_per_foot_and_m': slip / 4.0 / far if far and slip is not None else None}


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
        v_x, v_y, gamma = motion.held(reference.time, reference.value, interval[0])
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
    return float(work / (context.robot.mass * GRAVITY * distance)), source


def cost_without_losses(recording: Recording, context: RunContext, distance: float | None,
                        ) -> float | None:
    """As :func:`cost_of_transport`, less what damping and dry friction in the joints take; None
    where the robot did not tell it.
    """
    told = recording.work
    if context.robot is None or not distance or told.time.size < 2:
        return None
    loss = (told.loss[-1] - told.loss[0]).sum()
    cost, _ = cost_of_transport(recording, context, distance)
    without = (cost or 0.0) - loss / (context.robot.mass * GRAVITY * distance)
    return float(without) if np.isfinite(without) else None


def peak_torque_share(recording: Recording, context: RunContext) -> float | None:
    """Largest torque of a joint over its limit: of every physics step where the robot told it,
    otherwise at the stamps of its states.
    """
    effort = recording.work.peak_effort if recording.work.time.size else recording.joints.effort
    if context.robot is None or not np.isfinite(effort).any():
        return None
    limit = np.concatenate([leg.torque_limit for leg in context.robot.legs])
    return float(np.nanmax(np.abs(effort) / limit))


def tracking_metrics(recording: Recording) -> dict[str, Any]:
    """Group ``tracking`` of ``metrics.json``.

    Returns
    -------
    dict
        ``v_rmse``, ``v_y_rmse`` [m/s] and ``gamma_rmse`` [rad/s]: root mean squares over the whole
        run of measured minus reference at every instant; with ``_cycle`` after averaging over a
        gait cycle, which leaves the sway of every step out; ``steady``: one entry per stretch of
        constant reference with means over whole gait cycles, and ``v_error_max``, the largest
        relative error of the speed among them.
    """
    odometry, reference, steady = recording.odometry, recording.reference, steady_errors(recording)
    found: list[float] = []
    if odometry.time.size and reference.time.size:
        error = body_motion(recording) - motion.held(
            reference.time, reference.value, odometry.time)
        found = motion.root_mean_square(error)
        period = episodes.gait_period(recording)
        if period is not None:
            found += motion.root_mean_square(motion.smoothed(odometry.time, error, period))
    names = [*TRACKED, *(f'{name}_cycle' for name in TRACKED)]
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
        ``start_s``, ``end_s``, ``cycles``, ``v``, ``v_reference``, ``v_error`` (of the
        speed along the direction of the reference, relative; None when that goes nowhere),
        ``v_y``, ``gamma``, ``gamma_reference``, ``gamma_error`` (relative, None when straight).
    """
    odometry, reference, entries = recording.odometry, recording.reference, []
    if not odometry.time.size:
        return []
    measured = body_motion(recording)
    for start, end in episodes.steady_segments(recording):
        v, v_y, gamma = motion.mean_between(odometry.time, measured, start, end).tolist()
        v_r, v_y_r, gamma_r = motion.mean_between(
            reference.time, reference.value, start, end).tolist()
        cycles = round(episodes.cycle_count(recording, start, end))
        entries.append({
            'start_s': start, 'end_s': end, 'cycles': cycles,
            'v': v, 'v_reference': v_r, 'v_error': _relative_along((v, v_y), (v_r, v_y_r)),
            'v_y': v_y, 'v_y_reference': v_y_r,
            'gamma': gamma, 'gamma_reference': gamma_r, 'gamma_error': _relative(gamma, gamma_r)})
    return entries


def _relative_along(value: tuple[float, float], reference: tuple[float, float]) -> float | None:
    speed = float(np.hypot(*reference))
    return _relative(float(np.dot(value, reference)) / speed, speed) if speed else None


def _relative(value: float, reference: float) -> float | None:
    return (value - reference) / abs(reference) if abs(reference) > episodes.MOVING else None


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
    """Errors of ``odom`` against ``ground_truth``; None where one of them is missing."""
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
    errors = estimate_errors(recording)
    if errors is None:
        return dict.fromkeys(ESTIMATED)
    yaw, (x, y, z) = float(np.rad2deg(errors.yaw[-1])), errors.position_in_world[-1].tolist()
    per_metre = [value / errors.walked if errors.walked >= SHORTEST_DISTANCE else None
                 for value in (abs(yaw) * 10.0, float(np.hypot(x, y)), abs(z))]
    return dict(zip(ESTIMATED, [
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
