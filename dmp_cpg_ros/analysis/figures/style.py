# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One look for all figures: sizes, colours that colour-blind readers can tell apart, shared marks.

Figures are made without pyplot: nothing is global and nothing needs a screen.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.episodes import (
    STOPPING,
    episodes,
    gait_period,
    requested_stops,
    steady_segments,
)
from dmp_cpg_ros.analysis.motion import spans, thinned
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.core.robot_model.state import LEGS

Window = tuple[float, float]
"""First and last time that are shown [s]."""

WIDTH = 7.2
"""Width of every figure [inch], that of a page."""

MOST_POINTS = 20_000
"""Points that are drawn of a line, more than can be told apart."""

DPI = 200

LEGEND_HEIGHT = 0.28
"""Strip above the panels that a legend takes [inch]."""

DEEP_BLUE, VERMILION = '#0072B2', '#D55E00'
LEG_COLOURS = dict(zip(LEGS, (DEEP_BLUE, VERMILION, '#009E73', '#CC79A7'), strict=True))
"""Okabe & Ito's palette, which keeps its contrast with every kind of colour vision."""

LEG_NAMES = dict(zip(LEGS, ('front left', 'front right', 'rear left', 'rear right'), strict=True))

INK, GREY, FRAME, MEASURED = '#222222', '#8A8A8A', '#555555', DEEP_BLUE
REFERENCE = INK
SHADES = {'stop requested': '#F6E8B1', 'inhibited': '#D9DEE4'}
BLUE, ORANGE, VIOLET, RED = '#56B4E9', '#E69F00', '#6A51A3', '#C00000'
REGION: Any = {'facecolor': '#E8EEF6', 'edgecolor': '#3B6EA8'}
DASHED = (0, (5, 2))

_PARAMETERS: Any = {
    'font.family': 'sans-serif', 'mathtext.fontset': 'dejavusans', 'font.size': 8.5,
    'axes.labelsize': 8.5, 'axes.titlesize': 8.5, 'legend.fontsize': 8.0, 'xtick.labelsize': 8.0,
    'ytick.labelsize': 8.0, 'axes.titlelocation': 'left', 'axes.titlepad': 4.0,
    'text.color': INK, 'axes.labelcolor': INK, 'xtick.labelcolor': INK, 'ytick.labelcolor': INK,
    'xtick.color': FRAME, 'ytick.color': FRAME, 'axes.edgecolor': FRAME,
    'axes.linewidth': 0.7, 'axes.spines.top': False, 'axes.spines.right': False,
    'axes.grid': True, 'grid.color': '#E4E4E4', 'grid.linewidth': 0.6, 'axes.axisbelow': True,
    'lines.linewidth': 1.2, 'legend.frameon': False, 'agg.path.chunksize': 10_000,
    'figure.facecolor': 'white', 'axes.facecolor': 'white', 'savefig.dpi': DPI, 'figure.dpi': DPI,
}


@contextmanager
def applied() -> Iterator[None]:
    """Make and save figures in this context, whatever matplotlibrc the user has."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_PARAMETERS)
        yield


def new_figure(
        height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    """Figure of page width and its axes, ndarray (rows, columns).

    Parameters
    ----------
    height : float
        [inch]
    rows, columns : int
        Panels.
    **options
        For :meth:`matplotlib.figure.Figure.subplots`.
    """
    figure = Figure(figsize=(WIDTH, height), layout='constrained')
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def time_panels(recording: Recording, height: float, labels: Sequence[str],
                window: Window | None = None) -> tuple[Figure, list[Axes], list[Patch]]:
    """Panels over one time axis, in which stops are shaded.

    Parameters
    ----------
    recording : Recording
        The run.
    height : float
        Of the figure [inch].
    labels : sequence of str
        One per panel, of its y axis.
    window : (float, float), optional
        Times that are shown [s]; all without.

    Returns
    -------
    Figure, list of Axes, list of Patch
        The last are handles of the shades for the legend.
    """
    figure, axes = new_figure(height, len(labels), sharex=True)
    panels, shades = list(axes[:, 0]), []
    for panel, label in zip(panels, labels, strict=True):
        shades = shade_stops(panel, recording)
        panel.set_ylabel(label)
        limit_view(panel, window or recording.span)
    panels[-1].set_xlabel('time [s]')
    figure.align_ylabels()
    return figure, panels, shades


def line(axes: Axes, time: Array, values: Array, **look: Any) -> None:
    """Draw values (n,) over time (n,)."""
    axes.plot(*thinned(time, values, MOST_POINTS), **look)


def plot_lines(axes: Axes, time: Array, values: Array,
               colours: Iterable[str] = LEG_COLOURS.values(), **look: Any) -> None:
    """Draw a line per column of values (n, k) over time (n,), in the colours of the legs."""
    for colour, column in zip(colours, values.T, strict=False):
        line(axes, time, column, color=colour, **look)


def leg_rows(axes: Axes) -> None:
    """Lay out one row per leg, fl at the top: leg i is at y = 3 - i."""
    axes.set_yticks(range(len(LEGS)), [LEG_NAMES[leg] for leg in reversed(LEGS)])
    axes.set_ylim(-0.6, len(LEGS) - 0.4)
    axes.grid(visible=False, axis='y')


def leg_bars(axes: Axes, time: Array, masks: NDArray[np.bool_], height: float, **look: Any,
             ) -> None:
    """Draw a bar in the row of each leg while its mask (n, 4) holds at the times (n,)."""
    for row, (leg, mask) in enumerate(zip(LEGS, masks.T, strict=True)):
        bars = [(start, end - start) for start, end in spans(time, mask)]
        axes.broken_barh(bars, (len(LEGS) - 1 - row - 0.5 * height, height),
                         facecolor=LEG_COLOURS[leg], linewidth=0, **look)


def key(label: str, **look: Any) -> Line2D:
    """Handle of a legend for what looks like that."""
    return Line2D([], [], label=label, **look)


def keys(labels: Sequence[str], colours: Iterable[str]) -> list[Line2D]:
    """Handles of a legend for lines of some colours."""
    return [key(label, color=colour) for label, colour in zip(labels, colours, strict=True)]


def legend(figure: Figure, handles: Sequence[Any]) -> Figure:
    """Put a legend in one row above the panels; returns the figure."""
    height = LEGEND_HEIGHT / figure.get_figheight()
    figure.set_layout_engine('constrained', rect=(0.0, 0.0, 1.0, 1.0 - height))
    figure.legend(handles=list(handles), loc='upper center', ncols=len(handles),
                  columnspacing=1.3, handlelength=1.6, handletextpad=0.5, borderaxespad=0.3)
    return figure


def leg_legend(figure: Figure, extra: Sequence[Any] = ()) -> Figure:
    """Put a legend of the four legs, and more handles, above the panels; returns the figure."""
    return legend(figure, [*keys(tuple(LEG_NAMES.values()), LEG_COLOURS.values()), *extra])


def shade_stops(axes: Axes, recording: Recording) -> list[Patch]:
    """Shade requested stops and inhibition; returns handles for the legend."""
    shown = set()
    for stop in episodes(recording, STOPPING):
        times = (stop.start, stop.captured, stop.end)
        for label, start, end in zip(SHADES, times, times[1:], strict=False):
            if end > start:
                axes.axvspan(start, end, color=SHADES[label], linewidth=0, zorder=0)
                shown.add(label)
    return [Patch(color=SHADES[label], label=label) for label in SHADES if label in shown]


def limit_view(axes: Axes, window: Window) -> None:
    """Show a time window [s] without margins."""
    axes.set_xlim(*window)
    axes.margins(x=0.0)


def stop_window(recording: Recording, around: float = 2.5, longest: float = 14.0) -> Window:
    """Window around the first stop that was asked for, up to the walking after it [s].

    Without a stop it is the end of the recording.
    """
    first, last = recording.span
    for stop in requested_stops(recording):
        start = max(first, stop.start - around)
        return start, min(last, stop.end + around, start + longest)
    return max(first, last - 2 * around), last


def steady_window(recording: Recording, cycles: int) -> Window | None:
    """Last cycles of the first steady walking, None when there is none [s]."""
    segments, period = steady_segments(recording), gait_period(recording)
    if not segments or period is None:
        return None
    start, end = segments[0]
    return max(start, end - cycles * period), end


def rows_in(time: Array, window: Window) -> NDArray[np.bool_]:
    """Rows of a time axis in a window, boolean ndarray."""
    return (time >= window[0]) & (time <= window[1])
