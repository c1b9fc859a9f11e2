# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The way the robot took, from above, with its footholds."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import requested_stops
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.foot_motion import feet_in_base
from dmp_cpg_ros.analysis.motion import common_rows, roll_pitch_yaw, rotations, stretches
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.robot_model.state import LEGS

FEWEST_SAMPLES = 5
"""Shorter contacts are no footholds."""

FOOTHOLD: Any = {'marker': '.', 'linestyle': ''}
BEGIN: Any = {
    'marker': 'o', 'color': 'white', 'markeredgecolor': style.INK, 'linestyle': ''}
STOP: Any = {'marker': 's', 'color': style.RED, 'linestyle': ''}


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the path; None without odometry."""
    odometry = recording.odometry
    if odometry.time.size < 2:
        return None
    x, y = odometry.position_in_world[:, :2].T
    margin = 0.4
    span_x, span_y = np.ptp(x) + 2 * margin, np.ptp(y) + 2 * margin
    figure, axes = style.new_figure(
        float(np.clip((style.WIDTH - 0.7) * span_y / span_x + 0.9, 2.0, 7.0)))
    panel = axes[0, 0]
    handles = [style.key('base', color=style.INK)]
    if context.robot is not None and _footholds(panel, recording, context):
        handles += [style.key(style.LEG_NAMES[leg], color=style.LEG_COLOURS[leg], **FOOTHOLD)
                    for leg in LEGS]
    panel.plot(x, y, color=style.INK, linewidth=1.3, zorder=3)
    _headings(panel, recording)
    panel.plot(x[0], y[0], markersize=6, zorder=5, **BEGIN)
    for stop in requested_stops(recording):
        place = (np.interp(stop.end, odometry.time, column) for column in (x, y))
        panel.plot(*place, markersize=5, zorder=5, **STOP)
    panel.set(
        xlim=(x.min() - margin, x.max() + margin), ylim=(y.min() - margin, y.max() + margin),
        xlabel='x [m]', ylabel='y [m]')
    panel.set_aspect('equal')
    style.legend(figure, [*handles, style.key('begin', **BEGIN), style.key('stop', **STOP)])
    return figure


def _headings(axes: Axes, recording: Recording, every: float = 2.0) -> None:
    odometry = recording.odometry
    yaw = roll_pitch_yaw(odometry.quaternion)[:, 2]
    times = np.arange(odometry.time[0] + every, odometry.time[-1], every)
    x, y, heading = (
        np.interp(times, odometry.time, column)
        for column in (*odometry.position_in_world[:, :2].T, yaw)
    )
    axes.quiver(
        x, y, np.cos(heading), np.sin(heading), color=style.INK, angles='xy', scale_units='xy',
        scale=4.5, width=0.0028, headwidth=5, headlength=5, headaxislength=4.5, zorder=4)


def _footholds(axes: Axes, recording: Recording, context: RunContext) -> bool:
    """Mark the mean place of each stance of each foot; returns whether it could."""
    rows = common_rows(recording.joints.time, recording.odometry.time, recording.feet.time)
    if context.robot is None or len(rows[0]) < 2:
        return False
    R = rotations(recording.odometry.quaternion[rows[1]])
    base = recording.odometry.position_in_world[rows[1]]
    for index, leg in enumerate(context.robot.legs):
        q = recording.joints.position[rows[0], 3 * index : 3 * index + 3]
        feet = base + np.einsum('nij,nj->ni', R, feet_in_base(leg, q))
        loaded = recording.feet.force[rows[2], index] > context.contact_force
        places = [
            feet[first:past, :2].mean(axis=0)
            for first, past in stretches(loaded)
            if past - first > FEWEST_SAMPLES
        ]
        if places:
            axes.plot(
                *np.array(places).T, color=style.LEG_COLOURS[leg.name], markersize=3.5, zorder=2,
                **FOOTHOLD)
    return True
