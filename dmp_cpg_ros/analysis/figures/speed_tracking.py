# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forward speed and turn rate against command and reference."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import MOVING, gait_period
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.metrics.tracking import body_motion
from dmp_cpg_ros.analysis.motion import smoothed
from dmp_cpg_ros.analysis.recording import Recording

CAPTION = (
    'As commanded, as filtered by the reference system, and as measured; the pale line is every '
    'sample, the bold one the mean over a gait cycle. While a stop is requested the reference '
    'goes to zero whatever the command.'
)

PANELS = ('forward speed $v$ [m/s]', 'lateral speed [m/s]', 'turn rate $\\gamma$ [rad/s]')

COMMANDED: Any = {'color': style.ORANGE, 'linestyle': (0, (1, 1.2))}
FILTERED: Any = {'color': style.REFERENCE, 'linestyle': style.DASHED}


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw v and γ (and the lateral speed where it was asked for); None without odometry."""
    odometry, commands, reference = recording.odometry, recording.commands, recording.reference
    if odometry.time.size < 3:
        return None
    motion = body_motion(recording)
    mean = smoothed(odometry.time, motion, gait_period(recording) or 0.5)
    lateral = reference.time.size and np.abs(reference.value[:, 1]).max() > MOVING
    columns = (0, 1, 2) if lateral else (0, 2)
    figure, panels, shades = style.time_panels(
        recording, 1.6 * len(columns) + 0.6, [PANELS[column] for column in columns])
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
