# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the description of a robot from its compiled model."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.files import readable
from dmp_cpg_ros.robot import model_parts
from dmp_cpg_ros.robot.leg_width import leg_widths
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_parts import ModelIds, foot_position
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import (
    OWN_ROBOT,
    USUAL_VELOCITY_LIMIT,
    RobotFile,
    load_robot_file,
)
from dmp_cpg_ros.robot.soft_feet import standing_radius, with_rolling_radii
from dmp_cpg_ros.robot.start_pose import home_joint_position
from dmp_cpg_ros.strict_yaml import naming

STANCE_LEG_SHARE = 0.7  # distance hip-foot over leg length when the model has no usable home pose
GAIN_OVER_WEIGHT = 1.7  # kp / (m g L); gives 60 N m/rad for 9 kg and legs of 0.4 m
DAMPING_TIME = 0.15  # kd / kp in units of sqrt(L / g)
DAMPING_SHARE = 0.5
"""Largest share kd dt/I of a joint's speed that the drive's damping takes away in a physics step.
Torque is held for the step, so that speed is multiplied by 1 - kd dt/I: above 1 it changes its
sign at every step and the joint chatters, above 2 it grows."""
_PLACE_OF_LEG = {'fl': (1, 1), 'fr': (1, -1), 'rl': (-1, 1), 'rr': (-1, -1)}  # signs of x, y

MOST_KEPT = 100_000
"""Largest model whose description is kept [bytes]."""


def load_description(path: Path | str | None = None) -> RobotDescription:
    """Read a robot's description.

    Parameters
    ----------
    path : Path, str or None
        Robot YAML file; None is the package's own robot.

    Raises
    ------
    MissingFileError, ParameterError
        If a file is missing, or the model is no quadruped of the kind that this package drives.
    """
    with naming(path or OWN_ROBOT):
        file = load_robot_file(path)
        text = _whole(file.model)
        return _described(file, text) if text else _described.__wrapped__(file, text)


def _whole(model: Path) -> bytes:
    """Text of a model that names no other file; nothing of another one."""
    if not readable(model).is_file():
        return b''
    with model.open('rb') as stream:
        text = stream.read(MOST_KEPT + 1)
    return b'' if len(text) > MOST_KEPT or b'file' in text else text


@lru_cache(maxsize=8)
def _described(file: RobotFile, text: bytes) -> RobotDescription:
    """Description that nobody changes, made once of the same text: all nodes of a process read it,
    and those that are forked have it before they begin.
    """
    return read_description(load_model(file.model, file.base), file)


def pose(model: mujoco.MjModel, ids: ModelIds, joint_position: Array) -> mujoco.MjData:
    """Return data with the base at the origin, the joints as given, and kinematics computed."""
    data = mujoco.MjData(model)
    model_parts.place_robot(model, data, ids, np.zeros(3), (1, 0, 0, 0), joint_position)
    return data


def read_description(model: mujoco.MjModel, file: RobotFile) -> RobotDescription:
    """Read leg geometry, limits, masses and inertia from a model.

    Parameters
    ----------
    model : mujoco.MjModel
        Compiled model.
    file : RobotFile
        Names of base, joints and feet, and what overrides the model.

    Raises
    ------
    ParameterError
        If a name is not in the model, or a leg is not abduction (x), hip (y), knee (y).
    """
    ids = model_parts.find_ids(model, file)
    at_zero, home = pose(model, ids, np.zeros(12)), None
    if (key := mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, 'home')) >= 0:
        home = model.key_qpos[key, model.jnt_qposadr[ids.joints]]
    legs = tuple(_read_leg(model, at_zero, ids, i, file, home) for i in range(4))
    leg_length = float(np.mean([np.linalg.norm(leg.thigh) + np.linalg.norm(leg.shank)
                                for leg in legs]))
    mass = float(model.body_subtreemass[ids.base])
    kp = file.kp or (GAIN_OVER_WEIGHT * mass * GRAVITY * leg_length,) * 3
    description = RobotDescription(
        name=file.model.stem, legs=legs, mass=mass, base_inertia=np.zeros((3, 3)),
        com_in_base=np.zeros(3), kp=np.array(kp), kd=np.zeros(3),
        stance_height=file.stance_height or _stance_height(model, ids, legs, leg_length, home),
        belly_depth=_belly_depth(model, ids.base, at_zero), joint_names=file.joint_names)
    standing = pose(model, ids, home_joint_position(description))
    com, inertia = _composite_inertia(model, standing, ids.base)
    joints = model.jnt_dofadr[ids.joints]
    joint_inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_crb(model, standing)
    mujoco.mj_fullM(model, standing, joint_inertia)
    free = 1.0 / np.diag(np.linalg.inv(joint_inertia))[joints].reshape(4, 3)  # 1/(M⁻¹)_jj
    kd = _damping(model, file, free.min(axis=0), DAMPING_TIME * np.sqrt(leg_length / GRAVITY)
                  * description.kp)
    radius = standing_radius(model, standing, ids)
    legs = tuple(
        replace(leg, foot_radius=leg.foot_radius if radius is None else radius,
                swing_inertia=float(joint_inertia[hip, hip]), width=width)
        for leg, hip, width in zip(legs, joints.reshape(4, 3)[:, 1],
                                   leg_widths(model, standing, ids), strict=True))
    legs = with_rolling_radii(replace(description, legs=legs), model, ids)
    return replace(description, legs=legs, base_inertia=inertia, com_in_base=com, kd=kd)


def _damping(model: mujoco.MjModel, file: RobotFile, free: Array, usual: Array) -> Array:
    """Damping (3,) of the drive [N m s/rad]: the file's, or the usual one, less where it would
    stop a joint of a swinging leg, of the inertia ``free`` (3,), within a physics step.
    """
    stopping = free / model.opt.timestep
    if file.kd is None:
        return np.minimum(usual, DAMPING_SHARE * stopping)
    if (np.array(file.kd) >= 2.0 * stopping).any():
        raise ParameterError(
            f'kd = {list(file.kd)} N m s/rad makes joints swing ever faster: with physics steps '
            f"of {model.opt.timestep * 1e3:g} ms and this robot's legs it must be less than "
            f'{(2.0 * stopping).round(2).tolist()}')
    return np.array(file.kd)


def _read_leg(model: mujoco.MjModel, at_zero: mujoco.MjData, ids: ModelIds, index: int,
              file: RobotFile, home: Array | None) -> LegGeometry:
    name, foot = LEGS[index], ids.feet[index]
    joints = [int(joint) for joint in ids.joints[3 * index:3 * index + 3]]
    sign = model_parts.check_leg(model, at_zero, name, joints, foot, ids.base)
    abduction, hip, knee = at_zero.xanchor[joints]
    if tuple(np.sign(hip[:2])) != _PLACE_OF_LEG[name]:
        raise ParameterError(
            f'leg {name} is not where its name says: with x forward and y left its hip joint is '
            f'at x = {hip[0]:.3f} m, y = {hip[1]:.3f} m')
    limited = model.jnt_limited[joints].astype(bool)
    lower, upper = np.where(limited[:, None], model.jnt_range[joints], (-np.pi, np.pi)).T.copy()
    thigh, shank = knee - hip, foot_position(at_zero, foot) - knee
    angle = 0.5 * (lower[2] + upper[2]) if home is None else home[3 * index + 2]
    return LegGeometry(
        name=name, hip_in_base=abduction, hip_offset=hip - abduction, thigh=thigh, shank=shank,
        axis_sign=sign, knee_sign=_knee_sign(name, thigh, shank, sign[2] * angle),
        position_lower=lower, position_upper=upper,
        torque_limit=np.array(
            file.torque_limit or [model_parts.torque_limit(model, joint) for joint in joints]),
        velocity_limit=np.array(file.velocity_limit or (USUAL_VELOCITY_LIMIT,) * 3),
        rotor_inertia=model.dof_armature[model.jnt_dofadr[joints]].copy(), foot_radius=foot.radius,
        damping=model.dof_damping[model.jnt_dofadr[joints]].copy())


def _knee_sign(leg: str, thigh: Array, shank: Array, angle: float) -> int:
    """Return the sign of the rotation about +y from thigh to shank at a knee angle."""
    bend = angle + np.arctan2(thigh[2] * shank[0] - thigh[0] * shank[2], thigh[::2] @ shank[::2])
    bend = (bend + np.pi) % (2 * np.pi) - np.pi
    if abs(bend) < 0.05:
        raise ParameterError(
            f'leg {leg}: which way the knee bends cannot be told: it is straight in the keyframe '
            "'home', or in the middle of its range when there is none")
    return int(np.sign(bend))


def _stance_height(model: mujoco.MjModel, ids: ModelIds, legs: tuple[LegGeometry, ...],
                   leg_length: float, home: Array | None) -> float:
    """Return the height at which the home keyframe's feet touch, or 0.7 of the leg's length."""
    usual = float(np.mean([STANCE_LEG_SHARE * leg_length + leg.foot_radius
                           - leg.hip_in_base[2] - leg.hip_offset[2] for leg in legs]))
    if home is None:
        return usual
    data = pose(model, ids, home)
    height = max(foot.radius - float(foot_position(data, foot)[2]) for foot in ids.feet)
    return height if 0.6 * usual < height < 1.3 * usual else usual


def _belly_depth(model: mujoco.MjModel, base: int, at_zero: mujoco.MjData) -> float:
    """Return how far the base body's colliding shapes reach below its origin [m].

    A base without any (some models let only the legs collide) is taken by its visible shapes.
    """
    geoms = np.flatnonzero(model.geom_bodyid == base)
    colliding = geoms[(model.geom_contype[geoms] | model.geom_conaffinity[geoms]) != 0]
    depth = 0.0
    for geom in colliding if len(colliding) else geoms:
        down = at_zero.geom_xmat[geom].reshape(3, 3)[2]
        centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
        lowest = at_zero.geom_xpos[geom, 2] + down @ centre - np.abs(down) @ half
        depth = max(depth, -float(lowest))
    return depth


def _composite_inertia(model: mujoco.MjModel, data: mujoco.MjData,
                       base: int) -> tuple[Array, Array]:
    """Return centre of mass (3,) and inertia about it (3, 3) of the base and all on it."""
    root = model.body_rootid[base]
    bodies = [body for body in range(model.nbody) if model.body_rootid[body] == root]
    mass, place = model.body_mass[bodies], data.xipos[bodies]
    com = mass @ place / mass.sum()
    inertia = np.zeros((3, 3))
    for body, m, arm in zip(bodies, mass, place - com, strict=True):
        R = data.ximat[body].reshape(3, 3)
        inertia += (R * model.body_inertia[body]) @ R.T
        inertia += m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return com, inertia
