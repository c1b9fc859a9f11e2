# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rate and latency: as the robot measured them, and as the recorder saw the ticks arrive."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.recording import Recording, StatusEvent
from dmp_cpg_ros.suite_table import ROBOT

MEDIAN, LATE = '#0072B2', '#D55E00'


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the robot's statuses and the recorder's arrivals; None when there is neither."""
    history = robot_history(recording)
    arrivals = recording.arrivals
    rows = bool(history) + arrivals.on_wall_clock
    if not rows:
        return None
    figure, axes = style.new_figure(1.9 * rows + 0.2, rows, 2)
    if history:
        rate, latency = axes[0]
        _plot(rate, history, 'rate_hz', color=MEDIAN)
        rate.set(xlabel='time [s]', ylabel='control rate [Hz]', ylim=(0.0, None))
        factor = [value for status in history if (value := status.number('real_time_factor'))]
        if factor:
            rate.set_title(f'real-time factor {factor[-1]:.3f}')
        _plot(latency, history, 'latency_ms_p99', color=LATE, label='99%')
        _plot(latency, history, 'latency_ms_p50', color=MEDIAN, label='median')
        latency.set(xlabel='time [s]', ylabel='latency [ms]', ylim=(0.0, None))
        latency.legend(loc='lower right', bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0)
    if arrivals.on_wall_clock:
        _histogram(axes[-1, 0], 1e3 * np.diff(arrivals.state), 'interval between states [ms]')
        answer = 1e3 * (arrivals.targets - arrivals.state)
        _histogram(axes[-1, 1], answer[np.isfinite(answer)], 'state to last target [ms]')
    return figure


def robot_history(recording: Recording) -> list[StatusEvent]:
    """Statuses of the robot that state a rate, in order."""
    found = [status for name, history in recording.statuses.items() if ROBOT in name
             for status in history if status.number('rate_hz') is not None]
    return sorted(found, key=lambda status: status.time)


def _plot(axes: Axes, history: list[StatusEvent], key: str, **look: Any) -> None:
    values = [np.nan if (value := status.number(key)) is None else value for status in history]
    axes.plot([status.time for status in history], values, marker='.', markersize=3, **look)


def _histogram(axes: Axes, values: NDArray[np.float64], label: str) -> None:
    if not values.size:
        axes.set_axis_off()
        return
    largest = float(np.percentile(values, 99.9)) * 1.1 or 1.0
    axes.hist(np.clip(values, 0.0, largest), bins=80, range=(0.0, largest), color=MEDIAN)
    axes.set_yscale('log')
    axes.set(xlabel=label, ylabel='ticks')
    axes.set_title(
        f'median {np.median(values):.2f} ms, 99% {np.percentile(values, 99):.2f} ms, '
        f'largest {values.max():.1f} ms'
    )
