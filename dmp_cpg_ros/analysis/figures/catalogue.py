# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which figures there are, in the order of the report, and how they are written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import drawings, style
from dmp_cpg_ros.analysis.recording import Recording


class FigureEntry(NamedTuple):
    """A figure of the report.

    Attributes
    ----------
    title : str
        What it is.
    draw : callable
        From recording and context to a Figure, or None when the recording lacks what it needs.
    caption : str
        What there is to see.
    """

    title: str
    draw: Callable[[Recording, RunContext], Figure | None]
    caption: str

    @property
    def name(self) -> str:
        """That of its file, without ending."""
        return self.draw.__name__


CATALOGUE = (
    FigureEntry('Target kinematics', drawings.target_kinematics,
        'Targets of the hips and the knees across a stop by sparse inhibition and the start '
        'after it. One oscillator is inhibited; the targets of all legs should come to rest and '
        'resume without a kick.'),
    FigureEntry('Canonical states', drawings.canonical_states,
        'The four oscillators across the addition and the removal of sparse inhibition. Only the '
        'inhibited leg feels it; the coupling brings the other three to rest near their places.'),
    FigureEntry('Phase portrait', drawings.phase_portrait,
        'The first stop in the plane of the oscillators. Left: the inhibited oscillator runs on '
        'its limit cycle until inhibition is armed and it enters the region C, where it is held '
        'near its target. Middle: close-up of C; the small distance at which it rests is the '
        'pull of the other oscillators over the gain. Right: all four legs; dots mark where they '
        'rest, rings their places in the gait.'),
    FigureEntry('Footfall', drawings.footfall,
        'Bars mark feet on the ground, measured (solid) over planned (pale). Top: a few cycles '
        'of steady walking. Bottom: the first stop and the start after it; at rest all four bars '
        'should be unbroken.'),
    FigureEntry('Path', drawings.path,
        'The base from above. Small dots are footholds, one for each stance; squares mark where '
        'the robot stood still, arrows its heading every two seconds.'),
    FigureEntry('Speed tracking', drawings.speed_tracking,
        'As commanded, as filtered by the reference system, and as measured; the pale line is '
        'every sample, the bold one the mean over a gait cycle. While a stop is requested the '
        'reference goes to zero whatever the command.'),
    FigureEntry('Body attitude', drawings.attitude,
        'Roll and pitch, height over the ground and yaw of the base. The dashed lines are what '
        'is asked for: the standing height, and the integral of the reference turn rate.'),
    FigureEntry('Estimate of the body', drawings.estimation,
        'What the robot believes of its motion, from gyroscope, accelerometer, joints and '
        "contacts, minus the simulator's truth: velocity in the base, tilt, and yaw, which "
        'nothing it has can correct.'),
    FigureEntry('Joint torques', drawings.torques,
        'Left: three cycles of steady walking; grey lines are the limits where they are in view. '
        'Right: the whole run as share of the limit; bars reach to the 99th percentile, ticks '
        'mark the largest value.'),
    FigureEntry('Timing', drawings.timing,
        'Top: what the robot measured of itself, control rate and latency from a state to the '
        'last of the four targets that answer it. Bottom, where the recording bears wall time: '
        'how far apart the states reached the recorder, and how long after a state the last '
        'target of its tick did.'),
)


def write_figures(recording: Recording, context: RunContext, folder: Path) -> dict[str, Path]:
    """Draw and write ``NAME.png`` for each figure that the recording allows.

    Returns
    -------
    dict of str to Path
        The files by the figures' names, in order.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for entry in CATALOGUE:
        with style.applied():
            figure = entry.draw(recording, context)
            if figure is not None:
                written[entry.name] = folder / f'{entry.name}.png'
                FigureCanvasAgg(figure).print_png(written[entry.name])
    return written
