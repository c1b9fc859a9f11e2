# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Forward speed and turn rate against command and reference."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

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

PANELS = (
    (0, 'forward speed $v$ [m/s]'), (1, 'lateral speed [m/s]'), (2, 'turn rate $\\gamma$ [rad/s]'))


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw v and γ (and the lateral speed where it was asked for); None without odometry."""
    odometry = recording.odometry
    if odometry.time.size < 3:
        return None
    motion = body_motion(recording)
    mean = smoothed(odometry.time, motion, gait_period(recording) or 0.5)
    lateral = (
        recording.reference.time.size and np.abs(recording.reference.value[:, 1]).max() > MOVING
    )
    panels = [entry for entry in PANELS if entry[0] != 1 or lateral]
    figure, axes = style.new_figure(1.6 * len(panels) + 0.6, len(panels), sharex=True)
    for panel, (column, label) in zip(axes[:, 0], panels, strict=True):
        shades = style.shade_stops(panel, recording)
        panel.plot(
            odometry.time, motion[:, column], color=style.MEASURED, alpha=0.28, linewidth=0.6)
        panel.plot(odometry.time, mean[:, column], color=style.MEASURED, linewidth=1.5)
        panel.step(
            recording.commands.time, recording.commands.value[:, column], where='post',
            color='#E69F00', linewidth=1.0, linestyle=(0, (1, 1.2)))
        panel.plot(
            recording.reference.time, recording.reference.value[:, column], color=style.REFERENCE,
            linewidth=1.0, linestyle=(0, (5, 2)))
        panel.set_ylabel(label)
        style.limit_view(panel, recording.span)
    axes[-1, 0].set_xlabel('time [s]')
    style.legend(
        figure,
        [
            Line2D([], [], color='#E69F00', linestyle=(0, (1, 1.2)), label='command'),
            Line2D([], [], color=style.REFERENCE, linestyle=(0, (5, 2)), label='reference'),
            Line2D([], [], color=style.MEASURED, linewidth=1.5, label='measured'), *shades],
    )
    figure.align_ylabels()
    return figure
