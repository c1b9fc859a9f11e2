# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``film``: a recorded run as a GIF (always) or an MP4 (with imageio-ffmpeg), drawn after it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.motion import held, smoothed, velocity_in_heading
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.analysis.strict_json import read_json
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import (
    RosArguments,
    number,
    run_command,
    whole_within,
    within,
)
from dmp_cpg_ros.commands.run_folder import run_context
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.files import replacing, writable
from dmp_cpg_ros.robot.camera import Camera

Frame = NDArray[np.uint8]

LOOK_WINDOW, SPEED_WINDOW = 1.2, 0.8
"""The camera follows the path, and the speed is shown, averaged over this [s]."""

INK, OUTLINE = (255, 255, 255), (30, 40, 55)
"""Colours of the words."""

PALETTE_FRAMES, COLOURS = 6, 128
"""Frames from which a GIF takes its colours, and their number; one palette for all frames keeps
what stands still from flickering.
"""

ENCODER, MP4_QUALITY = 'imageio_ffmpeg', 7
"""The module that encodes MP4, and the quality, from 0 to 10."""

RATES, WIDTHS = (0.1, 240.0), (32, 3840)
"""Frames per second and widths [pixels] that may be asked for, least and most."""


@dataclass(frozen=True)
class Shot:
    """What to film.

    Attributes
    ----------
    start, end : float
        On the robot's clock [s].
    fps : float
        Frames per second, at the robot's own pace.
    width, height : int
        [pixels]
    """

    start: float = -np.inf
    end: float = np.inf
    fps: float = 20.0
    width: int = 640
    height: int = 360


def film(recording: Recording, context: RunContext, robot_file: Path | None, path: Path,
         shot: Shot | None = None, tell: Callable[[str], None] = lambda text: None) -> int:
    """Draw a recording and write it; returns the number of frames.

    Parameters
    ----------
    recording : Recording
        Needs joints and odometry.
    context : RunContext
        The world that was walked in.
    robot_file : Path or None
        The robot; None is the package's own.
    path : Path
        ``.gif`` or ``.mp4``.
    shot : Shot, optional
        What to film; all of it without.
    tell : callable (str), optional
        Is told how far it is.

    Raises
    ------
    DataError
        If nothing was recorded in the time.
    RobotError
        If OpenGL cannot draw here.
    ParameterError
        If the file cannot be written in this format here.
    """
    shot = shot or Shot()
    checked_film_path(path)
    odometry, joints = recording.odometry, recording.joints
    if not (odometry.time.size and joints.time.size):
        raise DataError('a film needs recorded joint_states and ground_truth or odom')
    first = max(odometry.time[0], joints.time[0], shot.start)
    last = min(odometry.time[-1], joints.time[-1], shot.end)
    times = np.arange(first, last + 1e-9, 1.0 / shot.fps)
    if not times.size:
        raise DataError(f'nothing was recorded between {shot.start} s and {shot.end} s; the '
                        f'recording is from {odometry.time[0]:g} s to {odometry.time[-1]:g} s')
    with Camera(robot_file, shot.width, shot.height, context.world, plain=True) as camera:
        draw = _painter(recording, camera, shot.height)
        sample = [draw(t) for t in np.linspace(first, last, min(PALETTE_FRAMES, len(times)))]
        write_film(path, _told(map(draw, times), len(times), tell), sample, shot.fps)
    return len(times)


def _told(frames: Iterator[Frame], count: int, tell: Callable[[str], None]) -> Iterator[Frame]:
    for drawn, frame in enumerate(frames, 1):
        tell(f'drawing: {drawn} of {count} frames')
        yield frame


def _painter(recording: Recording, camera: Camera, height: int) -> Callable[[float], Frame]:
    """Return what draws the recording at a time [s], with its state and speed written on it."""
    odometry, joints = recording.odometry, recording.joints
    moving = (odometry.position_in_world, odometry.quaternion,
              smoothed(odometry.time, odometry.position_in_world, LOOK_WINDOW),
              smoothed(odometry.time, velocity_in_heading(odometry)[:, :1], SPEED_WINDOW))
    file = Path(matplotlib.get_data_path()) / 'fonts' / 'ttf' / 'DejaVuSans-Bold.ttf'
    font, margin = ImageFont.truetype(str(file), max(height // 18, 11)), height // 24

    def draw(time: float) -> Frame:
        at = np.array([time])
        place, quaternion, look, speed = (held(odometry.time, values, at)[0] for values in moving)
        angles = held(joints.time, joints.position, at)[0]
        picture = Image.fromarray(camera.drawn(place, quaternion, angles, look_at=look))
        words = [event.message for event in recording.inhibition if event.time <= time]
        left = (words[-1] if words else '').replace('_', ' ')
        right = f'{round(float(speed[0]), 2) + 0.0:.2f} m/s   {time:.1f} s'
        pen = ImageDraw.Draw(picture)
        end = picture.width - margin - pen.textlength(right, font=font)
        for x, text in ((margin, left), (end, right)):
            pen.text((x, margin), text, font=font, fill=INK, stroke_width=2, stroke_fill=OUTLINE)
        return np.asarray(picture, dtype=np.uint8)

    return draw


def film_run(run: Path, path: Path, shot: Shot | None = None,
             tell: Callable[[str], None] = lambda text: None) -> int:
    """Film a run's folder, with the robot and the world that its manifest names; see :func:`film`.

    Raises
    ------
    DmpCpgError
        If there is no readable bag, or as :func:`film`.
    """
    parameters = read_json(run / 'manifest.json').get('parameters')
    context, robot_file = run_context(parameters)
    recording = load_recording(run, joint_names=context.joint_names, tell=tell)
    return film(recording, context, robot_file, path, shot, tell)


def has_encoder() -> bool:
    """Whether MP4 can be written."""
    return find_spec(ENCODER) is not None


def checked_film_path(path: Path) -> Path:
    """Return a film's path, or say why it cannot be written.

    Raises
    ------
    ParameterError
        If its ending is neither ``.gif`` nor ``.mp4``, or nothing here encodes MP4.
    MissingFileError
        If it is no file to write.
    """
    if path.suffix.lower() not in ('.gif', '.mp4'):
        raise ParameterError(f"a film must end in .gif or .mp4, not '{path.name}'")
    if path.suffix.lower() == '.mp4' and not has_encoder():
        raise ParameterError(
            f"'{path.name}' needs an encoder: pip install imageio-ffmpeg; a .gif needs none")
    return writable(path)


def write_film(path: Path, frames: Iterator[Frame], palette_from: list[Frame], fps: float) -> None:
    """Write frames as they come; the film is there when it is whole.

    Parameters
    ----------
    path : Path
        Ends in ``.gif`` or ``.mp4``.
    frames : iterator of ndarray (height, width, 3) of uint8
        At least one, all of one size.
    palette_from : list of ndarray
        Frames that have the colours of the film, for a GIF.
    fps : float
        Frames per second.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as new:
        (_write_gif if path.suffix.lower() == '.gif' else _write_mp4)(
            new, frames, palette_from, fps)


def _write_gif(path: Path, frames: Iterator[Frame], palette_from: list[Frame], fps: float) -> None:
    palette = Image.fromarray(np.concatenate(palette_from)).quantize(
        COLOURS, Image.Quantize.MAXCOVERAGE)
    pictures = (Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
                for frame in frames)
    next(pictures).save(path, save_all=True, append_images=pictures, loop=0,
                        duration=max(round(1000.0 / fps), 20), optimize=False)


def _write_mp4(path: Path, frames: Iterator[Frame], _: list[Frame], fps: float) -> None:
    import imageio_ffmpeg

    first = next(frames)
    writer = imageio_ffmpeg.write_frames(
        str(path), first.shape[1::-1], fps=fps, quality=MP4_QUALITY, macro_block_size=2,
        ffmpeg_log_level='error')
    writer.send(None)
    for frame in chain([first], frames):
        writer.send(np.ascontiguousarray(frame))
    writer.close()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog='film', description="Draw a recorded run as a film, from the run's folder.")
    add = parser.add_argument
    add('run', metavar='RUN', type=Path, help="a run's folder, with bag/ inside")
    add('film', metavar='FILE', type=Path,
        help='FILE.gif, or FILE.mp4 when imageio-ffmpeg is installed')
    add('--start', metavar='S', type=number, default=Shot.start,
        help="begin, on the robot's clock")
    add('--end', metavar='S', type=number, default=Shot.end, help='end')
    add('--fps', metavar='HZ', type=within(*RATES), default=Shot.fps,
        help='frames per second, {:g} to {:g} (default: %(default)g)'.format(*RATES))
    add('--width', metavar='PIXELS', type=whole_within(*WIDTHS), default=Shot.width,
        help='width, {} to {}, of 16:9 (default: %(default)s)'.format(*WIDTHS))
    return run_command(parser, arguments, _film)


def _film(options: argparse.Namespace, _: RosArguments) -> int:
    checked_film_path(options.film)
    height = 2 * round(options.width * 9 / 32)
    shot = Shot(options.start, options.end, options.fps, options.width, height)
    frames = film_run(options.run, options.film, shot, Progress())
    print(f'{options.film}: {frames} frames, {options.film.stat().st_size / 1e6:.2f} MB')
    return 0


if __name__ == '__main__':
    sys.exit(main())
