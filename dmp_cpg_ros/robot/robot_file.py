# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The few lines of YAML that name a robot: its model file, joints, feet and base."""

from __future__ import annotations

import dataclasses
import importlib.resources
import importlib.util
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from dmp_cpg_ros.core.errors import MissingFileError, ParameterError
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS

Triple = tuple[float, float, float]

_REQUIRED = ('model', 'base', 'joints', 'feet')
_OPTIONAL = ('stance_height', 'kp', 'kd', 'torque_limit', 'velocity_limit')

OWN_MODEL = 'mini_quadruped.xml'


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

    def without_gains(self) -> RobotFile:
        """The same robot with a joint drive that applies torques only, for the torque reading."""
        return dataclasses.replace(self, kp=(0.0, 0.0, 0.0), kd=(0.0, 0.0, 0.0))


def own_robot_file() -> RobotFile:
    """Return what ``config/robots/mini_quadruped.yaml`` says, without looking for that file."""
    return RobotFile(
        model=find_model(OWN_MODEL, None), base='base_link',
        joints=tuple((f'{leg}_abduction', f'{leg}_hip', f'{leg}_knee') for leg in LEGS),
        feet=tuple(f'{leg}_foot' for leg in LEGS),
        kp=(60.0, 60.0, 60.0), kd=(1.8, 1.8, 1.8), velocity_limit=(40.0, 40.0, 25.7))


def load_robot_file(path: Path | str) -> RobotFile:
    """Read a robot's YAML file.

    Parameters
    ----------
    path : Path or str
        YAML file as in ``config/robots``.

    Raises
    ------
    MissingFileError
        If the file or the model that it names does not exist.
    ParameterError
        If the file is no YAML mapping, or an entry is missing, unknown or of the wrong form.
    """
    path = Path(path).expanduser()
    try:
        text = path.read_text(encoding='utf-8')
    except OSError as error:
        raise MissingFileError(f"robot file '{path}' cannot be read: {error.strerror}") from error
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ParameterError(f"robot file '{path}' is not valid YAML: {error}") from error
    return parse_robot_file(content, str(path), path.parent)


def parse_robot_file(content: Any, where: str, folder: Path | None) -> RobotFile:
    """Build a RobotFile from a YAML file's content; `where` names the file in errors."""
    if not isinstance(content, Mapping):
        raise ParameterError(f"{where}: a robot file is a mapping with {', '.join(_REQUIRED)}")
    for key in content:
        if key not in _REQUIRED + _OPTIONAL:
            raise ParameterError(f"{where}: there is no entry '{key}'; valid are "
                                 f"{', '.join(_REQUIRED + _OPTIONAL)}")
    for key in _REQUIRED:
        if key not in content:
            raise ParameterError(f"{where}: the entry '{key}' is missing; required are "
                                 f"{', '.join(_REQUIRED)}")
    model, base = _text(content['model'], 'model', where), _text(content['base'], 'base', where)
    per_leg = _by_leg(content['joints'], 'joints', where)
    joints = []
    for leg, names in zip(LEGS, per_leg, strict=True):
        if not isinstance(names, (list, tuple)) or len(names) != len(JOINTS_OF_LEG):
            raise ParameterError(f"{where}: joints.{leg} must list the three joints "
                                 f"{', '.join(JOINTS_OF_LEG)}, not {names!r}")
        abduction, hip, knee = (_text(name, f'joints.{leg}', where) for name in names)
        joints.append((abduction, hip, knee))
    feet = tuple(_text(name, 'feet', where) for name in _by_leg(content['feet'], 'feet', where))
    height = content.get('stance_height')
    return RobotFile(
        model=find_model(model, folder), base=base, joints=tuple(joints), feet=feet,
        stance_height=None if height is None else _positive(height, 'stance_height', where),
        **{key: _triple(content.get(key), key, where)
           for key in ('kp', 'kd', 'torque_limit', 'velocity_limit')})


def find_model(name: str, folder: Path | None) -> Path:
    """Return the path of a model file.

    `name` is looked up relative to `folder` (the robot file's), then among the package's own
    models; ``package://NAME/PATH`` is a file inside an installed Python package.

    Raises
    ------
    MissingFileError
        If it is in none of them; the message lists where it was looked for.
    """
    if name.startswith('package://'):
        package, _, inside = name[len('package://'):].partition('/')
        spec = importlib.util.find_spec(package) if package.isidentifier() else None
        if spec is None:
            raise MissingFileError(f"model '{name}': there is no Python package '{package}' here")
        places = [Path(root) / inside for root in spec.submodule_search_locations or ()]
    else:
        own = Path(str(importlib.resources.files('dmp_cpg_ros') / 'models'))
        file = Path(name).expanduser()
        places = ([] if folder is None else [folder / file]) + [own / file]
    for place in places:
        if place.is_file():
            return place.resolve()
    looked = ', '.join(f"'{place}'" for place in places)
    raise MissingFileError(f"model '{name}' was not found; looked at {looked}")


def _by_leg(value: Any, key: str, where: str) -> list[Any]:
    if not isinstance(value, Mapping) or sorted(value) != sorted(LEGS):
        raise ParameterError(f"{where}: '{key}' must have exactly one entry for each leg "
                             f"{', '.join(LEGS)}, not {value!r}")
    return [value[leg] for leg in LEGS]


def _text(value: Any, key: str, where: str) -> str:
    if not isinstance(value, str) or not value:
        raise ParameterError(f"{where}: '{key}' must be a name, not {value!r}")
    return value


def _positive(value: Any, key: str, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not (
            math.isfinite(value) and value > 0):
        raise ParameterError(f"{where}: '{key}' must be a positive number, not {value!r}")
    return float(value)


def _triple(value: Any, key: str, where: str) -> Triple | None:
    if value is None:
        return None
    if not isinstance(value, (list, tuple)):
        value = (value,) * len(JOINTS_OF_LEG)
    if len(value) != len(JOINTS_OF_LEG):
        raise ParameterError(f"{where}: '{key}' must be one number or three "
                             f"({', '.join(JOINTS_OF_LEG)}), not {value!r}")
    first, second, third = (_positive(entry, key, where) for entry in value)
    return first, second, third
