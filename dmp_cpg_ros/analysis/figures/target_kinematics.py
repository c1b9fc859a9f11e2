# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Hip and knee targets across a stop and a start (paper, figure "Target kinematics")."""

from __future__ import annotations

from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG

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
    joints = ('hip', 'knee')
    figure, panels, shades = style.time_panels(
        recording, 3.6, [f'{joint} target [rad]' for joint in joints], window)
    for panel, joint in zip(panels, joints, strict=True):
        angles = targets.position[rows, JOINTS_OF_LEG.index(joint)::3]
        style.plot_legs(panel, targets.time[rows], angles)
    style.leg_legend(figure, shades)
    return figure
