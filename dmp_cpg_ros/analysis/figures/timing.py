# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rate and latency: as the robot measured them, and as the recorder saw the ticks arrive."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Recording, StatusEvent
from dmp_cpg_ros.suite_table import ROBOT

CAPTION = (
    'Top: what the robot measured of itself, control rate and latency from a state to the last of '
    'the four targets that answer it. Bottom, where the recording bears wall time: how far apart '
    'the states reached the recorder, and how long after a state the last target of its tick did.'
)


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the robot's statuses and the recorder's arrivals; None when there is neither."""
    history = robot_history(recording)
    arrivals = recording.arrivals
    rows = bool(history) + arrivals.on_wall_clock
    if not rows:
        return None
    figure, axes = style.new_figure(1.9 * rows + 0.2, rows, 2)
    if history:
        _rate(axes[0, 0], history)
        _latency(axes[0, 1], history)
    if arrivals.on_wall_clock:
        _histogram(axes[-1, 0], 1e3 * np.diff(arrivals.state), 'interval between states [ms]')
        latency = 1e3 * (arrivals.targets - arrivals.state)
        _histogram(axes[-1, 1], latency[np.isfinite(latency)], 'state to last target [ms]')
    return figure


def robot_history(recording: Recording) -> list[StatusEvent]:
    """Statuses of the robot that state a rate, in order."""
    statuses = (
        status
        for name, history in recording.statuses.items()
        if ROBOT in name
        for status in history
    )
    return sorted(
        (status for status in statuses if status.number('rate_hz') is not None),
        key=lambda status: status.time,
    )


def _series(history: list[StatusEvent], key: str) -> NDArray[np.float64]:
    return np.array(
        [np.nan if (value := status.number(key)) is None else value for status in history]
    )


def _rate(axes: Axes, history: list[StatusEvent]) -> None:
    time = [status.time for status in history]
    axes.plot(time, _series(history, 'rate_hz'), color='#0072B2', marker='.', markersize=3)
    axes.set(xlabel='time [s]', ylabel='control rate [Hz]')
    axes.set_ylim(bottom=0.0)
    factor = _series(history, 'real_time_factor')
    if np.isfinite(factor).any():
        axes.set_title(f'real-time factor {factor[np.isfinite(factor)][-1]:.3f}')


def _latency(axes: Axes, history: list[StatusEvent]) -> None:
    time = [status.time for status in history]
    for key, label, colour in (
        ('latency_ms_p99', '99%', '#D55E00'),
        ('latency_ms_p50', 'median', '#0072B2'),
    ):
        axes.plot(time, _series(history, key), color=colour, marker='.', markersize=3, label=label)
    axes.set(xlabel='time [s]', ylabel='latency [ms]')
    axes.set_ylim(bottom=0.0)
    axes.legend(loc='lower right', bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0)


def _histogram(axes: Axes, values: NDArray[np.float64], label: str) -> None:
    if not values.size:
        axes.set_axis_off()
        return
    largest = float(np.percentile(values, 99.9)) * 1.1 or 1.0
    axes.hist(np.clip(values, 0.0, largest), bins=80, range=(0.0, largest), color='#0072B2')
    axes.set_yscale('log')
    axes.set(xlabel=label, ylabel='ticks')
    axes.set_title(
        f'median {np.median(values):.2f} ms, 99% {np.percentile(values, 99):.2f} ms, '
        f'largest {values.max():.1f} ms'
    )
