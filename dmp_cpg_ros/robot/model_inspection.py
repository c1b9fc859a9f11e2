# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Finds the legs of a quadruped in any MJCF, for its robot file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.robot import model_parts
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_reader import read_description
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import RobotFile
from dmp_cpg_ros.strict_yaml import naming

AXIS_COSINE = 0.95
"""A joint turns about x, y or z of the base when the cosine between the axes is at least this."""


@dataclass(frozen=True)
class Inspection:
    """What was found in a model.

    Attributes
    ----------
    file : RobotFile
        Names of base, joints and feet.
    description : RobotDescription
        What they lead to.
    others : tuple of str
        Joints that belong to no leg.
    """

    file: RobotFile
    description: RobotDescription
    others: tuple[str, ...]


def inspect_model(path: Path | str) -> Inspection:
    """Find base, legs and feet of a quadruped.

    A leg is a chain of three hinges from the base, about x, y and y when all joints are at zero,
    that branches into no other joint. Its place under the base says which leg it is, its lowest
    shape that touches is its foot.

    Parameters
    ----------
    path : Path or str
        MJCF file.

    Raises
    ------
    MissingFileError
        If there is no such file.
    ParameterError
        If MuJoCo cannot compile it, or it is no quadruped of the kind that this package drives;
        the text says what was found.
    """
    path = Path(path).expanduser()
    with naming(path):
        return _inspected(path)


def _inspected(path: Path) -> Inspection:
    model = load_model(path, '')
    base = _base(model, path)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    data.qpos[model.jnt_qposadr[model.body_jntadr[base]] + 3] = 1.0
    mujoco.mj_kinematics(model, data)
    chains = list(filter(None, (_chain(model, child) for child in _children(model, base))))
    legs = [chain for chain in chains if _axes(model, data, chain) == model_parts.LEG_AXES]
    places = {('f' if data.xanchor[leg[1], 0] > 0.0 else 'r')
              + ('l' if data.xanchor[leg[1], 1] > 0.0 else 'r'): leg for leg in legs}
    if not len(legs) == len(places) == 4:
        raise ParameterError(f"model '{path}' is no quadruped that this package drives: it takes "
                             'four chains abduction (x), hip (y), knee (y), one under each corner '
                             f'of the base. {_found(model, data, base, chains)}')
    placed = [places[name] for name in LEGS]
    file = RobotFile(
        model=path.resolve(), base=model.body(base).name,
        joints=tuple((model.joint(a).name, model.joint(b).name, model.joint(c).name)
                     for a, b, c in placed),
        feet=tuple(_foot_name(model, data, leg) for leg in placed))
    used = {*sum(placed, []), int(model.body_jntadr[base])}
    others = tuple(_joint_name(model, j) for j in range(model.njnt) if j not in used)
    return Inspection(file, read_description(model, file), others)


def _base(model: mujoco.MjModel, path: Path) -> int:
    """Return the body with a free joint that carries the most joints."""
    free = model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE].tolist()
    if not free:
        names = [model.body(i).name for i in range(1, min(model.nbody, 6))]
        raise ParameterError(
            f"model '{path}' is no quadruped that this package drives: none of its "
            f"{model.nbody - 1} bodies has a free joint (they are {', '.join(names) or 'none'}"
            f"{', ...' if model.nbody > 6 else ''})")
    roots = model.body_rootid[model.jnt_bodyid]
    return int(max(free, key=lambda body: (roots == model.body_rootid[body]).sum()))


def _children(model: mujoco.MjModel, body: int) -> list[int]:
    return [child for child in range(body + 1, model.nbody) if model.body_parentid[child] == body]


def _chain(model: mujoco.MjModel, body: int) -> list[int]:
    """Joints of a body and what hangs on it, in order; cut where they branch."""
    below = list(filter(None, (_chain(model, child) for child in _children(model, body))))
    return model_parts.joints_of(model, body) + (below[0] if len(below) == 1 else [])


def _axes(model: mujoco.MjModel, data: mujoco.MjData, chain: list[int]) -> str:
    """Axes of a chain's joints as letters; ``?`` for another direction, ``-`` for no hinge."""
    letters = ''
    for joint in chain:
        axis = np.abs(data.xaxis[joint])
        straight = 'xyz'[int(axis.argmax())] if axis.max() >= AXIS_COSINE else '?'
        hinge = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
        letters += straight if hinge else '-'
    return letters


def _foot_name(model: mujoco.MjModel, data: mujoco.MjData, leg: list[int]) -> str:
    """Name by which :func:`~dmp_cpg_ros.robot.model_parts.find_foot` finds the foot of a leg."""
    knee = data.xanchor[leg[2]]
    below = model_parts.subtree(model, model.jnt_bodyid[leg[2]])
    touching, spheres = model_parts.touching_geoms(model, below)

    def far(place: Array) -> float:
        return float(np.linalg.norm(place - knee))

    bodies = sorted({int(model.geom_bodyid[g]) for g in spheres or touching})
    sites = [s for s in range(model.nsite) if model.site_bodyid[s] in below]
    choices = [named(i).name for ids, places, named in (
        (spheres, data.geom_xpos, model.geom), (bodies, data.xpos, model.body),
        (sites, data.site_xpos, model.site)) for i in sorted(ids, key=lambda i: -far(places[i]))]
    best = max((far(data.geom_xpos[g]) for g in spheres), default=0.0)
    for name in filter(None, choices):
        foot = model_parts.find_foot(model, name)
        if foot.body in below and far(model_parts.foot_position(data, foot)) > 0.5 * best + 0.02:
            return str(name)
    raise ParameterError(
        f"no foot was found on the leg of joint '{model.joint(leg[2]).name}': below the knee "
        'there is neither a sphere that touches nor a site, or they bear no names; name one')


def _joint_name(model: mujoco.MjModel, joint: int) -> str:
    return model.joint(joint).name or f'joint {joint}'


def _found(model: mujoco.MjModel, data: mujoco.MjData, base: int,
           chains: list[list[int]]) -> str:
    """Say which chains there are, with their axes."""
    if not chains:
        return f"Found: base '{model.body(base).name}' without any joint below it"
    described = (f"{' > '.join(_joint_name(model, joint) for joint in chain)} "
                 f'(axes {_axes(model, data, chain)})' for chain in chains)
    return f"Found below base '{model.body(base).name}': {'; '.join(described)}"
