# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Canonical states across inhibition and release (paper, figure "Oscillator states")."""

from __future__ import annotations

from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.robot_model.state import LEGS

CAPTION = (
    'The four oscillators across the addition and the removal of sparse inhibition. Only the '
    'inhibited leg feels it; the coupling brings the other three to rest near their places.'
)


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw x_i1 and x_i2 of the four legs; None when there are none."""
    canonical, window = recording.canonical, style.stop_window(recording)
    rows = style.rows_in(canonical.time, window)
    if not rows.any():
        return None
    figure, axes = style.new_figure(3.6, 2, sharex=True)
    for component, panel in enumerate(axes[:, 0]):
        shades = style.shade_stops(panel, recording)
        for index, leg in enumerate(LEGS):
            panel.plot(
                canonical.time[rows], canonical.x[rows, index, component],
                color=style.LEG_COLOURS[leg])
        panel.set_ylabel(f'$x_{{i{component + 1}}}$ [–]')
        panel.set_ylim(-1.25 * context.radius, 1.25 * context.radius)
        style.limit_view(panel, window)
    axes[-1, 0].set_xlabel('time [s]')
    style.leg_legend(figure, shades)
    return figure
