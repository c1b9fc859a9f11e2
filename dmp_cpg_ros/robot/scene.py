# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot and its world as shapes that a browser can draw, and where they are in a pose."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_parts import find_ids, foot_position, place_robot
from dmp_cpg_ros.robot.model_reader import read_description
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import load_robot_file

SHOWN_GROUPS = 3
"""Groups of shapes that MuJoCo shows by default: below this."""

_KINDS = {mujoco.mjtGeom.mjGEOM_PLANE: 'plane', mujoco.mjtGeom.mjGEOM_SPHERE: 'sphere',
          mujoco.mjtGeom.mjGEOM_CAPSULE: 'capsule', mujoco.mjtGeom.mjGEOM_ELLIPSOID: 'ellipsoid',
          mujoco.mjtGeom.mjGEOM_CYLINDER: 'cylinder', mujoco.mjtGeom.mjGEOM_BOX: 'box',
          mujoco.mjtGeom.mjGEOM_MESH: 'mesh', mujoco.mjtGeom.mjGEOM_HFIELD: 'mesh'}

FIELD_SIDE = 128
"""Most heights of a height field that are drawn along a side."""


class Scene:
    """What stands and moves, without its physics.

    Parameters
    ----------
    robot_file : Path or str
        The robot.
    world : World
        What it walks on.

    Raises
    ------
    MissingFileError, ParameterError
        If the robot's files cannot be used.
    """

    def __init__(self, robot_file: Path | str, world: World) -> None:
        file = load_robot_file(robot_file)
        self._model = model = load_model(file.model, file.base, world)
        self._data, self._ids = mujoco.MjData(model), find_ids(model, file)
        self._description = read_description(model, file)

    def shapes(self) -> dict[str, Any]:
        """Mass [kg] and standing height [m] of the robot, its legs and their feet's radii [m], and
        all shapes: body, kind, size [m], place [m] and quaternion (w, x, y, z) in the body,
        colour. A height field is a mesh, of every height or of ``FIELD_SIDE`` along a side.
        """
        description = self._description
        return {
            'mass': description.mass, 'height': description.stance_height, 'legs': LEGS,
            'base': self._ids.base, 'feet': [foot.radius for foot in self._ids.feet],
            'meshes': {self._mesh_name(geom): self._mesh(geom) for geom in self._shown()
                       if self._kind(geom) == 'mesh'},
            'shapes': [self._shape(geom) for geom in self._shown()]}

    def poses(self, base_position: ArrayLike, base_quaternion: NDArray[np.float64],
              joint_position: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where all bodies are in a pose of the robot.

        Parameters
        ----------
        base_position : array_like (3,)
            In the world [m].
        base_quaternion : ndarray (4,)
            x, y, z, w.
        joint_position : array_like (12,)
            [rad]

        Returns
        -------
        bodies : ndarray (n, 7)
            Place [m] and quaternion (w, x, y, z) of every body.
        feet : ndarray (4, 3)
            Centres of the feet [m].
        """
        place_robot(self._model, self._data, self._ids, base_position,
                    np.roll(base_quaternion, 1), joint_position)
        return (np.hstack((self._data.xpos, self._data.xquat)),
                np.array([foot_position(self._data, foot) for foot in self._ids.feet]))

    def _kind(self, geom: int) -> str:
        return _KINDS.get(mujoco.mjtGeom(self._model.geom_type[geom]), '')

    def _shown(self) -> list[int]:
        model = self._model
        return [geom for geom in range(model.ngeom) if model.geom_group[geom] < SHOWN_GROUPS
                and self._kind(geom) and geom_colour(model, geom)[3] > 0.0]

    def _shape(self, geom: int) -> dict[str, Any]:
        model, material = self._model, self._model.geom_matid[geom]
        return {
            'body': int(model.geom_bodyid[geom]), 'kind': self._kind(geom),
            'size': model.geom_size[geom].tolist(), 'place': model.geom_pos[geom].tolist(),
            'quaternion': model.geom_quat[geom].tolist(),
            'colour': geom_colour(model, geom).tolist(),
            'glow': float(model.mat_emission[material]) if material >= 0 else 0.0,
            'mesh': self._mesh_name(geom)}

    def _mesh_name(self, geom: int) -> str:
        model = self._model
        return f'{model.geom_type[geom]} {model.geom_dataid[geom]}'

    def _mesh(self, geom: int) -> dict[str, str]:
        """Corners (n, 3) as float32 and triangles (m, 3) as int32, little-endian in base64."""
        model, mesh = self._model, self._model.geom_dataid[geom]
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_HFIELD:
            corners, faces = _field(model, mesh)
        else:
            corner, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
            corners = model.mesh_vert[corner:corner + model.mesh_vertnum[mesh]]
            faces = model.mesh_face[face:face + model.mesh_facenum[mesh]]
        return {'corners': _text(corners.astype('<f4')), 'faces': _text(faces.astype('<i4'))}


def _field(model: mujoco.MjModel, field: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Corners and triangles of the upper side of a height field."""
    shape = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    first = model.hfield_adr[field]
    share = model.hfield_data[first:first + shape[0] * shape[1]].reshape(shape)
    along_y, along_x, height, _ = model.hfield_size[field][[1, 0, 2, 3]]
    rows, columns = (np.unique(np.linspace(0, n - 1, min(n, FIELD_SIDE)).round().astype(int))
                     for n in shape)
    y, x = np.meshgrid(along_y * (2.0 * rows / (shape[0] - 1) - 1.0),
                       along_x * (2.0 * columns / (shape[1] - 1) - 1.0), indexing='ij')
    corners = np.stack((x, y, height * share[np.ix_(rows, columns)]), axis=-1).reshape(-1, 3)
    cell = np.arange(corners.shape[0]).reshape(x.shape)
    a, b, c, d = (each.ravel() for each in (
        cell[:-1, :-1], cell[:-1, 1:], cell[1:, :-1], cell[1:, 1:]))
    return corners, np.concatenate((np.stack((a, b, d), axis=1), np.stack((a, d, c), axis=1)))


def geom_colour(model: mujoco.MjModel, geom: int) -> NDArray[np.float64]:
    """Red, green, blue, opacity; a material's colour holds where the shape has the default."""
    own, material = model.geom_rgba[geom], model.geom_matid[geom]
    given = material < 0 or not np.allclose(own, (0.5, 0.5, 0.5, 1.0))
    return np.asarray(own if given else model.mat_rgba[material], dtype=float)


def _text(numbers: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(numbers).tobytes()).decode('ascii')
