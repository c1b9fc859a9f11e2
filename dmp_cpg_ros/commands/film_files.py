# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames into a GIF (always) or an MP4 (with imageio-ffmpeg)."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from dmp_cpg_ros.core.errors import ParameterError

Frame = NDArray[np.uint8]

ENCODER = 'imageio_ffmpeg'
"""The module that encodes MP4."""

COLOURS = 128
"""Colours of a GIF; one palette for all frames keeps what stands still from flickering."""

MP4_QUALITY = 7
"""From 0 to 10."""


def has_encoder() -> bool:
    """Whether MP4 can be written."""
    return find_spec(ENCODER) is not None


def checked_film_path(path: Path) -> Path:
    """Return a film's path, or say why it cannot be written.

    Raises
    ------
    ParameterError
        If its ending is neither ``.gif`` nor ``.mp4``, or nothing here encodes MP4.
    """
    if path.suffix.lower() not in ('.gif', '.mp4'):
        raise ParameterError(f"a film must end in .gif or .mp4, not '{path.name}'")
    if path.suffix.lower() == '.mp4' and not has_encoder():
        raise ParameterError(
            f"'{path.name}' needs an encoder: pip install imageio-ffmpeg; a .gif needs none")
    return path


def write_film(path: Path, frames: Iterator[Frame], palette_from: list[Frame],
               fps: float) -> None:
    """Write frames as they come.

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

    Raises
    ------
    ParameterError
        See :func:`checked_film_path`.
    """
    checked_film_path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix.lower() == '.gif':
        _write_gif(path, frames, palette_from, fps)
    else:
        _write_mp4(path, frames, fps)


def _write_gif(path: Path, frames: Iterator[Frame], palette_from: list[Frame],
               fps: float) -> None:
    sample = Image.fromarray(np.concatenate(palette_from))
    palette = sample.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)

    def reduced(frame: Frame) -> Image.Image:
        return Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)

    first = reduced(next(frames))
    first.save(path, save_all=True, append_images=map(reduced, frames), loop=0,
               duration=max(round(1000.0 / fps), 20), optimize=False)


def _write_mp4(path: Path, frames: Iterator[Frame], fps: float) -> None:
    import imageio_ffmpeg

    first = next(frames)
    height, width = first.shape[:2]
    writer = imageio_ffmpeg.write_frames(
        str(path), (width, height), fps=fps, quality=MP4_QUALITY, macro_block_size=2,
        ffmpeg_log_level='error')
    writer.send(None)
    for frame in chain([first], frames):
        writer.send(np.ascontiguousarray(frame))
    writer.close()
