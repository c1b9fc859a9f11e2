# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Figures over time: targets, oscillators, speeds, attitude of the body and its estimate.

Each function draws from a recording and its context, and returns None when the recording lacks
what it needs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import MOVING, gait_period
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.ground import height_over_ground
from dmp_cpg_ros.analysis.metrics.estimation import estimate_errors
from dmp_cpg_ros.analysis.metrics.tracking import body_motion
from dmp_cpg_ros.analysis.motion import integral, roll_pitch_yaw, smoothed
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG

SPEEDS = ('forward speed $v$ [m/s]', 'lateral speed [m/s]', 'turn rate $\\gamma$ [rad/s]')
COMMANDED: Any = {'color': style.ORANGE, 'linestyle': (0, (1, 1.2))}
FILTERED: Any = {'color': style.REFERENCE, 'linestyle': style.DASHED}
COLOURS = (style.BLUE, style.ORANGE, style.VIOLET)


def target_kinematics(recording: Recording, context: RunContext) -> Figure | None:
    """Hip and knee targets across a stop and a start (paper, fig. 5, TargetKinematics)."""
    targets, window = recording.targets, style.stop_window(recording)
    rows = style.rows_in(targets.time, window)
    if not rows.any():
        return None
    joints = ('hip', 'knee')
    figure, panels, shades = style.time_panels(
        recording, 3.6, [f'{joint} target [rad]' for joint in joints], window)
    for panel, joint in zip(panels, joints, strict=True):
        angles = targets.position[rows, JOINTS_OF_LEG.index(joint)::3]
        style.plot_legs(panel, targets.time[rows], angles)
    style.leg_legend(figure, shades)
    return figure


def canonical_states(recording: Recording, context: RunContext) -> Figure | None:
    """Canonical states across inhibition and release (paper, fig. 7, OscillatorStates)."""
    canonical, window = recording.canonical, style.stop_window(recording)
    rows = style.rows_in(canonical.time, window)
    if not rows.any():
        return None
    figure, panels, shades = style.time_panels(
        recording, 3.6, ('$x_{i1}$ [–]', '$x_{i2}$ [–]'), window)
    for component, panel in enumerate(panels):
        style.plot_legs(panel, canonical.time[rows], canonical.x[rows, :, component])
        panel.set_ylim(-1.25 * context.radius, 1.25 * context.radius)
    style.leg_legend(figure, shades)
    return figure


def speed_tracking(recording: Recording, context: RunContext) -> Figure | None:
    """Commanded, reference and measured v and γ; v_y too where it was asked for."""
    odometry, commands, reference = recording.odometry, recording.commands, recording.reference
    if odometry.time.size < 3:
        return None
    motion = body_motion(recording)
    mean = smoothed(odometry.time, motion, gait_period(recording) or 0.5)
    lateral = reference.time.size and np.abs(reference.value[:, 1]).max() > MOVING
    columns = (0, 1, 2) if lateral else (0, 2)
    figure, panels, shades = style.time_panels(
        recording, 1.6 * len(columns) + 0.6, [SPEEDS[column] for column in columns])
    for panel, column in zip(panels, columns, strict=True):
        panel.plot(
            odometry.time, motion[:, column], color=style.MEASURED, alpha=0.28, linewidth=0.6)
        panel.plot(odometry.time, mean[:, column], color=style.MEASURED, linewidth=1.5)
        panel.step(
            commands.time, commands.value[:, column], where='post', linewidth=1.0, **COMMANDED)
        panel.plot(reference.time, reference.value[:, column], linewidth=1.0, **FILTERED)
    style.legend(figure, [
        style.key('command', **COMMANDED), style.key('reference', **FILTERED),
        style.key('measured', color=style.MEASURED, linewidth=1.5), *shades])
    return figure


def attitude(recording: Recording, context: RunContext) -> Figure | None:
    """Roll and pitch, height and yaw of the base, and what is asked for."""
    odometry, reference = recording.odometry, recording.reference
    if odometry.time.size < 2:
        return None
    roll, pitch, yaw = np.rad2deg(roll_pitch_yaw(odometry.quaternion)).T
    figure, (tilts, heights, yaws), shades = style.time_panels(
        recording, 4.6, ('tilt [°]', 'height [cm]', 'yaw [°]'))
    asked_for: dict[str, Any] = {'color': style.INK, 'linewidth': 0.9, 'linestyle': style.DASHED}
    tilts.plot(odometry.time, roll, color=style.BLUE, linewidth=0.9)
    tilts.plot(odometry.time, pitch, color=style.ORANGE, linewidth=0.9)
    heights.plot(odometry.time, 100.0 * height_over_ground(odometry, context),
                 color=style.VIOLET, linewidth=0.9)
    if context.robot is not None:
        heights.axhline(100.0 * context.robot.stance_height, **asked_for)
    yaws.plot(odometry.time, yaw, color=style.VIOLET)
    if reference.time.size > 1:
        turned = np.rad2deg(integral(reference.time, reference.value[:, 2]))
        yaws.plot(reference.time, turned + yaw[0], **asked_for)
    style.legend(figure, [
        style.key('roll', color=style.BLUE), style.key('pitch', color=style.ORANGE),
        style.key('height, yaw', color=style.VIOLET),
        style.key('asked for', color=style.INK, linestyle=style.DASHED), *shades])
    return figure


def estimation(recording: Recording, context: RunContext) -> Figure | None:
    """Errors of the estimated velocity, tilt and yaw."""
    errors = estimate_errors(recording)
    if errors is None:
        return None
    figure, (velocities, tilts, yaws), shades = style.time_panels(
        recording, 4.6, ('velocity [mm/s]', 'tilt [°]', 'yaw [°]'))
    for axis, color in enumerate(COLOURS):
        velocities.plot(
            errors.time, 1e3 * errors.velocity_in_base[:, axis], color=color, linewidth=0.7)
    for axis, color in enumerate(COLOURS[:2]):
        tilts.plot(errors.time, np.rad2deg(errors.tilt[:, axis]), color=color, linewidth=0.9)
    yaws.plot(errors.time, np.rad2deg(errors.yaw), color=COLOURS[2])
    style.legend(figure, [style.key(label, color=color) for label, color in zip(
        ('x, roll', 'y, pitch', 'z, yaw'), COLOURS, strict=True)] + shades)
    return figure
