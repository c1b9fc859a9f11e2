# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hip and knee targets across a stop and a start (paper, figure "Target kinematics")."""

from __future__ import annotations

from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS

CAPTION = (
    'Targets of the hips and the knees across a stop by sparse inhibition and the start after it. '
    'One oscillator is inhibited; the targets of all legs should come to rest and resume without '
    'a kick.'
)


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the targets; None when there are none."""
    targets, window = recording.targets, style.stop_window(recording)
    rows = style.rows_in(targets.time, window)
    if not rows.any():
        return None
    figure, axes = style.new_figure(3.6, 2, sharex=True)
    for panel, joint in zip(axes[:, 0], ('hip', 'knee'), strict=True):
        shades = style.shade_stops(panel, recording)
        for index, leg in enumerate(LEGS):
            angle = targets.position[rows, 3 * index + JOINTS_OF_LEG.index(joint)]
            panel.plot(targets.time[rows], angle, color=style.LEG_COLOURS[leg])
        panel.set_ylabel(f'{joint} target [rad]')
        style.limit_view(panel, window)
    axes[-1, 0].set_xlabel('time [s]')
    style.leg_legend(figure, shades)
    figure.align_ylabels()
    return figure
