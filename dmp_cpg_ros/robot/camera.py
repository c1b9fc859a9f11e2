# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the robot without a screen, and a window where there is one."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.robot_model.world import World
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_reader import find_ids, read_description
from dmp_cpg_ros.robot.mujoco_import import has_screen, mujoco
from dmp_cpg_ros.robot.port import RobotError
from dmp_cpg_ros.robot.robot_file import RobotFile, load_robot_file, own_robot_file

if TYPE_CHECKING:
    from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

Picture = NDArray[np.uint8]

Mark = Callable[[mujoco.MjData, mujoco.MjvScene], None]

AZIMUTH, ELEVATION = 140.0, -16.0  # [deg] onto the robot's right side and face
DISTANCE_OVER_HEIGHT = 3.6  # distance of the camera over the robot's stance height
PLAIN_SHADOW = 2048  # texels along a side of the shadow map
FAR_CLIPPING = 400.0  # in units of the model's extent

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
        Whether to leave out what is costly to draw: reflections, the finest shadows.

    Attributes
    ----------
    model : mujoco.MjModel
        What it draws.
    reason : str or None
        Why there are no pictures; None when there are.

    Raises
    ------
    MissingFileError, ParameterError
        If the robot's files cannot be used.
    """

    def __init__(self, robot_file: RobotFile | Path | str | None = None, width: int = 1280,
                 height: int = 720, world: World | None = None, plain: bool = False) -> None:
        if not isinstance(robot_file, RobotFile):
            robot_file = own_robot_file() if robot_file is None else load_robot_file(robot_file)
        self._world = world or World()
        self.model = load_model(robot_file.model, robot_file.base, self._world)
        self._ids = find_ids(self.model, robot_file)
        self._height = read_description(self.model, robot_file).stance_height
        self._distance = DISTANCE_OVER_HEIGHT * self._height
        if plain:
            _simplify(self.model)
        self._data = mujoco.MjData(self.model)
        self._renderer, self.reason = _renderer(self.model, width, height)

    def picture(self, base_position_in_world: ArrayLike, base_quaternion: ArrayLike,
                joint_position: ArrayLike, azimuth: float = AZIMUTH, elevation: float = ELEVATION,
                distance: float | None = None) -> Picture | None:
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

        Returns
        -------
        ndarray (height, width, 3) of uint8 or None
            None where pictures cannot be drawn (see ``reason``).
        """
        if self._renderer is None:
            return None
        return self.drawn(base_position_in_world, base_quaternion, joint_position, azimuth,
                          elevation, distance)

    def drawn(self, base_position_in_world: ArrayLike, base_quaternion: ArrayLike,
              joint_position: ArrayLike, azimuth: float = AZIMUTH, elevation: float = ELEVATION,
              distance: float | None = None, mark: Mark | None = None,
              look_at: ArrayLike | None = None) -> Picture:
        """Draw one pose as :meth:`picture` does, or raise.

        Parameters
        ----------
        base_position_in_world, base_quaternion, joint_position, azimuth, elevation, distance
            See :meth:`picture`.
        mark : callable (data, scene), optional
            Adds shapes of its own to the scene.
        look_at : array_like (3,), optional
            Place of the base at which the camera looks [m]; by default the one it draws.

        Raises
        ------
        RobotError
            With the reason, where pictures cannot be drawn.
        """
        if self._renderer is None:
            raise RobotError(str(self.reason))
        model, data = self.model, self._data
        start = int(model.jnt_qposadr[self._ids.free_joint])
        place = np.asarray(base_position_in_world, dtype=float)
        data.qpos[start:start + 3] = place
        data.qpos[start + 3:start + 7] = np.roll(np.asarray(base_quaternion, dtype=float), 1)
        data.qpos[model.jnt_qposadr[self._ids.joints]] = joint_position
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        view = mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FREE
        x, y, z = place if look_at is None else np.asarray(look_at, dtype=float)
        ground = float(self._world.height_at(x, y))
        view.lookat[:] = (x, y, z - 0.38 * (self._height if look_at is not None else z - ground))
        view.azimuth, view.elevation = azimuth, elevation
        view.distance = self._distance if distance is None else distance
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

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Close the camera."""
        self.close()


def pose_pictures(robot_file: RobotFile | Path | str | None, base_positions_in_world: ArrayLike,
                  base_quaternions: ArrayLike, joint_positions: ArrayLike, width: int = 1280,
                  height: int = 720, world: World | None = None,
                  **view: float) -> list[Picture]:
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
    **view
        ``azimuth``, ``elevation`` [deg], ``distance`` [m] as in :meth:`Camera.picture`.

    Returns
    -------
    list of ndarray (height, width, 3) of uint8
        Empty where pictures cannot be drawn; the reason is logged.
    """
    with Camera(robot_file, width, height, world) as camera:
        pictures = [camera.picture(place, quaternion, joints, **view)
                    for place, quaternion, joints in zip(
                        np.asarray(base_positions_in_world), np.asarray(base_quaternions),
                        np.asarray(joint_positions), strict=True)]
    return [picture for picture in pictures if picture is not None]


def open_viewer(robot: MujocoRobot) -> Any | None:
    """Open MuJoCo's window on a running simulation; its camera follows the robot.

    Returns
    -------
    handle or None
        MuJoCo's passive viewer: call ``sync()`` after each tick, ``close()`` at the end, and stop
        syncing when ``is_running()`` turns false. None without a screen or where the window cannot
        be opened; the reason is logged.
    """
    if not has_screen():
        _log.warning('no window: there is no screen (DISPLAY and WAYLAND_DISPLAY are unset)')
        return None
    try:
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


def _simplify(model: mujoco.MjModel) -> None:
    model.vis.quality.shadowsize = min(model.vis.quality.shadowsize, PLAIN_SHADOW)
    model.vis.quality.offsamples = min(model.vis.quality.offsamples, 2)
    model.mat_reflectance[:] = 0.0


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
