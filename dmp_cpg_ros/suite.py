# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A parameter file as the nodes read it, for everything that runs without ROS."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dmp_cpg_ros.configuration import find_config, load_yaml, node_parameters
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.core.gait import Gait
from dmp_cpg_ros.core.gait_network import CanonicalParameters
from dmp_cpg_ros.core.inhibition import InhibitionParameters
from dmp_cpg_ros.core.leg_primitive import LegParameters
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.posture import PostureParameters
from dmp_cpg_ros.core.reference import ReferenceParameters
from dmp_cpg_ros.core.robot_state import LEGS
from dmp_cpg_ros.core.suite_parameters import NODE_PARAMETERS, MujocoRobotParameters, SuiteParameters

DEFAULT_FILE = 'suite.yaml'
"""Parameter file of the package, in the config folder."""


@dataclass(frozen=True)
class Suite:
    """What a parameter file says.

    Attributes
    ----------
    parameters : SuiteParameters
        Parameters of the parts.
    gait : Gait
        The gait that is named.
    robot : MujocoRobotParameters
        Parameters of the robot.
    robot_file : Path
        The robot file that is named.
    file : Path
        The parameter file itself.
    """

    parameters: SuiteParameters
    gait: Gait
    robot: MujocoRobotParameters
    robot_file: Path
    file: Path


def load_gaits(name: str | Path = 'gaits.yaml') -> dict[str, Gait]:
    """Read all gaits of a file.

    Parameters
    ----------
    name : str or Path
        File in the config folder, or by its path.

    Returns
    -------
    dict of str → Gait

    Raises
    ------
    MissingFileError, DataError, ParameterError
        If the file is not there, is not YAML, or a gait is impossible.
    """
    path = find_config(name)
    gaits = load_yaml(path).get('gaits')
    if not isinstance(gaits, Mapping) or not gaits:
        raise ParameterError(f"'{path}' must have a mapping 'gaits'")
    return {key: Gait.from_mapping(key, values) for key, values in gaits.items()}


def load_gait(name: str, file: str | Path = 'gaits.yaml') -> Gait:
    """Read one gait; raises ParameterError with the valid names when it is not there."""
    gaits = load_gaits(file)
    if name not in gaits:
        raise ParameterError(f"there is no gait '{name}'; valid are {', '.join(gaits)}")
    return gaits[name]


def load_suite(file: str | Path | None = None, overrides: Mapping[str, Any] | None = None) -> Suite:
    """Read a parameter file.

    Parameters
    ----------
    file : str or Path, optional
        ROS 2 parameter file in the config folder or by its path; the package's own without.
    overrides : mapping, optional
        Values by parameter name that hold for every node that has the parameter.

    Returns
    -------
    Suite

    Raises
    ------
    DmpCpgError
        If the file is not there, or a name or value in it is wrong; the text says where and what is valid.
    """
    path = find_config(file or DEFAULT_FILE)
    overrides = dict(overrides or {})
    sets = {kind: node_set(path, kind, overrides) for kind in NODE_PARAMETERS}
    every_name = {field.name for cls in NODE_PARAMETERS.values() for field in dataclasses.fields(cls)}
    unknown = [name for name in overrides if name not in every_name]
    if unknown:
        raise ParameterError(f"there is no parameter '{unknown[0]}'; valid are {', '.join(sorted(every_name))}")
    canonical, robot = sets['canonical_oscillators'], sets['mujoco_robot']
    assert isinstance(robot, MujocoRobotParameters)
    parameters = SuiteParameters(
        _part(sets['reference_filter'], ReferenceParameters), _part(canonical, CanonicalParameters),
        _part(sets['inhibition'], InhibitionParameters), _part(sets['leg_transformation'], LegParameters),
        _part(sets['posture_control'], PostureParameters))
    values = dataclasses.asdict(canonical)
    return Suite(parameters, load_gait(values['gait'], values['gaits_file']), robot, find_config(robot.robot),
                 path)


def node_set(path: Path, kind: str, overrides: Mapping[str, Any] | None = None) -> Parameters:
    """Parameter set of one kind of node from a parameter file.

    Values for other nodes under ``/**`` are left aside; names that no node has are errors. The legs'
    own sections ``leg_fl`` … must agree, since one set stands for the four.

    Raises
    ------
    DmpCpgError
        As :func:`load_suite`.
    """
    cls = NODE_PARAMETERS[kind]
    names = {field.name for field in dataclasses.fields(cls)}
    every_name = {field.name for other in NODE_PARAMETERS.values() for field in dataclasses.fields(other)}
    node = f'leg_{LEGS[0]}' if kind == 'leg_transformation' else kind
    values: dict[str, Any] = {}
    for name, value in node_parameters(path, node).items():
        if name in names:
            values[name] = value
        elif name not in every_name and name not in NODE_NAMES:
            raise ParameterError(f"'{path}', {node}: there is no parameter '{name}'; valid are "
                                 f"{', '.join(sorted(names))}")
    values.update({name: value for name, value in (overrides or {}).items() if name in names})
    try:
        return cls.from_mapping(values, f"'{path}', {node}")
    except DmpCpgError as error:
        raise ParameterError(f"'{path}', {node}: {error}") from error


NODE_NAMES = ('autostart', 'executor', 'use_sim_time', 'storage', 'output', 'topics', 'flush_period')
"""Parameters that nodes have as nodes, not for their part of the core."""


def _part(values: Parameters, cls: type[Any]) -> Any:
    """The fields of one part out of a node's set."""
    return cls(**{field.name: getattr(values, field.name) for field in dataclasses.fields(cls)})
