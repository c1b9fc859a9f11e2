# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base, joints, feet, actuators and contacts of a robot in its compiled model."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.mismatch import MismatchParameters
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import RobotFile

LEG_AXES = 'xyy'
"""Axes of abduction, hip and knee."""

_AXIS_TOLERANCE = 0.02  # [rad] of an axis from x or y

_FOOT, _SHANK, _BASE, _OUTSIDE, _OTHER = range(5)

NEAR_FOOT = 1.5  # foot radii from the foot's centre within which the lower leg's shell is its foot

Places = slice | NDArray[np.integer[Any]]
"""Where some values are in an array."""


@dataclass(frozen=True)
class Foot:
    """A foot: its body, its point in the body's frame [m], radius [m], and geoms that touch."""

    body: int
    point_in_body: Array
    radius: float
    geoms: tuple[int, ...]


@dataclass(frozen=True)
class ModelIds:
    """Where in the model is what a robot file names.

    Attributes
    ----------
    base : int
        Body.
    base_qpos, base_dof : int
        Where position and velocity of its free joint begin.
    joints : ndarray (12,) of int
        Joints in the order of ``JOINT_NAMES``.
    feet : tuple of Foot
        In the order fl, fr, rl, rr.
    """

    base: int
    base_qpos: int
    base_dof: int
    joints: NDArray[np.int64]
    feet: tuple[Foot, ...]


def find_ids(model: mujoco.MjModel, file: RobotFile) -> ModelIds:
    """Find base, joints and feet in a model.

    Raises
    ------
    ParameterError
        If a name is not in the model (those there are get listed), or the base cannot move freely.
    """
    base = _find(model, mujoco.mjtObj.mjOBJ_BODY, file.base, 'body')
    free = int(model.body_jntadr[base])
    if free < 0 or model.jnt_type[free] != mujoco.mjtJoint.mjJNT_FREE:
        raise ParameterError(f"the base '{file.base}' must have a free joint")
    joints = [_find(model, mujoco.mjtObj.mjOBJ_JOINT, name, 'joint')
              for leg in file.joints for name in leg]
    if len(set(joints)) != len(joints):
        raise ParameterError(f'the twelve joints must differ; named are {file.joints}')
    return ModelIds(base, int(model.jnt_qposadr[free]), int(model.jnt_dofadr[free]),
                    np.array(joints), tuple(find_foot(model, name) for name in file.feet))


def place_robot(model: mujoco.MjModel, data: mujoco.MjData, ids: ModelIds, place: ArrayLike,
                quaternion: ArrayLike, joint_position: ArrayLike) -> None:
    """Put the base at a place [m] and quaternion (w, x, y, z), the joints at their angles (12,)
    [rad], and compute where all bodies are.
    """
    b = ids.base_qpos
    data.qpos[b:b + 3], data.qpos[b + 3:b + 7] = place, quaternion
    data.qpos[model.jnt_qposadr[ids.joints]] = joint_position
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)


def _find(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str, what: str) -> int:
    number = mujoco.mj_name2id(model, kind, name)
    if number < 0:
        count = model.njnt if what == 'joint' else model.nbody
        valid = ', '.join(filter(None, (mujoco.mj_id2name(model, kind, i) for i in range(count))))
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
    geom, site, body = (mujoco.mj_name2id(model, kind, name) for kind in (
        mujoco.mjtObj.mjOBJ_GEOM, mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_BODY))
    if geom >= 0:
        return _foot_of_geom(model, geom)
    if site < 0 and body < 0:
        raise ParameterError(f"the model has no geom, site or body '{name}' that could be a foot")
    point = model.site_pos[site].copy() if site >= 0 else np.zeros(3)
    body = int(model.site_bodyid[site]) if site >= 0 else body
    touching, spheres = touching_geoms(model, [body])
    if spheres:
        return _foot_of_geom(model, min(
            spheres, key=lambda g: float(np.linalg.norm(model.geom_pos[g] - point))))
    return Foot(body, point, 0.0, tuple(touching))


def _foot_of_geom(model: mujoco.MjModel, geom: int) -> Foot:
    is_sphere = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE
    radius = model.geom_size[geom, 0] if is_sphere else model.geom_aabb[geom, 3:].min()
    return Foot(int(model.geom_bodyid[geom]), model.geom_pos[geom].copy(), float(radius), (geom,))


def touching_geoms(model: mujoco.MjModel, bodies: Collection[int]
                   ) -> tuple[list[int], list[int]]:
    """Shapes of some bodies that can touch, and those of them that are spheres."""
    touching = [g for g in range(model.ngeom) if model.geom_bodyid[g] in bodies
                and (model.geom_contype[g] or model.geom_conaffinity[g])]
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    return touching, [g for g in touching if model.geom_type[g] == sphere]


def subtree(model: mujoco.MjModel, root: int) -> set[int]:
    """Return a body with all that hang on it."""
    bodies = {int(root)}
    for body in range(root + 1, model.nbody):
        if int(model.body_parentid[body]) in bodies:
            bodies.add(body)
    return bodies


def foot_position(data: mujoco.MjData, foot: Foot) -> Array:
    """Return the centre of the foot's contact sphere in the world [m], after mj_kinematics."""
    place: Array = data.xpos[foot.body] + data.xmat[foot.body].reshape(3, 3) @ foot.point_in_body
    return place


def check_leg(model: mujoco.MjModel, data: mujoco.MjData, leg: str, joints: list[int], foot: Foot,
              base: int) -> Array:
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
    for i, (role, joint, letter) in enumerate(zip(JOINTS_OF_LEG, joints, LEG_AXES, strict=True)):
        name, axis = model.joint(joint).name, data.xaxis[joint]
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
            raise ParameterError(f"joint '{name}' ({role} of leg {leg}) is not a hinge")
        along = axis['xyz'.index(letter)]
        if np.arccos(min(1.0, abs(along))) > _AXIS_TOLERANCE:
            raise ParameterError(
                f"joint '{name}' ({role} of leg {leg}) must turn about {letter} of the base "
                f'when all joints are at zero; its axis is '
                f'[{axis[0]:.3f}, {axis[1]:.3f}, {axis[2]:.3f}]')
        signs[i] = np.sign(along)
    found, body = [], foot.body
    while body not in (0, base):
        found += joints_of(model, body)[::-1]
        body = int(model.body_parentid[body])
    if found != joints[::-1]:
        there, expected = (', '.join(model.joint(j).name for j in chain) or '(none)'
                           for chain in (found, joints[::-1]))
        raise ParameterError(f'leg {leg}: from the foot up to the base the model has the joints '
                             f'{there}; expected are {expected} (knee, hip, abduction)')
    return signs


def joints_of(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the joints between a body and its parent, in the model's order."""
    first = int(model.body_jntadr[body])
    return list(range(first, first + int(model.body_jntnum[body])))


def actuator_of(model: mujoco.MjModel, joint: int) -> int | None:
    """Return the actuator that drives a joint directly, or None."""
    of_joint = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    drives = np.flatnonzero(of_joint & (model.actuator_trnid[:, 0] == joint))
    return int(drives[0]) if len(drives) else None


def motor_ratio(model: mujoco.MjModel, actuator: int) -> float:
    """Return joint torque per unit of control of a plain motor (force = gain · control); 0 for any
    other actuator.
    """
    is_motor = (model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
                and model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
                and model.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_NONE)
    ratio = model.actuator_gear[actuator, 0] * model.actuator_gainprm[actuator, 0]
    return float(ratio) if is_motor else 0.0


def torque_limit(model: mujoco.MjModel, joint: int) -> float:
    """Return the torque limit of a joint [N m]: the least of what joint and actuator allow.

    Raises
    ------
    ParameterError
        If the model limits neither.
    """
    bounds = [(model.jnt_actfrclimited[joint], model.jnt_actfrcrange[joint], 1.0)]
    a = actuator_of(model, joint)
    if a is not None:
        bounds += [(model.actuator_forcelimited[a], model.actuator_forcerange[a],
                    model.actuator_gear[a, 0]),
                   (model.actuator_ctrllimited[a], model.actuator_ctrlrange[a],
                    motor_ratio(model, a))]
    limits = [float(np.abs(values).min() * abs(ratio)) for limited, values, ratio in bounds
              if limited and ratio]
    if not limits:
        raise ParameterError(
            f"the model gives no torque limit for joint '{model.joint(joint).name}' (ctrlrange, "
            "forcerange or actuatorfrcrange); add 'torque_limit' to the robot file")
    return min(limits)


def as_slice(places: NDArray[np.integer[Any]]) -> Places:
    """Slice of consecutive places, which reads and writes at a fraction of the price of a list of
    them; of others the list itself.
    """
    first = int(places[0])
    consecutive = np.array_equal(places, np.arange(first, first + len(places)))
    return slice(first, first + len(places)) if consecutive else places


class JointActuators:
    """Where the torques of twelve joints go.

    When every joint has a plain motor the motors get them. Otherwise all torques are
    applied to the joints themselves, and the model's own actuators of these joints (position
    servos, say) are switched off in ``model``.
    """

    def __init__(self, model: mujoco.MjModel, joints: NDArray[np.int64]) -> None:
        found = (actuator_of(model, int(joint)) for joint in joints)
        actuators = [actuator for actuator in found if actuator is not None]
        ratios = np.array([motor_ratio(model, actuator) for actuator in actuators])
        self._through_motors = len(actuators) == len(joints) and bool(ratios.all())
        if self._through_motors:
            self._index, self._per_torque = as_slice(np.array(actuators)), 1.0 / ratios
            return
        self._index, self._per_torque = as_slice(model.jnt_dofadr[joints]), np.ones(len(joints))
        model.actuator_gainprm[actuators] = model.actuator_biasprm[actuators] = 0.0

    def inputs(self, data: mujoco.MjData) -> tuple[Array, Places, Array]:
        """Where the torques (12,) [N m] of the coming physics step go: an array of the data, their
        places in it, and what is put there per torque.
        """
        return (data.ctrl if self._through_motors else data.qfrc_applied), self._index, (
            self._per_torque)


def differ(model: mujoco.MjModel, ids: ModelIds, dof: Places, mismatch: MismatchParameters,
           mass: float) -> None:
    """Make a model differ from what its controllers know of it, a robot of some mass [kg]."""
    base = ids.base
    more = 1.0 + mismatch.payload * mass / model.body_mass[base]
    model.body_mass[base] *= more
    model.body_inertia[base] *= more
    model.body_ipos[base, :2] += mismatch.mass_offset
    model.dof_frictionloss[dof] *= mismatch.joint_friction
    model.dof_damping[dof] *= mismatch.joint_friction
    mujoco.mj_setConst(model, mujoco.MjData(model))


def standing_torque(model: mujoco.MjModel, data: mujoco.MjData, ids: ModelIds,
                    dof: Places) -> Array:
    """Return the torques of statics, τ = h(q) − Σ J_iᵀ f_i, with vertical foot forces f_i.

    The forces carry the weight and have no moment about the centre of mass; of all such forces
    those of least norm are taken.

    Parameters
    ----------
    model, data
        MuJoCo's, after mj_forward, at rest.
    ids : ModelIds
        Base and feet.
    dof : ndarray (12,) or slice
        Degrees of freedom of the joints.

    Returns
    -------
    ndarray (12,)
        [N m].
    """
    places = np.array([foot_position(data, foot) for foot in ids.feet])
    arms = places - data.subtree_com[ids.base]
    weight = -model.body_subtreemass[ids.base] * model.opt.gravity[2]
    balance = np.array([np.ones(4), arms[:, 0], arms[:, 1]])
    force = np.linalg.lstsq(balance, np.array([weight, 0.0, 0.0]), rcond=None)[0]
    torque: Array = data.qfrc_bias.copy()
    J = np.zeros((3, model.nv))
    for foot, place, f in zip(ids.feet, places, force, strict=True):
        mujoco.mj_jac(model, data, J, None, place, foot.body)
        torque -= J[2] * f
    return torque[dof]


class ContactReader:
    """Reads contacts between the robot and its surroundings from MuJoCo's data."""

    def __init__(self, model: mujoco.MjModel, ids: ModelIds) -> None:
        self._model, self._feet, self._wrench = model, ids.feet, np.zeros(6)
        kind, leg = np.full(model.ngeom, _OTHER), np.zeros(model.ngeom, dtype=int)
        kind[model.body_rootid[model.geom_bodyid] != model.body_rootid[ids.base]] = _OUTSIDE
        kind[model.geom_bodyid == ids.base] = _BASE
        shanks = model.jnt_bodyid[ids.joints[2::3]]
        for i, (foot, shank) in enumerate(zip(ids.feet, shanks, strict=True)):
            lower_leg = np.isin(model.geom_bodyid, (shank, foot.body))
            kind[lower_leg], leg[lower_leg] = _SHANK, i
            kind[list(foot.geoms)] = _FOOT
        self._kind, self._leg = kind.tolist(), leg.tolist()

    def foot_force(self, data: mujoco.MjData) -> Array:
        """Return the normal force of each foot (4,), summed over its contacts [N].

        Some models wrap the lower leg in a mesh that reaches around the foot; what touches so near
        the foot's centre counts as the foot.
        """
        force = [0.0, 0.0, 0.0, 0.0]
        for i, (geom, other) in enumerate(data.contact.geom.tolist()):
            if self._kind[geom] == _OUTSIDE:
                geom, other = other, geom
            if self._kind[other] != _OUTSIDE or self._kind[geom] not in (_FOOT, _SHANK):
                continue
            leg = self._leg[geom]
            if self._kind[geom] == _FOOT or np.linalg.norm(
                    data.contact.pos[i] - foot_position(data, self._feet[leg])
                    ) < NEAR_FOOT * self._feet[leg].radius:
                mujoco.mj_contactForce(self._model, data, i, self._wrench)
                force[leg] += float(self._wrench[0])
        return np.array(force)

    def base_touches(self, data: mujoco.MjData) -> bool:
        """Return whether the base body touches the surroundings."""
        return any({self._kind[first], self._kind[second]} == {_BASE, _OUTSIDE}
                   for first, second in data.contact.geom.tolist())
