# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gait diagram: when each foot was planned to stand, and when it did."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from dmp_cpg_ros.analysis import gait_in_force
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import (
    gait_period,
    running_intervals,
    steady_segments,
    within,
)
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.motion import stretches
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.robot_model.state import LEGS

CYCLES = 6
"""Gait cycles of steady walking that are drawn."""


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw steady walking and the first stop; None without contact forces."""
    if not recording.feet.time.size:
        return None
    steady, stop = steady_window(recording), style.stop_window(recording)
    windows = [stop] if steady is None else [steady, stop]
    figure, axes = style.new_figure(1.75 * len(windows) + 0.5, len(windows))
    for panel, window in zip(axes[:, 0], windows, strict=True):
        _diagram(panel, recording, context, window)
    shades = style.shade_stops(axes[-1, 0], recording)
    axes[-1, 0].set_xlabel('time [s]')
    planned = [Patch(color='#BBBBBB', label='planned')] if context.gait is not None else []
    style.legend(figure, [Patch(color='#555555', label='measured'), *planned, *shades])
    return figure


def steady_window(recording: Recording, cycles: int = CYCLES) -> tuple[float, float] | None:
    """Last cycles of the first steady walking, None when there is none [s]."""
    segments, period = steady_segments(recording), gait_period(recording)
    if not segments or period is None:
        return None
    start, end = segments[0]
    return max(start, end - cycles * period), end


def planned_stance(recording: Recording, context: RunContext) -> NDArray[np.bool_] | None:
    """Feet that the gait plans on the ground at each canonical state, boolean (n, 4).

    While a stop or a start is under way every foot is planned where it is, and nothing is drawn.
    """
    canonical = recording.canonical
    stance, duty = gait_in_force.planned_stance(recording, context)
    if not duty.size:
        return None
    if not recording.inhibition:
        return stance
    return stance & within(canonical.time, running_intervals(recording))[:, None]


def _diagram(
    axes: Axes, recording: Recording, context: RunContext, window: tuple[float, float]
) -> None:
    contact = recording.feet.force > context.contact_force
    planned = planned_stance(recording, context)
    for leg in range(len(LEGS)):
        if planned is not None:
            style.leg_bars(axes, leg, bars(recording.canonical.time, planned[:, leg]), 0.8,
                           alpha=0.28)
        style.leg_bars(axes, leg, bars(recording.feet.time, contact[:, leg]), 0.44)
    style.leg_rows(axes)
    style.limit_view(axes, window)


def bars(time: NDArray[np.float64], mask: NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Start and length of each stretch in which a mask holds [s]."""
    return [
        (float(time[first]), float(time[min(past, len(time) - 1)] - time[first]))
        for first, past in stretches(mask)
    ]
