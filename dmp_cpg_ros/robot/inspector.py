# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Finds the legs of a quadruped in any MJCF, for its robot file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import MissingFileError, ParameterError
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.robot.leg_reader import find_foot
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_reader import read_description
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import RobotFile

AXIS_COSINE = 0.95
"""A joint turns about x, y or z of the base when the cosine between the axes is at least this."""

LEG_AXES = 'xyy'
"""Axes of abduction, hip and knee."""


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
    if not path.is_file():
        raise MissingFileError(f"model '{path}' does not exist")
    model = load_model(path, '')
    base = _base(model, path)
    data = mujoco.MjData(model)
    start = int(model.jnt_qposadr[model.body_jntadr[base]])
    data.qpos[:] = 0.0
    data.qpos[start + 3] = 1.0
    mujoco.mj_kinematics(model, data)
    chains = _chains(model, base)
    legs = [chain for chain in chains if _axes(model, data, chain) == LEG_AXES]
    placed = _placed(data, legs)
    if len(legs) != 4 or placed is None:
        raise ParameterError(f"model '{path}' is no quadruped that this package drives: it takes "
                             'four chains abduction (x), hip (y), knee (y), one under each corner '
                             f'of the base. {_found(model, data, base, chains)}')
    file = RobotFile(
        model=path.resolve(), base=model.body(base).name,
        joints=tuple((model.joint(leg[0]).name, model.joint(leg[1]).name, model.joint(leg[2]).name)
                     for leg in placed),
        feet=tuple(_foot_name(model, data, leg) for leg in placed))
    used = {base_joint for leg in placed for base_joint in leg}
    others = tuple(model.joint(j).name or f'joint {j}' for j in range(model.njnt)
                   if j not in used and j != model.body_jntadr[base])
    return Inspection(file, read_description(model, file), others)


def _base(model: mujoco.MjModel, path: Path) -> int:
    """Return the body with a free joint that carries the most joints."""
    free = [int(model.jnt_bodyid[j]) for j in range(model.njnt)
            if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE]
    if not free:
        names = [model.body(i).name for i in range(1, min(model.nbody, 6))]
        raise ParameterError(
            f"model '{path}' is no quadruped that this package drives: none of its "
            f"{model.nbody - 1} bodies has a free joint (they are {', '.join(names) or 'none'}"
            f"{', ...' if model.nbody > 6 else ''})")
    roots = model.body_rootid[model.jnt_bodyid]
    return max(free, key=lambda body: int((roots == model.body_rootid[body]).sum()))


def _chains(model: mujoco.MjModel, base: int) -> list[list[int]]:
    """Joints of every subtree of the base in order; a subtree whose joints branch is cut there."""
    chains = []
    for child in range(base + 1, model.nbody):
        if model.body_parentid[child] == base:
            chain = _down(model, child)
            if chain:
                chains.append(chain)
    return chains


def _down(model: mujoco.MjModel, body: int) -> list[int]:
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    own = list(range(first, first + count))
    below = [chain for child in range(body + 1, model.nbody)
             if model.body_parentid[child] == body and (chain := _down(model, child))]
    return own + (below[0] if len(below) == 1 else [])


def _axes(model: mujoco.MjModel, data: mujoco.MjData, chain: list[int]) -> str:
    """Axes of a chain's joints as letters; ``?`` for another direction, ``-`` for no hinge."""
    letters = ''
    for joint in chain:
        axis = np.abs(data.xaxis[joint])
        hinge = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE
        straight = 'xyz'[int(axis.argmax())] if axis.max() >= AXIS_COSINE else '?'
        letters += straight if hinge else '-'
    return letters


def _placed(data: mujoco.MjData, legs: list[list[int]]) -> list[list[int]] | None:
    """Legs in the order fl, fr, rl, rr; None unless there is one in each place."""
    places: dict[str, list[int]] = {}
    for leg in legs:
        x, y, _ = data.xanchor[leg[1]]
        places[('f' if x > 0.0 else 'r') + ('l' if y > 0.0 else 'r')] = leg
    return [places[name] for name in LEGS] if len(places) == len(legs) == 4 else None


def _foot_name(model: mujoco.MjModel, data: mujoco.MjData, leg: list[int]) -> str:
    """Name by which :func:`~dmp_cpg_ros.robot.leg_reader.find_foot` finds the foot of a leg."""
    knee = data.xanchor[leg[2]]
    below = _subtree(model, int(model.jnt_bodyid[leg[2]]))
    touching = [g for g in range(model.ngeom) if model.geom_bodyid[g] in below
                and (model.geom_contype[g] or model.geom_conaffinity[g])]
    spheres = [g for g in touching if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_SPHERE]

    def far(place: NDArray[np.float64]) -> float:
        return float(np.linalg.norm(place - knee))

    sites = [s for s in range(model.nsite) if model.site_bodyid[s] in below]
    choices = [model.geom(g).name for g in sorted(spheres, key=lambda g: -far(data.geom_xpos[g]))]
    choices += [model.body(b).name for b in sorted(below, key=lambda b: -far(data.xpos[b]))
                if any(model.geom_bodyid[g] == b for g in spheres or touching)]
    choices += [model.site(s).name for s in sorted(sites, key=lambda s: -far(data.site_xpos[s]))]
    best = max((far(data.geom_xpos[g]) for g in spheres), default=0.0)
    for name in filter(None, choices):
        foot = find_foot(model, name)
        place = data.xpos[foot.body] + data.xmat[foot.body].reshape(3, 3) @ foot.point_in_body
        if foot.body in below and far(place) > 0.5 * best + 0.02:
            return str(name)
    raise ParameterError(
        f"no foot was found on the leg of joint '{model.joint(leg[2]).name}': below the knee "
        'there is neither a sphere that touches nor a site, or they bear no names; name one')


def _subtree(model: mujoco.MjModel, root: int) -> set[int]:
    bodies = {root}
    for body in range(root + 1, model.nbody):
        if int(model.body_parentid[body]) in bodies:
            bodies.add(body)
    return bodies


def _found(model: mujoco.MjModel, data: mujoco.MjData, base: int,
           chains: list[list[int]]) -> str:
    """Say which chains there are, with their axes."""
    if not chains:
        return f"Found: base '{model.body(base).name}' without any joint below it"
    described = (f"{' > '.join(model.joint(j).name or f'joint {j}' for j in chain)} "
                 f'(axes {_axes(model, data, chain)})' for chain in chains)
    return f"Found below base '{model.body(base).name}': {'; '.join(described)}"
