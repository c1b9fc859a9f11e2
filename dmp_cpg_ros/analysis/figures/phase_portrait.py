# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Oscillators in their plane with the region C (paper, figure "Local dynamics")."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Patch

from dmp_cpg_ros.analysis import gait_in_force
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import STOPPING, Episode, episodes
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.robot_model.state import LEGS

CAPTION = (
    'The first stop in the plane of the oscillators. Left: the inhibited oscillator runs on its '
    'limit cycle until inhibition is armed and it enters the region C, where it is held near its '
    'target. Middle: close-up of C; the small distance at which it rests is the pull of the other '
    'oscillators over the gain. Right: all four legs; dots mark where they rest, rings their '
    'places in the gait.'
)

AHEAD = 1.5
"""Time before the request that is drawn [s]."""

FREE, REQUESTED = '#C9CED6', '#B8860B'


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the first stop; None without canonical states or a stop."""
    stops = [
        episode
        for episode in episodes(recording, STOPPING)
        if episode.events[0].message != 'at_rest'
    ]
    if not recording.canonical.time.size or not stops:
        return None
    held = LEGS.index(context.inhibition.inhibited_legs[0])
    figure, axes = style.new_figure(2.85, 1, 3)
    places = _places(context)
    _inhibited(axes[0, 0], recording, context, stops[0], held)
    _inhibited(axes[0, 1], recording, context, stops[0], held)
    r0, target = 1.25 * context.inhibition.region_radius, places[held]
    axes[0, 1].set(xlim=(target[0] - r0, target[0] + r0), ylim=(target[1] - r0, target[1] + r0))
    _all_legs(axes[0, 2], recording, context, stops[0], places)
    for panel, title in zip(
        axes[0], (f'{style.LEG_NAMES[LEGS[held]]}', 'close-up of C', 'all legs'), strict=True):
        panel.set_aspect('equal')
        panel.set_title(title)
        panel.set_xlabel('$x_{i1}$ [–]')
    axes[0, 0].set_ylabel('$x_{i2}$ [–]')
    handles = [
        Line2D([], [], color=FREE, linewidth=3.2, label='free'),
        Line2D([], [], color=REQUESTED, label='stop requested'),
        Line2D([], [], color=style.INK, label='inhibited'),
        Patch(facecolor='#E8EEF6', edgecolor='#3B6EA8', label='region C'),
        Line2D([], [], color='#C00000', marker='x', linestyle='', label='target $x_d$')]
    style.legend(figure, handles)
    return figure


def _place_at(recording: Recording, context: RunContext, time: float, leg: int
              ) -> tuple[float, float]:
    """x_d of a leg in the gait in force at a time."""
    offsets = gait_in_force.phase_offsets(recording, context)
    if offsets is None:
        x_1, x_2 = _places(context)[leg]
        return float(x_1), float(x_2)
    row = min(int(np.searchsorted(recording.canonical.time, time)), len(offsets)) - 1
    x_1, x_2 = state_at(offsets[max(row, 0), leg], context.radius)
    return float(x_1), float(x_2)


def _places(context: RunContext) -> np.ndarray:
    offsets = context.phase_offsets
    return state_at(np.zeros(len(LEGS)) if offsets is None else offsets, context.radius)


def _limit_cycle(axes: Axes, context: RunContext) -> None:
    axes.add_patch(
        Circle(
            (0.0, 0.0), context.radius, fill=False, linestyle=(0, (4, 3)), linewidth=0.8,
            edgecolor='#AAAAAA', zorder=1)
    )


def _inhibited(
        axes: Axes, recording: Recording, context: RunContext, stop: Episode, held: int) -> None:
    time, x = recording.canonical.time, recording.canonical.x[:, held]
    target = _place_at(recording, context, stop.end, held)
    _limit_cycle(axes, context)
    axes.add_patch(
        Circle(
            target, context.inhibition.region_radius, facecolor='#E8EEF6', edgecolor='#3B6EA8',
            linewidth=0.8, zorder=1.5)
    )
    captured = next((event.time for event in stop.events if event.message != 'waiting'), stop.end)
    for start, end, colour, width in (
        (stop.start - AHEAD, stop.start, FREE, 3.2), (stop.start, captured, REQUESTED, 1.3),
        (captured, stop.end, style.INK, 1.5)):
        rows = style.rows_in(time, (start, end))
        axes.plot(*x[rows].T, color=colour, linewidth=width, zorder=3)
    axes.plot(
        *target, marker='x', color='#C00000', markersize=5, markeredgewidth=1.3, linestyle='',
        zorder=5)
    rest = x[time <= stop.end]
    if len(rest):
        axes.plot(*rest[-1], marker='o', color=style.INK, markersize=3.5, zorder=4)
    reach = context.radius + context.inhibition.region_radius + 0.1
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach))
    _sense(axes, context)


def _sense(axes: Axes, context: RunContext) -> None:
    """Arrow inside the limit cycle that shows the sense of rotation."""
    tail, head = (0.78 * state_at(angle, context.radius) for angle in (2.0, 2.9))
    axes.add_patch(
        FancyArrowPatch(
            tuple(tail), tuple(head), connectionstyle='arc3,rad=-0.22', arrowstyle='-|>',
            mutation_scale=8, color=style.GREY, linewidth=0.9)
    )


def _all_legs(
    axes: Axes, recording: Recording, context: RunContext, stop: Episode, places: np.ndarray
) -> None:
    time = recording.canonical.time
    rows = style.rows_in(time, (stop.start, stop.end))
    _limit_cycle(axes, context)
    for index, leg in enumerate(LEGS):
        x = recording.canonical.x[rows, index]
        axes.plot(*x.T, color=style.LEG_COLOURS[leg], linewidth=0.9, alpha=0.8)
        if len(x):
            axes.plot(*x[-1], marker='o', color=style.LEG_COLOURS[leg], markersize=5, zorder=4)
            axes.annotate(
                leg.upper(), x[-1], 0.62 * x[-1], color=style.LEG_COLOURS[leg], ha='center',
                va='center', fontweight='bold')
        axes.plot(
            *places[index], marker='o', markerfacecolor='none', color=style.LEG_COLOURS[leg],
            markersize=8, linestyle='', zorder=3)
    reach = context.radius + context.inhibition.region_radius + 0.1
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach))
