# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a plane: the way of the robot from above, and the oscillators with the region C."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, Patch

from dmp_cpg_ros.analysis import motion
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import Episode, phase_offsets, requested_stops
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.robot_model.state import LEGS

FEWEST_SAMPLES = 5
"""Shorter contacts are no footholds."""

MARGIN = 0.4
"""Around the path [m]."""

EVERY = 2.0
"""Time between two arrows along the path [s]."""

FOOTHOLD: Any = {'marker': '.', 'linestyle': ''}
BEGIN: Any = {'marker': 'o', 'color': 'white', 'markeredgecolor': style.INK, 'linestyle': ''}
STOP: Any = {'marker': 's', 'color': style.RED, 'linestyle': ''}

AHEAD = 1.5
"""Time before the request that is drawn [s]."""

FREE, REQUESTED = '#C9CED6', '#B8860B'
REGION: Any = {'facecolor': '#E8EEF6', 'edgecolor': '#3B6EA8'}
TARGET: Any = {'color': style.RED, 'marker': 'x', 'linestyle': ''}


def path(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the path with its footholds; None without odometry."""
    odometry = recording.odometry
    time = odometry.time
    if time.size < 2:
        return None
    xy = odometry.position_in_world[:, :2]
    low, high = xy.min(axis=0) - MARGIN, xy.max(axis=0) + MARGIN
    width, height = high - low
    figure, [[panel]] = style.new_figure(
        float(np.clip((style.WIDTH - 0.7) * height / width + 0.9, 2.0, 7.0)))
    handles = [style.key('base', color=style.INK)]
    if context.robot is not None and _footholds(panel, recording, context):
        handles += [style.key(style.LEG_NAMES[leg], color=style.LEG_COLOURS[leg], **FOOTHOLD)
                    for leg in LEGS]
    panel.plot(*xy.T, color=style.INK, linewidth=1.3, zorder=3)
    columns = (*xy.T, motion.roll_pitch_yaw(odometry.quaternion)[:, 2])
    times = np.arange(time[0] + EVERY, time[-1], EVERY)
    x, y, yaw = (np.interp(times, time, column) for column in columns)
    panel.quiver(x, y, np.cos(yaw), np.sin(yaw), color=style.INK, angles='xy', scale_units='xy',
                 scale=4.5, width=0.0028, headwidth=5, headlength=5, headaxislength=4.5, zorder=4)
    panel.plot(*xy[0], markersize=6, zorder=5, **BEGIN)
    for stop in requested_stops(recording):
        place = (np.interp(stop.end, time, column) for column in xy.T)
        panel.plot(*place, markersize=5, zorder=5, **STOP)
    panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel='x [m]', ylabel='y [m]')
    panel.set_aspect('equal')
    return style.legend(figure, [*handles, style.key('begin', **BEGIN), style.key('stop', **STOP)])


def _footholds(axes: Axes, recording: Recording, context: RunContext) -> bool:
    """Mark the mean place of each stance of each foot; returns whether it could."""
    joints, odometry, feet = motion.matched(
        recording.joints, recording.odometry, recording.feet)
    if context.robot is None or len(joints.time) < 2:
        return False
    for i, leg in enumerate(context.robot.legs):
        place = motion.feet_in_world(leg, joints.position[:, 3 * i : 3 * i + 3], odometry)
        loaded = feet.force[:, i] > context.contact_force
        places = [place[first:past, :2].mean(axis=0) for first, past in motion.stretches(loaded)
                  if past - first > FEWEST_SAMPLES]
        if places:
            axes.plot(*np.array(places).T, color=style.LEG_COLOURS[leg.name], markersize=3.5,
                      zorder=2, **FOOTHOLD)
    return True


def phase_portrait(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the first stop (paper, figure "Local dynamics"); None without oscillators or a stop."""
    stops = requested_stops(recording)
    if not recording.canonical.time.size or not stops:
        return None
    inhibited, radius = context.inhibition, context.radius
    held = LEGS.index(inhibited.inhibited_legs[0])
    figure, [panels] = style.new_figure(2.85, 1, 3)
    whole, close_up, all_legs = panels
    places = _places(recording, context, stops[0].end)
    reach = radius + inhibited.region_radius + 0.1
    titles = (style.LEG_NAMES[LEGS[held]], 'close-up of C', 'all legs')
    for panel, title in zip(panels, titles, strict=True):
        panel.add_patch(Circle((0.0, 0.0), radius, fill=False, linestyle=(0, (4, 3)),
                               linewidth=0.8, edgecolor='#AAAAAA', zorder=1))
        panel.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel='$x_{i1}$ [–]', title=title)
        panel.set_aspect('equal')
    for panel in (whole, close_up):
        _inhibited(panel, recording, context, stops[0], held, places[held])
    r0, (x_1, x_2) = 1.25 * inhibited.region_radius, places[held]
    close_up.set(xlim=(x_1 - r0, x_1 + r0), ylim=(x_2 - r0, x_2 + r0))
    _all_legs(all_legs, recording, stops[0], places)
    whole.set_ylabel('$x_{i2}$ [–]')
    return style.legend(figure, [
        style.key('free', color=FREE, linewidth=3.2),
        *style.keys(('stop requested', 'inhibited'), (REQUESTED, style.INK)),
        Patch(label='region C', **REGION), style.key('target $x_d$', **TARGET)])


def _places(recording: Recording, context: RunContext, time: float) -> Array:
    """Targets x_d of the legs (4, 2) in the gait in force at a time."""
    offsets = phase_offsets(recording, context)
    if offsets is not None:
        phases = motion.held(recording.canonical.time, offsets, time)
    else:
        phases = np.zeros(len(LEGS)) if context.gait is None else context.gait.phases
    return state_at(phases, context.radius)


def _inhibited(axes: Axes, recording: Recording, context: RunContext, stop: Episode, held: int,
               target: Array) -> None:
    """Draw the inhibited oscillator before, during and after its capture."""
    time, x = recording.canonical.time, recording.canonical.x[:, held]
    axes.add_patch(Circle(
        tuple(target), context.inhibition.region_radius, linewidth=0.8, zorder=1.5, **REGION))
    for start, end, colour, width in (
            (stop.start - AHEAD, stop.start, FREE, 3.2),
            (stop.start, stop.captured, REQUESTED, 1.3),
            (stop.captured, stop.end, style.INK, 1.5)):
        rows = style.rows_in(time, (start, end))
        axes.plot(*x[rows].T, color=colour, linewidth=width, zorder=3)
    axes.plot(*target, markersize=5, markeredgewidth=1.3, zorder=5, **TARGET)
    axes.plot(*x[time <= stop.end][-1:].T, marker='o', color=style.INK, markersize=3.5, zorder=4)
    # arrow inside the limit cycle that shows the sense of rotation
    tail, head = (tuple(0.78 * state_at(angle, context.radius)) for angle in (2.0, 2.9))
    axes.add_patch(FancyArrowPatch(
        tail, head, connectionstyle='arc3,rad=-0.22', arrowstyle='-|>', mutation_scale=8,
        color=style.GREY, linewidth=0.9))


def _all_legs(axes: Axes, recording: Recording, stop: Episode, places: Array) -> None:
    """Draw all oscillators from the request to rest, and their places in the gait."""
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
