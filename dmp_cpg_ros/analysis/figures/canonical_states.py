# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Canonical states across inhibition and release (paper, figure "Oscillator states")."""

from __future__ import annotations

from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Recording

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
    figure, panels, shades = style.time_panels(
        recording, 3.6, ('$x_{i1}$ [–]', '$x_{i2}$ [–]'), window)
    for component, panel in enumerate(panels):
        style.plot_legs(panel, canonical.time[rows], canonical.x[rows, :, component])
        panel.set_ylim(-1.25 * context.radius, 1.25 * context.radius)
    style.leg_legend(figure, shades)
    return figure
