# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draws a robot with its four legs in four colours, each with its name."""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.robot.camera import Camera, Picture
from dmp_cpg_ros.robot.leg_reader import foot_position
from dmp_cpg_ros.robot.model_reader import find_ids, read_description
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import RobotFile
from dmp_cpg_ros.robot.start_pose import home_joint_position

COLOURS = {
    'fl': (0.86, 0.15, 0.15), 'fr': (0.10, 0.38, 0.90),
    'rl': (0.95, 0.60, 0.05), 'rr': (0.05, 0.60, 0.30)}
"""Red, green, blue of each leg."""

AZIMUTH, ELEVATION = 140.0, -22.0
"""Direction of the view [deg]."""


def leg_picture(file: RobotFile, width: int = 1280, height: int = 800) -> Picture:
    """Draw a robot that stands, legs coloured as in ``COLOURS`` and named at their hips.

    Parameters
    ----------
    file : RobotFile
        The robot.
    width, height : int
        Size of the picture [pixels].

    Returns
    -------
    ndarray (height, width, 3) of uint8

    Raises
    ------
    RobotError
        If OpenGL cannot draw here.
    MissingFileError, ParameterError
        If the robot's files cannot be used.
    """
    with Camera(file, width, height) as camera:
        description = read_description(camera.model, file)
        _colour_legs(camera.model, file)
        stance = (0.0, 0.0, description.stance_height)
        return camera.drawn(stance, (0.0, 0.0, 0.0, 1.0), home_joint_position(description),
                            azimuth=AZIMUTH, elevation=ELEVATION,
                            mark=lambda data, scene: _label(camera.model, data, scene, file))


def _colour_legs(model: mujoco.MjModel, file: RobotFile) -> None:
    """Give the bodies from each abduction joint down the leg's colour."""
    ids = find_ids(model, file)
    for i, leg in enumerate(LEGS):
        bodies = {int(model.jnt_bodyid[ids.joints[3 * i]])}
        for body in range(min(bodies), model.nbody):
            if int(model.body_parentid[body]) in bodies:
                bodies.add(body)
        geoms = np.isin(model.geom_bodyid, list(bodies))
        shade = np.linspace(0.75, 1.0, int(geoms.sum()))[:, None]
        model.geom_matid[geoms] = -1
        model.geom_rgba[geoms, :3] = shade * COLOURS[leg]


def _label(model: mujoco.MjModel, data: mujoco.MjData, scene: mujoco.MjvScene,
           file: RobotFile) -> None:
    """Mark each hip and foot with a ball that bears the leg's name."""
    ids = find_ids(model, file)
    for i, leg in enumerate(LEGS):
        hip = data.xanchor[ids.joints[3 * i + 1]]
        places = ((hip + (0.0, 0.0, 0.12), f'{leg}'), (foot_position(data, ids.feet[i]), ''))
        for place, text in places:
            if scene.ngeom >= scene.maxgeom:
                return
            geom = scene.geoms[scene.ngeom]
            kind = mujoco.mjtGeom.mjGEOM_LABEL if text else mujoco.mjtGeom.mjGEOM_SPHERE
            mujoco.mjv_initGeom(geom, kind, np.full(3, 1.15 * max(ids.feet[i].radius, 0.01)),
                                np.asarray(place), np.eye(3).ravel(),
                                np.array((*COLOURS[leg], 1.0), dtype=np.float32))
            geom.label = text
            scene.ngeom += 1
