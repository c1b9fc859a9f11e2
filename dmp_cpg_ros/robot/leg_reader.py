# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One leg's joints, foot and geometry, read from a compiled model at zero joint angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG
from dmp_cpg_ros.robot.mujoco_import import mujoco

Vector = NDArray[np.float64]

_AXES = {'abduction': 'x', 'hip': 'y', 'knee': 'y'}
_AXIS_TOLERANCE = 0.02  # [rad] of an axis from x or y


@dataclass(frozen=True)
class Foot:
    """A foot: its body, its point in the body's frame [m], radius [m], and geoms that touch."""

    body: int
    point_in_body: Vector
    radius: float
    geoms: tuple[int, ...]


def find(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str, what: str) -> int:
    """Return the id of a named object; raises ParameterError that lists the names there are."""
    number = mujoco.mj_name2id(model, kind, name)
    if number < 0:
        count = model.njnt if kind == mujoco.mjtObj.mjOBJ_JOINT else model.nbody
        names = [mujoco.mj_id2name(model, kind, i) for i in range(count)]
        valid = ', '.join(entry for entry in names if entry)
        raise ParameterError(f"the model has no {what} '{name}'; it has {valid}")
    return int(number)


def find_foot(model: mujoco.MjModel, name: str) -> Foot:
    """Find a foot by the name of a geom, a site or a body (in this order).

    A site or body takes the nearest collision sphere of its body, if there is one, as its contact
    sphere.

    Raises
    ------
    ParameterError
        If nothing bears the name.
    """
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    if geom >= 0:
        return _foot_of_geom(model, geom)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if site < 0 and body < 0:
        raise ParameterError(f"the model has no geom, site or body '{name}' that could be a foot")
    point = model.site_pos[site].copy() if site >= 0 else np.zeros(3)
    body = int(model.site_bodyid[site]) if site >= 0 else body
    touching = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body
                and (model.geom_contype[g] or model.geom_conaffinity[g])]
    spheres = [g for g in touching if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_SPHERE]
    if spheres:
        return _foot_of_geom(model, min(
            spheres, key=lambda g: float(np.linalg.norm(model.geom_pos[g] - point))))
    return Foot(body, point, 0.0, tuple(touching))


def _foot_of_geom(model: mujoco.MjModel, geom: int) -> Foot:
    is_sphere = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE
    radius = model.geom_size[geom, 0] if is_sphere else model.geom_aabb[geom, 3:].min()
    return Foot(int(model.geom_bodyid[geom]), model.geom_pos[geom].copy(), float(radius), (geom,))


def foot_position(data: mujoco.MjData, foot: Foot) -> Vector:
    """Return the centre of the foot's contact sphere in the world [m], after mj_kinematics."""
    place: Vector = data.xpos[foot.body] + data.xmat[foot.body].reshape(3, 3) @ foot.point_in_body
    return place


def check_leg(model: mujoco.MjModel, data: mujoco.MjData, leg: str, joints: list[int], foot: Foot,
              base: int) -> Vector:
    """Check that a leg is base → abduction (x) → hip (y) → knee (y) → foot.

    Returns
    -------
    axis_sign : ndarray (3,)
        +1 or −1 for each joint.

    Raises
    ------
    ParameterError
        That names the joint and says what was found.
    """
    signs = np.zeros(3)
    for i, (role, joint) in enumerate(zip(JOINTS_OF_LEG, joints, strict=True)):
        name = model.joint(joint).name
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
            raise ParameterError(f"joint '{name}' ({role} of leg {leg}) is not a hinge")
        axis = data.xaxis[joint]
        wanted = 'xyz'.index(_AXES[role])
        if np.arccos(min(1.0, abs(axis[wanted]))) > _AXIS_TOLERANCE:
            raise ParameterError(
                f"joint '{name}' ({role} of leg {leg}) must turn about {_AXES[role]} of the base "
                f'when all joints are at zero; its axis is '
                f'[{axis[0]:.3f}, {axis[1]:.3f}, {axis[2]:.3f}]')
        signs[i] = np.sign(axis[wanted])
    found = _joints_up_to(model, foot.body, base)
    if found != joints[::-1]:
        raise ParameterError(
            f'leg {leg}: from the foot up to the base the model has the joints '
            f"{', '.join(model.joint(j).name for j in found) or '(none)'}; expected are "
            f"{', '.join(model.joint(j).name for j in joints[::-1])} (knee, hip, abduction)")
    return signs


def _joints_up_to(model: mujoco.MjModel, body: int, base: int) -> list[int]:
    found: list[int] = []
    while body not in (0, base):
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        found.extend(reversed(range(first, first + count)))
        body = int(model.body_parentid[body])
    return found


def actuator_of(model: mujoco.MjModel, joint: int) -> int | None:
    """Return the actuator that drives a joint directly, or None."""
    for i in range(model.nu):
        if (model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
                and model.actuator_trnid[i, 0] == joint):
            return i
    return None


def is_motor(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether an actuator is a plain motor: force = gain · control."""
    return bool(model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
                and model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
                and model.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_NONE)


def motor_ratio(model: mujoco.MjModel, actuator: int) -> float:
    """Return joint torque per unit of control of a plain motor."""
    return float(model.actuator_gear[actuator, 0] * model.actuator_gainprm[actuator, 0])


def torque_limit(model: mujoco.MjModel, joint: int) -> float:
    """Return the torque limit of a joint [N m]: the least of what joint and actuator allow.

    Raises
    ------
    ParameterError
        If the model limits neither.
    """
    limits: list[float] = []

    def add(limited: Any, bounds: Vector, factor: float) -> None:
        if limited:
            limits.append(float(np.abs(bounds).min() * abs(factor)))

    add(model.jnt_actfrclimited[joint], model.jnt_actfrcrange[joint], 1.0)
    actuator = actuator_of(model, joint)
    if actuator is not None:
        add(model.actuator_forcelimited[actuator], model.actuator_forcerange[actuator],
            model.actuator_gear[actuator, 0])
        if is_motor(model, actuator):
            add(model.actuator_ctrllimited[actuator], model.actuator_ctrlrange[actuator],
                motor_ratio(model, actuator))
    if not limits:
        raise ParameterError(
            f"the model gives no torque limit for joint '{model.joint(joint).name}' (ctrlrange, "
            "forcerange or actuatorfrcrange); add 'torque_limit' to the robot file")
    return min(limits)
