# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the robot's estimate of its own motion."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.metrics.estimation import estimate_errors
from dmp_cpg_ros.analysis.recording import Recording

CAPTION = (
    'What the robot believes of its motion, from gyroscope, accelerometer, joints and contacts, '
    "minus the simulator's truth: velocity in the base, tilt, and yaw, which nothing it has can "
    'correct.'
)

FIRST, SECOND, THIRD = '#56B4E9', '#E69F00', '#6A51A3'


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the errors of velocity, tilt and yaw; None without an estimate."""
    errors = estimate_errors(recording)
    if errors is None:
        return None
    figure, axes = style.new_figure(4.6, 3, sharex=True)
    velocity_panel, tilt_panel, yaw_panel = axes[:, 0]
    for panel in axes[:, 0]:
        shades = style.shade_stops(panel, recording)
        style.limit_view(panel, recording.span)
    for axis, color in enumerate((FIRST, SECOND, THIRD)):
        velocity_panel.plot(
            errors.time, 1e3 * errors.velocity_in_base[:, axis], color=color, linewidth=0.7)
    velocity_panel.set_ylabel('velocity [mm/s]')
    for axis, color in enumerate((FIRST, SECOND)):
        tilt_panel.plot(errors.time, np.rad2deg(errors.tilt[:, axis]), color=color, linewidth=0.9)
    tilt_panel.set_ylabel('tilt [°]')
    yaw_panel.plot(errors.time, np.rad2deg(errors.yaw), color=THIRD)
    yaw_panel.set_ylabel('yaw [°]')
    yaw_panel.set_xlabel('time [s]')
    style.legend(
        figure,
        [
            Line2D([], [], color=FIRST, label='x, roll'),
            Line2D([], [], color=SECOND, label='y, pitch'),
            Line2D([], [], color=THIRD, label='z, yaw'), *shades],
    )
    figure.align_ylabels()
    return figure
