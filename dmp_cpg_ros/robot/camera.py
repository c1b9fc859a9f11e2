# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the robot without a screen, and a window where there is one."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_parts import ModelIds, find_ids, foot_position, place_robot, subtree
from dmp_cpg_ros.robot.model_reader import read_description
from dmp_cpg_ros.robot.mujoco_import import has_screen, mujoco
from dmp_cpg_ros.robot.port import RobotError
from dmp_cpg_ros.robot.robot_file import RobotFile, load_robot_file
from dmp_cpg_ros.robot.start_pose import home_joint_position

if TYPE_CHECKING:
    from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

Picture = NDArray[np.uint8]

Mark = Callable[[mujoco.MjData, mujoco.MjvScene], None]

AZIMUTH, ELEVATION = 140.0, -16.0  # [deg] onto the robot's right side and face
DISTANCE_OVER_HEIGHT = 3.6  # distance of the camera over the robot's stance height
PLAIN_SHADOW = 2048  # texels along a side of the shadow map
PLAIN_SLICES, PLAIN_STACKS = 16, 10  # faces around and along what is round
FAR_CLIPPING = 400.0  # in units of the model's extent

COLOURS = {'fl': (0.86, 0.15, 0.15), 'fr': (0.10, 0.38, 0.90), 'rl': (0.95, 0.60, 0.05),
           'rr': (0.05, 0.60, 0.30)}
"""Red, green, blue of each leg."""

_log = logging.getLogger(__name__)


class Camera:
    """Draws a robot in given poses; where OpenGL is missing it says so once and draws nothing.

    Parameters
    ----------
    robot_file : RobotFile, Path, str or None
        The robot; None is the package's own.
    width, height : int
        Size of the pictures [pixels].
    world : World, optional
        What it walks on; the flat floor without.
    plain : bool
        Whether to leave out what is costly to draw: reflections, the finest shadows, the
        finest faces of what is round.

    Attributes
    ----------
    model : mujoco.MjModel
        What it draws.
    ids : ModelIds
        The robot's parts in the model.
    reason : str or None
        Why there are no pictures; None when there are.

    Raises
    ------
    MissingFileError, ParameterError
        If the robot's files cannot be used.
    """

    def __init__(self, robot_file: RobotFile | Path | str | None = None, width: int = 1280,
                 height: int = 720, world: World | None = None, plain: bool = False) -> None:
        file = load_robot_file(robot_file)
        self._world = world or World()
        self.model = load_model(file.model, file.base, self._world)
        self.ids = find_ids(self.model, file)
        self.description = read_description(self.model, file)
        self._height = self.description.stance_height
        if plain:
            quality = self.model.vis.quality
            quality.shadowsize = min(quality.shadowsize, PLAIN_SHADOW)
            quality.offsamples = min(quality.offsamples, 2)
            quality.numslices = min(quality.numslices, PLAIN_SLICES)
            quality.numstacks = min(quality.numstacks, PLAIN_STACKS)
            self.model.mat_reflectance[:] = 0.0
        self._data = mujoco.MjData(self.model)
        self._renderer, self.reason = _renderer(self.model, width, height)

    def drawn(self, base_position_in_world: ArrayLike, base_quaternion: ArrayLike,
              joint_position: ArrayLike, azimuth: float = AZIMUTH, elevation: float = ELEVATION,
              distance: float | None = None, mark: Mark | None = None,
              look_at: ArrayLike | None = None) -> Picture:
        """Draw one pose.

        Parameters
        ----------
        base_position_in_world : array_like (3,)
            [m]
        base_quaternion : array_like (4,)
            x, y, z, w.
        joint_position : array_like (12,)
            [rad], in the order of ``JOINT_NAMES``.
        azimuth, elevation : float
            Direction in which the camera looks [deg].
        distance : float, optional
            From the camera to the robot [m]; by default the robot fills the picture well.
        mark : callable (data, scene), optional
            Adds shapes of its own to the scene.
        look_at : array_like (3,), optional
            Place of the base at which the camera looks [m]; by default the one it draws.

        Returns
        -------
        ndarray (height, width, 3) of uint8

        Raises
        ------
        RobotError
            With the reason, where pictures cannot be drawn.
        """
        if self._renderer is None:
            raise RobotError(str(self.reason))
        model, data = self.model, self._data
        place_robot(model, data, self.ids, base_position_in_world,
                    np.roll(np.asarray(base_quaternion, dtype=float), 1), joint_position)
        mujoco.mj_camlight(model, data)
        view = mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FREE
        x, y, z = np.asarray(base_position_in_world if look_at is None else look_at, dtype=float)
        ground = float(self._world.height_at(x, y))
        view.lookat[:] = (x, y, z - 0.38 * (self._height if look_at is not None else z - ground))
        view.azimuth, view.elevation = azimuth, elevation
        view.distance = DISTANCE_OVER_HEIGHT * self._height if distance is None else distance
        self._renderer.update_scene(data, view)
        if mark is not None:
            mark(data, self._renderer.scene)
        return np.array(self._renderer.render(), dtype=np.uint8)

    def close(self) -> None:
        """Release the OpenGL context."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer, self.reason = None, 'the camera is closed'

    def __enter__(self) -> Camera:
        """Return the camera."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the camera."""
        self.close()


def pose_pictures(robot_file: RobotFile | Path | str | None, base_positions_in_world: ArrayLike,
                  base_quaternions: ArrayLike, joint_positions: ArrayLike, width: int = 1280,
                  height: int = 720, world: World | None = None) -> list[Picture]:
    """Draw recorded poses, without simulating them again.

    Parameters
    ----------
    robot_file : RobotFile, Path, str or None
        The robot; None is the package's own.
    base_positions_in_world : array_like (n, 3)
        [m]
    base_quaternions : array_like (n, 4)
        x, y, z, w.
    joint_positions : array_like (n, 12)
        [rad]
    width, height : int
        [pixels]
    world : World, optional
        What it walks on; the flat floor without.

    Returns
    -------
    list of ndarray (height, width, 3) of uint8
        Empty where pictures cannot be drawn; the reason is logged.
    """
    poses = zip(np.asarray(base_positions_in_world), np.asarray(base_quaternions),
                np.asarray(joint_positions), strict=True)
    with Camera(robot_file, width, height, world) as camera:
        return [camera.drawn(*pose) for pose in poses if camera.reason is None]


def leg_picture(file: RobotFile) -> Picture:
    """Draw a robot that stands, legs coloured as in ``COLOURS`` and named at their hips.

    Parameters
    ----------
    file : RobotFile
        The robot.

    Returns
    -------
    ndarray (800, 1280, 3) of uint8

    Raises
    ------
    RobotError
        If OpenGL cannot draw here.
    MissingFileError, ParameterError
        If the robot's files cannot be used.
    """
    with Camera(file, height=800) as camera:
        model, ids, description = camera.model, camera.ids, camera.description
        for leg, abduction in zip(LEGS, ids.joints[::3], strict=True):
            geoms = np.isin(model.geom_bodyid, list(subtree(model, model.jnt_bodyid[abduction])))
            model.geom_matid[geoms] = -1
            shade = np.linspace(0.75, 1.0, int(geoms.sum()))[:, None]
            model.geom_rgba[geoms, :3] = shade * COLOURS[leg]
        return camera.drawn((0.0, 0.0, description.stance_height), (0.0, 0.0, 0.0, 1.0),
                            home_joint_position(description), elevation=-22.0,
                            mark=lambda data, scene: _label(data, scene, ids))


def _label(data: mujoco.MjData, scene: mujoco.MjvScene, ids: ModelIds) -> None:
    """Name each leg over its hip, and put a ball onto its foot."""
    for leg, hip, foot in zip(LEGS, ids.joints[1::3], ids.feet, strict=True):
        for kind, place, text in (
            (mujoco.mjtGeom.mjGEOM_LABEL, data.xanchor[hip] + (0.0, 0.0, 0.12), leg),
            (mujoco.mjtGeom.mjGEOM_SPHERE, foot_position(data, foot), ''),
        ):
            if scene.ngeom >= scene.maxgeom:
                return
            geom = scene.geoms[scene.ngeom]
            mujoco.mjv_initGeom(geom, kind, np.full(3, 1.15 * max(foot.radius, 0.01)), place,
                                np.eye(3).ravel(), np.array((*COLOURS[leg], 1.0), np.float32))
            geom.label = text
            scene.ngeom += 1


def open_viewer(robot: MujocoRobot) -> Any | None:
    """Open MuJoCo's window on a running simulation; its camera follows the robot.

    Returns
    -------
    handle or None
        MuJoCo's passive viewer: call ``sync()`` after each tick, ``close()`` at the end, and stop
        syncing when ``is_running()`` turns false. None without a screen or where the window cannot
        be opened; the reason is logged.
    """
    try:
        if not has_screen():
            raise RobotError('there is no screen (DISPLAY and WAYLAND_DISPLAY are unset)')
        import mujoco.viewer as viewer

        # MuJoCo opens its window in a thread whose failure it would wait for without end.
        if not viewer.glfw.init():
            raise RobotError(f'the screen {os.environ.get("DISPLAY", "")!r} cannot be opened')
        window = viewer.launch_passive(
            robot.model, robot.data, show_left_ui=False, show_right_ui=False)
    except Exception as error:  # noqa: BLE001 (what a broken OpenGL raises varies)
        _log.warning('no window: %s', error)
        return None
    with window.lock():
        window.cam.type, window.cam.trackbodyid = mujoco.mjtCamera.mjCAMERA_TRACKING, robot.base
        window.cam.azimuth, window.cam.elevation = AZIMUTH, ELEVATION
        window.cam.distance = DISTANCE_OVER_HEIGHT * robot.description.stance_height
    return window


def _renderer(model: mujoco.MjModel, width: int, height: int) -> tuple[Any | None, str | None]:
    """Return a renderer, or None and the reason."""
    model.vis.global_.offwidth = max(model.vis.global_.offwidth, width)
    model.vis.global_.offheight = max(model.vis.global_.offheight, height)
    # A far clipping plane that is near makes software renderers speckle the floor with shadow.
    model.vis.map.zfar = max(model.vis.map.zfar, FAR_CLIPPING)
    try:
        return mujoco.Renderer(model, height, width), None
    except Exception as error:  # noqa: BLE001 (what a broken OpenGL raises varies)
        reason = f'no pictures: OpenGL cannot draw offscreen here ({error})'
        _log.warning('%s', reason)
        return None, reason
