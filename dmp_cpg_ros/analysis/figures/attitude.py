# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attitude and height of the body."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.ground import height_over_ground
from dmp_cpg_ros.analysis.motion import integral, roll_pitch_yaw
from dmp_cpg_ros.analysis.recording import Recording

CAPTION = (
    'Roll and pitch, height over the ground and yaw of the base. The dashed lines are what is '
    'asked for: the standing height, and the integral of the reference turn rate.'
)


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw roll and pitch, height, yaw; None without odometry."""
    odometry, reference = recording.odometry, recording.reference
    if odometry.time.size < 2:
        return None
    roll, pitch, yaw = np.rad2deg(roll_pitch_yaw(odometry.quaternion)).T
    figure, (tilts, heights, yaws), shades = style.time_panels(
        recording, 4.6, ('tilt [°]', 'height [cm]', 'yaw [°]'))
    asked_for = {'color': style.INK, 'linewidth': 0.9, 'linestyle': style.DASHED}
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
