# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Robot, gait and inhibition of a run, from its parameters.

The analysis itself knows neither MuJoCo nor configuration files; here both are read for it.
"""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext, find_parameter
from dmp_cpg_ros.analysis.pictures import Draw
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.world import World, WorldParameters
from dmp_cpg_ros.suite import load_gait, load_gaits

Array = NDArray[np.float64]

P = TypeVar('P', bound=Parameters)

_log = logging.getLogger(__name__)


def run_context(
    parameters: Mapping[str, Any] | None, robot_file: Path | str | None = None
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
    robot, path = _robot(robot_file, find_parameter(parameters, 'robot'))
    radius = float(find_parameter(parameters, 'radius', 1.0))
    gait, gaits = _gaits(parameters)
    context = RunContext(
        robot, gait, _inhibition(parameters), radius, _world(parameters), gaits
    )
    return context, path


def picture_taker(robot_path: Path | None, world: World | None = None) -> Draw:
    """Return a function that draws poses of a robot, or says why it cannot and draws nothing."""

    def draw(positions: Array, quaternions: Array, joints: Array) -> Sequence[Any]:
        try:
            from dmp_cpg_ros.robot.camera import pose_pictures

            return pose_pictures(robot_path, positions, quaternions, joints, world=world)
        except (DmpCpgError, ImportError, AttributeError, OSError, RuntimeError) as error:
            _log.warning('no pictures: %s', error)
            return []

    return draw


def _robot(
    robot_file: Path | str | None, named: str | None
) -> tuple[RobotDescription | None, Path | None]:
    """Read the robot that walked; one that only a parameter names may be missing here."""
    try:
        from dmp_cpg_ros.robot.model_reader import load_description

        name = robot_file or named
        path = None if name is None else find_config(name)
        return load_description(path), path
    except (DmpCpgError, ImportError) as error:
        if robot_file is not None:
            raise
        _log.warning("what needs the robot's geometry is left out: %s", error)
        return None, None


def _gaits(parameters: Mapping[str, Any] | None) -> tuple[Gait | None, dict[str, Gait]]:
    """Gait that the parameters name, and all of its file."""
    name = find_parameter(parameters, 'gait')
    if name is None:
        return None, {}
    try:
        file = find_parameter(parameters, 'gaits_file', 'gaits.yaml')
        return load_gait(name, file), load_gaits(file)
    except DmpCpgError as error:
        _log.warning('phase offsets are taken from the recording: %s', error)
        return None, {}


def _inhibition(parameters: Mapping[str, Any] | None) -> InhibitionParameters:
    try:
        return _parameter_set(InhibitionParameters, parameters)
    except DmpCpgError as error:
        _log.warning('the region C is drawn with default parameters: %s', error)
        return InhibitionParameters()


def _world(parameters: Mapping[str, Any] | None) -> World:
    try:
        return _parameter_set(WorldParameters, parameters).build()
    except DmpCpgError as error:
        _log.warning('the world is taken to be flat: %s', error)
        return World()


def _parameter_set(kind: type[P], parameters: Mapping[str, Any] | None) -> P:
    """Collect the parameters of a set from wherever they stand; defaults for those that do not."""
    values = {
        field.name: find_parameter(parameters, field.name) for field in dataclasses.fields(kind)
    }
    return kind.from_mapping({name: value for name, value in values.items() if value is not None})
