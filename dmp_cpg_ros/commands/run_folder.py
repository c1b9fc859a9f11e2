# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run's folder: ``runs/<time>/`` with the parameters of every node, and what they say later.

The analysis itself knows neither MuJoCo nor configuration files; here both are read for it.
"""

from __future__ import annotations

import dataclasses
import datetime
import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from dmp_cpg_ros.analysis.context import RunContext, find_parameter
from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.world import WorldParameters
from dmp_cpg_ros.files import numbered
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite import load_gait, load_gaits, node_sets
from dmp_cpg_ros.suite_table import RECORDER, instances

if TYPE_CHECKING:
    from dmp_cpg_ros.analysis.run import Draw

_log = logging.getLogger(__name__)


def make_run_folder(out: Path | None) -> Path:
    """Make the folder of a new run.

    Parameters
    ----------
    out : Path, optional
        The folder itself; must not exist or be empty. Without, a new one in ``runs`` that
        ``runs/latest`` points at.

    Raises
    ------
    DataError
        If ``out`` holds something or cannot be made.
    """
    try:
        if out is not None:
            if out.exists() and (not out.is_dir() or any(out.iterdir())):
                raise DataError(
                    f"'{out}' exists and is not an empty folder; name another with --out")
            out.mkdir(parents=True, exist_ok=True)
            return out.resolve()
        runs = Path('runs')
        runs.mkdir(exist_ok=True)
        for folder in numbered(runs / datetime.datetime.now().strftime('%Y-%m-%d_%H-%M-%S')):
            with suppress(FileExistsError):  # perhaps of another walk that starts now
                folder.mkdir()
                break
        latest, link = runs / 'latest', runs / f'.latest_{folder.name}'
        if latest.is_symlink() or not latest.exists():
            link.symlink_to(folder.name, target_is_directory=True)
            link.replace(latest)
        return folder.resolve()
    except OSError as error:
        raise DataError(f'cannot make the folder of the run: {error}') from error


def resolved_parameters(file: Path, overrides: Mapping[str, Any], namespace: str = ''
                        ) -> dict[str, dict[str, Any]]:
    """Every parameter of every node that walks by node name, as it will run.

    Parameters
    ----------
    file : Path
        Parameter file.
    overrides : mapping
        Values by name that hold for every node that has the parameter.
    namespace : str
        Namespace of the nodes.

    Returns
    -------
    dict of node name → dict of parameter → value
    """
    resolved: dict[str, dict[str, Any]] = {}
    content = load_yaml(file)
    for kind, name, own in instances():
        if kind.name != RECORDER:
            sets = node_sets(file, kind.name, overrides, namespace, name, content)
            resolved[name] = {
                key: list(value) if isinstance(value, tuple) else value
                for part in reversed(sets.values())
                for key, value in dataclasses.asdict(part).items()} | dict(own)
    return resolved


def write_parameters(folder: Path, resolved: Mapping[str, Mapping[str, Any]]) -> Path:
    """Write ``parameters.yaml``, which all processes of the run read, in any namespace."""
    path = folder / 'parameters.yaml'
    content = {f'/**/{name}': {'ros__parameters': values} for name, values in resolved.items()}
    path.write_text('# Parameters of every node of this run.\n'
                    + yaml.safe_dump(content, sort_keys=False), encoding='utf-8')
    return path


def run_of(bag: Path, given: Path) -> Path | None:
    """Run's folder around a bag; None for a bare bag."""
    if bag == given / 'bag':
        return given
    folder = bag.resolve() if bag.is_dir() else bag.resolve().parent
    is_run = folder.name == 'bag' and (folder.parent / 'manifest.json').is_file()
    return folder.parent if is_run else None


def run_context(parameters: Mapping[str, Any] | None, robot_file: Path | str | None = None
                ) -> tuple[RunContext, Path | None]:
    """Find out what walked.

    Parameters
    ----------
    parameters : mapping or None
        Parameters of the nodes, nested as they like.
    robot_file : path-like, optional
        Overrides the robot that the parameters name.

    Returns
    -------
    context : RunContext
        Without robot or gait where the parameters name a file that is not here; a warning says so.
    robot_path : Path or None
        The robot's file, None for the package's own.

    Raises
    ------
    MissingFileError, ParameterError
        If ``robot_file`` cannot be used.
    """
    named, name = find_parameter(parameters, 'robot'), find_parameter(parameters, 'gait')
    file = find_parameter(parameters, 'gaits_file', 'gaits.yaml')
    robot, path = _robot(robot_file) if robot_file is not None else _read_or(
        (None, None), "what needs the robot's geometry is left out", lambda: _robot(named))
    gait, gaits = (None, {}) if name is None else _read_or(
        (None, {}), 'phase offsets are taken from the recording',
        lambda: (load_gait(name, file), load_gaits(file)))
    inhibition = _read_or(
        InhibitionParameters(), 'the region C is drawn with default parameters',
        lambda: _parameter_set(InhibitionParameters, parameters))
    world = _read_or(World(), 'the world is taken to be flat',
                     lambda: _parameter_set(WorldParameters, parameters).build())
    radius = _read_or(1.0, 'the radius is taken to be 1', lambda: CanonicalParameters(
        radius=find_parameter(parameters, 'radius', 1.0)).radius)
    return RunContext(robot, gait, inhibition, radius, world, gaits), path


def picture_taker(robot_path: Path | None, world: World | None = None) -> Draw:
    """Return a function that draws poses of a robot, or says why it cannot and draws nothing."""

    def draw(positions: Any, quaternions: Any, joints: Any) -> Sequence[Any]:
        try:
            from dmp_cpg_ros.robot.camera import pose_pictures

            return pose_pictures(robot_path, positions, quaternions, joints, world=world)
        except (DmpCpgError, ImportError, AttributeError, OSError, RuntimeError) as error:
            _log.warning('no pictures: %s', error)
            return []

    return draw


def _robot(name: Path | str | None) -> tuple[RobotDescription, Path | None]:
    from dmp_cpg_ros.robot.model_reader import load_description

    path = None if name is None else find_config(name, ROBOTS)
    return load_description(path), path


def _read_or(usual: Any, without: str, read: Callable[[], Any]) -> Any:
    """Return what is read, or what is usual after a warning that says what is done without."""
    try:
        return read()
    except (DmpCpgError, ImportError) as error:
        _log.warning('%s: %s', without, error)
        return usual


def _parameter_set(kind: type[Any], parameters: Mapping[str, Any] | None) -> Any:
    """Collect the parameters of a set from wherever they stand; defaults for those that do not."""
    values = {field.name: find_parameter(parameters, field.name)
              for field in dataclasses.fields(kind)}
    return kind.from_mapping({name: value for name, value in values.items() if value is not None})
