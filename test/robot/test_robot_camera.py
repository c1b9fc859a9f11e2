# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures where they can be drawn, a reason where they cannot."""

from __future__ import annotations

import os
import subprocess
import sys
from unittest import mock

import numpy as np
import pytest

from dmp_cpg_ros.robot.camera import Camera, open_viewer, pose_pictures
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.mujoco_import import mujoco, usable_backend
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.port import RobotError
from dmp_cpg_ros.robot.start_pose import home_joint_position

HOME = home_joint_position(load_description())
UPRIGHT = (0.0, 0.0, 0.0, 1.0)

# A process in which no OpenGL library can be loaded.
WITHOUT_OPENGL = """
import ctypes
load = ctypes.CDLL.__init__
def refuse(self, name, *args, **kwargs):
    if name and any(part in str(name) for part in ('EGL', 'libGL', 'OpenGL', 'OSMesa')):
        raise OSError(f'{name}: cannot open shared object file')
    load(self, name, *args, **kwargs)
ctypes.CDLL.__init__ = refuse
import numpy as np
from dmp_cpg_ros.robot.camera import Camera, pose_pictures
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
state = MujocoRobot().reset()
with Camera() as camera:
    assert 'no pictures' in camera.reason
assert pose_pictures(None, [(0, 0, 0.28)], [(0, 0, 0, 1)], [state.joint_position]) == []
"""


@pytest.fixture(scope='module')
def camera():
    with Camera(width=320, height=240) as camera:
        if camera.reason:
            pytest.skip(camera.reason)
        yield camera


def test_a_picture_has_its_size_and_shows_the_robot_in_the_middle(camera):
    picture = camera.drawn((0, 0, 0.28), UPRIGHT, HOME)
    assert picture.shape == (240, 320, 3) and picture.dtype == np.uint8
    orange = (picture[..., 0] > 150) & (picture[..., 2] < 80)
    rows, columns = np.nonzero(orange)
    assert len(rows) > 50
    assert abs(np.median(columns) - 160) < 60 and abs(np.median(rows) - 120) < 60


def test_the_camera_follows_the_robot(camera):
    here, there = (camera.drawn((x, 0, 0.28), UPRIGHT, HOME) for x in (0.0, 4.0))
    difference = np.abs(here.astype(int) - there.astype(int)).mean(axis=2) > 60
    assert difference.mean() < 0.1  # the floor is periodic, so both show almost the same


def test_recorded_poses_are_drawn_without_simulating(camera):
    pictures = pose_pictures(None, [(0, 0, 0.28), (1, 0, 0.35)], [UPRIGHT, UPRIGHT],
                             [HOME, np.tile((0.0, 0.2, -0.4), 4)], width=160, height=120)
    assert [picture.shape for picture in pictures] == [(120, 160, 3)] * 2
    assert (pictures[0] != pictures[1]).mean() > 0.02


def test_a_closed_camera_draws_nothing():
    camera = Camera(width=64, height=48)
    camera.close()
    with pytest.raises(RobotError, match='closed'):
        camera.drawn((0, 0, 0.28), UPRIGHT, HOME)


@pytest.mark.parametrize('backend', ['egl', 'osmesa', ''])
def test_without_opengl_the_robot_runs_and_pictures_are_left_out(backend):
    environment = {**os.environ, 'MUJOCO_GL': backend}
    environment.pop('DISPLAY', None)
    environment.pop('WAYLAND_DISPLAY', None)
    ran = subprocess.run([sys.executable, '-c', WITHOUT_OPENGL], env=environment, check=False,
                         timeout=120, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert 'no pictures' in ran.stderr


@pytest.mark.parametrize('wanted', ['glfw', 'disable', 'cgl'])
def test_a_backend_that_was_chosen_is_kept(wanted):
    assert usable_backend(wanted, has_screen=False) == wanted


def test_with_a_screen_nothing_is_chosen():
    assert not usable_backend('', has_screen=True)


def test_without_a_screen_there_is_no_window(monkeypatch, caplog):
    monkeypatch.delenv('DISPLAY', raising=False)
    monkeypatch.delenv('WAYLAND_DISPLAY', raising=False)
    assert open_viewer(MujocoRobot()) is None
    assert 'no screen' in caplog.text


def test_a_screen_that_cannot_be_opened_is_one_line_and_no_window():
    """In a process of its own, whose end shows that nothing waits for the window."""
    code = ('from dmp_cpg_ros.robot.camera import open_viewer\n'
            'from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot\n'
            'assert open_viewer(MujocoRobot()) is None')
    screen = {key: value for key, value in os.environ.items() if key != 'WAYLAND_DISPLAY'}
    done = subprocess.run([sys.executable, '-c', code], env={**screen, 'DISPLAY': ':4242'},
                          capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert "no window: the screen ':4242' cannot be opened" in done.stderr


def test_the_window_looks_at_the_robot_wherever_it_goes(monkeypatch):
    window = mock.MagicMock()
    viewer = mock.MagicMock(launch_passive=mock.Mock(return_value=window))
    monkeypatch.setenv('DISPLAY', ':0')
    monkeypatch.setitem(sys.modules, 'mujoco.viewer', viewer)
    monkeypatch.setattr(mujoco, 'viewer', viewer, raising=False)
    robot = MujocoRobot()
    assert open_viewer(robot) is window
    assert window.cam.type == mujoco.mjtCamera.mjCAMERA_TRACKING
    assert robot.model.body(window.cam.trackbodyid).jntnum == 1
    assert robot.model.jnt_type[robot.model.body(window.cam.trackbodyid).jntadr[0]] == (
        mujoco.mjtJoint.mjJNT_FREE)


def test_an_unknown_backend_is_named_and_replaced():
    done = subprocess.run(
        [sys.executable, '-c', 'from dmp_cpg_ros.robot.mujoco_import import mujoco; '
         'assert mujoco.MjModel'],
        env={**os.environ, 'MUJOCO_GL': 'nonsense'}, capture_output=True, text=True, timeout=60,
        check=False)
    assert done.returncode == 0, done.stderr
    assert "MUJOCO_GL = 'nonsense' is not known; valid are egl" in done.stderr
    assert done.stderr.count('\n') == 1
