# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attitude and height of the body."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.ground import height_over_ground
from dmp_cpg_ros.analysis.motion import integral, roll_pitch_yaw
from dmp_cpg_ros.analysis.recording import Recording

CAPTION = (
    'Roll and pitch, height over the ground and yaw of the base. The dashed lines are what is '
    'asked for: the standing height, and the integral of the reference turn rate.'
)

ROLL, PITCH, HEIGHT, YAW = '#56B4E9', '#E69F00', '#6A51A3', '#6A51A3'
DASHED = (0, (5, 2))


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw roll and pitch, height, yaw; None without odometry."""
    odometry, reference = recording.odometry, recording.reference
    if odometry.time.size < 2:
        return None
    roll, pitch, yaw = np.rad2deg(roll_pitch_yaw(odometry.quaternion)).T
    figure, axes = style.new_figure(4.6, 3, sharex=True)
    tilt_panel, height_panel, yaw_panel = axes[:, 0]
    for panel in axes[:, 0]:
        shades = style.shade_stops(panel, recording)
        style.limit_view(panel, recording.span)
    tilt_panel.plot(odometry.time, roll, color=ROLL, linewidth=0.9)
    tilt_panel.plot(odometry.time, pitch, color=PITCH, linewidth=0.9)
    tilt_panel.set_ylabel('tilt [°]')
    height_panel.plot(
        odometry.time, 100.0 * height_over_ground(odometry, context), color=HEIGHT, linewidth=0.9)
    height_panel.set_ylabel('height [cm]')
    if context.robot is not None:
        height_panel.axhline(
            100.0 * context.robot.stance_height, color=style.INK, linewidth=0.9, linestyle=DASHED)
    yaw_panel.plot(odometry.time, yaw, color=YAW)
    if reference.time.size > 1:
        asked = np.rad2deg(integral(reference.time, reference.value[:, 2]))
        yaw_panel.plot(
            reference.time, asked + yaw[0], color=style.INK, linewidth=0.9, linestyle=DASHED)
    yaw_panel.set_ylabel('yaw [°]')
    yaw_panel.set_xlabel('time [s]')
    style.legend(
        figure,
        [
            Line2D([], [], color=ROLL, label='roll'), Line2D([], [], color=PITCH, label='pitch'),
            Line2D([], [], color=HEIGHT, label='height, yaw'),
            Line2D([], [], color=style.INK, linestyle=DASHED, label='asked for'), *shades],
    )
    figure.align_ylabels()
    return figure
