# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a bag to a run's folder: metrics, manifest, figures, pictures and report.

Pictures show the robot at telling moments. Who draws is handed in: this layer knows poses, the
robot's layer knows how the robot looks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import MOVING, requested_stops, steady_segments
from dmp_cpg_ros.analysis.metrics.summary import compute_metrics
from dmp_cpg_ros.analysis.motion import held, roll_pitch_yaw, stretches
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.analysis.strict_json import plain, read_json, write_json
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.files import writable

Draw = Callable[[Array, Array, Array], Sequence[NDArray[np.uint8]]]
"""From base positions (n, 3), quaternions (n, 4), joint positions (n, 12) to pictures, or none."""

NEAR_FOOT = LEGS.index('fr')
"""Front foot on the side from which pictures are taken."""

FEWEST_SAMPLES = 3
"""Shorter losses of contact are no swings."""


class Moment(NamedTuple):
    """A time that is worth a picture.

    Attributes
    ----------
    name : str
        Of the file, without ending.
    caption : str
        What it shows.
    time : float
        [s]
    """

    name: str
    caption: str
    time: float


def moments(recording: Recording, context: RunContext) -> list[Moment]:
    """Walking straight on with a foot in the air, at rest, turning; those that happened."""
    reference, found = recording.reference, []
    steady = [(*held(reference.time, reference.value, start)[[0, 2]], start, end)
              for start, end in steady_segments(recording)]
    straight = next((of for of in steady if abs(of[1]) < MOVING), None)
    if straight:
        time = _foot_in_the_air(recording, context, *straight[2:])
        caption = f'Walking at {straight[0]:.2f} m/s (t = {time:.2f} s)'
        found.append(Moment('walking', caption, time))
    stop = next((stop for stop in requested_stops(recording)
                 if stop.events[-1].message == 'at_rest'), None)
    if stop:
        time = 0.5 * (stop.events[-1].time + stop.end)
        found.append(Moment('at_rest', f'At rest under inhibition (t = {time:.2f} s)', time))
    fastest = max(steady, key=lambda of: abs(of[1]), default=None)
    if fastest and abs(fastest[1]) >= MOVING:
        time = _foot_in_the_air(recording, context, *fastest[2:])
        caption = f'Turning at {fastest[1]:.2f} rad/s (t = {time:.2f} s)'
        found.append(Moment('turning', caption, time))
    return found


Pose = tuple[Array, Array, Array]


def _scenes(recording: Recording, context: RunContext) -> list[tuple[Moment, Pose]]:
    """Moments and poses of the pictures."""
    if not (recording.joints.time.size and recording.odometry.time.size):
        return []
    return [(moment, _pose(recording, moment.time, context.world.is_flat))
            for moment in moments(recording, context)]


def _draw_pictures(scenes: Sequence[tuple[Moment, Pose]], folder: Path, draw: Draw,
                   ) -> dict[str, tuple[Path, str]]:
    """Write the moments as ``NAME.png``; files and captions by name, none where none is drawn."""
    from matplotlib import image

    if not scenes:
        return {}
    pictures = draw(*(np.array(part) for part in zip(*(pose for _, pose in scenes), strict=True)))
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for (moment, _), picture in zip(scenes, pictures, strict=False):
        path = writable(folder / f'{moment.name}.png')
        image.imsave(path, picture)
        written[moment.name] = (path, moment.caption)
    return written


def _pose(recording: Recording, time: float, turn: bool) -> Pose:
    """Pose at a time; on a flat floor turned to face along x, so that every picture is taken from
    the same side.
    """
    odometry, joints = recording.odometry, recording.joints
    row = min(int(np.searchsorted(odometry.time, time)), len(odometry.time) - 1)
    position = odometry.position_in_world[row].copy()
    angles = held(joints.time, joints.position, time).copy()
    if not turn:
        return position, odometry.quaternion[row].copy(), angles
    quaternion = odometry.quaternion[row : row + 1]
    yaw = float(roll_pitch_yaw(quaternion)[0, 2])
    x, y, z, w = quaternion[0]
    s, c = np.sin(-0.5 * yaw), np.cos(-0.5 * yaw)
    turned = np.array([c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z])
    return position * np.array([0.0, 0.0, 1.0]), turned, angles


def _foot_in_the_air(recording: Recording, context: RunContext, start: float, end: float) -> float:
    """Middle of a swing of the near front foot, about the middle of an interval [s]."""
    middle, feet = 0.5 * (start + end), recording.feet
    inside = (feet.time >= start) & (feet.time <= end)
    swings = stretches(inside & (feet.force[:, NEAR_FOOT] <= context.contact_force))
    middles = [float(feet.time[(first + past) // 2]) for first, past in swings
               if past - first > FEWEST_SAMPLES]
    return min(middles, key=lambda time: abs(time - middle), default=middle)


@dataclass(frozen=True)
class RunResults:
    """What an analysis found and wrote.

    Attributes
    ----------
    folder : Path
        Where everything is.
    metrics, manifest : dict
        As in ``metrics.json`` and ``manifest.json``.
    report : Path or None
        None when no report was asked for.
    pictures : dict of str to (Path, str)
        PNG files and captions by name.
    """

    folder: Path
    metrics: dict[str, Any]
    manifest: dict[str, Any]
    report: Path | None = None
    pictures: dict[str, tuple[Path, str]] = field(default_factory=dict)


def write_results(
        folder: Path, recording: Recording, context: RunContext, manifest: Mapping[str, Any],
        certificate: Sequence[Any] | None = None, draw: Draw | None = None,
        report: bool = True, tell: Callable[[str], None] = lambda text: None) -> RunResults:
    """Write everything that a run's folder holds besides its bag.

    Parameters
    ----------
    folder : Path
        Made when missing.
    recording : Recording
        The run.
    context : RunContext
        What is known besides.
    manifest : mapping
        As from :func:`~dmp_cpg_ros.analysis.manifest.build_manifest`; written as
        ``manifest.json`` unless that is what it says already.
    certificate : sequence, optional
        The inequalities, passed through.
    draw : callable, optional
        Draws the robot (see :mod:`dmp_cpg_ros.analysis.run`); no pictures without.
    report : bool
        Whether to draw figures and write the report; the two JSON files are written in any case,
        and first.
    tell : callable (str), optional
        Is told how far it is.

    Returns
    -------
    RunResults
    """
    folder.mkdir(parents=True, exist_ok=True)
    tell('metrics')
    metrics: dict[str, Any] = plain(compute_metrics(recording, context, certificate))
    facts: dict[str, Any] = plain(manifest)
    write_json(folder / 'metrics.json', metrics)
    if read_json(folder / 'manifest.json') != facts:
        write_json(folder / 'manifest.json', facts)
    if not report:
        return RunResults(folder, metrics, facts)
    from dmp_cpg_ros.analysis.report import render, write_figures
    from dmp_cpg_ros.analysis.story import story

    tell('figures')
    figures = write_figures(recording, context, folder / 'figures')
    tell('pictures and report')
    told, headings = story(recording, metrics), _headings(recording, context, facts)
    scenes = [] if draw is None else _scenes(recording, context)
    del recording  # an hour's arrays and the drawing together would take too much memory
    pictures = {} if draw is None else _draw_pictures(scenes, folder / 'figures', draw)
    page = writable(folder / 'report.html')
    page.write_text(render(*headings, metrics, facts, figures, pictures, told), encoding='utf-8')
    return RunResults(folder, metrics, facts, page, pictures)


def _headings(recording: Recording, context: RunContext, manifest: Mapping[str, Any],
              ) -> tuple[str, str]:
    """Title and subtitle of the report."""
    scenario, (start, end) = manifest.get('scenario'), recording.span
    name = scenario.get('name') if isinstance(scenario, Mapping) else scenario
    gait = 'Walk' if context.gait is None else context.gait.name.capitalize()
    title = f'{gait}: {name}' if isinstance(name, str) and name else (
        f'{gait} with sparse inhibition')
    lock_step = manifest.get('lock_step')
    pace = [] if lock_step is None else ['lock-step' if lock_step else 'real time']
    robot = [] if context.robot is None else [context.robot.name]
    return title, ' · '.join([*robot, f'{end - start:.1f} s of robot time', *pace,
                              f'{sum(recording.counts.values()):,} messages'])
