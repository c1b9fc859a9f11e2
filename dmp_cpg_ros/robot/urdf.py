# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot's URDF, made from its model.

Links are the model's bodies from the base on, each with its frame in its (last) joint, and a link
in the centre of each foot. Joints bear their names in ``joint_states``, which the robot file may
choose. The tree is that of MuJoCo's ``mj_kinematics``: bodies without a joint are fixed, several
joints of a body follow one another through links without mass.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, hypot
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import shown
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_parts import find_ids, joints_of, subtree
from dmp_cpg_ros.robot.model_reader import read_description
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import RobotFile, load_robot_file
from dmp_cpg_ros.robot.scene import SHOWN_GROUPS, geom_colour

BASE_LINK = 'base_link'
"""Frame of the base (REP-105)."""

RENAMED = 'dmp_cpg_ros_joint'
"""Element that says which joint of ours a joint with another name is; other readers skip it."""

_Element = ElementTree.Element
_Geom = mujoco.mjtGeom


def urdf(robot: RobotFile | Path | str | None = None) -> str:
    """Write a robot's URDF.

    Capsules become a cylinder and two spheres, ellipsoids a sphere of their volume; meshes are
    named by the model's own files.

    Parameters
    ----------
    robot : RobotFile, Path, str or None
        As :func:`~dmp_cpg_ros.robot.robot_file.load_robot_file` takes it.

    Raises
    ------
    MissingFileError, ParameterError
        If the robot's files cannot be used.
    """
    file = load_robot_file(robot)
    model = load_model(file.model, file.base)
    root = _Tree(model, file).written()
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding='unicode')


class _Tree:
    """Bodies of a model on their way into links."""

    def __init__(self, model: mujoco.MjModel, file: RobotFile) -> None:
        self._model, self._folder = model, file.model.parent
        self._ids = find_ids(model, file)
        description = read_description(model, file)
        self._limits = {joint: (torque, speed) for joint, torque, speed in zip(
            self._ids.joints.tolist(),
            np.concatenate([leg.torque_limit for leg in description.legs]),
            np.concatenate([leg.velocity_limit for leg in description.legs]), strict=True)}
        self._names = dict(zip(self._ids.joints.tolist(), file.joint_names, strict=True))
        self._root = ElementTree.Element('robot', name=description.name)
        self._origin: dict[int, Array] = {}  # of a body's link, in the body's frame

    def written(self) -> _Element:
        model, ids = self._model, self._ids
        for name, usual in zip(self._names.values(), JOINT_NAMES, strict=True):
            if name != usual:
                ElementTree.SubElement(self._root, RENAMED, name=name, usual=usual)
        for body in sorted(subtree(model, ids.base)):
            if body == ids.base:
                self._origin[body] = np.zeros(3)
            else:
                self._joints(body)
            self._link(body)
        for leg, foot in zip(LEGS, ids.feet, strict=True):
            name = f'{leg}_foot'
            ElementTree.SubElement(self._root, 'link', name=name)
            self._joint(f'{name}_fixed', 'fixed', self._name(foot.body), name,
                        foot.point_in_body - self._origin[foot.body], np.eye(3))
        return self._root

    def _name(self, body: int) -> str:
        name = self._model.body(body).name
        return BASE_LINK if body == self._ids.base else name or f'body_{body}'

    def _joints(self, body: int) -> None:
        """Joints from the parent's link to that of a body."""
        model, parent = self._model, int(self._model.body_parentid[body])
        joints, link = joints_of(model, body), self._name(parent)
        turn = _rotation(model.body_quat[body])
        place = model.body_pos[body] - self._origin[parent]
        at = np.zeros(3)
        if not joints:
            self._joint(f'{self._name(body)}_fixed', 'fixed', link, self._name(body), place, turn)
        for j in joints:
            name = self._names.get(j) or model.joint(j).name or f'joint_{j}'
            if j not in self._names and name in self._names.values():
                raise ParameterError(f"'joint_names': {shown(name)} is a joint of no leg in the "
                                     'model already')
            child = self._name(body)
            if j != joints[-1]:
                child = f'{child}_{name}'
                ElementTree.SubElement(self._root, 'link', name=child)
            axis, zero = model.jnt_axis[j], float(model.qpos0[model.jnt_qposadr[j]])
            place = place + turn @ (model.jnt_pos[j] - at)
            slides = model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE
            if slides:
                place = place - turn @ axis * zero
            else:
                turn = turn @ _about(axis, -zero)
            limited = bool(model.jnt_limited[j])
            kind = 'prismatic' if slides else 'revolute' if limited else 'continuous'
            joint = self._joint(name, kind, link, child, place, turn)
            ElementTree.SubElement(joint, 'axis', xyz=_numbers(axis))
            torque, speed = self._limits.get(j, (0.0, 0.0))
            limit = ElementTree.SubElement(
                joint, 'limit', effort=_numbers([torque]), velocity=_numbers([speed]))
            if limited:
                low, high = model.jnt_range[j]
                limit.attrib.update(lower=_numbers([low]), upper=_numbers([high]))
            dof = int(model.jnt_dofadr[j])
            ElementTree.SubElement(joint, 'dynamics', damping=_numbers([model.dof_damping[dof]]),
                                   friction=_numbers([model.dof_frictionloss[dof]]))
            link, at = child, model.jnt_pos[j]
            place, turn = np.zeros(3), np.eye(3)
        self._origin[body] = at

    def _joint(self, name: str, kind: str, parent: str, child: str, place: Array,
               turn: Array) -> _Element:
        joint = ElementTree.SubElement(self._root, 'joint', name=name, type=kind)
        ElementTree.SubElement(joint, 'parent', link=parent)
        ElementTree.SubElement(joint, 'child', link=child)
        _pose(joint, place, turn)
        return joint

    def _link(self, body: int) -> None:
        model, at = self._model, self._origin[body]
        link = ElementTree.SubElement(self._root, 'link', name=self._name(body))
        if model.body_mass[body] > 0.0:
            inertial = ElementTree.SubElement(link, 'inertial')
            _pose(inertial, model.body_ipos[body] - at, _rotation(model.body_iquat[body]))
            ElementTree.SubElement(inertial, 'mass', value=_numbers([model.body_mass[body]]))
            x, y, z = (_numbers([value]) for value in model.body_inertia[body])
            ElementTree.SubElement(
                inertial, 'inertia', ixx=x, iyy=y, izz=z, ixy='0', ixz='0', iyz='0')
        for geom in np.flatnonzero(model.geom_bodyid == body).tolist():
            colour = geom_colour(model, geom)
            if model.geom_group[geom] < SHOWN_GROUPS and colour[3] > 0.0:
                for visual in self._shapes(link, 'visual', geom, at):
                    material = ElementTree.SubElement(visual, 'material', name=f'colour_{geom}')
                    ElementTree.SubElement(material, 'color', rgba=_numbers(colour))
            if model.geom_contype[geom] or model.geom_conaffinity[geom]:
                for _ in self._shapes(link, 'collision', geom, at):
                    pass

    def _shapes(self, link: _Element, kind: str, geom: int, at: Array) -> Iterator[_Element]:
        """Elements of one of the model's shapes."""
        model, turn = self._model, _rotation(self._model.geom_quat[geom])
        place, size = model.geom_pos[geom] - at, model.geom_size[geom]
        shape, radius = _Geom(model.geom_type[geom]), _numbers(size[:1])
        parts: list[tuple[str, dict[str, str], Array]] = []
        if shape == _Geom.mjGEOM_BOX:
            parts = [('box', {'size': _numbers(2.0 * size)}, place)]
        elif shape == _Geom.mjGEOM_SPHERE:
            parts = [('sphere', {'radius': radius}, place)]
        elif shape == _Geom.mjGEOM_ELLIPSOID:
            parts = [('sphere', {'radius': _numbers([np.cbrt(size.prod())])}, place)]
        elif shape in (_Geom.mjGEOM_CYLINDER, _Geom.mjGEOM_CAPSULE):
            parts = [('cylinder', {'radius': radius, 'length': _numbers([2.0 * size[1]])}, place)]
            if shape == _Geom.mjGEOM_CAPSULE:
                parts += [('sphere', {'radius': radius}, place + end * turn[:, 2])
                          for end in (-size[1], size[1])]
        elif shape == _Geom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            file = self._mesh_file(mesh)
            if file is not None:  # the compiled mesh lies in its own axes of inertia
                turn = turn @ _rotation(model.mesh_quat[mesh]).T
                parts = [('mesh', {'filename': file.as_uri(),
                                   'scale': _numbers(model.mesh_scale[mesh])},
                          place - turn @ model.mesh_pos[mesh])]
        for tag, attributes, where in parts:
            element = ElementTree.SubElement(link, kind)
            _pose(element, where, turn)
            geometry = ElementTree.SubElement(element, 'geometry')
            ElementTree.SubElement(geometry, tag, attributes)
            yield element

    def _mesh_file(self, mesh: int) -> Path | None:
        """File of a mesh; None for one that the model spells out."""
        start = int(self._model.mesh_pathadr[mesh])
        name = self._model.paths[start:].split(b'\0', 1)[0].decode() if start >= 0 else ''
        path = self._folder / name
        return path.resolve() if path.is_file() else None


def _pose(parent: _Element, place: Array, turn: Array) -> None:
    """Place and angles about the fixed axes x, y, z; upright, roll stands for yaw as well."""
    level = hypot(turn[0, 0], turn[1, 0])
    pitch = atan2(-turn[2, 0], level)
    roll, yaw = ((atan2(turn[2, 1], turn[2, 2]), atan2(turn[1, 0], turn[0, 0])) if level > 1e-9
                 else (atan2(-turn[1, 2], turn[1, 1]), 0.0))
    ElementTree.SubElement(
        parent, 'origin', xyz=_numbers(place), rpy=_numbers((roll, pitch, yaw)))


def _rotation(quaternion: Array) -> Array:
    """Matrix of MuJoCo's w, x, y, z."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _about(axis: Array, angle: float) -> Array:
    quaternion = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quaternion, axis, angle)
    return _rotation(quaternion)


def _numbers(values: ArrayLike) -> str:
    return ' '.join(f'{value + 0.0:.12g}' for value in np.asarray(values, dtype=float).tolist())
