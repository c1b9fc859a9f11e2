# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which figures there are, in the order of the report, and how they are written."""

from __future__ import annotations

from collections.abc import Callable
from inspect import getdoc
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import drawings, style
from dmp_cpg_ros.analysis.recording import Recording

CATALOGUE = (
    drawings.target_kinematics, drawings.canonical_states, drawings.phase_portrait,
    drawings.footfall, drawings.path, drawings.speed_tracking, drawings.attitude,
    drawings.estimation, drawings.torques, drawings.timing)


def caption(draw: Callable[..., object]) -> tuple[str, str]:
    """Title of a figure, and what there is to see: its function's docstring."""
    title, _, text = (getdoc(draw) or draw.__name__).partition('.\n\n')
    return title, ' '.join(text.split())


def write_figures(recording: Recording, context: RunContext, folder: Path) -> dict[str, Path]:
    """Draw and write ``NAME.png`` for each figure that the recording allows.

    Returns
    -------
    dict of str to Path
        The files by the figures' names, in order.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for draw in CATALOGUE:
        with style.applied():
            figure = draw(recording, context)
            if figure is not None:
                written[draw.__name__] = folder / f'{draw.__name__}.png'
                FigureCanvasAgg(figure).print_png(written[draw.__name__])
    return written
