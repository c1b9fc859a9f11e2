# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Oscillators in their plane with the region C (paper, figure "Local dynamics")."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, Patch

from dmp_cpg_ros.analysis import gait_in_force
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import Episode, requested_stops
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.robot_model.state import LEGS

AHEAD = 1.5
"""Time before the request that is drawn [s]."""

FREE, REQUESTED = '#C9CED6', '#B8860B'
REGION: Any = {'facecolor': '#E8EEF6', 'edgecolor': '#3B6EA8'}
TARGET: Any = {'color': style.RED, 'marker': 'x', 'linestyle': ''}


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the first stop; None without canonical states or a stop."""
    stops = requested_stops(recording)
    if not recording.canonical.time.size or not stops:
        return None
    held = LEGS.index(context.inhibition.inhibited_legs[0])
    figure, axes = style.new_figure(2.85, 1, 3)
    whole, close_up, all_legs = axes[0]
    places = _places(context)
    reach = context.radius + context.inhibition.region_radius + 0.1
    for panel in axes[0]:
        panel.add_patch(Circle((0.0, 0.0), context.radius, fill=False, linestyle=(0, (4, 3)),
                               linewidth=0.8, edgecolor='#AAAAAA', zorder=1))
        panel.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel='$x_{i1}$ [–]')
        panel.set_aspect('equal')
    _inhibited(whole, recording, context, stops[0], held)
    _inhibited(close_up, recording, context, stops[0], held)
    r0, (x_1, x_2) = 1.25 * context.inhibition.region_radius, places[held]
    close_up.set(xlim=(x_1 - r0, x_1 + r0), ylim=(x_2 - r0, x_2 + r0))
    _all_legs(all_legs, recording, stops[0], places)
    for panel, title in zip(
            axes[0], (style.LEG_NAMES[LEGS[held]], 'close-up of C', 'all legs'), strict=True):
        panel.set_title(title)
    whole.set_ylabel('$x_{i2}$ [–]')
    style.legend(figure, [
        style.key('free', color=FREE, linewidth=3.2),
        style.key('stop requested', color=REQUESTED),
        style.key('inhibited', color=style.INK),
        Patch(label='region C', **REGION),
        style.key('target $x_d$', **TARGET)])
    return figure


def _place_at(recording: Recording, context: RunContext, time: float, leg: int) -> np.ndarray:
    """x_d of a leg in the gait in force at a time."""
    offsets = gait_in_force.phase_offsets(recording, context)
    if offsets is None:
        return _places(context)[leg]
    row = min(int(np.searchsorted(recording.canonical.time, time)), len(offsets)) - 1
    return state_at(offsets[max(row, 0), leg], context.radius)


def _places(context: RunContext) -> np.ndarray:
    offsets = context.phase_offsets
    return state_at(np.zeros(len(LEGS)) if offsets is None else offsets, context.radius)


def _inhibited(
    axes: Axes, recording: Recording, context: RunContext, stop: Episode, held: int
) -> None:
    """The inhibited oscillator before, during and after its capture."""
    time, x = recording.canonical.time, recording.canonical.x[:, held]
    x_1, x_2 = _place_at(recording, context, stop.end, held)
    axes.add_patch(
        Circle((x_1, x_2), context.inhibition.region_radius, linewidth=0.8, zorder=1.5, **REGION))
    for start, end, colour, width in (
        (stop.start - AHEAD, stop.start, FREE, 3.2),
        (stop.start, stop.captured, REQUESTED, 1.3),
        (stop.captured, stop.end, style.INK, 1.5),
    ):
        rows = style.rows_in(time, (start, end))
        axes.plot(*x[rows].T, color=colour, linewidth=width, zorder=3)
    axes.plot(x_1, x_2, markersize=5, markeredgewidth=1.3, zorder=5, **TARGET)
    rest = x[time <= stop.end]
    if len(rest):
        axes.plot(*rest[-1], marker='o', color=style.INK, markersize=3.5, zorder=4)
    # arrow inside the limit cycle that shows the sense of rotation
    tail, head = (0.78 * state_at(angle, context.radius) for angle in (2.0, 2.9))
    axes.add_patch(FancyArrowPatch(
        tuple(tail), tuple(head), connectionstyle='arc3,rad=-0.22', arrowstyle='-|>',
        mutation_scale=8, color=style.GREY, linewidth=0.9))


def _all_legs(axes: Axes, recording: Recording, stop: Episode, places: np.ndarray) -> None:
    """All oscillators from the request to rest, and their places in the gait."""
    rows = style.rows_in(recording.canonical.time, (stop.start, stop.end))
    for index, leg in enumerate(LEGS):
        x, colour = recording.canonical.x[rows, index], style.LEG_COLOURS[leg]
        axes.plot(*x.T, color=colour, linewidth=0.9, alpha=0.8)
        if len(x):
            axes.plot(*x[-1], marker='o', color=colour, markersize=5, zorder=4)
            axes.annotate(leg.upper(), x[-1], 0.62 * x[-1], color=colour, ha='center',
                          va='center', fontweight='bold')
        axes.plot(*places[index], marker='o', markerfacecolor='none', color=colour, markersize=8,
                  linestyle='', zorder=3)
