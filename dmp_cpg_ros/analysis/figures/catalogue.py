# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which figures there are, in the order of the report, and how they are written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import (
    attitude,
    canonical_states,
    estimation,
    footfall,
    path,
    phase_portrait,
    speed_tracking,
    style,
    target_kinematics,
    timing,
    torques,
)
from dmp_cpg_ros.analysis.recording import Recording


@dataclass(frozen=True)
class FigureEntry:
    """A figure of the report.

    Attributes
    ----------
    name : str
        Of its file, without ending.
    title, caption : str
        What it is, and what there is to see.
    draw : callable
        From recording and context to a Figure, or None when the recording lacks what it needs.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[Recording, RunContext], Figure | None]


CATALOGUE: tuple[FigureEntry, ...] = tuple(
    FigureEntry(module.__name__.rsplit('.', 1)[-1], title, module.CAPTION, module.draw)
    for module, title in (
        (target_kinematics, 'Target kinematics'), (canonical_states, 'Canonical states'),
        (phase_portrait, 'Phase portrait'), (footfall, 'Footfall'), (path, 'Path'),
        (speed_tracking, 'Speed tracking'), (attitude, 'Body attitude'),
        (estimation, 'Estimate of the body'), (torques, 'Joint torques'), (timing, 'Timing'))
)


def write_figures(
        recording: Recording, context: RunContext, folder: Path,
        entries: Sequence[FigureEntry] = CATALOGUE) -> dict[str, Path]:
    """Draw and write ``NAME.png`` for each figure that the recording allows.

    Returns
    -------
    dict of str to Path
        The files by the figures' names, in order.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for entry in entries:
        with style.applied():
            figure = entry.draw(recording, context)
            if figure is not None:
                written[entry.name] = folder / f'{entry.name}.png'
                FigureCanvasAgg(figure).print_png(written[entry.name])
    return written
