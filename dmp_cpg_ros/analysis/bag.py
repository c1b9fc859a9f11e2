# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Opening a rosbag2 folder: sound, damaged or no bag at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.typesys import Stores, get_typestore

from dmp_cpg_ros.core.errors import DataError, MissingFileError

STORAGE_SUFFIXES = ('.mcap', '.db3')


def bag_folder(path: Path | str) -> Path:
    """Folder of the bag that a path names: itself, in a run's folder, or around a file.

    Raises
    ------
    MissingFileError
        If the path does not exist.
    DataError
        If there is no bag.
    """
    path = Path(path)
    if not path.exists():
        raise MissingFileError(
            f"'{path}' does not exist; name a rosbag2 folder or a run's folder with bag/ inside"
        )
    if path.is_file() and path.suffix in STORAGE_SUFFIXES + ('.yaml',):
        path = path.parent
    for folder in (path, path / 'bag'):
        if folder.is_dir() and (_storage_files(folder) or (folder / 'metadata.yaml').is_file()):
            return folder
    raise DataError(
        f"'{path}' holds no rosbag2 recording; valid are a folder with *.mcap or *.db3, "
        f"or a run's folder with such a folder bag/ inside"
    )


@contextmanager
def opened(folder: Path) -> Iterator[AnyReader]:
    """Reader over a bag; a bag that was not closed is rescued first.

    Parameters
    ----------
    folder : Path
        As from :func:`bag_folder`.

    Raises
    ------
    DataError
        If the bag cannot be read.
    """
    try:
        reader = _reader(folder)
    except DataError as damage:
        reader = _reader(_rescued(folder, damage))
    try:
        yield reader
    finally:
        reader.close()


def _reader(folder: Path) -> AnyReader:
    try:
        reader = AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_JAZZY))
        reader.open()
    except (AnyReaderError, OSError, AssertionError, TypeError, KeyError) as error:
        raise DataError(f"the bag '{folder}' cannot be read: {error}") from error
    return reader


def _rescued(folder: Path, damage: DataError) -> Path:
    """Folder of a readable copy of what a damaged bag still holds."""
    if not any(file.suffix == '.mcap' for file in _storage_files(folder)):
        raise damage
    try:
        from dmp_cpg_ros.analysis.rescue import rescue
    except ImportError as error:
        raise DataError(f"{damage}; rescuing it needs the package '{error.name}'") from error
    return rescue(folder)


def _storage_files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if file.suffix in STORAGE_SUFFIXES)
