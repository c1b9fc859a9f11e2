# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Figures of the robot: its body, its joints, its timing.

Each function of the catalogue draws from a recording and its context, and returns None when the
recording lacks what it needs; its docstring is the title and the caption.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis import episodes, motion
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import requested_stops
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.metrics.robot import body_motion, estimate_errors
from dmp_cpg_ros.analysis.recording import Array, Recording, StatusEvent, taken
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS
from dmp_cpg_ros.suite_table import ROBOT

SPEEDS = ('forward speed $v$ [m/s]', 'lateral speed [m/s]', 'turn rate $\\gamma$ [rad/s]')
COMMANDED: Any = {'color': style.ORANGE, 'linestyle': (0, (1, 1.2))}
FILTERED: Any = {'color': style.REFERENCE, 'linestyle': style.DASHED}
ASKED_FOR: Any = {'color': style.INK, 'linestyle': style.DASHED}
LIMIT: Any = {'color': style.GREY, 'linestyle': style.DASHED, 'linewidth': 0.9}
COLOURS = (style.BLUE, style.ORANGE, style.VIOLET)
MEDIAN, LATE = style.DEEP_BLUE, style.VERMILION

CYCLES = 3
"""Gait cycles of steady walking whose torques are drawn."""

FEWEST_SAMPLES = 5
"""Shorter contacts are no footholds."""

MARGIN = 0.4
"""Around the path [m]."""

EVERY = 2.0
"""Time between two arrows along the path [s]."""

FOOTHOLD: Any = {'marker': '.', 'linestyle': ''}
BEGIN: Any = {'marker': 'o', 'color': 'white', 'markeredgecolor': style.INK, 'linestyle': ''}
STOP: Any = {'marker': 's', 'color': style.RED, 'linestyle': ''}


def speed_tracking(recording: Recording, context: RunContext) -> Figure | None:
    """Speed tracking.

    As commanded, as filtered by the reference system, and as measured; the pale line is every
    sample, the bold one the mean over a gait cycle. While a stop is requested the reference
    goes to zero whatever the command.
    """
    odometry, commands, reference = recording.odometry, recording.commands, recording.reference
    if odometry.time.size < 3:
        return None
    measured = body_motion(recording)
    mean = motion.smoothed(odometry.time, measured, episodes.gait_period(recording) or 0.5)
    lateral = reference.time.size and np.abs(reference.value[:, 1]).max() > episodes.MOVING
    columns = (0, 1, 2) if lateral else (0, 2)
    figure, panels, shades = style.time_panels(
        recording, 1.6 * len(columns) + 0.6, [SPEEDS[column] for column in columns])
    look: Any = {'color': style.MEASURED}
    for panel, k in zip(panels, columns, strict=True):
        style.line(panel, odometry.time, measured[:, k], alpha=0.28, linewidth=0.6, **look)
        style.line(panel, odometry.time, mean[:, k], linewidth=1.5, **look)
        panel.step(commands.time, commands.value[:, k], where='post', linewidth=1.0, **COMMANDED)
        style.line(panel, reference.time, reference.value[:, k], linewidth=1.0, **FILTERED)
    return style.legend(figure, [
        style.key('command', **COMMANDED), style.key('reference', **FILTERED),
        style.key('measured', linewidth=1.5, **look), *shades])


def attitude(recording: Recording, context: RunContext) -> Figure | None:
    """Body attitude.

    Roll and pitch, height over the ground and yaw of the base. The dashed lines are what is
    asked for: the standing height, and the integral of the reference turn rate.
    """
    odometry, reference = recording.odometry, recording.reference
    if odometry.time.size < 2:
        return None
    angles = np.rad2deg(motion.roll_pitch_yaw(odometry.quaternion))
    height, yaw = 100.0 * motion.height_over_ground(odometry, context), angles[:, 2]
    figure, (tilts, heights, yaws), shades = style.time_panels(
        recording, 4.6, ('tilt [°]', 'height [cm]', 'yaw [°]'))
    style.plot_lines(tilts, odometry.time, angles[:, :2], COLOURS, linewidth=0.9)
    style.line(heights, odometry.time, height, color=style.VIOLET, linewidth=0.9)
    style.line(yaws, odometry.time, yaw, color=style.VIOLET)
    if context.robot is not None:
        heights.axhline(100.0 * context.robot.stance_height, linewidth=0.9, **ASKED_FOR)
    if reference.time.size > 1:
        turned = np.rad2deg(motion.integral(reference.time, reference.value[:, 2]))
        style.line(yaws, reference.time, turned + yaw[0], linewidth=0.9, **ASKED_FOR)
    return style.legend(figure, [
        *style.keys(('roll', 'pitch', 'height, yaw'), COLOURS),
        style.key('asked for', **ASKED_FOR), *shades])


def estimation(recording: Recording, context: RunContext) -> Figure | None:
    """Estimate of the body.

    What the robot believes of its motion, from gyroscope, accelerometer, joints and contacts,
    minus the simulator's truth: velocity in the base, tilt, and yaw, which nothing it has can
    correct.
    """
    errors = estimate_errors(recording)
    if errors is None:
        return None
    figure, (velocities, tilts, yaws), shades = style.time_panels(
        recording, 4.6, ('velocity [mm/s]', 'tilt [°]', 'yaw [°]'))
    style.plot_lines(
        velocities, errors.time, 1e3 * errors.velocity_in_base, COLOURS, linewidth=0.7)
    style.plot_lines(tilts, errors.time, np.rad2deg(errors.tilt), COLOURS, linewidth=0.9)
    style.line(yaws, errors.time, np.rad2deg(errors.yaw), color=COLOURS[2])
    return style.legend(figure, [*style.keys(('x, roll', 'y, pitch', 'z, yaw'), COLOURS), *shades])


def torques(recording: Recording, context: RunContext) -> Figure | None:
    """Joint torques.

    Left: three cycles of steady walking; grey lines are the limits where they are in view.
    Right: the whole run as share of the limit; bars reach to the 99th percentile, ticks mark
    the largest value.
    """
    joints, robot = recording.joints, context.robot
    if not joints.time.size or not np.isfinite(joints.effort).any():
        return None
    window = style.steady_window(recording, CYCLES) or style.stop_window(recording)
    shown = taken(joints, style.rows_in(joints.time, window))
    figure, axes = style.new_figure(4.6, 3, 1 if robot is None else 2, sharex='col',
                                    width_ratios=None if robot is None else (3.0, 1.0))
    for k, joint in enumerate(JOINTS_OF_LEG):
        panel = axes[k, 0]
        style.plot_lines(panel, shown.time, shown.effort[:, k::3])
        panel.set_ylabel(f'{joint} [N m]')
        style.limit_view(panel, window)
        if robot is not None:
            limits = np.array([leg.torque_limit[k] for leg in robot.legs])
            low, high = panel.get_ylim()
            for value in (-limits.min(), limits.min()):
                if low <= value <= high:
                    panel.axhline(value, **LIMIT)
            _shares(axes[k, 1], 100.0 * (np.abs(joints.effort[:, k::3]) / limits))
    axes[-1, 0].set_xlabel('time [s]')
    if robot is not None:
        axes[-1, 1].set_xlabel('share of limit [%]')
    figure.align_ylabels()
    return style.leg_legend(figure)


def _shares(axes: Axes, share: Array) -> None:
    """Bars of the legs up to the 99th percentiles of shares (n, 4) [%], ticks at the largest."""
    rows = np.arange(len(LEGS))[::-1]
    for leg, y, of in zip(LEGS, rows, share.T, strict=True):
        axes.barh(y, np.nanpercentile(of, 99.0), height=0.62, color=style.LEG_COLOURS[leg],
                  alpha=0.75)
        axes.plot([np.nanmax(of)] * 2, [y - 0.31, y + 0.31], color=style.INK, linewidth=1.2)
    axes.axvline(100.0, **LIMIT)
    axes.set(xlim=(0.0, 108.0), yticks=rows, yticklabels=[leg.upper() for leg in LEGS])
    axes.grid(visible=False, axis='y')


def timing(recording: Recording, context: RunContext) -> Figure | None:
    """Timing.

    Top: what the robot measured of itself, control rate and latency from a state to the last
    of the four targets that answer it. Bottom, where the recording bears wall time: how far
    apart the states reached the recorder, and how long after a state the last target of its
    tick did.
    """
    arrivals = recording.arrivals
    history = sorted((status for name, of in recording.statuses.items() if ROBOT in name
                      for status in of if status.number('rate_hz') is not None),
                     key=lambda status: status.time)
    rows = bool(history) + arrivals.on_wall_clock
    if not rows:
        return None
    figure, axes = style.new_figure(1.9 * rows + 0.2, rows, 2)
    if history:
        rate, latency = axes[0]
        _plot(rate, history, 'rate_hz', color=MEDIAN)
        factor = [value for status in history if (value := status.number('real_time_factor'))]
        rate.set(xlabel='time [s]', ylabel='control rate [Hz]', ylim=(0.0, None),
                 title=f'real-time factor {factor[-1]:.3f}' if factor else '')
        _plot(latency, history, 'latency_ms_p99', color=LATE, label='99%')
        _plot(latency, history, 'latency_ms_p50', color=MEDIAN, label='median')
        latency.set(xlabel='time [s]', ylabel='latency [ms]', ylim=(0.0, None))
        latency.legend(loc='lower right', bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0)
    if arrivals.on_wall_clock:
        _histogram(axes[-1, 0], 1e3 * np.diff(arrivals.state), 'interval between states [ms]')
        answer = 1e3 * (arrivals.targets - arrivals.state)
        _histogram(axes[-1, 1], answer[np.isfinite(answer)], 'state to last target [ms]')
    return figure


def _plot(axes: Axes, history: list[StatusEvent], key: str, **look: Any) -> None:
    values = np.array([status.number(key) for status in history], dtype=float)
    axes.plot([status.time for status in history], values, marker='.', markersize=3, **look)


def _histogram(axes: Axes, values: Array, label: str) -> None:
    if not values.size:
        axes.set_axis_off()
        return
    largest = max(1.1 * float(np.percentile(values, 99.9)), 0.0) or 1.0
    axes.hist(np.clip(values, 0.0, largest), bins=80, range=(0.0, largest), color=MEDIAN)
    axes.set(xlabel=label, ylabel='ticks', yscale='log',
             title=f'median {np.median(values):.2f} ms, 99% {np.percentile(values, 99):.2f} ms, '
                   f'largest {values.max():.1f} ms')


def path(recording: Recording, context: RunContext) -> Figure | None:
    """Path.

    The base from above. Small dots are footholds, one for each stance; squares mark where the
    robot stood still, arrows its heading every two seconds.
    """
    odometry = recording.odometry
    poses = np.column_stack([odometry.position_in_world[:, :2], odometry.quaternion])
    odometry = taken(odometry, np.isfinite(poses).all(axis=1))
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
