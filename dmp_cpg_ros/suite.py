# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A parameter file as the nodes read it, for everything that runs without ROS."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dmp_cpg_ros.configuration import ROBOTS, find_config, nearest, node_parameters
from dmp_cpg_ros.core import suite_parameters as core
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.mismatch import MismatchParameters
from dmp_cpg_ros.core.robot_model.sensors import SensorParameters
from dmp_cpg_ros.core.robot_model.world import WorldParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.primitive_files import load_motion
from dmp_cpg_ros.strict_yaml import load_yaml, naming
from dmp_cpg_ros.suite_table import KINDS, LEG, RETURN_S, ROBOT, WALKING

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
    gaits : KnownGaits
        All gaits of the file that is named.
    robot : RobotParameters
        How the robot is run.
    sensors : SensorParameters
        Noise of its sensors.
    mismatch : MismatchParameters
        How it differs from the model that its controllers have.
    world : World
        What it walks on.
    tick_ns : int
        Control tick [ns].
    request_lead_s : float
        Time after which requests act, and inhibition where it is armed, in real time [s].
    robot_file : Path
        The robot file that is named.
    file : Path
        The parameter file itself.
    """

    parameters: core.SuiteParameters
    gait: Gait
    gaits: KnownGaits
    robot: core.RobotParameters
    sensors: SensorParameters
    mismatch: MismatchParameters
    world: World
    tick_ns: int
    request_lead_s: float
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
    with naming(path):
        return {key: Gait.from_mapping(key, values) for key, values in gaits.items()}


def load_gait(name: str, file: str | Path = 'gaits.yaml') -> Gait:
    """Read one gait; raises ParameterError with the valid names when it is not there."""
    return KnownGaits(load_gaits(file)).named(name)


def load_suite(file: str | Path | None = None, overrides: Mapping[str, Any] | None = None,
               namespace: str = '') -> Suite:
    """Read a parameter file.

    Parameters
    ----------
    file : str or Path, optional
        ROS 2 parameter file in the config folder or by its path; the package's own without.
    overrides : mapping, optional
        Values by parameter name that hold for every node that has the parameter.
    namespace : str
        Namespace of the nodes, which decides what sections mean them.

    Returns
    -------
    Suite

    Raises
    ------
    DmpCpgError
        If the file is not there, or a name or value in it or in the overrides is wrong; the text
        says where in the file, or neither file nor node where it is an override, and what is
        valid.
    """
    path = find_config(DEFAULT_FILE if file is None else file)
    overrides = dict(overrides or {})
    for name in overrides:
        if name not in SUITE_NAMES:
            raise ParameterError(_unknown(name))
    try:
        with naming(path):
            return _suite(path, overrides, namespace)
    except DmpCpgError as error:
        text, named = str(error), f"'{path}'"
        if not overrides or not text.startswith(named) or text == _problem(path, namespace):
            raise
        # The file is right without the overrides.
        raise type(error)(text.removeprefix(named).partition(': ')[2]) from error


def _problem(path: Path, namespace: str) -> str:
    """What is wrong in a parameter file itself; empty where nothing is."""
    try:
        load_suite(path, None, namespace)
    except DmpCpgError as error:
        return str(error)
    return ''


def _unknown(name: str) -> str:
    return (f"there is no parameter '{name}'; {nearest(name, SUITE_NAMES)}valid are "
            f'{", ".join(sorted(SUITE_NAMES))}')


def _suite(path: Path, overrides: Mapping[str, Any], namespace: str) -> Suite:
    content = load_yaml(path)
    sets = {kind.name: node_sets(path, kind.name, overrides, namespace, content=content)
            for kind in WALKING}
    canonical, robot = sets[core.CANONICAL], sets[ROBOT]
    parameters = dataclasses.replace(
        core.SuiteParameters.of(
            {part: sets[node][part] for node, parts in core.PART_OF.items() for part in parts}),
        motion=load_motion(sets[LEG][LegParameters].motion))
    gait = canonical[core.GaitParameters]
    gaits = KnownGaits(load_gaits(gait.gaits_file))
    world = core.chosen_world(robot[WorldParameters], robot[core.RobotParameters])
    return Suite(parameters, gaits.named(gait.gait), gaits, robot[core.RobotParameters],
                 robot[SensorParameters], robot[MismatchParameters], world,
                 robot[core.TickParameters].tick_ns,
                 sets[core.INHIBITION][core.RequestParameters].request_lead,
                 find_config(robot[core.RobotFileParameters].robot, ROBOTS), path)


def node_sets(path: Path, kind: str, overrides: Mapping[str, Any] | None = None,
              namespace: str = '', name: str | None = None,
              content: Mapping[str, Any] | None = None) -> dict[type[Any], Any]:
    """Parameter sets of one node from a parameter file.

    Values for other nodes under ``/**`` are left aside; names that no node has are errors.

    Parameters
    ----------
    path : Path
        Parameter file.
    kind : str
        Kind of node, a key of :data:`~dmp_cpg_ros.suite_table.KINDS`.
    overrides : mapping, optional
        Values by parameter name; names that this kind has not are left aside.
    namespace : str
        Namespace of the node.
    name : str, optional
        Its name, where there are several of the kind; the first of them without.
    content : mapping, optional
        Of the file, where it has been read already.

    Returns
    -------
    dict of class → instance

    Raises
    ------
    DmpCpgError
        As :func:`load_suite`.
    """
    node = f'{namespace.rstrip("/")}/{name or next(iter(KINDS[kind].instances))}'
    content = load_yaml(path) if content is None else content
    given = {**node_parameters(content, node, path), **(overrides or {})}
    for unknown in given.keys() - SUITE_NAMES - NODE_NAMES:
        raise ParameterError(f"'{path}', {node}: {_unknown(unknown)}")
    sets: dict[type[Any], Any] = {}
    for cls in KINDS[kind].sets:
        names = {field.name for field in dataclasses.fields(cls)}
        try:
            sets[cls] = cls(**{name: value for name, value in given.items() if name in names})
        except DmpCpgError as error:
            raise ParameterError(f"'{path}', {node}: {error}") from error
    return sets


def return_times(path: Path, nodes: Iterable[str], respawn: bool, namespace: str = ''
                 ) -> dict[str, float]:
    """``return_time`` of nodes, for those that do not have their own default [s].

    Parameters
    ----------
    path : Path
        Parameter file, which is asked first.
    nodes : iterable of str
        Names of the nodes.
    respawn : bool
        Whether nodes that die are started again: ``RETURN_S`` then, where the file says nothing.
    namespace : str
        Namespace of the nodes.

    Raises
    ------
    DataError
        If the file has no section for a node.
    """
    content, name = load_yaml(path), 'return_time'
    given = {node: node_parameters(content, f'{namespace.rstrip("/")}/{node}', path)
             for node in nodes}
    return {node: values.get(name, RETURN_S) for node, values in given.items()
            if respawn or name in values}


SUITE_NAMES = frozenset(field.name for kind in WALKING for cls in kind.sets
                        for field in dataclasses.fields(cls))
"""Names of all parameters of all parts."""

NODE_NAMES = frozenset(('autostart', 'delivery', 'executor', 'expected_nodes', 'lock_step',
                        'return_time', 'scheduling', 'use_sim_time', 'storage', 'output', 'topics',
                        'flush_period', 'drawing_rate'))
"""Parameters that nodes have as nodes, not for their part of the core."""
