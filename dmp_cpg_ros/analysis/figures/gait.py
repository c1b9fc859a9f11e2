# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Figures of the gait and its stops.

Each function of the catalogue draws from a recording and its context, and returns None when the
recording lacks what it needs; its docstring is the title and the caption. Target kinematics and
canonical states are figures TargetKinematics and OscillatorStates of the paper.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, Patch

from dmp_cpg_ros.analysis import episodes, motion
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import Episode, phase_offsets, requested_stops
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.core.canonical.phase import phase, state_at, turned
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS

CYCLES = 6
"""Gait cycles of steady walking that are drawn."""

AHEAD = 1.5
"""Time before the request that is drawn [s]."""

FREE, REQUESTED = '#C9CED6', '#B8860B'
TARGET: Any = {'color': style.RED, 'marker': 'x', 'linestyle': ''}


def target_kinematics(recording: Recording, context: RunContext) -> Figure | None:
    """Target kinematics.

    Targets of the hips and the knees across a stop by sparse inhibition and the start after
    it. One oscillator is inhibited; the targets of all legs should come to rest and resume
    without a kick.
    """
    joints = ('hip', 'knee')
    return _legs_across_stop(recording, recording.targets.time, {
        f'{joint} target [rad]': recording.targets.position[:, JOINTS_OF_LEG.index(joint)::3]
        for joint in joints})


def canonical_states(recording: Recording, context: RunContext) -> Figure | None:
    """Canonical states.

    The four oscillators across the addition and the removal of sparse inhibition. Only the
    inhibited leg feels it; the coupling brings the other three to rest near their places.
    """
    x = recording.canonical.x
    return _legs_across_stop(
        recording, recording.canonical.time,
        {'$x_{i1}$ [–]': x[..., 0], '$x_{i2}$ [–]': x[..., 1]}, 1.25 * context.radius)


def _legs_across_stop(recording: Recording, time: Array, values: dict[str, Array],
                      reach: float | None = None) -> Figure | None:
    """One panel for each of some values (n, 4) of the legs."""
    window = style.stop_window(recording)
    rows = style.rows_in(time, window)
    if not rows.any():
        return None
    figure, panels, shades = style.time_panels(recording, 3.6, list(values), window)
    for panel, of_legs in zip(panels, values.values(), strict=True):
        style.plot_lines(panel, time[rows], of_legs[rows])
        if reach:
            panel.set_ylim(-reach, reach)
    return style.leg_legend(figure, shades)


def footfall(recording: Recording, context: RunContext) -> Figure | None:
    """Footfall.

    Bars mark feet on the ground, measured (solid) over planned (pale). Top: a few cycles of
    steady walking. Bottom: the first stop and the start after it; at rest all four bars should
    be unbroken.
    """
    feet = recording.feet
    if not feet.time.size:
        return None
    steady, stop = style.steady_window(recording, CYCLES), style.stop_window(recording)
    windows = [stop] if steady is None else [steady, stop]
    contact = feet.force > context.contact_force
    planned, duty = episodes.planned_stance(recording, context)
    if duty.size and recording.inhibition:
        # while a stop or a start is under way every foot is planned where it is
        running = episodes.running_intervals(recording)
        planned &= episodes.within(recording.canonical.time, running)[:, None]
    figure, axes = style.new_figure(1.75 * len(windows) + 0.5, len(windows))
    for panel, window in zip(axes[:, 0], windows, strict=True):
        if duty.size:
            style.leg_bars(panel, recording.canonical.time, planned, 0.8, alpha=0.28)
        style.leg_bars(panel, feet.time, contact, 0.44)
        style.leg_rows(panel)
        style.limit_view(panel, window)
    shades = style.shade_stops(axes[-1, 0], recording)
    axes[-1, 0].set_xlabel('time [s]')
    pale = [Patch(color='#BBBBBB', label='planned')] if context.gait is not None else []
    return style.legend(figure, [Patch(color=style.FRAME, label='measured'), *pale, *shades])


def phase_portrait(recording: Recording, context: RunContext) -> Figure | None:
    """Phase portrait.

    The first stop in the plane of the oscillators. Left: the inhibited oscillator runs on its
    limit cycle until inhibition is armed and it enters the region C, where it is held near its
    target. Middle: close-up of C; the small distance at which it rests is the pull of the
    other oscillators over the gain. Right: all four legs; dots mark where they rest, rings
    their places in the gait.
    """
    stops = requested_stops(recording)
    if not recording.canonical.time.size or not stops:
        return None
    inhibited, radius = context.inhibition, context.radius
    figure, [panels] = style.new_figure(2.85, 1, 3)
    whole, close_up, all_legs = panels
    places = _places(recording, context, stops[0].end)
    if inhibited.auto:                                       # the one that is held is nearest
        x = recording.canonical.x[recording.canonical.time <= stops[0].end][-1]
        held = int(np.hypot(*(x - (radius, 0.0)).T).argmin())
        places = turned(places, np.full(len(LEGS), -phase(places[held])))
    else:
        held = LEGS.index(inhibited.inhibited_legs[0])
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
        Patch(label='region C', **style.REGION), style.key('target $x_d$', **TARGET)])


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
        tuple(target), context.inhibition.region_radius, linewidth=0.8, zorder=1.5,
        **style.REGION))
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
