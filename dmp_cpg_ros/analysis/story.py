# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The run in one figure, as SVG inside of HTML: what was commanded, how the robot walked, when it
was to stop, what was promised of the stop, and what was kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from dmp_cpg_ros.analysis import episodes, motion
from dmp_cpg_ros.analysis.recording import Array, Recording

MOST_POINTS = 6000
"""Points of a line; between them are the least and the largest value of what is left out."""

FASTEST = 1e6
"""What is more, or no number, is no speed and is not drawn [m/s]."""

CAPTION = (
    'Forward speed as commanded, as filtered by the reference, and as walked (mean over a gait '
    'cycle). Shaded: a stop was requested, then inhibition held an oscillator. Below, from each '
    'request on: promised, a line to the bound with a mark at the prediction; kept, a bar to '
    'rest, red where it is longer than its bound. Drag to zoom in time; a double click shows all.')

LANE = 0.16
"""Height below the axis in which promises are drawn, as share of the height above it."""


def story(recording: Recording, metrics: Mapping[str, Any]) -> str:
    """Figure as HTML; empty where neither speeds nor stops were recorded."""
    lines = {
        'commanded': _steps(*_sane(recording.commands.time, recording.commands.value[:, 0]),
                            recording.span[1]),
        'reference': _sane(recording.reference.time, recording.reference.value[:, 0]),
        'walked': _sane(*_walked(recording))}
    lines = {name: line for name, line in lines.items() if len(line[0]) > 1}
    stops = metrics['stop']['all']
    start, end = recording.span
    if end <= start or not (lines or stops):
        return ''
    values = np.concatenate([[0.0, 0.1], *(line[1] for line in lines.values())])
    low, high = float(values.min()), 1.05 * float(values.max())
    floor = low - 2.0 * LANE * (high - low)
    shapes = [*_shades(recording, low, high), *_promises(stops, low, (high - low) * LANE)]
    for name, (time, value) in lines.items():
        points = ' '.join(f'{t:.3f},{v:.4f}' for t, v in zip(
            *motion.thinned(time, value, MOST_POINTS), strict=True))
        shapes.append(f'<polyline class="{name}" points="{points}"/>')
    ticks = ''.join(
        f'<span class="y" style="bottom:{100 * (v - floor) / (high - floor):.2f}%">{v:g}</span>'
        for v in _ticks(low, high))
    names = [*lines, *(['stop requested', 'inhibited', 'promised', 'kept'] if stops else [])]
    legend = ''.join(f'<span class="{name.replace(" ", "-")}">{name}</span>' for name in names)
    return (f'<figure class="story"><div class="legend"><i>speed [m/s]</i>{legend}</div>'
            f'<div class="plot">{ticks}<svg viewBox="{start:.3f} {-high:.4f} {end - start:.3f} '
            f'{high - floor:.4f}" preserveAspectRatio="none"><g transform="scale(1,-1)">'
            f'<line class="zero" x1="{start:.3f}" x2="{end:.3f}" y1="0" y2="0"/>{"".join(shapes)}'
            f'</g></svg></div><div class="times">{_times(start, end)}</div>'
            f'<figcaption><b>The run.</b> {CAPTION}</figcaption></figure>')


def _walked(recording: Recording) -> tuple[Array, Array]:
    odometry = recording.odometry
    if len(odometry.time) < 3:
        return odometry.time, odometry.time
    speed = motion.velocity_in_heading(odometry)[:, 0]
    return odometry.time, motion.smoothed(
        odometry.time, speed, episodes.gait_period(recording) or 0.5)


def _sane(time: Array, value: Array) -> tuple[Array, Array]:
    """Rows whose values are speeds."""
    rows = np.abs(value) <= FASTEST
    return time[rows], value[rows]


def _steps(time: Array, value: Array, end: float) -> tuple[Array, Array]:
    """Line of values that hold until the next."""
    if not len(time):
        return time, value
    return np.append(np.repeat(time, 2)[1:], end), np.repeat(value, 2)


def _shades(recording: Recording, low: float, high: float) -> Iterable[str]:
    for stop in episodes.episodes(recording, episodes.STOPPING):
        for kind, start, end in (('stop-requested', stop.start, stop.captured),
                                 ('inhibited', stop.captured, stop.end)):
            yield _bar(kind, start, end, low, high - low)


def _promises(stops: Iterable[Mapping[str, Any]], low: float, lane: float) -> Iterable[str]:
    for stop in stops:
        request, bound, measured = (stop[key] for key in ('request_s', 'bound_s', 'measured_s'))
        if measured is not None:
            broken = ' broken' if bound is not None and measured > bound else ''
            yield _bar(f'kept{broken}', request, request + measured, low - 1.8 * lane, 0.7 * lane)
        if bound is not None:
            yield _bar('promised', request, request + bound, low - 0.75 * lane, 0.15 * lane)
        if stop['predicted_s'] is not None:
            at, bottom, top = request + stop['predicted_s'], low - lane, low - 0.4 * lane
            yield (f'<line class="promised" x1="{at:.3f}" x2="{at:.3f}" y1="{bottom:.4f}" '
                   f'y2="{top:.4f}"/>')


def _bar(kind: str, start: float, end: float, bottom: float, height: float) -> str:
    return (f'<rect class="{kind}" x="{start:.3f}" y="{bottom:.4f}" '
            f'width="{max(end - start, 0.0):.3f}" height="{height:.4f}"/>')


def _ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round numbers in an interval, about so many."""
    step = 10.0 ** np.floor(np.log10((high - low) / count))
    step *= next(factor for factor in (1, 2, 5, 10) if (high - low) / (factor * step) <= count + 1)
    return [round(float(k * step), 9) for k in range(int(np.ceil(low / step)),
                                                     int(np.floor(high / step)) + 1)]


def _times(start: float, end: float) -> str:
    """Marks below the figure, as the page's script draws them again when it zooms."""
    return ''.join(f'<span style="left:{100 * (t - start) / (end - start):.2f}%">{t:g} s</span>'
                   for t in _ticks(start, end, 8))
