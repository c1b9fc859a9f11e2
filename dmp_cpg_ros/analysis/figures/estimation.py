# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of the robot's estimate of its own motion."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.metrics.estimation import estimate_errors
from dmp_cpg_ros.analysis.recording import Recording

CAPTION = (
    'What the robot believes of its motion, from gyroscope, accelerometer, joints and contacts, '
    "minus the simulator's truth: velocity in the base, tilt, and yaw, which nothing it has can "
    'correct.'
)

COLOURS = (style.BLUE, style.ORANGE, style.VIOLET)


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the errors of velocity, tilt and yaw; None without an estimate."""
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
